//! Time of a voxel and iteration.
#![allow(missing_docs, reason = "criterion makes functions without")]

use std::hint::black_box;
use std::ops::ControlFlow;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ndarray::Array2;
use stereology_exemplar::{Domain, Exemplar, SolidOptions, synthesize_solid};

fn synthesize(c: &mut Criterion) {
    let picture = Array2::from_shape_fn((64, 64), |(y, x)| ((y * y + 7 * x + x * y * 3) % 23) as f32 / 23.0);
    let exemplar = [Exemplar::grey(picture.view()).expect("a picture")];
    let domain = Domain::new([32; 3]).expect("a box");
    let options = SolidOptions::default().with_iterations(2).with_levels(2);
    let mut group = c.benchmark_group("synthesize_solid");
    group.sample_size(10);
    group.throughput(Throughput::Elements(2 * (32 * 32 * 32 + 16 * 16 * 16)));
    group.bench_function("best, three views", |b| {
        b.iter(|| synthesize_solid(black_box(&exemplar), &domain, &options, &|_| ControlFlow::Continue(())));
    });
    group.finish();
}

criterion_group!(benches, synthesize);
criterion_main!(benches);
