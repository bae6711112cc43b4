//! Radial power spectra: the power of a field at each frequency, averaged over directions.

use ndarray::{ArrayView, Dimension};

use crate::transform::contiguous;
use crate::{Real, RealFft, SpectrumError, frequency};

/// Power of a field by frequency, averaged over circles (2D) or spheres (3D).
///
/// All bins have the same width. Those beyond the Nyquist frequency 1/2 lie in the corners of the square or cube of
/// frequencies and contain fewer directions.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialSpectrum {
    /// Centre frequency of each bin, cycles per sample.
    pub frequency: Vec<f64>,
    /// Mean of `|F(k)|² / N` over the bin, in squared units of the field; zero for an empty bin.
    pub power: Vec<f64>,
    /// Number of frequencies in the bin, counting both signs.
    pub count: Vec<u64>,
}

/// Radial spectrum of a field without its mean, with `bins` bins up to the Nyquist frequency and further bins of the
/// same width that cover the corners beyond it.
///
/// The field is assumed to be periodic: apply [`periodic_component`](crate::periodic_component) to a photograph first.
/// The mean of the field is in no bin; `Σ count · power / N` is the variance of the field.
///
/// # Errors
///
/// [`SpectrumError::NoBins`], [`SpectrumError::NotFinite`], [`SpectrumError::Shape`] for no axis or more than three.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_spectrum::radial_spectrum;
///
/// let checkers = Array2::from_shape_fn((8, 8), |(y, x)| if (y + x) % 2 == 0 { 1.0_f64 } else { -1.0 });
/// let spectrum = radial_spectrum(checkers.view(), 4)?;
/// // All power is at the corner of the frequency square, 1/√2 cycles per sample.
/// assert_eq!(spectrum.power.iter().filter(|&&p| p > 1e-9).count(), 1);
/// assert!(spectrum.power[5] > 0.0);
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
#[allow(clippy::cast_possible_truncation, reason = "bin numbers are small and not negative")]
pub fn radial_spectrum<T: Real, D: Dimension>(
    field: ArrayView<'_, T, D>,
    bins: usize,
) -> Result<RadialSpectrum, SpectrumError> {
    if bins == 0 {
        return Err(SpectrumError::NoBins);
    }
    let shape = field.shape().to_vec();
    let fft = RealFft::<T>::new(&shape)?;
    if field.iter().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotFinite);
    }
    let spectrum = fft.forward(field)?;
    let width = 0.5 / bins as f64;
    let corner = 0.5 * (shape.len() as f64).sqrt();
    let total = bins.max((corner / width + 1e-9).floor() as usize + 1);
    let (mut power, mut count) = (vec![0.0; total], vec![0_u64; total]);
    let last = shape[shape.len() - 1];
    let half = last / 2 + 1;
    let scale = 1.0 / shape.iter().product::<usize>() as f64;
    for (row, values) in contiguous(&spectrum).chunks_exact(half).enumerate() {
        let mut rest = row;
        let mut across = 0.0;
        for &n in shape[..shape.len() - 1].iter().rev() {
            across += frequency(rest % n, n).powi(2);
            rest /= n;
        }
        for (k, value) in values.iter().enumerate() {
            if row == 0 && k == 0 {
                continue;
            }
            let radius = (across + frequency(k, last).powi(2)).sqrt();
            // A frequency on an edge belongs to the bin above it, whatever its rounding error.
            let bin = ((radius / width + 1e-9).floor() as usize).min(total - 1);
            let twice = if k == 0 || 2 * k == last { 1 } else { 2 };
            power[bin] += twice as f64 * value.norm_sqr().to_f64_exact() * scale;
            count[bin] += twice;
        }
    }
    for (p, &c) in power.iter_mut().zip(&count) {
        if c > 0 {
            *p /= c as f64;
        }
    }
    let frequency = (0..total).map(|i| (i as f64 + 0.5) * width).collect();
    Ok(RadialSpectrum {
        frequency,
        power,
        count,
    })
}
