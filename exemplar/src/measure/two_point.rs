//! The two-point correlation S2: how often two points a given way apart are both in a phase.

use ndarray::{Array, ArrayView, Dimension};
use stereology_spectrum::{Complex, RealFft, SpectrumError};

/// Mean of `u(x) u(x + d)` over all pairs of samples that both lie in the field, which is not wrapped around: S2 if the field is 1 in a phase and 0 outside.
///
/// Entry `reach + d` along each axis, |d| ≤ `reach`; a reach beyond the field is cut to what fits. Cost: N log N, by a Fourier transform of the field padded with zeros.
///
/// # Formula
///
/// ```text
/// S2(d) = Σ u(x) u(x + d) / Π (nₖ − |dₖ|)        S2(0) = φ, the phase's share;  S2(far) → φ²
/// overlapping spheres (radius R, λ per volume), outside of them:
/// S2(r) = exp(−λ (4π/3) R³ (1 + 3r/4R − r³/16R³))   for r < 2R, then φ²
/// ```
///
/// # Errors
///
/// [`SpectrumError`] for a field that is empty or holds values that are not finite.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_exemplar::measure::two_point;
///
/// let s2 = two_point(array![[1.0, 0.0, 1.0, 0.0]].view(), 2)?;
/// assert!((s2[[0, 2]] - 0.5).abs() < 1e-12); // lag 0: half the samples
/// assert!(s2[[0, 3]].abs() < 1e-12);         // neighbours are never both 1
/// assert!((s2[[0, 4]] - 0.5).abs() < 1e-12); // of two pairs at lag 2, one
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn two_point<D: Dimension>(field: ArrayView<'_, f64, D>, reach: usize) -> Result<Array<f64, D>, SpectrumError> {
    if field.iter().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotFinite);
    }
    let sizes = field.shape().to_vec();
    let reaches: Vec<usize> = sizes.iter().map(|n| reach.min(n.saturating_sub(1))).collect();
    let mut padded = field.raw_dim();
    (0..sizes.len()).for_each(|axis| padded[axis] = sizes[axis] + reaches[axis]);
    let fft = RealFft::<f64>::new(padded.slice())?;
    let mut values = Array::zeros(padded.clone());
    values
        .slice_each_axis_mut(|axis| (0..sizes[axis.axis.index()]).into())
        .assign(&field);
    let mut spectrum = fft.forward(values.view())?;
    spectrum.mapv_inplace(|v| Complex::new(v.norm_sqr(), 0.0));
    let products = fft.inverse(spectrum)?;
    let mut lags = field.raw_dim();
    (0..sizes.len()).for_each(|axis| lags[axis] = 2 * reaches[axis] + 1);
    let mut s2 = Array::zeros(lags);
    let mut place = padded;
    for (at, value) in s2.iter_mut().enumerate() {
        // Indices of this entry, last axis fastest.
        let (mut rest, mut pairs) = (at, 1.0);
        for axis in (0..sizes.len()).rev() {
            let side = 2 * reaches[axis] + 1;
            let lag = rest % side;
            rest /= side;
            pairs *= (sizes[axis] - lag.abs_diff(reaches[axis])) as f64;
            let n = sizes[axis] + reaches[axis];
            place[axis] = (lag + n - reaches[axis]) % n;
        }
        *value = products[place.clone()] / pairs;
    }
    Ok(s2)
}

/// Means of a map of lags over rings of whole distances from its middle: entry r holds the lags r − ½ to r + ½ away, up to the map's nearest border.
///
/// ```
/// use ndarray::Array2;
/// use stereology_exemplar::measure::radial_mean;
///
/// let map = Array2::from_shape_fn((9, 9), |(y, x)| (y as f64 - 4.0).hypot(x as f64 - 4.0));
/// let means = radial_mean(map.view());
/// assert_eq!((means.len(), means[0]), (5, 0.0));
/// assert!((means[3] - 3.0).abs() < 0.1);
/// ```
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a distance in a map"
)]
pub fn radial_mean<D: Dimension>(map: ArrayView<'_, f64, D>) -> Vec<f64> {
    let sizes = map.shape().to_vec();
    let reach = sizes.iter().map(|n| n / 2).filter(|&r| r > 0).min().unwrap_or(0);
    let mut rings = vec![(0.0, 0_u32); reach + 1];
    for (at, value) in map.iter().enumerate() {
        let (mut rest, mut square) = (at, 0.0);
        for &side in sizes.iter().rev() {
            square += ((rest % side) as f64 - (side / 2) as f64).powi(2);
            rest /= side;
        }
        if let Some(ring) = rings.get_mut(square.sqrt().round() as usize) {
            *ring = (ring.0 + value, ring.1 + 1);
        }
    }
    rings.iter().map(|(sum, n)| sum / f64::from((*n).max(1))).collect()
}
