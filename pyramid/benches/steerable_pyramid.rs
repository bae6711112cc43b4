//! Decomposition and reconstruction of an image of 1024 x 1024: target 0.2 s.
#![allow(missing_docs, reason = "criterion's macro generates a public function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array2;
use stereology_pyramid::SteerablePyramid;

fn steerable_pyramid(c: &mut Criterion) {
    let mut group = c.benchmark_group("steerable_pyramid");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2));
    let image = Array2::from_shape_fn((1024, 1024), |(y, x)| ((y * 31 + x * 17) % 101) as f32);
    let pyramid = SteerablePyramid::new([1024, 1024], 4, 4).expect("a size that fits");
    group.bench_function("build_reconstruct_1024x1024_f32", |b| {
        b.iter(|| pyramid.reconstruct(&pyramid.build(black_box(image.view())).expect("finite values")));
    });
    let image = image.mapv(f64::from);
    let pyramid = SteerablePyramid::new([1024, 1024], 4, 4).expect("a size that fits");
    group.bench_function("build_reconstruct_1024x1024_f64", |b| {
        b.iter(|| pyramid.reconstruct(&pyramid.build(black_box(image.view())).expect("finite values")));
    });
    group.finish();
}

criterion_group!(benches, steerable_pyramid);
criterion_main!(benches);
