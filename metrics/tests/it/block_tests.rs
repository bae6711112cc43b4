//! The block test on synthetic textures: equal ones pass, changed ones do not.

use ndarray::{Array3, Array4, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_metrics::{BlockSource, Family, Level, block_test};

/// Noise smoothed over 5 voxels along each axis, about .5.
fn noise(shape: [usize; 3], seed: u64) -> Array4<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let wide = shape.map(|n| n + 4);
    let mut field = Array3::from_shape_fn(wide, |_| rng.random::<f32>() - 0.5);
    for (axis, &n) in shape.iter().enumerate() {
        let mut sum = Array3::zeros(field.slice_axis(Axis(axis), (0..n).into()).raw_dim());
        (0..5).for_each(|k| sum += &field.slice_axis(Axis(axis), (k..k + n).into()));
        field = sum;
    }
    field.mapv(|v| 0.5 + v / 20.0).insert_axis(Axis(3))
}

fn volume(voxels: &Array4<f32>) -> BlockSource<'_> {
    BlockSource::Volume {
        voxels: voxels.view(),
        families: &Family::ALL,
        mask: None,
    }
}

/// Of 30 volumes of the exemplar's law, fewer than 6 are found different at the level .01: the chance of 6 is 5e-7.
#[test]
fn solids_of_the_same_law_pass() {
    let alarms = (0..30)
        .filter(|&seed| {
            let (exemplar, solid) = (noise([1, 128, 128], 100 + seed), noise([48, 48, 48], seed));
            let images = [exemplar.index_axis(Axis(0), 0)];
            let test = block_test(&BlockSource::Images(&images), &volume(&solid), seed).unwrap();
            assert_ne!(test.level(), Level::Bad, "{test:?}");
            test.level() != Level::Good
        })
        .count();
    assert!(alarms < 6, "{alarms}");
}

/// A threshold that keeps mean and variance changes the tails; the test names features of the tails.
#[test]
fn two_tones_are_distinguished_from_noise() {
    let (exemplar, solid) = (noise([1, 128, 128], 1), noise([64, 64, 64], 2));
    let deviation = solid.std(0.0);
    let tones = exemplar.mapv(|v| if v > 0.5 { 0.5 + deviation } else { 0.5 - deviation });
    let images = [tones.index_axis(Axis(0), 0)];
    let test = block_test(&BlockSource::Images(&images), &volume(&solid), 0).unwrap();
    assert_eq!(test.level(), Level::Bad, "{test:?}");
    assert!(test.accuracy > 0.95 && test.feature("flatness").unwrap().difference.abs() > 1.0);
}

/// Masked blocks do not count, and too few blocks give no test.
#[test]
fn masks_and_small_volumes() {
    let (exemplar, solid) = (noise([1, 96, 96], 3), noise([64, 64, 64], 4));
    let images = [exemplar.index_axis(Axis(0), 0)];
    let half = Array3::from_shape_fn((64, 64, 64), |(_, _, x)| x < 32);
    let masked = BlockSource::Volume {
        voxels: solid.view(),
        families: &Family::ALL,
        mask: Some(half.view()),
    };
    let test = block_test(&BlockSource::Images(&images), &masked, 0).unwrap();
    assert_eq!((test.side, test.blocks), (16, 32));
    let none = Array3::from_elem((64, 64, 64), false);
    let masked = BlockSource::Volume {
        voxels: solid.view(),
        families: &Family::ALL,
        mask: Some(none.view()),
    };
    assert_eq!(block_test(&BlockSource::Images(&images), &masked, 0), None);
    let small = noise([24, 24, 24], 5);
    assert_eq!(block_test(&BlockSource::Images(&images), &volume(&small), 0), None);
}
