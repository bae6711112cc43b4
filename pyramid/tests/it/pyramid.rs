use ndarray::{Array2, Axis};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_pyramid::{PyramidError, SteerablePyramid};

fn noise(seed: u64, height: usize, width: usize) -> Array2<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Array2::from_shape_simple_fn((height, width), || rng.random::<f64>())
}

/// Rolled by (dy, dx): sample (y, x) moves to (y + dy, x + dx).
fn rolled(image: &Array2<f64>, dy: usize, dx: usize) -> Array2<f64> {
    let (h, w) = image.dim();
    Array2::from_shape_fn((h, w), |(y, x)| image[[(y + h - dy % h) % h, (x + w - dx % w) % w]])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// The bands reconstruct the image at any size, including odd and non-square sizes, in both precisions.
    #[test]
    fn reconstruction_is_perfect(h in 8_usize..70, w in 8_usize..70, k in 1_usize..9, seed in 0_u64..1000, pick in 0_usize..9) {
        let levels = 1 + pick % SteerablePyramid::<f64>::most_levels([h, w]);
        let image = noise(seed, h, w);
        let pyramid = SteerablePyramid::new([h, w], levels, k).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(image.view()).unwrap());
        prop_assert!(image.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1e-12));
        let single = image.mapv(|v| v as f32);
        let pyramid = SteerablePyramid::new([h, w], levels, k).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(single.view()).unwrap());
        prop_assert!(single.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 2e-6));
    }

    /// The real parts of complex bands are the bands: they reconstruct the image too, in both precisions.
    #[test]
    fn complex_bands_reconstruct_the_image(h in 8_usize..60, w in 8_usize..60, k in 1_usize..7, seed in 0_u64..1000, pick in 0_usize..9) {
        let levels = 1 + pick % SteerablePyramid::<f64>::most_levels([h, w]);
        let image = noise(seed, h, w);
        let pyramid = SteerablePyramid::new([h, w], levels, k).unwrap();
        let back = pyramid.reconstruct(pyramid.build_complex(image.view()).unwrap().real());
        prop_assert!(image.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1e-12));
        let single = image.mapv(|v| v as f32);
        let pyramid = SteerablePyramid::new([h, w], levels, k).unwrap();
        let back = pyramid.reconstruct(pyramid.build_complex(single.view()).unwrap().real());
        prop_assert!(single.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 2e-6));
    }

    /// The energies of the bands, weighted by the coarseness of their grids, sum to that of the image (Parseval).
    #[test]
    fn energies_of_bands_sum_to_that_of_the_image(h in 8_usize..70, w in 8_usize..70, k in 1_usize..7, seed in 0_u64..1000) {
        let image = noise(seed, h, w);
        let levels = SteerablePyramid::<f64>::most_levels([h, w]);
        let bands = SteerablePyramid::new([h, w], levels, k).unwrap().build(image.view()).unwrap();
        let held: f64 = bands.summaries().iter().map(|b| b.mean_square).sum();
        let energy = image.mapv(|v| v * v).mean().unwrap();
        prop_assert!((held - energy).abs() < 1e-12 * energy);
    }

    /// A shift of the image by whole samples of a level shifts the bands of that level (for sizes that halve exactly).
    #[test]
    fn bands_move_with_the_image(h in 4_usize..9, w in 4_usize..9, dy in 0_usize..9, dx in 0_usize..9, seed in 0_u64..1000) {
        let (h, w) = (8 * h, 8 * w);
        let image = noise(seed, h, w);
        let pyramid = SteerablePyramid::new([h, w], 3, 4).unwrap();
        let still = pyramid.build(image.view()).unwrap();
        let moved = pyramid.build(rolled(&image, 4 * dy, 4 * dx).view()).unwrap();
        for level in 0..3 {
            let step = 4 >> level;
            for b in 0..4 {
                let expected = rolled(&still.oriented(level, b).to_owned(), step * dy, step * dx);
                prop_assert!(expected.iter().zip(moved.oriented(level, b)).all(|(a, b)| (a - b).abs() < 1e-12));
            }
        }
    }

    /// Transposing a square image mirrors the orientations about the diagonal.
    #[test]
    fn bands_follow_a_transposed_image(n in 8_usize..40, seed in 0_u64..1000) {
        let image = noise(seed, n, n);
        let pyramid = SteerablePyramid::new([n, n], 1, 4).unwrap();
        let bands = pyramid.build(image.view()).unwrap();
        let mirrored = pyramid.build(image.t()).unwrap();
        // Transposition maps θ → π/2 − θ, b → 2 − b modulo 4; an odd filter changes sign where the angle leaves the
        // half turn.
        for (b, mirror, sign) in [(0, 2, 1.0), (1, 1, 1.0), (3, 3, -1.0)] {
            let there = mirrored.oriented(0, mirror);
            prop_assert!(bands.oriented(0, b).t().iter().zip(there).all(|(a, c)| (a - sign * c).abs() < 1e-12));
        }
    }
}

