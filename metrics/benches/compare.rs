//! Time to judge 32 slices of 128² pixels.
#![allow(missing_docs, reason = "criterion's macros make functions without")]

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array3;
use std::ops::ControlFlow;
use stereology_metrics::{MeasureOptions, compare};

fn bench(criterion: &mut Criterion) {
    let picture = |k: usize| {
        Array3::from_shape_fn((128, 128, 1), move |(y, x, _)| {
            ((x * x + 3 * y * y + k * x) % 251) as f32 / 250.0
        })
    };
    let slices: Vec<Array3<f32>> = (0..32).map(picture).collect();
    let views: Vec<_> = slices.iter().map(|s| s.view()).collect();
    let options = MeasureOptions::new(0.5).with_patches(2048);
    criterion.bench_function("compare/32 slices of 128²", |bencher| {
        bencher.iter(|| compare(&views[..1], &views, None, &options, &|_| ControlFlow::Continue(())));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = bench
}
criterion_main!(benches);
