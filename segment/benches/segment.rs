//! One drawn photo of half a megapixel.

#![allow(missing_docs, reason = "made by criterion's macro")]
#![allow(clippy::cast_possible_truncation, reason = "levels of a drawn picture")]

use std::{hint::black_box, ops::ControlFlow, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use stereology_segment::{SegmentOptions, segment};

fn half_a_megapixel(c: &mut Criterion) {
    let photo = image::RgbImage::from_fn(800, 640, |x, y| {
        let inside = (f64::from(x % 40) - 19.5).hypot(f64::from(y % 40) - 19.5) < f64::from(6 + (x / 40 + y / 40) % 9);
        let texture = ((x * 7919 + y * 104_729) % 7) as u8;
        image::Rgb(if inside {
            [60 + texture, 80, 90 + texture]
        } else {
            [210 + texture, 205 + texture, 200]
        })
    });
    c.bench_function("segment 0.5 megapixels", |b| {
        b.iter(|| {
            segment(black_box(&photo), &SegmentOptions::default(), &|_| {
                ControlFlow::Continue(())
            })
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(4));
    targets = half_a_megapixel
}
criterion_main!(benches);
