//! Complex bands: local amplitude and phase.

use ndarray::{Array2, Zip};
use stereology_spectrum::{Complex, Real};

use crate::Bands;

/// The complex bands of one image, computed by
/// [`SteerablePyramid::build_complex`](crate::SteerablePyramid::build_complex).
///
/// The complex coefficients of a band contain the frequencies on one side of its orientation only, doubled: their real
/// part is the real band, their imaginary part the band in quadrature.
///
/// # Formula
///
/// ```text
/// complex band = FT⁻¹[ (1 + sgn(k · v_b)) G A_b û ]
/// ```
///
/// # References
///
/// Portilla & Simoncelli 2000, section 2.1.
///
/// # Examples
///
/// The amplitude of a wave is the same everywhere, while its real band oscillates:
///
/// ```
/// use ndarray::Array2;
/// use stereology_pyramid::SteerablePyramid;
///
/// let wave = Array2::from_shape_fn((64, 64), |(_, x)| (x as f64 * std::f64::consts::TAU / 8.0).sin());
/// let pyramid = SteerablePyramid::new([64, 64], 2, 4)?;
/// let bands = pyramid.build_complex(wave.view())?;
/// let amplitude = bands.oriented(1, 0).mapv(|c| c.norm());
/// let (low, high) = amplitude.iter().fold((f64::MAX, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
/// assert!(high - low < 1e-12 && high > 0.5);
/// let back = pyramid.reconstruct(bands.real());
/// assert!(wave.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<(), stereology_pyramid::PyramidError>(())
/// ```
#[derive(Clone, Debug)]
pub struct AnalyticBands<T: Real> {
    pub(crate) real: Bands<T>,
    pub(crate) imaginary: Bands<T>,
}

impl<T: Real> AnalyticBands<T> {
    /// The real parts: the bands of the real pyramid, from which the image is reconstructed.
    #[must_use]
    pub fn real(&self) -> &Bands<T> {
        &self.real
    }

    /// Mutable [`Self::real`].
    pub fn real_mut(&mut self) -> &mut Bands<T> {
        &mut self.real
    }

    /// Complex band of a level (0 is the finest) and an orientation.
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or orientation.
    #[must_use]
    pub fn oriented(&self, level: usize, orientation: usize) -> Array2<Complex<T>> {
        let (real, imaginary) = (
            self.real.oriented(level, orientation),
            self.imaginary.oriented(level, orientation),
        );
        Zip::from(&real)
            .and(&imaginary)
            .map_collect(|&re, &im| Complex::new(re, im))
    }
}
