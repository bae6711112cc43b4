//! Photos whose profiles are known.

use std::ops::ControlFlow;

use image::{Rgb, RgbImage, imageops};
use ndarray::Array2;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_imaging::gaussian_filter;
use stereology_segment::{EdgeRule, SegmentError, SegmentOptions, Segmentation, segment};

use crate::drawn::{discs, photo};

const SIZE: [u32; 2] = [260, 200];

fn run(photo: &RgbImage) -> Segmentation {
    segment(photo, &SegmentOptions::default(), &|_| ControlFlow::Continue(())).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// As many profiles as discs, each with its area, lighter and darker ones, under uneven light.
    #[test]
    fn discs_are_found(seed in 0_u64..10_000) {
        let drawn = discs(24, SIZE, seed);
        let found = run(&photo(&drawn, SIZE, seed));
        prop_assert_eq!(found.profiles.len(), drawn.len());
        let mut total = [0.0; 2];
        for d in &drawn {
            let nearest = found.profiles.iter().map(|p| ((p.x - d.centre[0]).hypot(p.y - d.centre[1]), p)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            prop_assert!(nearest.0 < 0.5, "centre {} off", nearest.0);
            prop_assert!((nearest.1.size - 2.0 * d.radius).abs() < 0.8, "{} {}", nearest.1.size, 2.0 * d.radius);
            total[0] += nearest.1.area;
            total[1] += std::f64::consts::PI * d.radius * d.radius;
        }
        prop_assert!((total[0] / total[1] - 1.0).abs() < 0.02, "areas {:?}", total);
        prop_assert!(found.findings.iter().all(|f| f.code == "few-profiles"), "{:?}", found.findings);
    }

    /// Mirrored and rotated photos have the same profiles.
    #[test]
    fn mirrored_and_turned(seed in 0_u64..10_000) {
        let drawn = discs(20, SIZE, seed);
        let original = photo(&drawn, SIZE, seed);
        let expected = run(&original);
        for other in [imageops::flip_horizontal(&original), imageops::flip_vertical(&original), imageops::rotate90(&original)] {
            let found = run(&other);
            prop_assert_eq!(found.profiles.len(), expected.profiles.len());
            prop_assert!((found.area_fraction / expected.area_fraction - 1.0).abs() < 0.005);
        }
    }
}

/// The measured sizes of many discs have the distribution from which they were drawn, uniform from 10 to 32 pixels, and
/// their number and area are right. In order, measured sizes are within 0.4 pixels of the true ones, so the largest
/// difference of the cumulative distributions is at most that of shifting the law by as much, plus one disc.
#[test]
fn histogram_of_discs() {
    let size = [700, 520];
    let drawn = discs(160, size, 8);
    let found = run(&photo(&drawn, size, 8));
    assert_eq!(found.profiles.len(), drawn.len());
    let mut wanted: Vec<f64> = drawn.iter().map(|d| 2.0 * d.radius).collect();
    let mut sizes: Vec<f64> = found.profiles.iter().map(|p| p.size).collect();
    wanted.sort_by(f64::total_cmp);
    sizes.sort_by(f64::total_cmp);
    for (found, wanted) in sizes.iter().zip(&wanted) {
        assert!((found - wanted).abs() < 0.4, "{found} {wanted}");
    }
    let below = |v: &[f64], x: f64| v.partition_point(|s| *s <= x) as f64 / v.len() as f64;
    let apart = wanted.iter().map(|&x| (below(&sizes, x) - below(&wanted, x)).abs());
    assert!(apart.fold(0.0, f64::max) < 0.04);
    let area: f64 = drawn.iter().map(|d| std::f64::consts::PI * d.radius * d.radius).sum();
    assert!((found.profiles.iter().map(|p| p.area).sum::<f64>() / area - 1.0).abs() < 0.01);
    assert!(found.findings.is_empty(), "{:?}", found.findings);
}

/// Same photo, same bytes, on one thread and on three.
#[test]
fn threads_do_not_matter() {
    let photo = photo(&discs(24, SIZE, 3), SIZE, 3);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&photo))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.labels, three.labels);
    assert_eq!(one.profiles, three.profiles);
    assert_eq!(one.residual(), three.residual());
}

/// The colour of the binder may be given: here the one that covers less of the photo.
#[test]
fn binder_given() {
    let photo = RgbImage::from_fn(120, 120, |x, y| {
        let texture = ((x * 7919 + y * 104_729) % 5) as u8;
        let inside = x % 30 < 26 && y % 30 < 26;
        Rgb(if inside {
            [200 + texture, 190 + texture, 180]
        } else {
            [60 + texture, 60, 70 + texture]
        })
    });
    let options = SegmentOptions::default().with_binder([62.0 / 255.0, 60.0 / 255.0, 72.0 / 255.0]);
    let found = segment(&photo, &options, &|_| ControlFlow::Continue(())).unwrap();
    assert_eq!(found.profiles.len(), 16);
    assert!(
        (found.area_fraction - 16.0 * 676.0 / 14_400.0).abs() < 0.02,
        "{}",
        found.area_fraction
    );
}

