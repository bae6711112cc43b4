use ndarray::{Array2, Array3};
use proptest::prelude::*;
use std::f64::consts::TAU;
use stereology_spectrum::{
    Complex, ComplexFft, RealFft, SpectrumError, autocovariance, masked_autocovariance, periodic_component,
    radial_spectrum,
};

/// Pseudo-random values from a linear congruential generator, to avoid a dependency on a random number crate.
fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        })
        .collect()
}

fn slow_transform(field: &Array3<f64>, k: (usize, usize, usize)) -> Complex<f64> {
    let (nz, ny, nx) = field.dim();
    field
        .indexed_iter()
        .map(|((z, y, x), &v)| {
            let phase = (k.0 * z) as f64 / nz as f64 + (k.1 * y) as f64 / ny as f64 + (k.2 * x) as f64 / nx as f64;
            Complex::from_polar(v, -TAU * phase)
        })
        .sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Real and complex transforms equal the defining sum at any size, including odd and prime sizes.
    #[test]
    fn transforms_are_the_defining_sum(nz in 1_usize..6, ny in 1_usize..8, nx in 1_usize..10, seed in 0_u64..1000) {
        let field = Array3::from_shape_vec((nz, ny, nx), noise(seed, nz * ny * nx)).unwrap();
        let half = RealFft::new(&[nz, ny, nx]).unwrap().forward(field.view()).unwrap();
        let mut full = field.mapv(|v| Complex::new(v, 0.0));
        ComplexFft::new(&[nz, ny, nx]).unwrap().forward(&mut full).unwrap();
        for (k, value) in full.indexed_iter() {
            let expected = slow_transform(&field, k);
            prop_assert!((value - expected).norm() < 1e-10);
            if k.2 < half.dim().2 {
                prop_assert!((half[k] - expected).norm() < 1e-10);
            }
        }
    }

    /// The inverse transform undoes the forward transform, in both precisions.
    #[test]
    fn inverse_undoes_forward(ny in 1_usize..40, nx in 1_usize..40, seed in 0_u64..1000) {
        let field = Array2::from_shape_vec((ny, nx), noise(seed, ny * nx)).unwrap();
        let fft = RealFft::new(&[ny, nx]).unwrap();
        let back = fft.inverse(fft.forward(field.view()).unwrap()).unwrap();
        prop_assert!(field.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-13));
        let single = field.mapv(|v| v as f32);
        let fft = RealFft::new(&[ny, nx]).unwrap();
        let back = fft.inverse(fft.forward(single.view()).unwrap()).unwrap();
        prop_assert!(single.iter().zip(&back).all(|(a, b)| (a - b).abs() < 2e-6));
    }

    /// The powers of the radial spectrum sum to the variance (Parseval).
    #[test]
    fn radial_spectrum_sums_to_the_variance(ny in 2_usize..40, nx in 2_usize..40, bins in 1_usize..30, seed in 0_u64..1000) {
        let field = Array2::from_shape_vec((ny, nx), noise(seed, ny * nx)).unwrap();
        let spectrum = radial_spectrum(field.view(), bins).unwrap();
        let held: f64 = spectrum.power.iter().zip(&spectrum.count).map(|(p, &c)| p * c as f64).sum();
        let n = (ny * nx) as f64;
        prop_assert!((held / n - field.var(0.0)).abs() < 1e-12);
        prop_assert_eq!(spectrum.count.iter().sum::<u64>() + 1, (ny * nx) as u64);
    }

    /// The autocovariance is the mean product of pairs, wrapped around.
    #[test]
    fn autocovariance_is_the_mean_product(ny in 1_usize..9, nx in 1_usize..9, seed in 0_u64..1000) {
        let field = Array2::from_shape_vec((ny, nx), noise(seed, ny * nx)).unwrap();
        let mean = field.mean().unwrap();
        let covariance = autocovariance(field.view()).unwrap();
        for ((dy, dx), value) in covariance.indexed_iter() {
            let expected = field
                .indexed_iter()
                .map(|((y, x), v)| (v - mean) * (field[[(y + dy) % ny, (x + dx) % nx]] - mean))
                .sum::<f64>() / (ny * nx) as f64;
            prop_assert!((value - expected).abs() < 1e-12);
        }
    }

    /// The periodic component keeps the mean, and its wrapped Laplacian equals the Laplacian of the image without
    /// neighbours beyond the edges (Moisan's definition).
    #[test]
    fn periodic_component_removes_only_the_jumps(ny in 4_usize..30, nx in 4_usize..30, seed in 0_u64..1000) {
        let field = Array2::from_shape_vec((ny, nx), noise(seed, ny * nx)).unwrap();
        let periodic = periodic_component(field.view()).unwrap();
        prop_assert!((periodic.mean().unwrap() - field.mean().unwrap()).abs() < 1e-13);
        for ((y, x), &value) in periodic.indexed_iter() {
            let (mut wrapped, mut inside) = (0.0, 0.0);
            for (dy, dx) in [(1, 0), (ny - 1, 0), (0, 1), (0, nx - 1)] {
                let to = [(y + dy) % ny, (x + dx) % nx];
                wrapped += periodic[to] - value;
                if to[0].abs_diff(y) + to[1].abs_diff(x) == 1 {
                    inside += field[to] - field[[y, x]];
                }
            }
            prop_assert!((wrapped - inside).abs() < 1e-11);
        }
    }

    /// At lag zero the masked autocovariance is the variance inside the mask; values outside are ignored.
    #[test]
    fn masked_autocovariance_reads_only_the_mask(ny in 3_usize..20, nx in 3_usize..20, seed in 0_u64..1000) {
        let mut field = Array2::from_shape_vec((ny, nx), noise(seed, ny * nx)).unwrap();
        let mask = Array2::from_shape_fn((ny, nx), |(y, x)| !(y * 7 + x * 3 + seed as usize).is_multiple_of(4));
        let inside: Vec<f64> = field.iter().zip(&mask).filter(|(_, m)| **m).map(|(v, _)| *v).collect();
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        let variance = inside.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / inside.len() as f64;
        field.zip_mut_with(&mask, |v, m| if !m { *v = f64::INFINITY });
        let (covariance, pairs) = masked_autocovariance(field.view(), mask.view(), 2).unwrap();
        prop_assert!((covariance[[2, 2]] - variance).abs() < 1e-12);
        prop_assert_eq!(pairs[[2, 2]], inside.len() as f64);
    }
}

