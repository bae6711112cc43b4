//! How a comparison is made.

use std::fmt;

use ndarray::{Array2, ArrayView2};

/// How to compare. The threshold has no default, since it depends on the images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureOptions {
    /// Grey level above which a pixel belongs to the bright phase, such as Otsu's threshold of the exemplar.
    pub threshold: f32,
    /// Patches drawn from each side.
    pub patches: usize,
    /// Directions of the sliced Wasserstein distance.
    pub projections: usize,
    /// Seed of the random patches and directions.
    pub seed: u64,
}

impl MeasureOptions {
    /// 16,384 patches, 128 directions, seed 0.
    #[must_use]
    pub fn new(threshold: f32) -> Self {
        Self {
            threshold,
            patches: 16_384,
            projections: 128,
            seed: 0,
        }
    }

    /// With another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With `patches` patches from each side.
    #[must_use]
    pub fn with_patches(self, patches: usize) -> Self {
        Self { patches, ..self }
    }
}

/// A filter of grey images.
pub type FringeFilter<'a> = dyn Fn(ArrayView2<'_, f32>) -> Result<Array2<f64>, String> + Sync + 'a;

/// The band of frequencies in which fringes are followed.
#[derive(Clone, Copy)]
pub struct FringeBand<'a> {
    /// Distance between neighbouring fringes, pixels.
    pub period: f64,
    /// Direction along the fringes, degrees from the columns' axis, if the band has one.
    pub direction: Option<f64>,
    /// Filters an image to the band, to values about zero; a failure is described in words.
    pub filter: &'a FringeFilter<'a>,
}

impl fmt::Debug for FringeBand<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FringeBand")
            .field("period", &self.period)
            .field("direction", &self.direction)
            .finish_non_exhaustive()
    }
}
