//! Time to render an image.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use std::time::Duration;
use stereology_render::{BlockOptions, Camera, RenderOptions, render_block, render_mesh};
use stereology_shape::TriangleMesh;

fn images(c: &mut Criterion) {
    let mut group = c.benchmark_group("128² pixels");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    let torus = TriangleMesh::torus(2.0, 0.8, 144, 72);
    let options = RenderOptions::default().with_size(128, 128);
    group.bench_function("render_mesh, 20 736 triangles", |b| {
        b.iter(|| render_mesh(&torus, &|_| [0.7; 3], &Camera::default(), &options));
    });
    let options = BlockOptions::default().with_size(128, 128);
    group.bench_function("render_block", |b| {
        b.iter(|| render_block(&|_| [0.7; 3], Vector3::repeat(1.0), &options));
    });
    group.finish();
}

criterion_group!(benches, images);
criterion_main!(benches);
