//! Triangulation of faces with more than three corners.

use nalgebra::{Point3, Vector3};
use robust::{Coord, orient2d};

use crate::file::mesh_file_error::MeshFileFault;

/// Faces with more corners are refused: the cost grows with the square of their number.
const MOST_CORNERS: usize = 4096;

/// Cuts a face, convex or concave, into triangles that use its corners only and share its edges. `corners` are indices
/// in range.
pub(crate) fn triangulate(
    corners: &[u32],
    vertices: &[Point3<f64>],
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), MeshFileFault> {
    if let &[a, b, c] = corners {
        triangles.push([a, b, c]);
        return Ok(());
    }
    if !(3..=MOST_CORNERS).contains(&corners.len()) {
        return Err(MeshFileFault::Corners { corners: corners.len() });
    }
    let flat = project(corners, vertices);
    let mut ring: Vec<usize> = (0..corners.len()).collect();
    while ring.len() > 3 {
        let ear = find_ear(&ring, &flat);
        let n = ring.len();
        triangles.push([ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]].map(|i| corners[i]));
        ring.remove(ear);
    }
    triangles.push([ring[0], ring[1], ring[2]].map(|i| corners[i]));
    Ok(())
}

/// The corners projected along the axis closest to the face's normal, counter-clockwise.
fn project(corners: &[u32], vertices: &[Point3<f64>]) -> Vec<Coord<f64>> {
    let at = |i: usize| vertices[corners[i % corners.len()] as usize];
    // Newell's normal: the vector area of the polygon.
    let normal: Vector3<f64> = (1..corners.len())
        .map(|i| (at(i) - at(0)).cross(&(at(i + 1) - at(0))))
        .sum();
    let axis = normal.iamax();
    let (u, v) = if normal[axis] >= 0.0 {
        ((axis + 1) % 3, (axis + 2) % 3)
    } else {
        ((axis + 2) % 3, (axis + 1) % 3)
    };
    (0..corners.len())
        .map(|i| Coord {
            x: at(i)[u],
            y: at(i)[v],
        })
        .collect()
}

/// The first corner that can be cut off: it turns left and no other corner lies in its triangle. A polygon that crosses
/// itself may have none; then any corner is cut off, and the surface stays closed.
fn find_ear(ring: &[usize], flat: &[Coord<f64>]) -> usize {
    let n = ring.len();
    let is_ear = |k: usize| {
        let [a, b, c] = [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]].map(|i| flat[i]);
        let left = |p, q, r| orient2d(p, q, r) >= 0.0;
        orient2d(a, b, c) > 0.0
            && ring
                .iter()
                .map(|&i| flat[i])
                .all(|p| p == a || p == b || p == c || !(left(a, b, p) && left(b, c, p) && left(c, a, p)))
    };
    (0..n).find(|&k| is_ear(k)).unwrap_or(0)
}
