//! The periodic component of an image: the image without the cross that its edges produce in the spectrum.

use ndarray::{Array2, ArrayView2};

use crate::{Complex, Real, RealFft, SpectrumError};

/// Periodic component of an image: its Laplacian equals that of the image in the interior, and it has no jump where it
/// wraps around. It has the mean of the image.
///
/// A tiled image jumps at its edges, and the jumps add power along the axes of the spectrum that the texture does not
/// have. The image is the sum of this component and a smooth component that contains the jumps.
///
/// # Formula
///
/// ```text
/// u = p + s,   s^(k) = v^(k) / (2 cos 2πk_y/n_y + 2 cos 2πk_x/n_x − 4),   s^(0) = 0
/// v(0, x) += u(n_y−1, x) − u(0, x), v(n_y−1, x) −= the same; likewise in x
/// ```
///
/// # Errors
///
/// [`SpectrumError::Shape`] for an image without pixels, [`SpectrumError::NotFinite`] for NaN or infinity.
///
/// # References
///
/// Moisan 2011, Periodic plus smooth image decomposition, eqs. (10), (11).
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_spectrum::periodic_component;
///
/// let ramp = Array2::from_shape_fn((16, 16), |(_, x)| x as f64);
/// let periodic = periodic_component(ramp.view())?;
/// assert!((periodic.mean().unwrap() - 7.5).abs() < 1e-12);
/// assert!((periodic[[3, 0]] - periodic[[3, 15]]).abs() < 1.0, "the jump of 15 at the wrap is gone");
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
pub fn periodic_component<T: Real>(image: ArrayView2<'_, T>) -> Result<Array2<T>, SpectrumError> {
    let (height, width) = image.dim();
    let fft = RealFft::<T>::new(&[height, width])?;
    if image.iter().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotFinite);
    }
    let mut jumps = Array2::from_elem((height, width), T::zero());
    for x in 0..width {
        let jump = image[[height - 1, x]] - image[[0, x]];
        jumps[[0, x]] = jumps[[0, x]] + jump;
        jumps[[height - 1, x]] = jumps[[height - 1, x]] - jump;
    }
    for y in 0..height {
        let jump = image[[y, width - 1]] - image[[y, 0]];
        jumps[[y, 0]] = jumps[[y, 0]] + jump;
        jumps[[y, width - 1]] = jumps[[y, width - 1]] - jump;
    }
    let mut spectrum = fft.forward(jumps.view())?;
    let cosine = |k: usize, n: usize| 2.0 * (std::f64::consts::TAU * k as f64 / n as f64).cos();
    for ((ky, kx), value) in spectrum.indexed_iter_mut() {
        *value = if ky == 0 && kx == 0 {
            Complex::new(T::zero(), T::zero())
        } else {
            *value / T::from_f64_lossy(cosine(ky, height) + cosine(kx, width) - 4.0)
        };
    }
    let smooth = fft.inverse(spectrum)?;
    Ok(&image - &smooth)
}
