//! One iteration of a colour volume of 64 x 64 x 64 in each mode; 128 x 128 x 128 takes eight times as long.
#![allow(missing_docs, reason = "criterion's macro generates a public function")]

use std::ops::ControlFlow;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array3;
use stereology_pyramid::{Exemplar, Mode, TextureOptions, synthesize_volume};

fn synthesize_volume_64(c: &mut Criterion) {
    let mut group = c.benchmark_group("synthesize_volume");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(2));
    let exemplar = Array3::from_shape_fn((128, 128, 3), |(y, x, c)| {
        ((y * y + 31 * x + x * y * (c + 3)) % 101) as f32
    });
    for (name, mode) in [
        ("slices", Mode::Slices),
        ("spectrum", Mode::Spectrum),
        ("volume", Mode::Volume),
    ] {
        let options = TextureOptions::default().with_mode(mode).with_iterations(1);
        group.bench_function(name, |b| {
            b.iter(|| {
                let go = |_| ControlFlow::Continue(());
                synthesize_volume(&Exemplar::new(exemplar.view()), [64; 3], &options, &go).expect("a checked exemplar")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, synthesize_volume_64);
criterion_main!(benches);
