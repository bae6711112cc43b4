//! A Poisson field of overlapping spheres, whose spectrum is known.

use ndarray::{Array3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use stereology_pyramid::{slice_spectrum, volume_spectrum};
use stereology_spectrum::{Complex, RadialSpectrum, RealFft, frequency};

/// Transform of the indicator of a sphere at `f` cycles per unit length: 4π (sin q − q cos q) / k³, q = k radius.
fn form_factor(f: f64, radius: f64) -> f64 {
    let k = TAU * f;
    let q = k * radius;
    if q < 1e-3 {
        4.0 / 3.0 * PI * radius.powi(3)
    } else {
        4.0 * PI * (q.sin() - q * q.cos()) / k.powi(3)
    }
}

/// The spectrum of slices of a Poisson field of spheres is density × squared form factor, summed over the waves along
/// the normal.
///
/// One realisation. False-alarm rate below 1e-6 over all bins: the sum in each bin has at least 200 independent
/// exponential terms, so 6.5 standard deviations have a probability below 3e-8 for each of 12.
#[test]
fn slices_of_sphere_field_follow_the_form_factor() {
    const N: usize = 24;
    const COUNT: usize = 1000;
    const RADIUS: f64 = 2.3;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let centres: Vec<[f64; 3]> = (0..COUNT)
        .map(|_| [0; 3].map(|_| N as f64 * rng.random::<f64>()))
        .collect();
    // The band-limited field, from its spectrum.
    let fft = RealFft::<f64>::new(&[N, N, N]).unwrap();
    let wave = |k: [usize; 3]| k.map(|k| frequency(k, N));
    let radius_of = |k: [usize; 3]| wave(k).iter().map(|f| f * f).sum::<f64>().sqrt();
    let nyquist = |k: [usize; 3]| k.contains(&(N / 2));
    let spectrum = Array3::from_shape_fn((N, N, N / 2 + 1), |(z, y, x)| {
        let (k, f) = ([z, y, x], wave([z, y, x]));
        if nyquist(k) {
            return Complex::new(0.0, 0.0);
        }
        let sum: Complex<f64> = centres
            .iter()
            .map(|c| Complex::cis(-TAU * (f[0] * c[0] + f[1] * c[1] + f[2] * c[2])))
            .sum();
        sum * form_factor(radius_of(k), RADIUS)
    });
    let field = fft.inverse(spectrum).unwrap();
    // Mean periodogram of all slices and its expectation, by radial bins.
    let flat = RealFft::<f64>::new(&[N, N]).unwrap();
    let (mut found, mut expected, mut variance) = (vec![0.0; 12], vec![0.0; 12], vec![0.0; 12]);
    let density = COUNT as f64 / (N * N * N) as f64;
    let mut terms = [0.0; 12];
    let slices: Vec<_> = field.axis_iter(Axis(0)).map(|s| flat.forward(s).unwrap()).collect();
    for y in 0..N {
        for x in 0..N / 2 + 1 {
            let bin = (frequency(y, N).hypot(frequency(x, N)) * N as f64).round() as usize;
            if bin == 0 || bin > 11 || nyquist([0, y, x]) {
                continue;
            }
            let twice = if x == 0 { 1.0 } else { 2.0 };
            found[bin] += twice * slices.iter().map(|s| s[[y, x]].norm_sqr()).sum::<f64>() / (N * N * N) as f64;
            for z in (0..N).filter(|&z| z != N / 2) {
                let power = density * form_factor(radius_of([z, y, x]), RADIUS).powi(2) / N as f64;
                expected[bin] += twice * power;
                // A wave and its complex conjugate are not independent: half as many terms of twice the size.
                variance[bin] += twice * 2.0 * power * power;
                terms[bin] += twice / 2.0;
            }
        }
    }
    for bin in 4..12 {
        let deviations = (found[bin] - expected[bin]) / f64::sqrt(variance[bin]);
        assert!(
            terms[bin] > 200.0 && deviations.abs() < 6.5,
            "bin {bin}: {deviations} standard deviations"
        );
    }
}

/// The spectrum of the volume, which is the form factor, is recovered from the spectrum of its slices.
#[test]
fn sphere_volume_is_recovered_from_its_slices() {
    let radius = 3.0;
    let volume = |f: f64| form_factor(f, radius).powi(2);
    let frequency: Vec<f64> = (0..46).map(|i| (i as f64 + 0.5) / 64.0).collect();
    let power = frequency.iter().map(|&f| slice_spectrum(&volume, f)).collect();
    let found = volume_spectrum(&RadialSpectrum {
        frequency,
        power,
        count: (1..47).collect(),
    });
    // Up to the first zero, q = 4.49, at f = 0.238.
    for i in 1..11 {
        let f = (f64::from(i) + 0.5) / 64.0;
        assert!(
            (found.at(f) / volume(f) - 1.0).abs() < 0.1,
            "{f}: {} for {}",
            found.at(f),
            volume(f)
        );
    }
    assert!(found.power.iter().all(|&p| p >= 0.0));
    assert!(found.residual < 0.15, "{}", found.residual);
}

/// A spectrum that slices of no volume can have (a ring) is approximated, and the residual reports the difference.
#[test]
fn impossible_slices_leave_a_residual() {
    let frequency: Vec<f64> = (0..46).map(|i| (i as f64 + 0.5) / 64.0).collect();
    let power = (0..46).map(|i| if i == 20 { 1.0 } else { 1e-4 }).collect();
    let found = volume_spectrum(&RadialSpectrum {
        frequency,
        power,
        count: vec![1; 46],
    });
    assert!(found.power.iter().all(|&p| p >= 0.0 && p.is_finite()));
    assert!(found.residual > 0.1);
}
