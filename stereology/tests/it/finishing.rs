//! The finishing pass of grown stone.

use std::ops::ControlFlow;

use ndarray::{Array2, Array3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::exemplar::SolidError;
use stereology::grow::{GrowOptions, Grown, grow};
use stereology::metrics::seams;
use stereology::pipeline::finish_grown;

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Square grains of three greys, 6 pixels wide.
fn stone(side: usize) -> Array3<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let greys = Array2::from_shape_fn([side.div_ceil(6); 2], |_| rng.random_range(0..3_u8));
    Array3::from_shape_fn((side, side, 1), |(y, x, _)| {
        f32::from(greys[[y / 6, x / 6]]) * 100.0 + 20.0
    })
}

/// The finishing pass removes the seams of cells; measurements and voxels outside the mask keep their values, and all
/// others are texels of the exemplar.
#[test]
fn finishing_removes_seams() {
    let mask = Array3::from_shape_fn((24, 24, 24), |(z, y, x)| z + y + x < 60);
    let measured: Vec<_> = (0..8)
        .map(|i| ([2 + i, 20 - 2 * i, (7 * i) % 20], vec![(31 * i) as f32 + 0.5]))
        .collect();
    let options = GrowOptions::default().with_window(3);
    let made = grow(mask.view(), stone(64).view(), &measured, &options, &go).unwrap();
    let finished = finish_grown(&made, mask.view(), stone(64).view(), &measured, 5, 0, &go).unwrap();
    let visible = |made: &Grown| seams(made.values.view(), made.labels.view()).visibility().unwrap();
    let (before, after) = (visible(&made), visible(&finished));
    assert!(
        before > 1.3 && (after - 1.0).abs() < 0.4 * (before - 1.0),
        "{before} {after}"
    );
    assert_eq!((finished.fixed_changed, &finished.labels), (0, &made.labels));
    for ((z, y, x), inside) in mask.indexed_iter() {
        let value = finished.values[[z, y, x, 0]];
        let given = measured.iter().find(|(at, _)| *at == [z, y, x]);
        let right = match (inside, given) {
            (false, _) => value == 0.0,
            (true, Some((_, v))) => value == v[0],
            (true, None) => [20.0, 120.0, 220.0].contains(&value),
        };
        assert!(right, "{z} {y} {x}: {value}");
    }
    let tiny = Array3::from_shape_fn((7, 7, 1), |(y, x, _)| (y * x) as f32);
    let refused = finish_grown(&made, mask.view(), tiny.view(), &[], 1, 0, &go);
    assert!(
        matches!(refused, Err(SolidError::ExemplarTooSmall { side: 7, .. })),
        "{refused:?}"
    );
}
