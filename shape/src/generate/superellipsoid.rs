//! Superellipsoids: one family that includes boxes, ellipsoids, octahedra and stars.

use nalgebra::{Point3, Vector3};

use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::hull::convex_hull;
use crate::mesh::mesh_error::MeshError;
use crate::mesh::triangle_mesh::TriangleMesh;

/// Subdivisions of the icosphere behind a superellipsoid (5,120 triangles); the octahedron behind a star has one more
/// (8,192).
const SUBDIVISIONS: u32 = 4;

/// Exponents for which surfaces differ from their limits in double precision.
pub(crate) const EXPONENTS: std::ops::RangeInclusive<f64> = 0.05..=4.0;

/// The superellipsoid with these semi-axes and exponents, as a mesh with its vertices on the surface.
///
/// # Formula
///
/// ```text
/// (|x/a|^(2/e₂) + |y/b|^(2/e₂))^(e₂/e₁) + |z/c|^(2/e₁) = 1        e₁ north-south, e₂ east-west: 0 a box, 1 an ellipsoid, 2 an octahedron
/// V = 2 a b c e₁ e₂ B(e₁/2 + 1, e₁) B(e₂/2, e₂/2)
/// ```
///
/// Up to exponents of 2 the body is convex, and the mesh is the hull of its vertices.
pub(crate) fn superellipsoid(semi_axes: [f64; 3], exponents: [f64; 2]) -> Result<ClosedMesh, MeshError> {
    let [a, b, c] = semi_axes;
    let [e1, e2] = exponents;
    let radius = |p: &Vector3<f64>| {
        // In logarithms, so that small exponents do not overflow.
        let log = |x: f64, axis: f64, e: f64| (2.0 / e) * (x.abs() / axis).ln();
        let (x, y, z) = (log(p.x, a, e2), log(p.y, b, e2), log(p.z, c, e1));
        let log_radius = -0.5 * e1 * log_of_sum(log_of_sum(x, y) * (e2 / e1), z);
        log_radius.exp()
    };
    if e1 <= 2.0 && e2 <= 2.0 {
        let mesh = star(SUBDIVISIONS, radius);
        convex_hull(&mesh.vertices).map_err(|_| MeshError::ZeroVolume)
    } else {
        // The ridges of a star lie in the coordinate planes, as do edges of a subdivided octahedron.
        ClosedMesh::try_from(
            TriangleMesh::octasphere(SUBDIVISIONS + 1).mapped(|p| Point3::from(p.coords * radius(&p.coords))),
        )
    }
}

/// ln(exp a + exp b)
fn log_of_sum(a: f64, b: f64) -> f64 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if high == f64::NEG_INFINITY {
        return high;
    }
    high + (low - high).exp().ln_1p()
}

/// The mesh with every direction from the origin scaled by `radius` of the direction: an icosphere mapped onto a
/// star-shaped surface.
pub(crate) fn star(subdivisions: u32, radius: impl Fn(&Vector3<f64>) -> f64) -> TriangleMesh {
    TriangleMesh::icosphere(2.0, subdivisions).mapped(|p| Point3::from(p.coords * radius(&p.coords)))
}
