//! A mesh with a texture image.

use crate::mesh::triangle_mesh::TriangleMesh;
use nalgebra::Vector3;

/// Triangles, the texture coordinates of their corners, and the normals to shade them with.
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
    /// Texture coordinates of the corners of each triangle: fractions of the image's width from the left and of its
    /// height from the top.
    pub uvs: Vec<[[f64; 2]; 3]>,
    /// Unit normals at the corners of each triangle.
    pub normals: Vec<[Vector3<f64>; 3]>,
    /// The texture image.
    pub texture: Texture,
}

/// An image with colours and alpha.
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
    /// Whether no texel is transparent.
    #[must_use]
    pub fn is_opaque(&self) -> bool {
        self.rgba.chunks_exact(4).all(|texel| texel[3] == u8::MAX)
    }
}