/// Two discs of one colour that overlap by a little are two profiles; of different colours, even by more.
#[test]
fn touching_discs_come_apart() {
    for (second, distance) in [([60, 45, 40], 26.0), ([230, 220, 120], 22.0)] {
        let photo = RgbImage::from_fn(120, 80, |x, y| {
            let texture = ((x * 7919 + y * 104_729) % 5) as u8;
            let from = |cx: f64| (f64::from(x) + 0.5 - cx).hypot(f64::from(y) - 39.5) < 14.0;
            let colour = if from(40.0) {
                [60, 45, 40]
            } else if from(40.0 + distance) {
                second
            } else {
                [150, 148, 140]
            };
            Rgb(colour.map(|c| c + texture))
        });
        let found = run(&photo);
        assert_eq!(found.profiles.len(), 2, "distance {distance}");
    }
}

/// Texture alone is not a particle: it gives an error or the finding `no-binder`.
#[test]
fn nothing_to_separate() {
    let plain = photo(&[], SIZE, 5);
    assert!(matches!(
        segment(&plain, &SegmentOptions::default(), &|_| ControlFlow::Continue(())),
        Err(SegmentError::NoParticles { .. })
    ));
    let one = RgbImage::new(1, 1);
    assert!(matches!(
        segment(&one, &SegmentOptions::default(), &|_| ControlFlow::Continue(())),
        Err(SegmentError::TooSmall { .. })
    ));
    let flat = RgbImage::from_pixel(50, 50, Rgb([9, 9, 9]));
    assert!(matches!(
        segment(&flat, &SegmentOptions::default(), &|_| ControlFlow::Continue(())),
        Err(SegmentError::SingleColour { .. })
    ));
}

/// Cropping two rows changes the mean area of inner profiles by less than half a percent.
#[test]
fn cropping_two_rows() {
    for seed in [4, 9] {
        let whole = photo(&discs(24, SIZE, seed), SIZE, seed);
        let cut = imageops::crop_imm(&whole, 0, 2, SIZE[0], SIZE[1] - 2).to_image();
        let mean = |found: &Segmentation, from: f64| {
            let inner = found.profiles.iter().filter(|p| !p.touches_edge && p.y > from);
            let areas: Vec<f64> = inner.map(|p| p.area).collect();
            areas.iter().sum::<f64>() / areas.len() as f64
        };
        let moved = mean(&run(&cut), 38.0) / mean(&run(&whole), 40.0);
        assert!((moved - 1.0).abs() < 0.005, "{moved}");
    }
}

/// The residual has mean zero in every profile and in the binder.
#[test]
fn residual_has_no_mean() {
    let found = run(&photo(&discs(24, SIZE, 6), SIZE, 6));
    let mut sums = vec![[0.0_f64; 3]; found.profiles.len() + 1];
    for ((y, x, c), r) in found.residual().indexed_iter() {
        sums[found.labels[[y, x]] as usize][c] += f64::from(*r);
    }
    let areas = std::iter::once(1e4).chain(found.profiles.iter().map(|p| p.area));
    for (sum, area) in sums.iter().zip(areas) {
        assert!(sum.iter().all(|s| (s / area).abs() < 1e-6), "{sum:?}");
    }
}

/// Discs sixteen levels lighter than a binder whose texture has eight levels of scatter are found where the texture is
/// averaged out.
#[test]
fn faint_discs() {
    let drawn = discs(12, SIZE, 2);
    let mut rng = <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(1);
    let photo = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let inside = drawn
            .iter()
            .any(|d| (f64::from(x) + 0.5 - d.centre[0]).hypot(f64::from(y) + 0.5 - d.centre[1]) < d.radius);
        let texture = 28.0 * rand::RngExt::random::<f64>(&mut rng);
        Rgb([((if inside { 116.0 } else { 100.0 }) + texture) as u8; 3])
    });
    let found = run(&photo);
    let large = drawn.iter().filter(|d| d.radius > 8.0);
    for d in large {
        let nearest = found
            .profiles
            .iter()
            .map(|p| (p.x - d.centre[0]).hypot(p.y - d.centre[1]))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 2.0, "radius {}: {nearest}", d.radius);
    }
}

