//! Real transforms, on which the speed of the pyramid depends.

#![allow(missing_docs, reason = "criterion's macro generates a public function")]

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::{Array2, Array3};
use std::hint::black_box;
use std::time::Duration;
use stereology_spectrum::RealFft;

fn real_fft(c: &mut Criterion) {
    let mut group = c.benchmark_group("real_fft");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2));
    let image = Array2::from_shape_fn((1024, 1024), |(y, x)| ((y * 31 + x * 17) % 101) as f32);
    let fft = RealFft::new(&[1024, 1024]).expect("sizes are positive");
    group.bench_function("forward_1024x1024_f32", |b| {
        b.iter(|| fft.forward(black_box(image.view())));
    });
    let volume = Array3::from_shape_fn((128, 128, 128), |(z, y, x)| ((z * 7 + y * 31 + x * 17) % 101) as f32);
    let fft = RealFft::new(&[128, 128, 128]).expect("sizes are positive");
    group.bench_function("forward_128x128x128_f32", |b| {
        b.iter(|| fft.forward(black_box(volume.view())));
    });
    let slice: Vec<f32> = (0..128 * 128).map(|i| ((i * 17) % 101) as f32).collect();
    let fft = RealFft::new(&[128, 128]).expect("sizes are positive");
    let mut work = fft.work();
    let mut spectrum = vec![stereology_spectrum::Complex::new(0.0, 0.0); 128 * 65];
    group.bench_function("forward_into_128x128_f32", |b| {
        b.iter(|| fft.forward_into(black_box(&slice), &mut spectrum, &mut work));
    });
    group.finish();
}

criterion_group!(benches, real_fft);
criterion_main!(benches);
