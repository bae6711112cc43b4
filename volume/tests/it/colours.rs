//! Colours: mean plus residual, the binder's outside and the particles' inside.

use crate::spheres::spheres;
use nalgebra::Point3;
use ndarray::Array4;
use stereology_volume::{Axis, Lookup, Residual, SlicePlane, Solid};

fn value(seed: f32, z: usize, y: usize, x: usize, c: usize) -> f32 {
    (seed + 1.7 * x as f32 + 2.3 * y as f32 + 3.1 * z as f32 + c as f32).sin() * 0.1
}

/// Residuals of different sizes, 16 and 8 voxels, of edge 1/2 in a box of side 8.
fn textured(seed: u64) -> Solid {
    let plain = spheres(seed);
    let residual = Residual {
        binder: Array4::from_shape_fn((16, 8, 16, 3), |(z, y, x, c)| value(0.0, z, y, x, c)),
        particles: Array4::from_shape_fn((8, 16, 4, 3), |(z, y, x, c)| value(5.0, z, y, x, c)),
        voxel: 0.5,
    };
    let colours = plain.colours().to_vec();
    Solid::new(plain.arrangement().clone(), colours, plain.binder(), Some(residual)).unwrap()
}

/// At the centre of a residual voxel every lookup gives mean + that voxel, whatever the period it is in.
#[test]
fn a_colour_is_the_mean_plus_the_residual() {
    for lookup in [Lookup::Nearest, Lookup::Trilinear, Lookup::VarianceKept] {
        let solid = textured(0).with_lookup(lookup);
        let (mut inside, mut outside) = (0, 0);
        for i in 0..16 * 16 * 16 {
            let (x, y, z) = (i % 16, i / 16 % 16, i / 256);
            let p = Point3::from([x, y, z].map(|n| (n as f64 + 0.5) / 2.0 - 8.0));
            let colour = solid.colour_at(&p);
            for (c, value_here) in colour.iter().enumerate() {
                let known = match solid.id_at(&p) {
                    Some(id) => solid.colours()[id][c] + value(5.0, z % 8, y, x % 4, c),
                    None => solid.binder()[c] + value(0.0, z, y % 8, x, c),
                };
                assert!((value_here - known).abs() < 1e-5, "{lookup:?} {p}");
            }
            let particle = u32::from(solid.id_at(&p).is_some());
            inside += particle;
            outside += 1 - particle;
        }
        assert!(inside > 100 && outside > 100);
    }
}

#[test]
fn without_its_residual_a_solid_has_mean_colours() {
    let solid = textured(1);
    let (plain, bare) = (spheres(1), solid.without_residual());
    for i in 0..1000 {
        let p = Point3::from([0.37, 0.71, 0.93].map(|step| step * f64::from(i)));
        assert_eq!(bare.colour_at(&p), plain.colour_at(&p));
    }
}

/// An image with pixels as large as the residual's voxels shows the voxels themselves, clamped only as bytes.
#[test]
fn images_at_the_photographs_scale_show_the_residual_unblurred() {
    let solid = textured(2).with_border_samples(1).unwrap();
    let picture = solid.slice(&SlicePlane::across(Axis::Z, 0.25), 16, 16, 0.5).unwrap();
    for (x, y, pixel) in picture.enumerate_pixels() {
        let p = Point3::new((f64::from(x) + 0.5) / 2.0, (f64::from(y) + 0.5) / 2.0, 0.25);
        let known = solid.colour_at(&p).map(|value| (value * 255.0).clamp(0.0, 255.0));
        for (known, byte) in known.iter().zip(pixel.0) {
            assert!((known - f32::from(byte)).abs() <= 0.5 + 1e-3);
        }
    }
}