/// A cancelled call returns the error `Cancelled`.
#[test]
fn cancelled() {
    let photo = photo(&discs(5, SIZE, 1), SIZE, 1);
    assert!(matches!(
        segment(&photo, &SegmentOptions::default(), &|_| ControlFlow::Break(())),
        Err(SegmentError::Cancelled)
    ));
}

/// Both rules are unbiased: discs of two sizes thrown at random over a plane larger than the photo are counted in
/// proportion to their densities, although large ones are cut more often. 400 photos; the bound is 5 standard errors
/// (false alarm 1e-6).
#[test]
fn edge_rules_are_unbiased() {
    use rand::{RngExt, SeedableRng};
    let (width, height) = (100_usize, 80_usize);
    let radii = [4.0_f64, 14.0];
    for rule in [EdgeRule::AssociatedPoint, EdgeRule::MilesLantuejoul] {
        let mut counted = [[0.0_f64; 400]; 2];
        for (trial, seed) in (0..400).enumerate() {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            // One photo a disc: the frame is that of its own extent.
            for (kind, radius) in radii.into_iter().enumerate() {
                let photo = RgbImage::from_pixel(width as u32, height as u32, Rgb([1, 2, 3]));
                let (w, h) = (width as f64 + 60.0, height as f64 + 60.0);
                let centre = [rng.random::<f64>() * w - 30.0, rng.random::<f64>() * h - 30.0];
                let labels = ndarray::Array2::from_shape_fn((height, width), |(y, x)| {
                    u32::from((x as f64 + 0.5 - centre[0]).hypot(y as f64 + 0.5 - centre[1]) < radius)
                });
                if labels.iter().all(|l| *l == 0) {
                    continue;
                }
                let options = SegmentOptions::default().with_edge_rule(rule).with_min_area(1);
                let found = Segmentation::from_labels(&photo, labels, &options).unwrap();
                counted[kind][trial] = found.number_per_area * w * h;
            }
        }
        for (kind, counted) in counted.iter().enumerate() {
            let mean = counted.iter().sum::<f64>() / 400.0;
            let variance = counted.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / 399.0;
            let error = (variance / 400.0).sqrt();
            assert!((mean - 1.0).abs() < 5.0 * error, "{rule:?} {kind}: {mean} ± {error}");
        }
    }
}

/// Two tones: pale grains close together in a mottled binder of medium grey. Between some of them the binder is darker,
/// but no darker than its mottles reach: pores, not profiles. Black grains are profiles, though they lie on the pores'
/// side of the binder.
#[test]
fn dark_pores_and_dark_grains() {
    const CELL: usize = 28;
    const SIDE: usize = 9 * CELL;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let white = Array2::from_shape_fn((SIDE, SIDE), |_| rng.random::<f32>() - 0.5);
    let mottle = gaussian_filter(white.view(), 2.0);
    let scatter = (mottle.iter().map(|v| v * v).sum::<f32>() / mottle.len() as f32).sqrt();
    let is_black = |x: usize, y: usize| (x / CELL + 9 * (y / CELL)) % 20 == 1;
    // Where four cells meet.
    let is_pore = |x: usize, y: usize| (x / CELL + 2 * (y / CELL)).is_multiple_of(5);
    let photo = RgbImage::from_fn(SIDE as u32, SIDE as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let from = |a: usize, b: usize| (a as f32 + 0.5 - CELL as f32 / 2.0).hypot(b as f32 + 0.5 - CELL as f32 / 2.0);
        let grain = (12.5 - from(x % CELL, y % CELL)).clamp(-0.75, 0.75) / 1.5 + 0.5;
        let [px, py] = [x + CELL / 2, y + CELL / 2];
        let pore = if is_pore(px, py) {
            (6.0 - from(px % CELL, py % CELL)).clamp(-1.5, 1.5) / 3.0 + 0.5
        } else {
            0.0
        };
        let mut level = 115.0 + 28.0 * (mottle[[y, x]] / scatter).min(1.0);
        level += pore * (35.0 - level);
        level += grain * (if is_black(x, y) { 6.0 } else { 200.0 } - level);
        Rgb([(level + 8.0 * white[[y, x]]).round().clamp(0.0, 255.0) as u8; 3])
    });
    let found = run(&photo);
    for (y, x) in (0..9).flat_map(|j| (0..9).map(move |i| (j * CELL, i * CELL))) {
        assert_eq!(found.labels[[y, x]], 0, "between the grains at {x}, {y}");
        let label = found.labels[[y + CELL / 2, x + CELL / 2]];
        assert_ne!(label, 0, "grain at {x}, {y}");
        let size = found.profiles[label as usize - 1].size;
        assert!((size - 25.0).abs() < 1.0, "size {size} at {x}, {y}");
    }
    assert_eq!(found.profiles.len(), 81);
}
