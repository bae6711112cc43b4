//! Sections: exact profiles against the formulas for spheres, images against profiles.

use crate::spheres::{mixture, spheres};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::f64::consts::PI;
use stereology_volume::{Axis, SlicePlane, Solid};

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

fn sphere_profiles(solid: &Solid, axis: Axis, depth: f64) -> Vec<(usize, f64)> {
    let mut profiles = Vec::new();
    for (i, sphere) in solid.particles().iter().enumerate() {
        let offset = Vector3::repeat(depth - sphere.position[axis.index()]);
        let h = solid.period().nearest(offset)[axis.index()];
        let square = (0.5 * sphere.size - h) * (0.5 * sphere.size + h);
        if square > 0.0 {
            profiles.push((i, PI * square));
        }
    }
    profiles
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A sphere of radius r at distance h from the plane shows a circle of area π (r² − h²).
    #[test]
    fn profiles_of_spheres_are_circles(seed in 0_u64..4, depth in -20.0..20.0_f64, axis in 0_usize..3) {
        let solid = spheres(seed);
        let axis = AXES[axis];
        let (ours, known) = (solid.section_profiles(axis, depth), sphere_profiles(&solid, axis, depth));
        prop_assert_eq!(ours.len(), known.len());
        for (a, b) in ours.iter().zip(&known) {
            prop_assert_eq!(a.0, b.0);
            prop_assert!((a.1 - b.1).abs() < 1e-9);
        }
    }

    /// The pixels whose centres lie in a profile cover its area except at its border: at most the ring of half a
    /// pixel's diagonal to both sides, 2π r √2 pixel.
    #[test]
    fn pixels_cover_the_profiles(seed in 0_u64..4, depth in 0.0..8.0_f64, axis in 0_usize..3) {
        let solid = spheres(seed);
        let axis = AXES[axis];
        let (n, pixel) = (256, 8.0 / 256.0);
        let ids = solid.slice_ids(&SlicePlane::across(axis, depth), n, n, pixel).unwrap();
        for (i, area) in sphere_profiles(&solid, axis, depth) {
            let pixels = ids.iter().filter(|&&id| id as usize == i + 1).count();
            let ring = 2.0 * PI * (area / PI).sqrt() * 2.0_f64.sqrt() * pixel + PI * pixel * pixel;
            prop_assert!((pixels as f64 * pixel * pixel - area).abs() <= ring);
        }
    }
}

/// Delesse and eq. (1) on one solid: planes at equal steps through the period find area fraction = volume fraction,
/// profiles per area = Σ d per volume, and a mean profile of Σ π d³/6 over Σ d.
#[test]
fn planes_through_the_period_measure_the_solid() {
    let solid = spheres(1);
    let (steps, volume, area) = (20_000, solid.period().volume(), 64.0);
    let sum = |power: i32| solid.particles().iter().map(|p| p.size.powi(power)).sum::<f64>();
    for axis in AXES {
        let depths = (0..steps).map(|i| (f64::from(i) + 0.5) * 8.0 / f64::from(steps));
        let profiles: Vec<f64> = depths
            .flat_map(|d| solid.section_profiles(axis, d))
            .map(|(_, area)| area)
            .collect();
        let (count, total) = (profiles.len() as f64, profiles.iter().sum::<f64>());
        let examined = area * f64::from(steps);
        // A sphere of diameter d is cut by d / step planes, plus or minus one: an error under 1 in 2000 for the
        // smallest.
        assert!((count / examined / (sum(1) / volume) - 1.0).abs() < 1e-3);
        assert!((total / examined / (PI / 6.0 * sum(3) / volume) - 1.0).abs() < 1e-6);
        assert!((total / count / (PI / 6.0 * sum(3) / sum(1)) - 1.0).abs() < 1e-3);
    }
}

/// The integral of an image is the sum of the profiles' colours times their areas: border pixels mix colours in
/// proportion.
#[test]
fn border_pixels_mix_colours_in_proportion() {
    let solid = spheres(2);
    let (n, depth) = (128, 3.1);
    let pixel = 8.0 / f64::from(n);
    let picture = solid.slice(&SlicePlane::across(Axis::Z, depth), n, n, pixel).unwrap();
    for channel in 0..3 {
        let binder = f64::from(solid.binder()[channel]);
        let known: f64 = sphere_profiles(&solid, Axis::Z, depth)
            .iter()
            .map(|&(i, area)| area * (f64::from(solid.colours()[i][channel]) - binder))
            .sum::<f64>()
            / 64.0
            + binder;
        let mean = picture.pixels().map(|p| f64::from(p.0[channel]) / 255.0).sum::<f64>() / f64::from(n * n);
        assert!((mean - known).abs() < 0.5 / 255.0 + 5e-4, "{mean} {known}"); // bytes are rounded
    }
}

/// An image has pure pixels inside profiles and mixed ones on borders; without border samples all pixels have the
/// colours of their centres.
#[test]
fn border_samples_can_be_turned_off() {
    let solid = mixture(0);
    let plane = SlicePlane::oblique(Vector3::new(1.0, 2.0, -0.5), 3.0).unwrap();
    let hard = solid
        .clone()
        .with_border_samples(1)
        .unwrap()
        .slice(&plane, 60, 50, 0.1)
        .unwrap();
    let soft = solid.slice(&plane, 60, 50, 0.1).unwrap();
    let ids = solid.slice_ids(&plane, 60, 50, 0.1).unwrap();
    let mut mixed = 0;
    for (x, y, pixel) in hard.enumerate_pixels() {
        let id = ids[[y as usize, x as usize]] as usize;
        let colour = if id == 0 {
            solid.binder()
        } else {
            solid.colours()[id - 1]
        };
        for (value, byte) in colour.iter().zip(pixel.0) {
            assert!((value * 255.0 - f32::from(byte)).abs() <= 0.5 + 1e-4);
        }
        mixed += usize::from(soft.get_pixel(x, y) != pixel);
    }
    assert!((50..1500).contains(&mixed), "{mixed}");
}
