//! The convex hull as a closed mesh.

use nalgebra::Point3;

use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::mesh_error::MeshError;
use crate::mesh::quickhull::{HullError, hull_mesh};

/// Convex hull as a closed triangle mesh; its vertices are a subset of the points, bit for bit (except that coordinates
/// below 1e-20 of the largest become zero).
///
/// Quickhull (Barber, Dobkin & Huhdanpaa 1996) in which every decision is the exact sign of a determinant (Shewchuk
/// 1997), so no point is outside the result. Cost: about n log n.
///
/// # Errors
///
/// [`HullError`] if there are fewer than four points, one is not finite, or they lie in a plane.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use stereology_shape::convex_hull;
///
/// let mut points: Vec<Point3<f64>> =
///     (0..8_u8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
/// points.push(Point3::new(0.5, 0.25, 0.75)); // inside: not a vertex of the hull
/// let cube = convex_hull(&points)?;
/// assert_eq!(cube.vertices().len(), 8);
/// assert!((cube.volume() - 1.0).abs() < 1e-12);
/// # Ok::<(), stereology_shape::HullError>(())
/// ```
pub fn convex_hull(points: &[Point3<f64>]) -> Result<ClosedMesh, HullError> {
    let mesh = hull_mesh(points)?;
    ClosedMesh::from_hull(mesh).map_err(|error| match error {
        MeshError::Extent { .. } => HullError::Extent,
        _ => HullError::Flat,
    })
}
