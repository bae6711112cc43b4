//! The search for the largest section, of a rock and of a torus.

#![allow(missing_docs, reason = "criterion's macro makes an undocumented function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use stereology_shape::{Body, ClosedMesh, TriangleMesh};

fn largest_section_area(c: &mut Criterion) {
    let mut group = c.benchmark_group("largest_section_area");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 48, 24)).expect("a torus is closed");
    group.bench_function("rock", |b| b.iter(|| Body::rock(black_box(7))));
    group.bench_function("torus_2304", |b| b.iter(|| Body::from_mesh(black_box(&torus).clone())));
    group.finish();
}

criterion_group!(benches, largest_section_area);
criterion_main!(benches);
