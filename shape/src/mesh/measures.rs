//! Volume, surface, centroid and mean width of a closed mesh, as sums over its triangles or edges.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use crate::mesh::topology::Neighbours;
use crate::mesh::triangle_mesh::TriangleMesh;

/// Twice the vector area of a triangle: its normal times twice its area.
pub(crate) fn double_area([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// Signed volume and centroid. Sums are taken about `reference`, so a mesh far from the origin loses no digits.
pub(crate) fn volume_and_centroid(mesh: &TriangleMesh, reference: &Point3<f64>) -> (f64, Point3<f64>) {
    let mut volume = 0.0;
    let mut moment = Vector3::zeros();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t).map(|p| p - reference);
        let cone = a.dot(&b.cross(&c)) / 6.0;
        volume += cone;
        moment += cone * 0.25 * (a + b + c);
    }
    (volume, reference + moment / volume)
}

/// Signed volume of a part of the mesh.
pub(crate) fn signed_volume(mesh: &TriangleMesh, part: &[u32], reference: &Point3<f64>) -> f64 {
    let cones = part.iter().map(|&t| {
        let [a, b, c] = mesh.corners(t as usize).map(|p| p - reference);
        a.dot(&b.cross(&c)) / 6.0
    });
    cones.sum()
}

pub(crate) fn surface_area(mesh: &TriangleMesh) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| 0.5 * double_area(&mesh.corners(t)).norm())
        .sum()
}

/// Unit normals. A triangle without area (three corners on a line) takes the normal of its neighbour across its longest
/// edge, so that edge angles remain those of the surface.
pub(crate) fn normals(mesh: &TriangleMesh, across: &Neighbours) -> Vec<Vector3<f64>> {
    let mut normals: Vec<Option<Vector3<f64>>> = Vec::with_capacity(mesh.triangles.len());
    let mut without_area = Vec::new();
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let area = double_area(&corners);
        let longest = longest_edge(&corners).1;
        if area.norm() <= 8.0 * f64::EPSILON * longest * longest {
            normals.push(None);
            without_area.push(t);
        } else {
            normals.push(Some(area.normalize()));
        }
    }
    // A row of triangles without area passes its neighbour's normal along, one triangle per iteration.
    while !without_area.is_empty() {
        let before = without_area.len();
        without_area.retain(|&t| {
            let beside = across[t][longest_edge(&mesh.corners(t)).0] as usize;
            normals[t] = normals[beside];
            normals[t].is_none()
        });
        if without_area.len() == before {
            // Some depend on each other: two back to back along an edge of four vertices or more. One of them takes the
            // normal of any neighbour that has one; its corners lie on a line, so all edges turn by the same angle.
            let beside = |t: usize| across[t].iter().find_map(|&other| normals[other as usize]);
            let Some((place, normal)) = (0..before).find_map(|place| Some((place, beside(without_area[place])?)))
            else {
                break;
            };
            normals[without_area.swap_remove(place)] = Some(normal);
        }
    }
    normals.into_iter().map(|n| n.unwrap_or_else(Vector3::z)).collect()
}

/// Which edge (0: corners 0→1, ...) is longest, and its length.
fn longest_edge(corners: &[Point3<f64>; 3]) -> (usize, f64) {
    let length = |k: usize| (corners[(k + 1) % 3] - corners[k]).norm();
    (0..3)
        .map(|k| (k, length(k)))
        .fold((0, 0.0), |best, next| if next.1 > best.1 { next } else { best })
}

/// H = (1/4π) Σ over edges of length × signed angle between the normals (convex positive, concave negative).
///
/// For a convex body this is the mean width (mean caliper diameter). For any closed mesh it is the mean of profiles
/// minus holes over random planes, per plane spacing.
pub(crate) fn signed_mean_width(mesh: &TriangleMesh, across: &Neighbours) -> f64 {
    let normals = normals(mesh, across);
    let mut sum = 0.0;
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let other = across[t][k] as usize;
            if other <= t {
                continue;
            }
            let edge = mesh.vertices[corners[(k + 1) % 3] as usize] - mesh.vertices[corners[k] as usize];
            let length = edge.norm();
            if length > 0.0 {
                let along = edge / length;
                // The angle about the edge; rounding may tilt a sliver's normal out of the plane across the edge.
                let sine = normals[t].cross(&normals[other]).dot(&along);
                let cosine = normals[t].dot(&normals[other]) - normals[t].dot(&along) * normals[other].dot(&along);
                sum += length * sine.atan2(cosine);
            }
        }
    }
    sum / (4.0 * PI)
}