/// Large fields take the parallel path: it agrees with the defining sum, and its bits do not depend on the number of
/// threads.
#[test]
fn large_fields_have_the_same_bits_at_any_number_of_threads() {
    let shape = [66, 50, 41];
    let field = Array3::from_shape_vec(shape, noise(7, shape.iter().product())).unwrap();
    let fft = RealFft::new(&shape).unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let spectrum = fft.forward(field.view()).unwrap();
            (spectrum.clone(), fft.inverse(spectrum).unwrap())
        })
    };
    let (spectrum, back) = with(1);
    assert_eq!((spectrum.clone(), back.clone()), with(3));
    assert!(field.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-13));
    for k in [(0, 0, 0), (1, 2, 3), (65, 49, 20), (33, 25, 1)] {
        assert!((spectrum[k] - slow_transform(&field, k)).norm() < 1e-8);
    }
}

/// Views that are not in C order give the same spectrum as copies in C order.
#[test]
fn strided_views_equal_their_copies() {
    let field = Array2::from_shape_vec((12, 9), noise(3, 108)).unwrap();
    let fft = RealFft::new(&[9, 12]).unwrap();
    let turned = fft.forward(field.t()).unwrap();
    let copied = fft.forward(field.t().as_standard_layout().view()).unwrap();
    assert_eq!(turned, copied);
}

/// Invalid fields are refused with a specific error.
#[test]
fn bad_fields_are_refused() {
    assert!(matches!(RealFft::<f64>::new(&[0, 4]), Err(SpectrumError::Shape { .. })));
    assert!(matches!(
        RealFft::<f64>::new(&[1, 1, 1, 1]),
        Err(SpectrumError::Shape { .. })
    ));
    let nan = Array2::from_elem((4, 4), f64::NAN);
    assert_eq!(periodic_component(nan.view()), Err(SpectrumError::NotFinite));
    assert_eq!(radial_spectrum(nan.view(), 0), Err(SpectrumError::NoBins));
    let fft = RealFft::<f64>::new(&[4, 4]).unwrap();
    assert!(matches!(
        fft.forward(Array2::zeros((4, 5)).view()),
        Err(SpectrumError::Mismatch { .. })
    ));
    let none = Array2::from_elem((4, 4), false);
    assert_eq!(
        masked_autocovariance(nan.view(), none.view(), 1),
        Err(SpectrumError::EmptyMask)
    );
}
