//! Checking and measuring triangles: a sphere of 82 k, a torus of 70 k.

#![allow(missing_docs, reason = "criterion's macro makes an undocumented function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use stereology_shape::{ClosedMesh, TriangleMesh};

fn closed_mesh(c: &mut Criterion) {
    let mut group = c.benchmark_group("closed_mesh");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    for (name, mesh) in [
        ("sphere_81920", TriangleMesh::icosphere(1.0, 6)),
        ("torus_70000", TriangleMesh::torus(2.0, 0.7, 250, 140)),
    ] {
        group.bench_function(name, |b| b.iter(|| ClosedMesh::try_from(black_box(&mesh).clone())));
    }
    group.finish();
}

criterion_group!(benches, closed_mesh);
criterion_main!(benches);
