//! Time to grow a block of 24³ voxels from a picture of 128² pixels, by window.
#![allow(missing_docs, reason = "criterion's macros make functions without")]

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array3;
use std::ops::ControlFlow;
use stereology_grow::{GrowOptions, grow};

fn bench(criterion: &mut Criterion) {
    let picture = Array3::from_shape_fn((128, 128, 1), |(y, x, _)| ((x * x + 3 * y * y + x * y) % 251) as f32);
    let block = Array3::from_elem((24, 24, 24), true);
    for window in [0, 5, 9] {
        let options = GrowOptions::default().with_seeds(8).with_window(window);
        criterion.bench_function(&format!("grow/window {window}"), |bencher| {
            bencher.iter(|| {
                grow(block.view(), picture.view(), &[], &options, &|_| {
                    ControlFlow::Continue(())
                })
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = bench
}
criterion_main!(benches);
