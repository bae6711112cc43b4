//! The steerable pyramid of an image: what it holds at every scale and in every direction, and the image back from it.

use std::sync::Arc;

use ndarray::{Array2, ArrayView2, ArrayViewMut2};
use stereology_spectrum::Real;

use crate::bank::{FilterBank, most_levels};

/// An image cannot be taken apart as asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PyramidError {
    /// The image is too small for a single level.
    #[error("an image of {height} x {width} pixels is too small for a pyramid: it needs at least 8 x 8")]
    TooSmall {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
    },
    /// The image is too small for so many levels, or none were asked for.
    #[error("a pyramid of {height} x {width} pixels has 1 to {most} levels, not {asked}")]
    Levels {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
        /// Levels asked for.
        asked: usize,
        /// Most levels possible.
        most: usize,
    },
    /// The number of orientations is out of range.
    #[error("a pyramid has 1 to 32 orientations, not {asked}")]
    Orientations {
        /// Orientations asked for.
        asked: usize,
    },
    /// The image has another shape than the pyramid was made for.
    #[error("this pyramid was made for {expected:?} pixels (rows, columns), but the image has {found:?}")]
    Shape {
        /// Rows and columns the pyramid was made for.
        expected: [usize; 2],
        /// Rows and columns of the image.
        found: [usize; 2],
    },
    /// The image holds NaN or infinity.
    #[error("the pixel at row {row}, column {column} is NaN or infinite")]
    NotFinite {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
    },
}

/// The steerable pyramid of images of one shape: its filters, made once.
///
/// Images are taken as periodic; edges are the caller's concern
/// ([`periodic_component`](stereology_spectrum::periodic_component)). Any size from 8 x 8, odd and non-square included.
/// Reconstruction is exact: below 1e-12 of the range in `f64`, below 2e-6 in `f32`. Building and reconstructing cost
/// `O(K N log N)`; the filters hold about `2/3 K N` numbers for `K` orientations.
///
/// # Formula
///
/// ```text
/// band(l, b) = Re FT⁻¹[ L_1 L_½ … H_{2^−(l+1)} A_b û ] on the grid of level l, ceil(n/2) samples an axis from level to level
/// Σ_l (N_0/N_l) |c_l|² = |u|²                         Parseval: N_l samples of level l, coefficients without gain
/// ```
///
/// # References
///
/// Simoncelli & Freeman 1995; windows and sizes as in the crate's documentation.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_pyramid::SteerablePyramid;
///
/// let image = Array2::from_shape_fn((33, 50), |(y, x)| ((y * y + 3 * x) % 17) as f64);
/// let pyramid = SteerablePyramid::new([33, 50], 2, 4)?;
/// let bands = pyramid.build(image.view())?;
/// assert_eq!(bands.oriented(1, 3).dim(), (17, 25));
/// let back = pyramid.reconstruct(&bands);
/// assert!(image.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<(), stereology_pyramid::PyramidError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SteerablePyramid<T: Real> {
    bank: Arc<FilterBank<T>>,
}

impl<T: Real> SteerablePyramid<T> {
    /// Pyramid of images of `shape` (rows, columns). One orientation makes the isotropic pyramid.
    ///
    /// # Errors
    ///
    /// [`PyramidError::TooSmall`] under 8 pixels, [`PyramidError::Levels`] outside 1 to [`Self::most_levels`],
    /// [`PyramidError::Orientations`] outside 1 to 32.
    pub fn new(shape: [usize; 2], levels: usize, orientations: usize) -> Result<Self, PyramidError> {
        let [height, width] = shape;
        let most = Self::most_levels(shape);
        if most == 0 {
            return Err(PyramidError::TooSmall { height, width });
        }
        if levels == 0 || levels > most {
            return Err(PyramidError::Levels {
                height,
                width,
                asked: levels,
                most,
            });
        }
        if orientations == 0 || orientations > 32 {
            return Err(PyramidError::Orientations { asked: orientations });
        }
        Ok(Self {
            bank: Arc::new(FilterBank::new(&shape, levels, orientations)),
        })
    }

    /// Most levels of an image of `shape`: its coarsest bands still have 8 samples along the shorter side; zero if the
    /// image has not.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_pyramid::SteerablePyramid;
    ///
    /// assert_eq!(SteerablePyramid::<f64>::most_levels([128, 512]), 5);
    /// assert_eq!(SteerablePyramid::<f64>::most_levels([7, 512]), 0);
    /// ```
    #[must_use]
    pub fn most_levels(shape: [usize; 2]) -> usize {
        most_levels(&shape)
    }

