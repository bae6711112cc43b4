//! Shapes for the tests.

use nalgebra::{Point3, Unit, UnitQuaternion, UnitVector3, Vector3};
use proptest::prelude::*;
use stereology_shape::{ClosedMesh, TriangleMesh, convex_hull};

/// Points in a cube about the origin.
pub(crate) fn points(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Point3<f64>>> {
    prop::collection::vec([-1.0..1.0, -1.0..1.0, -1.0..1.0_f64].prop_map(Point3::from), count)
}

/// Hulls of random points.
pub(crate) fn polytopes() -> impl Strategy<Value = ClosedMesh> {
    points(6..40).prop_map(|points| convex_hull(&points).unwrap())
}

pub(crate) fn directions() -> impl Strategy<Value = UnitVector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64].prop_filter_map("zero", |v| Unit::try_new(Vector3::from(v), 0.05))
}

pub(crate) fn rotations() -> impl Strategy<Value = UnitQuaternion<f64>> {
    (directions(), 0.0..6.2_f64).prop_map(|(axis, angle)| UnitQuaternion::from_axis_angle(&axis, angle))
}

/// A fat L: two arms of unit square section along x and y; not convex, volume 3.
pub(crate) fn fat_l() -> ClosedMesh {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let vertices = [0.0, 1.0]
        .iter()
        .flat_map(|&z| outline.map(|[x, y]| Point3::new(x, y, z)))
        .collect();
    let cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5_u32]];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for [a, b, c] in cap {
        triangles.extend([[a, c, b], [a + 6, b + 6, c + 6]]);
    }
    for i in 0..6 {
        let j = (i + 1) % 6;
        triangles.extend([[i, j, j + 6], [i, j + 6, i + 6]]);
    }
    ClosedMesh::try_from(TriangleMesh { vertices, triangles }).unwrap()
}

/// A fat tube about z with a square hole: genus one.
pub(crate) fn torus() -> ClosedMesh {
    ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 24, 12)).unwrap()
}

/// A cube of side 2 with a cubic cavity of side 1.
pub(crate) fn hollow_cube() -> ClosedMesh {
    let mut cavity = TriangleMesh::cuboid([1.0; 3]);
    cavity.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    ClosedMesh::try_from(TriangleMesh::cuboid([2.0; 3]).with(&cavity)).unwrap()
}
