//! The bands of an image.

use std::sync::Arc;

use ndarray::{Array2, ArrayView2, ArrayViewMut2};
use stereology_spectrum::Real;

use crate::bank::FilterBank;

/// The bands of one image: the high-pass residual, oriented bands by level (0 is the finest), and the low-pass
/// residual.
///
/// Computed by [`SteerablePyramid::build`](crate::SteerablePyramid::build); the `_mut` accessors change coefficients in
/// place.
#[derive(Clone, Debug)]
pub struct Bands<T: Real> {
    pub(crate) coefficients: Vec<T>,
    pub(crate) bank: Arc<FilterBank<T>>,
}

/// Statistics of one band, over its own samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandSummary {
    /// Level, 0 is the finest; the high-pass residual has level 0, the low-pass residual the number of levels.
    pub level: usize,
    /// Orientation `b` of `K`, at angle `π b / K`; `None` for the residual bands.
    pub orientation: Option<usize>,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Mean of the squared coefficients.
    pub mean_square: f64,
    /// Smallest coefficient.
    pub min: f64,
    /// Largest coefficient.
    pub max: f64,
}

impl<T: Real> Bands<T> {
    /// The high-pass residual: frequencies beyond Nyquist, in the corners of the frequency square; full size.
    #[must_use]
    pub fn high(&self) -> ArrayView2<'_, T> {
        self.band(0, 0)
    }

    /// Band of a level (0 is the finest) and an orientation `b` of `K`, sensitive to waves along the angle `π b / K`,
    /// measured from the x axis (along a row) towards the y axis (along a column).
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or orientation.
    #[must_use]
    pub fn oriented(&self, level: usize, orientation: usize) -> ArrayView2<'_, T> {
        self.band(self.index(level, orientation), level)
    }

    /// The low-pass residual: coarser than the last level, with the mean of the image.
    #[must_use]
    pub fn low(&self) -> ArrayView2<'_, T> {
        self.band(self.bank.ranges().len() - 1, self.bank.level_count())
    }

    /// Mutable [`Self::high`].
    pub fn high_mut(&mut self) -> ArrayViewMut2<'_, T> {
        self.band_mut(0, 0)
    }

    /// Mutable [`Self::oriented`].
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or orientation.
    pub fn oriented_mut(&mut self, level: usize, orientation: usize) -> ArrayViewMut2<'_, T> {
        self.band_mut(self.index(level, orientation), level)
    }

    /// Mutable [`Self::low`].
    pub fn low_mut(&mut self) -> ArrayViewMut2<'_, T> {
        self.band_mut(self.bank.ranges().len() - 1, self.bank.level_count())
    }

    /// Statistics of every band: high-pass, then level by level, low-pass.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array2;
    /// use stereology_pyramid::SteerablePyramid;
    ///
    /// // A wave along y appears in the band of orientation 2 of 4 (a right angle).
    /// let wave = Array2::from_shape_fn((64, 64), |(y, _)| (y as f64 * std::f64::consts::TAU / 8.0).sin());
    /// let bands = SteerablePyramid::new([64, 64], 3, 4)?.build(wave.view())?;
    /// let strongest = bands.summaries().into_iter().max_by(|a, b| a.mean_square.total_cmp(&b.mean_square)).unwrap();
    /// assert_eq!((strongest.level, strongest.orientation), (1, Some(2)));
    /// # Ok::<(), stereology_pyramid::PyramidError>(())
    /// ```
    #[must_use]
    pub fn summaries(&self) -> Vec<BandSummary> {
        let (levels, count) = (self.bank.level_count(), self.bank.orientations());
        let oriented = (0..levels).flat_map(|level| (0..count).map(move |b| (level, Some(b))));
        [(0, None)]
            .into_iter()
            .chain(oriented)
            .chain([(levels, None)])
            .zip(self.bank.ranges())
            .map(|((level, orientation), range)| {
                let values = self.coefficients[range.clone()].iter().map(|v| v.to_f64_exact());
                let shape = self.bank.shape_at(level);
                BandSummary {
                    level,
                    orientation,
                    shape: [shape[0], shape[1]],
                    mean_square: values.clone().map(|v| v * v).sum::<f64>() / range.len() as f64,
                    min: values.clone().fold(f64::INFINITY, f64::min),
                    max: values.fold(f64::NEG_INFINITY, f64::max),
                }
            })
            .collect()
    }

    /// The band of a level for an oriented filter at any `angle` (radians, from the x axis towards the y axis): an
    /// exact linear combination of the bands of the level. `O(K)` per sample.
    ///
    /// # Formula
    ///
    /// ```text
    /// cos^p(θ − φ) = Σ_b w_b cos^p(θ − πb/K),   w_b = (1/K) Σ_m cos(m (φ − πb/K)),   m = −p, 2−p, …, p,   p = K − 1
    /// ```
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level.
    ///
    /// # References
    ///
    /// Freeman & Adelson 1991, theorem 1.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array2;
    /// use stereology_pyramid::SteerablePyramid;
    ///
    /// let image = Array2::from_shape_fn((32, 32), |(y, x)| ((y * y + 3 * x) % 17) as f64);
    /// let bands = SteerablePyramid::new([32, 32], 2, 4)?.build(image.view())?;
    /// let same = bands.steered(1, std::f64::consts::FRAC_PI_4);
    /// assert!(same.iter().zip(bands.oriented(1, 1)).all(|(a, b)| (a - b).abs() < 1e-12));
    /// # Ok::<(), stereology_pyramid::PyramidError>(())
    /// ```
    #[must_use]
    pub fn steered(&self, level: usize, angle: f64) -> Array2<T> {
        let k = self.bank.orientations();
        let mut sum = Array2::zeros(self.oriented(level, 0).dim());
        for b in 0..k {
            let difference = angle - std::f64::consts::PI * b as f64 / k as f64;
            let waves = (0..k).map(|j| ((2.0 * j as f64 + 1.0 - k as f64) * difference).cos());
            let weight = T::from_f64_lossy(waves.sum::<f64>() / k as f64);
            sum.zip_mut_with(&self.oriented(level, b), |s, &v| *s = *s + weight * v);
        }
        sum
    }

    /// Multiplies every level by a function of the number of samples of the image divided by that of the level.
    pub(crate) fn scale(&mut self, factor: fn(f64) -> f64) {
        let samples = self.bank.ranges()[0].len() as f64;
        for range in self.bank.ranges() {
            let by = T::from_f64_lossy(factor(samples / range.len() as f64));
            self.coefficients[range.clone()].iter_mut().for_each(|v| *v = *v * by);
        }
    }

    fn index(&self, level: usize, orientation: usize) -> usize {
        let (levels, count) = (self.bank.level_count(), self.bank.orientations());
        assert!(
            level < levels && orientation < count,
            "no band ({level}, {orientation}) among {levels} x {count}"
        );
        1 + level * count + orientation
    }

    fn band(&self, band: usize, level: usize) -> ArrayView2<'_, T> {
        let shape = self.bank.shape_at(level);
        let values = &self.coefficients[self.bank.ranges()[band].clone()];
        ArrayView2::from_shape((shape[0], shape[1]), values).expect("a band has the shape of its level")
    }

    fn band_mut(&mut self, band: usize, level: usize) -> ArrayViewMut2<'_, T> {
        let shape = self.bank.shape_at(level);
        let values = &mut self.coefficients[self.bank.ranges()[band].clone()];
        ArrayViewMut2::from_shape((shape[0], shape[1]), values).expect("a band has the shape of its level")
    }
}
