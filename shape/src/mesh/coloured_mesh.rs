//! A mesh with a colour at each vertex.

use crate::mesh::corner_normals::corner_normals;
use crate::mesh::triangle_mesh::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// Triangles, the colours of their vertices, and the normals to shade them with.
///
/// # Examples
///
/// ```
/// use stereology_shape::{ColouredMesh, TriangleMesh};
///
/// let ball = ColouredMesh::new(TriangleMesh::icosphere(1.0, 2), |p| [0.5 + p.z as f32, 0.3, 0.2]);
/// assert_eq!((ball.colours.len(), ball.normals.len()), (162, 320));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ColouredMesh {
    /// Its triangles.
    pub mesh: TriangleMesh,
    /// Colour of each vertex, sRGB-encoded / 255, and its alpha: 1, or 0 in a hole.
    pub colours: Vec<[f32; 4]>,
    /// Unit normals at the corners of each triangle.
    pub normals: Vec<[Vector3<f64>; 3]>,
}

impl ColouredMesh {
    /// Whether no vertex is transparent.
    #[cfg(feature = "io")]
    pub(crate) fn is_opaque(&self) -> bool {
        self.colours.iter().all(|colour| colour[3] >= 1.0)
    }

    /// A mesh without holes, with the values of `colour` at its vertices, and [`corner_normals`]. Indices must be in
    /// range.
    #[must_use]
    pub fn new(mesh: TriangleMesh, colour: impl Fn(&Point3<f64>) -> [f32; 3]) -> Self {
        Self {
            colours: mesh
                .vertices
                .iter()
                .map(|p| {
                    let [r, g, b] = colour(p);
                    [r, g, b, 1.0]
                })
                .collect(),
            normals: corner_normals(&mesh),
            mesh,
        }
    }
}
