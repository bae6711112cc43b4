//! Exact point-in-mesh test: signed crossings of a ray, by robust predicates.

use nalgebra::Point3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// Signed crossing of triangle `[a, b, c]` with the ray from `p` towards +x: 1 where the ray leaves the solid, -1 where
/// it enters, else 0. The sum over a closed mesh is its winding number about `p`; 0 for a point on the surface or
/// outside.
///
/// The projections of neighbouring triangles to the (y, z) plane share no point and leave no gap (edges are half-open,
/// signs exact), so a ray through an edge or a vertex is counted correctly.
pub(crate) fn ray_crossing([a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> i32 {
    let turns = edge_crossing(a, b, p) + edge_crossing(b, c, p) + edge_crossing(c, a, p);
    if turns == 0 {
        return 0;
    }
    let below = orient3d(coord(a), coord(b), coord(c), coord(p));
    let ahead = if turns > 0 { below > 0.0 } else { below < 0.0 };
    if ahead { turns } else { 0 }
}

/// Crossing of the edge with the half-line from `p` along +y in the (y, z) plane.
fn edge_crossing(a: &Point3<f64>, b: &Point3<f64>, p: &Point3<f64>) -> i32 {
    let flat = |q: &Point3<f64>| Coord { x: q.y, y: q.z };
    if a.z <= p.z {
        i32::from(b.z > p.z && orient2d(flat(a), flat(b), flat(p)) > 0.0)
    } else {
        -i32::from(b.z <= p.z && orient2d(flat(a), flat(b), flat(p)) < 0.0)
    }
}

pub(crate) fn coord(p: &Point3<f64>) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}
