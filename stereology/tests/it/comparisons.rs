//! Comparisons of images that differ in a known way.

use ndarray::{Array3, ArrayView3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use stereology::metrics::{Comparison, MeasureError, Patches, sliced_wasserstein};
use stereology::pipeline::{CompareOptions, compare_solid};

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn with_patches(patches: usize) -> CompareOptions {
    CompareOptions {
        patches: Some(patches),
        ..CompareOptions::default()
    }
}

fn compared(exemplar: &Array3<f32>, solid: &Array3<f32>) -> Comparison {
    compare_solid(&[exemplar.view()], &[solid.view()], &with_patches(2000), &go).unwrap()
}

/// Smoothed noise about .5.
fn texture(height: usize, width: usize, seed: u64) -> Array3<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = ndarray::Array2::from_shape_fn((height + 4, width + 4), |_| rng.random::<f32>());
    Array3::from_shape_fn((height, width, 1), |(y, x, _)| {
        let sum: f32 = (0..25).map(|k| noise[[y + k / 5, x + k % 5]]).sum();
        0.5 + 1.5 * (sum / 25.0 - 0.5)
    })
}

/// The exemplar compared with itself: only the random patches differ.
#[test]
fn an_image_equals_itself() {
    let picture = texture(96, 96, 1);
    let found = compared(&picture, &picture);
    for (name, figure) in found.figures() {
        let (value, ideal, floor) = (figure.value.unwrap(), figure.ideal.unwrap(), figure.floor.unwrap());
        assert!(
            (value - ideal).abs() <= 1e-9 || name.starts_with("swd"),
            "{name}: {value}, {ideal}"
        );
        assert!(floor > 0.0, "{name}");
        assert!(figure.in_floors().unwrap() < 1.0, "{name}: {figure:?}");
    }
}

/// The figures of another image of the same material are within the floors; less contrast and another direction change
/// the figure that measures them.
#[test]
fn each_figure_shows_its_fault() {
    let (exemplar, other) = (texture(128, 128, 1), texture(128, 128, 2));
    let same = compared(&exemplar, &other);
    assert!(
        same.figures().iter().all(|(_, f)| f.in_floors().unwrap() < 3.5),
        "{:?}",
        same.figures()
    );
    let pale = compared(&exemplar, &other.mapv(|v| 0.5 + 0.6 * (v - 0.5)));
    assert!((pale.std_ratio.value.unwrap() - 0.6).abs() < 0.05 && pale.kl_grey.in_floors().unwrap() > 3.0);
    let striped = Array3::from_shape_fn((128, 128, 1), |(y, x, c)| {
        0.7 * other[[y, x, c]] + 0.3 * (0.5 + 0.5 * (x as f32 * 0.6).sin())
    });
    let striped = compared(&exemplar, &striped);
    assert!(striped.kl_orientation.in_floors().unwrap() > 3.0 && striped.swd16.in_floors().unwrap() > 1.5);
}

/// Fringes with more dislocations are shorter; wavy ones have a larger tortuosity.
#[test]
fn fringes_are_distinguished() {
    let fringes = |dislocations: usize, wave: f64| {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let ends: Vec<[f64; 3]> = (0..dislocations)
            .map(|i| {
                [
                    128.0 * rng.random::<f64>(),
                    128.0 * rng.random::<f64>(),
                    if i % 2 == 0 { 1.0 } else { -1.0 },
                ]
            })
            .collect();
        Array3::from_shape_fn((128, 128, 1), |(y, x, _)| {
            let (y, x) = (y as f64, x as f64);
            let turns: f64 = ends.iter().map(|[ey, ex, sign]| sign * (y - ey).atan2(x - ex)).sum();
            (0.5 + 0.4 * (y * TAU / 8.0 + turns + wave * (x * TAU / 40.0).sin()).sin()) as f32
        })
    };
    let found = compared(&fringes(12, 0.0), &fringes(40, 0.0));
    assert!((found.curves.period.unwrap() - 8.0).abs() < 1.0 && found.curves.direction.is_some());
    let by_ends = found.fringe_length_by_ends;
    assert!(
        by_ends.value.unwrap() < 0.6 * by_ends.ideal.unwrap(),
        "{:?}",
        found.figures()
    );
    let wavy = compared(&fringes(40, 0.0), &fringes(40, 1.5)).tortuosity;
    assert!(wavy.value.unwrap() > wavy.ideal.unwrap() + 0.01, "{wavy:?}");
}

