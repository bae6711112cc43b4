//! Synthetic test images of half a megapixel and of two, and label maps.

#![allow(missing_docs, reason = "made by criterion's macro")]
#![allow(clippy::cast_possible_truncation, reason = "levels of a synthetic test image")]

use std::{hint::black_box, ops::ControlFlow, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use stereology_segment::{SegmentOptions, fill_outlines, outlines, segment};

fn drawn(width: u32, height: u32) -> image::RgbImage {
    image::RgbImage::from_fn(width, height, |x, y| {
        let inside = (f64::from(x % 40) - 19.5).hypot(f64::from(y % 40) - 19.5) < f64::from(6 + (x / 40 + y / 40) % 9);
        let texture = ((x * 7919 + y * 104_729) % 7) as u8;
        image::Rgb(if inside {
            [60 + texture, 80, 90 + texture]
        } else {
            [210 + texture, 205 + texture, 200]
        })
    })
}

fn segment_photo(c: &mut Criterion) {
    for (name, width, height) in [
        ("segment 0.5 megapixels", 800, 640),
        ("segment 2 megapixels", 1600, 1280),
    ] {
        let photo = drawn(width, height);
        c.bench_function(name, |b| {
            b.iter(|| {
                segment(black_box(&photo), &SegmentOptions::default(), &|_| {
                    ControlFlow::Continue(())
                })
            });
        });
    }
}

fn outlines_and_back(c: &mut Criterion) {
    let labels = ndarray::Array2::from_shape_fn((640, 800), |(y, x)| {
        let inside = (x as f64 % 40.0 - 19.5).hypot(y as f64 % 40.0 - 19.5) < 15.0;
        if inside { (1 + x / 40 + 20 * (y / 40)) as u32 } else { 0 }
    });
    c.bench_function("outlines and fill_outlines 0.5 megapixels", |b| {
        b.iter(|| fill_outlines(&outlines(black_box(&labels)), labels.dim()));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(2));
    targets = segment_photo, outlines_and_back
}
criterion_main!(benches);
