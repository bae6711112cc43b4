//! A mesh with a picture wrapped about it.

use crate::mesh::triangle_mesh::TriangleMesh;
use nalgebra::Vector3;

/// Triangles, where their corners are in a picture, and the normals to shade them with.
///
/// # Examples
///
/// ```
/// use stereology_shape::{Texture, TexturedMesh, TriangleMesh, corner_normals};
///
/// let mesh = TriangleMesh::cuboid([1.0, 2.0, 3.0]);
/// let grey = TexturedMesh {
///     uvs: vec![[[0.5, 0.5]; 3]; mesh.triangles.len()],
///     normals: corner_normals(&mesh),
///     texture: Texture { width: 1, height: 1, rgba: vec![128, 128, 128, 255] },
///     mesh,
/// };
/// assert!(grey.texture.is_opaque());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TexturedMesh {
    /// Its triangles.
    pub mesh: TriangleMesh,
    /// Where the corners of each triangle are in the picture: shares of its width from the left and of its height from the top.
    pub uvs: Vec<[[f64; 2]; 3]>,
    /// Unit normals at the corners of each triangle.
    pub normals: Vec<[Vector3<f64>; 3]>,
    /// The picture.
    pub texture: Texture,
}

/// A picture of colours and alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue (sRGB-encoded) and alpha of each texel, row after row from the top.
    pub rgba: Vec<u8>,
}

impl Texture {
    /// Whether all of it is seen.
    #[must_use]
    pub fn is_opaque(&self) -> bool {
        self.rgba.chunks_exact(4).all(|texel| texel[3] == u8::MAX)
    }
}
