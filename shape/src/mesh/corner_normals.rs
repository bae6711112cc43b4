//! Normals for shading: smooth where neighbouring faces have similar normals, sharp at creases.

use crate::mesh::triangle_mesh::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// Faces that meet at less than this angle are one smooth surface: 35°.
const SMOOTH_COSINE: f64 = 0.82;

/// For each corner of each triangle, the mean of the face normals around its vertex that are within 35° of the
/// triangle's own, weighted by the angles at the vertex.
///
/// Unit vectors; zero if a triangle has no area. Indices must be in range. Cost: linear in the triangles.
///
/// # Examples
///
/// A sphere is smooth: its normals are nearly radial. The faces of a cube stay flat.
///
/// ```
/// use stereology_shape::{TriangleMesh, corner_normals};
///
/// let ball = TriangleMesh::icosphere(2.0, 3);
/// for (corners, normals) in ball.triangles.iter().zip(corner_normals(&ball)) {
///     for (corner, normal) in corners.iter().zip(normals) {
///         assert!(normal.dot(&ball.vertices[*corner as usize].coords) > 0.999);
///     }
/// }
/// let cube = TriangleMesh::cuboid([1.0, 1.0, 1.0]);
/// assert!(corner_normals(&cube).iter().flatten().all(|normal| normal.amax() > 0.999_999));
/// ```
#[must_use]
pub fn corner_normals(mesh: &TriangleMesh) -> Vec<[Vector3<f64>; 3]> {
    let corners: Vec<[Point3<f64>; 3]> = mesh
        .triangles
        .iter()
        .map(|triangle| triangle.map(|vertex| mesh.vertices[vertex as usize]))
        .collect();
    let normal = |[a, b, c]: &[Point3<f64>; 3]| (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
    let flat: Vec<Vector3<f64>> = corners.iter().map(normal).collect();
    let mut around = vec![Vec::new(); mesh.vertices.len()];
    for (facet, triangle) in mesh.triangles.iter().enumerate() {
        for (corner, &vertex) in triangle.iter().enumerate() {
            let [to, left, right] = [0, 1, 2].map(|i| corners[facet][(corner + i) % 3]);
            let angle = (left - to).angle(&(right - to));
            around[vertex as usize].push((facet, angle));
        }
    }
    mesh.triangles
        .iter()
        .zip(&flat)
        .map(|(triangle, own)| {
            triangle.map(|vertex| {
                let agree = around[vertex as usize]
                    .iter()
                    .filter(|(facet, _)| flat[*facet].dot(own) >= SMOOTH_COSINE);
                let sum = agree.fold(Vector3::zeros(), |sum, (facet, angle)| sum + *angle * flat[*facet]);
                sum.try_normalize(1e-12).unwrap_or(*own)
            })
        })
        .collect()
}
