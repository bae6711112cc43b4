//! The finishing pass of grown stone.

use std::ops::ControlFlow;

use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::exemplar::SolidError;
use stereology::grow::{GrowOptions, Grown, grow};
use stereology::metrics::seams;
use stereology::pipeline::finish_grown;

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Grains of three greys.
fn stone(side: usize) -> Array3<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let grains: Vec<[f64; 3]> = (0..side * side / 30)
        .map(|_| [0; 3].map(|_| rng.random::<f64>()))
        .collect();
    Array3::from_shape_fn((side, side, 1), |(y, x, _)| {
        let (y, x) = (y as f64 / side as f64, x as f64 / side as f64);
        let near = grains
            .iter()
            .min_by(|a, b| (a[0] - y).hypot(a[1] - x).total_cmp(&(b[0] - y).hypot(b[1] - x)));
        ((near.unwrap()[2] * 3.0) as u8 * 100 + 20) as f32
    })
}

fn grown(mask: &Array3<bool>, measured: &[([usize; 3], Vec<f32>)], options: &GrowOptions) -> Grown {
    grow(mask.view(), stone(64).view(), measured, options, &go).unwrap()
}

/// The finishing pass removes the seams of cells; measurements and voxels outside the mask keep their values, and all
/// others are texels of the exemplar.
#[test]
fn finishing_removes_seams() {
    let mask = Array3::from_shape_fn((24, 24, 24), |(z, y, x)| z + y + x < 60);
    let measured: Vec<_> = (0..8)
        .map(|i| ([2 + i, 20 - 2 * i, (7 * i) % 20], vec![(31 * i) as f32 + 0.5]))
        .collect();
    let made = grown(&mask, &measured, &GrowOptions::default().with_window(3));
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