/// A wave of direction θ has the amplitude α cos³(θ − πb/4) in band b: the identity on which steering is based.
#[test]
fn amplitude_of_waves_is_the_cube_of_the_cosine_in_each_orientation() {
    // At 10 to 14 cycles in 64 pixels (r of 0.44) all power is in levels 0 and 1.
    for (ky, kx) in [(0, 14), (14, 0), (10, 10), (5, 13), (13, -5), (-9, 11)] {
        let phase = |y: usize, x: usize| f64::from(ky) * y as f64 + f64::from(kx) * x as f64;
        let wave = Array2::from_shape_fn((64, 64), |(y, x)| (std::f64::consts::TAU * phase(y, x) / 64.0).cos());
        let summaries = SteerablePyramid::new([64, 64], 3, 4)
            .unwrap()
            .build(wave.view())
            .unwrap()
            .summaries();
        let angle = f64::from(ky).atan2(f64::from(kx));
        // α² = 4/5 for four orientations; a wave has mean square 1/2, divided between the levels.
        for b in 0..4 {
            let held: f64 = summaries
                .iter()
                .filter(|s| s.orientation == Some(b))
                .map(|s| s.mean_square)
                .sum();
            let expected = 0.5 * 0.8 * (angle - std::f64::consts::PI * b as f64 / 4.0).cos().powi(6);
            assert!(
                (held - expected).abs() < 1e-12,
                "wave ({ky}, {kx}), band {b}: {held} for {expected}"
            );
        }
    }
}

/// A constant image is entirely in the low-pass.
#[test]
fn constant_image_lies_in_the_low_pass() {
    let image = Array2::from_elem((37, 50), 0.7);
    let bands = SteerablePyramid::new([37, 50], 2, 4)
        .unwrap()
        .build(image.view())
        .unwrap();
    let summaries = bands.summaries();
    let (low, others) = summaries.split_last().unwrap();
    assert!(others.iter().all(|b| b.mean_square < 1e-28));
    assert!((low.min - 0.7).abs() < 1e-12 && (low.max - 0.7).abs() < 1e-12);
    assert_eq!(bands.low().mean_axis(Axis(0)).unwrap().len(), 13);
}

/// Large images take parallel paths, and the bits do not depend on the number of threads.
#[test]
fn same_bits_at_any_number_of_threads() {
    let image = noise(1, 400, 401);
    let pyramid = SteerablePyramid::new([400, 401], 4, 4).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| pyramid.reconstruct(&pyramid.build(image.view()).unwrap()))
    };
    assert_eq!(with(1), with(3));
}

/// Invalid images are refused with a specific error.
#[test]
fn bad_images_are_refused() {
    assert_eq!(
        SteerablePyramid::<f64>::new([7, 90], 1, 4).unwrap_err(),
        PyramidError::TooSmall { height: 7, width: 90 }
    );
    assert!(matches!(
        SteerablePyramid::<f64>::new([64, 90], 9, 4),
        Err(PyramidError::Levels { most: 4, .. })
    ));
    assert!(matches!(
        SteerablePyramid::<f64>::new([64, 90], 2, 0),
        Err(PyramidError::Orientations { .. })
    ));
    let pyramid = SteerablePyramid::new([8, 8], 1, 4).unwrap();
    let mut image = Array2::zeros((8, 8));
    image[[3, 5]] = f64::NAN;
    assert_eq!(
        pyramid.build(image.view()).unwrap_err(),
        PyramidError::NotFinite { row: 3, column: 5 }
    );
    assert!(matches!(
        pyramid.build(Array2::zeros((8, 9)).view()),
        Err(PyramidError::Shape { .. })
    ));
}
