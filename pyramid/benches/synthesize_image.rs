//! A colour image of 512 x 512 in 5 iterations: target 1.5 processor seconds.
#![allow(missing_docs, reason = "criterion's macro generates a public function")]

use std::ops::ControlFlow;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array3;
use stereology_pyramid::{Exemplar, TextureOptions, synthesize_image};

fn synthesize_image_512(c: &mut Criterion) {
    let mut group = c.benchmark_group("synthesize_image");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(4));
    let exemplar = Array3::from_shape_fn((128, 128, 3), |(y, x, c)| {
        ((y * y + 31 * x + x * y * (c + 3)) % 101) as f32
    });
    group.bench_function("512x512_rgb_5_iterations", |b| {
        b.iter(|| {
            let go = |_| ControlFlow::Continue(());
            let options = TextureOptions::default();
            synthesize_image(&Exemplar::new(exemplar.view()), [512; 2], &options, &go).expect("a checked exemplar")
        });
    });
    group.finish();
}

criterion_group!(benches, synthesize_image_512);
criterion_main!(benches);
