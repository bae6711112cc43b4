//! Autocovariance of fields: how similar two samples are as a function of the vector between them.

use ndarray::{Array, Array2, ArrayView, ArrayView2, Dimension, Zip};

use crate::{Complex, Real, RealFft, SpectrumError};

/// Periodic autocovariance of a field: entry `d` is the mean of `(u(x) − mean)(u(x + d) − mean)` over all `x`, wrapped
/// around. Entry 0 is the variance. Same shape as the field; lag `−d` is at `n − d`. `O(N log N)`.
///
/// # Errors
///
/// [`SpectrumError::Shape`], [`SpectrumError::NotFinite`].
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_spectrum::autocovariance;
///
/// let covariance = autocovariance(array![[1.0_f64, -1.0, 1.0, -1.0]].view())?;
/// assert!((covariance[[0, 0]] - 1.0).abs() < 1e-12);
/// assert!((covariance[[0, 1]] + 1.0).abs() < 1e-12);
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
pub fn autocovariance<T: Real, D: Dimension>(field: ArrayView<'_, T, D>) -> Result<Array<T, D>, SpectrumError> {
    let fft = RealFft::<T>::new(field.shape())?;
    if field.iter().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotFinite);
    }
    let scale = T::one() / T::from_f64_lossy(field.len() as f64);
    let mut spectrum = fft.forward(field)?;
    spectrum.mapv_inplace(|v| Complex::new(v.norm_sqr() * scale, T::zero()));
    if let Some(mean) = spectrum.first_mut() {
        *mean = Complex::new(T::zero(), T::zero());
    }
    fft.inverse(spectrum)
}

/// Periodic autocorrelation of a field: its [`autocovariance`] divided by its variance, so entry 0 is one.
///
/// # Errors
///
/// [`SpectrumError::Constant`] for a field without variance; the errors of [`autocovariance`].
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_spectrum::autocorrelation;
///
/// let correlation = autocorrelation(array![[5.0_f64, 1.0, 5.0, 1.0]].view())?;
/// assert!((correlation[[0, 2]] - 1.0).abs() < 1e-12);
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
pub fn autocorrelation<T: Real, D: Dimension>(field: ArrayView<'_, T, D>) -> Result<Array<T, D>, SpectrumError> {
    let (lowest, highest) = field
        .iter()
        .fold((T::infinity(), T::neg_infinity()), |(a, b), &v| (a.min(v), b.max(v)));
    let mut covariance = autocovariance(field)?;
    let Some(&variance) = covariance.first().filter(|_| lowest < highest) else {
        return Err(SpectrumError::Constant);
    };
    covariance.mapv_inplace(|v| v / variance);
    Ok(covariance)
}

/// Autocovariance of an image from the pixels of a mask only, without wrapping around.
///
/// Entry `(d_y + reach, d_x + reach)`, `|d| ≤ reach`, is the mean of `(u(x) − mean)(u(x + d) − mean)` over the pairs of
/// pixels that both lie in the mask; the second array contains the number of such pairs. The mean is that of the pixels
/// in the mask; values outside the mask are never read. `O(N log N)`.
///
/// # Errors
///
/// [`SpectrumError::Mismatch`] if image and mask differ in shape, [`SpectrumError::EmptyMask`],
/// [`SpectrumError::NotFinite`] for a value inside the mask.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_spectrum::masked_autocovariance;
///
/// let image = array![[1.0_f64, 3.0, f64::NAN, 1.0, 3.0]];
/// let mask = array![[true, true, false, true, true]];
/// let (covariance, pairs) = masked_autocovariance(image.view(), mask.view(), 1)?;
/// assert_eq!(pairs[[1, 2]], 2.0); // two pairs of neighbours
/// assert!((covariance[[1, 2]] + 1.0).abs() < 1e-12); // 1 beside 3, about the mean 2
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
pub fn masked_autocovariance(
    image: ArrayView2<'_, f64>,
    mask: ArrayView2<'_, bool>,
    reach: usize,
) -> Result<(Array2<f64>, Array2<f64>), SpectrumError> {
    if image.dim() != mask.dim() {
        return Err(SpectrumError::Mismatch {
            expected: image.shape().to_vec(),
            found: mask.shape().to_vec(),
        });
    }
    let inside = || image.iter().zip(mask).filter(|(_, m)| **m).map(|(v, _)| *v);
    let selected = inside().count();
    if selected == 0 {
        return Err(SpectrumError::EmptyMask);
    }
    if inside().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotFinite);
    }
    let mean = inside().sum::<f64>() / selected as f64;
    let (height, width) = image.dim();
    // Pad so that no lag wraps around.
    let padded = [height + reach, width + reach];
    let fft = RealFft::<f64>::new(&padded)?;
    let (mut values, mut ones) = (Array2::zeros(padded), Array2::zeros(padded));
    for ((y, x), _) in mask.indexed_iter().filter(|(_, m)| **m) {
        values[[y, x]] = image[[y, x]] - mean;
        ones[[y, x]] = 1.0;
    }
    let correlate = |field: Array2<f64>| -> Result<Array2<f64>, SpectrumError> {
        let mut spectrum = fft.forward(field.view())?;
        spectrum.mapv_inplace(|v| Complex::new(v.norm_sqr(), 0.0));
        fft.inverse(spectrum)
    };
    let (products, pairs) = (correlate(values)?, correlate(ones)?);
    let side = 2 * reach + 1;
    let at = |field: &Array2<f64>, i: usize, j: usize| {
        let wrap = |d: usize, n: usize| (d + n - reach) % n;
        field[[wrap(i, padded[0]), wrap(j, padded[1])]]
    };
    let counted = Array2::from_shape_fn((side, side), |(i, j)| at(&pairs, i, j).round());
    let mut covariance = Array2::from_shape_fn((side, side), |(i, j)| at(&products, i, j));
    Zip::from(&mut covariance)
        .and(&counted)
        .for_each(|c, &n| *c = if n > 0.0 { *c / n } else { 0.0 });
    Ok((covariance, counted))
}
