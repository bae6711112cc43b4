//! The relation between the spectrum of a volume and the spectrum of its slices.
//!
//! At each frequency a slice contains the sum of all waves of the volume with any frequency along its normal:
//!
//! ```text
//! S2(κ) = ∫ S3(√(κ² + k_z²)) dk_z = 2 ∫_κ^∞ S3(k) k dk / √(k² − κ²)      (Abel's transform; cycles per sample)
//! ```
//!
//! A volume with the spectrum of a photograph therefore has slices that are too smooth. Its spectrum must be the
//! inverse of this relation, as closely as a spectrum, which is never negative, can be.

use nalgebra::{DMatrix, DVector};
use stereology_spectrum::RadialSpectrum;

/// Number of steps of the quadrature over half the frequency range.
const STEPS: usize = 256;

/// Spectrum at frequency `kappa` of the slices of an isotropic sampled volume with spectrum `volume`, both in units of
/// `|F|² / N`; frequencies in cycles per sample. The integral runs to Nyquist, as the sum over a sampled volume does.
///
/// # Examples
///
/// A Gaussian volume spectrum gives a Gaussian slice spectrum:
///
/// ```
/// use stereology_pyramid::slice_spectrum;
///
/// let s = 0.08_f64;
/// let volume = |k: f64| (-0.5 * (k / s).powi(2)).exp();
/// let expected = s * std::f64::consts::TAU.sqrt() * volume(0.1);
/// assert!((slice_spectrum(&volume, 0.1) / expected - 1.0).abs() < 1e-6);
/// ```
#[must_use]
pub fn slice_spectrum(volume: &dyn Fn(f64) -> f64, kappa: f64) -> f64 {
    normal_frequencies().map(|k| volume(kappa.hypot(k))).sum::<f64>() / STEPS as f64
}

fn normal_frequencies() -> impl Iterator<Item = f64> {
    (0..STEPS).map(|i| 0.5 * (i as f64 + 0.5) / STEPS as f64)
}

/// A radial spectrum of a volume, linear between nodes, computed by [`volume_spectrum`].
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeSpectrum {
    /// Frequencies of the nodes, cycles per sample, evenly spaced.
    pub frequency: Vec<f64>,
    /// Power at the nodes, `|F|² / N`, never negative.
    pub power: Vec<f64>,
    /// Root mean square of the relative differences between the spectrum of the slices and the requested one, weighted
    /// by the number of frequencies in each bin: the part that no spectrum of a volume can give.
    pub residual: f64,
}

impl VolumeSpectrum {
    /// Power at a frequency; constant beyond the first and last node.
    #[must_use]
    pub fn at(&self, frequency: f64) -> f64 {
        let (i, part) = node(frequency, self.frequency[0], self.power.len());
        self.power[i] + part * (self.power[(i + 1).min(self.power.len() - 1)] - self.power[i])
    }
}

/// Node below a frequency and the fraction of the interval to the next, for nodes at `(i + 1/2) width`, `first = width
/// / 2`.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the position is clamped to the nodes"
)]
fn node(frequency: f64, first: f64, count: usize) -> (usize, f64) {
    let position = (frequency / (2.0 * first) - 0.5).clamp(0.0, (count - 1) as f64);
    (position as usize, position.fract())
}

/// Spectrum of the isotropic volume whose slices have the spectrum `slice`, as closely as a non-negative spectrum can:
/// non-negative least squares of the relative differences. `O(bins³)`.
///
/// # Examples
///
/// ```
/// use stereology_pyramid::{slice_spectrum, volume_spectrum};
/// use stereology_spectrum::RadialSpectrum;
///
/// // From the slices of the Gaussian volume of `slice_spectrum` back to the volume.
/// let volume = |k: f64| (-0.5 * (k / 0.08).powi(2)).exp();
/// let frequency: Vec<f64> = (0..46).map(|i| (i as f64 + 0.5) / 64.0).collect();
/// let power = frequency.iter().map(|&k| slice_spectrum(&volume, k)).collect();
/// let found = volume_spectrum(&RadialSpectrum { frequency, power, count: vec![1; 46] });
/// assert!((found.at(0.05) / volume(0.05) - 1.0).abs() < 0.02);
/// assert!(found.residual < 0.02);
/// ```
#[must_use]
pub fn volume_spectrum(slice: &RadialSpectrum) -> VolumeSpectrum {
    let n = slice.power.len();
    let strongest = slice.power.iter().copied().fold(0.0, f64::max);
    if strongest <= 0.0 {
        return VolumeSpectrum {
            frequency: slice.frequency.clone(),
            power: vec![0.0; n],
            residual: 0.0,
        };
    }
    let first = slice.frequency[0];
    let frequencies: f64 = slice.count.iter().map(|&c| c as f64).sum();
    let mut relation = DMatrix::zeros(n, n);
    let mut requested = DVector::zeros(n);
    for i in 0..n {
        // Relative differences are weighted, with a floor for bins far below the strongest.
        let scale = slice.power[i].max(1e-7 * strongest);
        let weight = (slice.count[i] as f64 / frequencies).sqrt() / scale;
        for k in normal_frequencies() {
            let (j, part) = node(slice.frequency[i].hypot(k), first, n);
            relation[(i, j)] += weight * (1.0 - part) / STEPS as f64;
            relation[(i, (j + 1).min(n - 1))] += weight * part / STEPS as f64;
        }
        requested[i] = weight * slice.power[i];
    }
    let power = non_negative_least_squares(&relation, &requested);
    let residual = (&relation * &power - &requested).norm();
    VolumeSpectrum {
        frequency: slice.frequency.clone(),
        power: power.iter().copied().collect(),
        residual,
    }
}

/// The x ≥ 0 that minimises |A x − b| (Lawson & Hanson 1974, chapter 23).
fn non_negative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let n = a.ncols();
    let mut free = vec![false; n];
    let mut x = DVector::zeros(n);
    let tolerance = 1e-12 * a.tr_mul(b).amax();
    for _ in 0..3 * n {
        let gradient = a.tr_mul(&(b - a * &x));
        let Some(enter) = (0..n)
            .filter(|&j| !free[j] && gradient[j] > tolerance)
            .max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]).then(j.cmp(&i)))
        else {
            break;
        };
        free[enter] = true;
        loop {
            let columns: Vec<usize> = (0..n).filter(|&j| free[j]).collect();
            let qr = a.select_columns(&columns).qr();
            let Some(solution) = qr.r().solve_upper_triangular(&qr.q().tr_mul(b)) else {
                free[enter] = false;
                break;
            };
            if solution.iter().all(|&v| v > 0.0) {
                x.fill(0.0);
                columns.iter().zip(solution.iter()).for_each(|(&j, &v)| x[j] = v);
                break;
            }
            // Move towards the solution as far as all components stay non-negative, and fix those that reach zero.
            let blocking = columns.iter().zip(solution.iter()).filter(|(_, v)| **v <= 0.0);
            let (first, step) = blocking
                .map(|(&j, &v)| (j, x[j] / (x[j] - v)))
                .min_by(|p, q| p.1.total_cmp(&q.1))
                .expect("some component is not positive");
            columns
                .iter()
                .zip(solution.iter())
                .for_each(|(&j, &v)| x[j] += step * (v - x[j]));
            x[first] = 0.0;
            columns.iter().filter(|&&j| x[j] <= 0.0).for_each(|&j| free[j] = false);
            if columns.len() == 1 {
                break;
            }
        }
    }
    x
}
