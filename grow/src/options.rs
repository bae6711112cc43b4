//! How a solid is grown.

use crate::planes::Planes;
use crate::search::Search;

/// How a solid is grown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowOptions {
    /// Side of the window that is compared, pixels: 0 (colours of the exemplar's histogram, without texture), or odd, 3
    /// to 15.
    pub window: usize,
    /// Random seeds in addition to the measurements.
    pub seeds: usize,
    /// Planes in which windows lie.
    pub planes: Planes,
    /// How similar windows are searched for.
    pub search: Search,
    /// One of the windows whose distance is at most 1 + this number times the least distance is chosen at random.
    pub tolerance: f32,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for GrowOptions {
    /// Windows of 5 × 5 in the planes of the axes, tolerance .1, no random seeds.
    fn default() -> Self {
        Self {
            window: 5,
            seeds: 0,
            planes: Planes::Axis,
            search: Search::default(),
            tolerance: 0.1,
            seed: 0,
        }
    }
}

impl GrowOptions {
    /// With another window.
    #[must_use]
    pub fn with_window(self, window: usize) -> Self {
        Self { window, ..self }
    }

    /// With `seeds` random seeds.
    #[must_use]
    pub fn with_seeds(self, seeds: usize) -> Self {
        Self { seeds, ..self }
    }

    /// With other planes.
    #[must_use]
    pub fn with_planes(self, planes: Planes) -> Self {
        Self { planes, ..self }
    }

    /// With another search.
    #[must_use]
    pub fn with_search(self, search: Search) -> Self {
        Self { search, ..self }
    }

    /// With another seed of the random numbers.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }
}