    /// Rows and columns of the images.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        [self.bank.shape()[0], self.bank.shape()[1]]
    }

    /// Number of oriented levels.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.bank.level_count()
    }

    /// Number of orientations.
    #[must_use]
    pub fn orientations(&self) -> usize {
        self.bank.orientations()
    }

    /// Takes an image apart.
    ///
    /// # Errors
    ///
    /// [`PyramidError::Shape`] for another shape, [`PyramidError::NotFinite`] for NaN or infinity.
    pub fn build(&self, image: ArrayView2<'_, T>) -> Result<Bands<T>, PyramidError> {
        let found = [image.nrows(), image.ncols()];
        if found != self.shape() {
            return Err(PyramidError::Shape {
                expected: self.shape(),
                found,
            });
        }
        if let Some(((row, column), _)) = image.indexed_iter().find(|(_, v)| !v.is_finite()) {
            return Err(PyramidError::NotFinite { row, column });
        }
        let mut coefficients = vec![T::zero(); self.bank.coefficients()];
        let values: Vec<T> = image.iter().copied().collect();
        self.bank.analyse(&values, &mut coefficients, &mut self.bank.work());
        Ok(Bands {
            coefficients,
            bank: Arc::clone(&self.bank),
        })
    }

    /// The image of a pyramid's bands, changed or not.
    ///
    /// # Panics
    ///
    /// If the bands are those of a pyramid of another shape, other levels or orientations.
    #[must_use]
    pub fn reconstruct(&self, bands: &Bands<T>) -> Array2<T> {
        assert_eq!(
            self.bank.ranges(),
            bands.bank.ranges(),
            "the bands are of another pyramid"
        );
        let mut image = vec![T::zero(); self.shape().iter().product()];
        self.bank
            .synthesise(&bands.coefficients, &mut image, &mut self.bank.work());
        Array2::from_shape_vec(self.shape(), image).expect("as many pixels as the shape has")
    }
}

/// The bands of one image: a high-pass residual, oriented bands by level (0 is the finest), a low-pass residual.
///
/// Made by [`SteerablePyramid::build`]; the `_mut` accessors change coefficients in place.
#[derive(Clone, Debug)]
pub struct Bands<T: Real> {
    coefficients: Vec<T>,
    bank: Arc<FilterBank<T>>,
}

/// Figures of one band, over its own samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandSummary {
    /// Level, 0 the finest; the high-pass residual is on level 0, the low-pass residual one beyond the last.
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
    /// What lies beyond Nyquist, in the corners of the frequency square; full size.
    #[must_use]
    pub fn high(&self) -> ArrayView2<'_, T> {
        self.band(0, 0)
    }

    /// Band of a level (0 the finest) and an orientation `b` of `K`, sensitive to waves that run along the angle `π b / K`
    /// from the columns' direction towards the rows'.
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or orientation.
    #[must_use]
    pub fn oriented(&self, level: usize, orientation: usize) -> ArrayView2<'_, T> {
        self.band(self.index(level, orientation), level)
    }

    /// What is coarser than the last level; its mean is the image's.
    #[must_use]
    pub fn low(&self) -> ArrayView2<'_, T> {
        self.band(self.bank.ranges().len() - 1, self.bank.level_count())
    }

    /// [`Self::high`], to be changed.
    pub fn high_mut(&mut self) -> ArrayViewMut2<'_, T> {
        self.band_mut(0, 0)
    }

    /// [`Self::oriented`], to be changed.
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or orientation.
    pub fn oriented_mut(&mut self, level: usize, orientation: usize) -> ArrayViewMut2<'_, T> {
        self.band_mut(self.index(level, orientation), level)
    }

    /// [`Self::low`], to be changed.
    pub fn low_mut(&mut self) -> ArrayViewMut2<'_, T> {
        self.band_mut(self.bank.ranges().len() - 1, self.bank.level_count())
    }

    /// Figures of every band: high-pass, then level by level, low-pass.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array2;
    /// use stereology_pyramid::SteerablePyramid;
    ///
    /// // A wave along the rows' direction shows in the band of orientation 2 of 4 (a right angle).
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
        ArrayView2::from_shape((shape[0], shape[1]), values).expect("a band has its level's shape")
    }

    fn band_mut(&mut self, band: usize, level: usize) -> ArrayViewMut2<'_, T> {
        let shape = self.bank.shape_at(level);
        let values = &mut self.coefficients[self.bank.ranges()[band].clone()];
        ArrayViewMut2::from_shape((shape[0], shape[1]), values).expect("a band has its level's shape")
    }
}
