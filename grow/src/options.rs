//! How a solid is grown.

use crate::error::GrowError;
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
    /// Bytes that growing may need; larger solids are refused.
    pub memory_limit: u64,
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
            memory_limit: 4 << 30,
        }
    }
}

impl GrowOptions {
    /// Whether a box of `size` (nz, ny, nx) with `channels` values per voxel can be grown within
    /// [`memory_limit`](Self::memory_limit), if `inside` of its voxels are inside the mesh.
    ///
    /// # Errors
    ///
    /// [`GrowError::Memory`].
    pub fn check_memory(&self, size: [usize; 3], inside: usize, channels: usize) -> Result<(), GrowError> {
        let voxels = size.iter().fold(1_u64, |all, &n| all.saturating_mul(n as u64));
        // The values and their stored form, labels, sources and the mask; the order in which voxels are filled.
        // Measured: 55 bytes of a voxel with three channels, all inside.
        let bytes = voxels
            .saturating_mul(16 + 5 * channels as u64)
            .saturating_add(24 * inside as u64);
        if bytes <= self.memory_limit {
            return Ok(());
        }
        let limit = self.memory_limit;
        Err(GrowError::Memory { size, bytes, limit })
    }

    /// With another limit of memory, in bytes.
    #[must_use]
    pub fn with_memory_limit(self, bytes: u64) -> Self {
        Self {
            memory_limit: bytes,
            ..self
        }
    }

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