/// A shift of all grey levels by c moves d-dimensional patches by c √d along the diagonal; projected on a random
/// direction this is c √d |u₁|, whose mean is known.
#[test]
fn sliced_wasserstein_of_a_shift() {
    let picture = texture(80, 80, 3);
    let lighter = &picture + 0.2;
    let of = |p: &Array3<f32>| Patches::draw(&[p.view()], 5, 1500, 7);
    let projections = 2000;
    let found = sliced_wasserstein(&of(&picture), &of(&lighter), projections, 1).unwrap();
    // Mean of |u1| in 25 dimensions: gamma(12.5) / (sqrt(pi) gamma(13)).
    let half_integer: f64 = (1..=12).map(|k| f64::from(k) - 0.5).product::<f64>() * PI.sqrt();
    let whole: f64 = (1..=12).map(f64::from).product();
    let law = 0.2 * 5.0 * half_integer / (PI.sqrt() * whole);
    // The standard deviation of |u1| is .76 of its mean; five standard errors.
    assert!(
        (found / law - 1.0).abs() < 5.0 * 0.76 / (projections as f64).sqrt(),
        "{found}, law {law}"
    );
}

/// White noise of two contrasts: on every direction it projects to normal distributions of standard deviations s and t,
/// whose distance is |s − t| √(2/π).
#[test]
fn sliced_wasserstein_of_two_contrasts() {
    let noise = |spread: f32, seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let picture = Array3::from_shape_fn((200, 200, 1), |_| {
            let twelve: f32 = (0..12).map(|_| rng.random::<f32>()).sum();
            spread * (twelve - 6.0)
        });
        Patches::draw(&[picture.view()], 7, 8000, seed)
    };
    let found = sliced_wasserstein(&noise(0.1, 1), &noise(0.2, 2), 64, 0).unwrap();
    assert!((found / (0.1 * (2.0 / PI).sqrt()) - 1.0).abs() < 0.03, "{found}");
}

/// Images that cannot be compared are refused.
#[test]
fn images_that_cannot_be_compared_are_refused() {
    let good = texture(32, 32, 1);
    let refused = |exemplar: &[ArrayView3<'_, f32>], slices: &[ArrayView3<'_, f32>]| {
        compare_solid(exemplar, slices, &with_patches(10), &go).unwrap_err()
    };
    assert!(matches!(
        refused(&[], &[good.view()]),
        MeasureError::Empty { side: "exemplar" }
    ));
    assert!(matches!(
        refused(&[good.view()], &[]),
        MeasureError::Empty { side: "volume" }
    ));
    let small = texture(8, 40, 1);
    assert!(matches!(
        refused(&[small.view()], &[good.view()]),
        MeasureError::TooSmall { least: 16, .. }
    ));
    let flat = Array3::from_elem((32, 32, 1), 0.3);
    assert_eq!(refused(&[flat.view()], &[good.view()]), MeasureError::ConstantExemplar);
    let mut holed = good.clone();
    holed[[3, 3, 0]] = f32::NAN;
    assert_eq!(
        refused(&[good.view()], &[holed.view()]),
        MeasureError::NotFinite { side: "volume" }
    );
    let stopped = compare_solid(&[good.view()], &[good.view()], &CompareOptions::default(), &|_| {
        ControlFlow::Break(())
    });
    assert_eq!(stopped.unwrap_err(), MeasureError::Cancelled);
    // Slices that are too small for patches of 16 pixels are measured without them.
    let thin = texture(10, 40, 2);
    let found = compare_solid(&[good.view()], &[thin.view()], &with_patches(100), &go).unwrap();
    assert!(found.swd16.value.is_none() && found.swd7.value.is_some());
}
