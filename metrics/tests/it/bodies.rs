//! Minkowski functionals of single bodies with known surface, curvature and Euler number.

use ndarray::{Array2, Array3};
use proptest::prelude::*;
use std::f64::consts::PI;
use stereology_metrics::{planar_functionals, spatial_functionals};

const SIDE: usize = 64;

/// A body about a point near the middle of a grid of 64³ voxels, by its inside at (z, y, x).
fn body(shift: [f64; 3], inside: impl Fn([f64; 3]) -> bool) -> Array3<bool> {
    Array3::from_shape_fn((SIDE, SIDE, SIDE), |(z, y, x)| {
        inside([
            z as f64 - 31.5 - shift[0],
            y as f64 - 31.5 - shift[1],
            x as f64 - 31.5 - shift[2],
        ])
    })
}

fn radius([z, y, x]: [f64; 3]) -> f64 {
    (z * z + y * y + x * x).sqrt()
}

/// Volume, surface, curvature and both Euler numbers of the whole body.
fn totals(body: &Array3<bool>) -> [f64; 5] {
    let found = spatial_functionals(body.view());
    let corners = ((SIDE - 1) as f64).powi(3);
    [
        found.fraction * (SIDE as f64).powi(3),
        found.specific_surface * corners,
        // Planes have one row and one column of corners less than pixels.
        found.mean_curvature * SIDE as f64 * ((SIDE - 1) as f64).powi(2),
        found.euler_26 * corners,
        found.euler_6 * corners,
    ]
}

fn near(found: f64, law: f64, tolerance: f64) -> bool {
    (found / law - 1.0).abs() < tolerance
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Ball of radius R: surface 4π R², curvature 4π R, Euler number 1.
    #[test]
    fn a_ball(r in 12.0..24.0_f64, shift in prop::array::uniform3(-0.5..0.5_f64)) {
        let [volume, surface, curvature, euler_26, euler_6] = totals(&body(shift, |at| radius(at) < r));
        prop_assert!(near(volume, 4.0 / 3.0 * PI * r.powi(3), 0.02), "{volume}");
        prop_assert!(near(surface, 4.0 * PI * r * r, 0.02), "{surface}");
        prop_assert!(near(curvature, 4.0 * PI * r, 0.05), "{curvature}");
        prop_assert!((euler_26 - 1.0).abs() < 1e-6 && (euler_6 - 1.0).abs() < 1e-6);
    }

    /// Shell between two radii: both surfaces, curvature 4π (R − r) since the inner one is concave, and Euler number 2:
    /// a component and a cavity.
    #[test]
    fn a_shell(r in 16.0..26.0_f64, inner in 0.3..0.7_f64, shift in prop::array::uniform3(-0.5..0.5_f64)) {
        let hollow = r * inner;
        let [_, surface, curvature, euler_26, euler_6] = totals(&body(shift, |at| radius(at) < r && radius(at) > hollow));
        prop_assert!(near(surface, 4.0 * PI * (r * r + hollow * hollow), 0.02), "{surface}");
        prop_assert!((curvature - 4.0 * PI * (r - hollow)).abs() < 0.05 * 4.0 * PI * r, "{curvature}");
        prop_assert!((euler_26 - 2.0).abs() < 1e-6 && (euler_6 - 2.0).abs() < 1e-6);
    }

    /// Torus about any axis: surface 4π² R r, Euler number 0.
    #[test]
    fn a_torus(r in 5.0..7.0_f64, axis in prop::array::uniform3(-1.0..1.0_f64)) {
        let length = radius(axis);
        prop_assume!(length > 0.2);
        let big = 18.0;
        let inside = |at: [f64; 3]| {
            let along = at.iter().zip(&axis).map(|(a, b)| a * b).sum::<f64>() / length;
            let around = (radius(at).powi(2) - along * along).max(0.0).sqrt() - big;
            around.hypot(along) < r
        };
        let [volume, surface, _, euler_26, euler_6] = totals(&body([0.0; 3], inside));
        prop_assert!(near(volume, 2.0 * PI * PI * big * r * r, 0.03), "{volume}");
        prop_assert!(near(surface, 4.0 * PI * PI * big * r, 0.03), "{surface}");
        prop_assert!(euler_26.abs() < 1e-6 && euler_6.abs() < 1e-6);
    }

    /// Euler numbers add up: for any pixels and any voxels away from the border the corners count what vertices, edges,
    /// faces and cells of the whole count.
    #[test]
    fn euler_numbers_are_those_of_cells(bits in prop::collection::vec(any::<bool>(), 64)) {
        let at = |z: usize, y: usize, x: usize| {
            let inside = |v: usize| (1..5).contains(&v);
            inside(z) && inside(y) && inside(x) && bits[(z - 1) * 16 + (y - 1) * 4 + x - 1]
        };
        let voxels = Array3::from_shape_fn((6, 6, 6), |(z, y, x)| at(z, y, x));
        // Cell complex on a grid of twice the voxels: odd coordinates are inside voxels, even ones between them.
        let cells = |any: bool| {
            let mut euler = 0_i32;
            for z in 2..=10_usize {
                for y in 2..=10_usize {
                    for x in 2..=10_usize {
                        let range = |v: usize| if v % 2 == 1 { v / 2..v / 2 + 1 } else { v / 2 - 1..v / 2 + 1 };
                        let mut around = range(z).flat_map(|z| range(y).flat_map(move |y| range(x).map(move |x| (z, y, x))));
                        let present = if any { around.any(|(z, y, x)| at(z, y, x)) } else { around.all(|(z, y, x)| at(z, y, x)) };
                        // The dimension of the cell, or of its dual.
                        let odd = z % 2 + y % 2 + x % 2;
                        let dimension = if any { odd } else { 3 - odd };
                        euler += i32::from(present) * if dimension % 2 == 0 { 1 } else { -1 };
                    }
                }
            }
            f64::from(euler)
        };
        let found = spatial_functionals(voxels.view());
        prop_assert!((found.euler_26 * 125.0 - cells(true)).abs() < 1e-9);
        prop_assert!((found.euler_6 * 125.0 - cells(false)).abs() < 1e-9);
        let plane = voxels.index_axis(ndarray::Axis(0), 2);
        let flat = Array3::from_shape_fn((3, 6, 6), |(z, y, x)| z == 1 && plane[[y, x]]);
        // A layer of voxels has the Euler number of its pixels.
        let (flat, plane) = (spatial_functionals(flat.view()), planar_functionals(plane));
        prop_assert!((flat.euler_26 * 50.0 - plane.euler_8 * 25.0).abs() < 1e-9);
        prop_assert!((flat.euler_6 * 50.0 - plane.euler_4 * 25.0).abs() < 1e-9);
    }
}

/// Crofton's formula with four directions: the length of a line along the rows is 5 % low, along a diagonal also.
#[test]
fn straight_boundaries() {
    let half = |of: &dyn Fn(usize, usize) -> bool| {
        let image = Array2::from_shape_fn((101, 101), |(y, x)| of(y, x));
        planar_functionals(image.view()).boundary_length * 100.0
    };
    let expected = (1.0 + 2.0_f64.sqrt()) * PI / 8.0;
    assert!((half(&|y, _| y < 50) - expected).abs() < 1e-9);
    assert!((half(&|y, x| y < x) / 2.0_f64.sqrt() - expected).abs() < 0.01);
    assert_eq!(half(&|_, _| true), 0.0);
}
