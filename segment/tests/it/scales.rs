//! The same picture as a JPEG, at other sizes and with more blur has the same profiles.

use std::ops::ControlFlow;

use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, blur, resize};
use image::{Rgb, RgbImage};
use stereology_segment::{Compression, PhotoOptions, SegmentOptions, Segmentation, read_photo_with, segment};

use crate::drawn::{discs, photo};

const SIZE: [u32; 2] = [360, 270];
const DISCS: usize = 60;

fn run(photo: &RgbImage, factor: f64, compression: Option<Compression>) -> Segmentation {
    let least = (30.0 * factor * factor).round();
    let options = SegmentOptions::default()
        .with_min_area((1..).find(|n| f64::from(*n) >= least).map_or(1, |n: u32| n as usize))
        .with_compression(compression);
    segment(photo, &options, &|_| ControlFlow::Continue(())).unwrap()
}

/// Number and mean area of profiles, the area in pixels of the picture at its own size.
fn summary(found: &Segmentation, factor: f64) -> (usize, f64) {
    let n = found.profiles.len();
    let area: f64 = found.profiles.iter().map(|p| p.area).sum();
    (n, area / n as f64 / (factor * factor))
}

fn assert_same((n, area): (usize, f64), (expected, expected_area): (usize, f64), what: &str) {
    assert!(
        n.abs_diff(expected) <= expected * 3 / 100,
        "{what}: {n} profiles for {expected}"
    );
    assert!(
        (area / expected_area - 1.0).abs() < 0.05,
        "{what}: mean area {area} for {expected_area}"
    );
}

/// As many profiles as discs whatever the quality, although chroma spreads beside the discs.
#[test]
fn quality_of_jpeg_does_not_matter() {
    for seed in 0..2 {
        let picture = photo(&discs(DISCS, SIZE, seed), SIZE, seed);
        let plain = summary(&run(&picture, 1.0, None), 1.0);
        assert_same(plain, (DISCS, plain.1), "PNG");
        let folder = tempfile::tempdir().unwrap();
        for quality in [95, 75, 60, 45, 35] {
            let file = folder.path().join(format!("{quality}.jpg"));
            let mut out = std::fs::File::create(&file).unwrap();
            JpegEncoder::new_with_quality(&mut out, quality)
                .encode_image(&picture)
                .unwrap();
            let read = read_photo_with(&file, &PhotoOptions::default()).unwrap();
            assert!(read.compression.is_some());
            let found = run(&read.photo, 1.0, read.compression);
            assert_same(summary(&found, 1.0), plain, &format!("quality {quality}, seed {seed}"));
        }
    }
}

/// Size does not matter from 0.6 to 3 times, nor blur of up to three pixels.
#[test]
fn size_and_blur_do_not_matter() {
    let picture = photo(&discs(DISCS, SIZE, 5), SIZE, 5);
    let plain = summary(&run(&picture, 1.0, None), 1.0);
    for factor in [0.6, 1.5, 2.0, 3.0] {
        for filter in [FilterType::Lanczos3, FilterType::CatmullRom] {
            let side = |n: u32| {
                (1..)
                    .find(|m| f64::from(*m) >= factor * f64::from(n) - 0.5)
                    .unwrap_or(n)
            };
            let resized = resize(&picture, side(SIZE[0]), side(SIZE[1]), filter);
            let found = run(&resized, factor, None);
            assert_same(summary(&found, factor), plain, &format!("{factor} times, {filter:?}"));
        }
    }
    // Discs are four pixels apart or more.
    for sigma in [1.0, 1.6] {
        let found = run(&blur(&picture, sigma), 1.0, None);
        assert_same(summary(&found, 1.0), plain, &format!("blur {sigma}"));
    }
}

/// Without noise, blur reaches the thresholds far outside of particles; it makes no profiles and joins none.
#[test]
fn rims_are_no_particles() {
    let circles = discs(40, SIZE, 9);
    let sharp = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let inside = circles
            .iter()
            .any(|d| (f64::from(x) + 0.5 - d.centre[0]).hypot(f64::from(y) + 0.5 - d.centre[1]) < d.radius);
        Rgb(if inside { [230, 60, 40] } else { [90, 95, 100] })
    });
    let found = run(&blur(&sharp, 1.2), 1.0, None);
    assert_eq!(found.profiles.len(), 40);
    assert_eq!(found.categories.len(), 1);
    for p in &found.profiles {
        let disc = circles.iter().min_by(|a, b| {
            let from = |d: &&crate::drawn::Disc| (d.centre[0] - p.x).hypot(d.centre[1] - p.y);
            from(a).total_cmp(&from(b))
        });
        let size = 2.0 * disc.unwrap().radius;
        assert!((p.size - size).abs() < 0.8, "{} for {size}", p.size);
    }
}

/// Bright blurred discs on a dark ground, each pair touching with different brightness, are as many profiles.
#[test]
fn nuclei_of_different_brightness_come_apart() {
    let sharp = RgbImage::from_fn(300, 240, |x, y| {
        let (u, v) = (f64::from(x % 60), f64::from(y % 48) - 23.5);
        let cell = f64::from(x / 60 + 5 * (y / 48));
        let level = if (u - 18.0).hypot(v) < 11.0 {
            60.0 + 4.0 * cell
        } else if (u - 38.0).hypot(v) < 10.0 {
            130.0 + 4.0 * cell
        } else {
            8.0
        };
        let noise = f64::from(((x * 7919) ^ (y * 104_729 + x * y * 31)) % 5) - 2.0;
        Rgb([(0..=255).find(|l| f64::from(*l) >= level + noise).unwrap_or(255); 3])
    });
    let found = run(&blur(&sharp, 1.5), 1.0, None);
    assert!((48..=52).contains(&found.profiles.len()), "{}", found.profiles.len());
}
