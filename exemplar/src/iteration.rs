//! The intermediate state of the solid after an iteration.

use ndarray::Array4;

use crate::field::Field;

/// The solid after an iteration, as [`synthesize_solid_watched`](crate::synthesize_solid_watched) passes it to its
/// callback.
#[derive(Clone, Copy)]
pub struct Iteration<'a> {
    /// Number of finer levels that follow; 0 at the finest level.
    pub coarser_by: usize,
    /// Number of the iteration at this level, from 1.
    pub number: usize,
    /// Mean energy of a neighbourhood, as in [`LevelReport`](crate::LevelReport).
    pub energy: f64,
    pub(crate) field: &'a Field,
    /// Channels that are not features.
    pub(crate) colours: usize,
}

impl Iteration<'_> {
    /// Values (z, y, x, channel) at this level's size, copied; 0 outside the mask. For phases these are indicators, one
    /// per phase (two phases share that of the second), because phases are assigned at the end.
    #[must_use]
    pub fn values(&self) -> Array4<f32> {
        let [nz, ny, nx] = self.field.size;
        Array4::from_shape_fn((nz, ny, nx, self.colours), |(z, y, x, channel)| {
            let voxel = self.field.index([z, y, x]);
            if self.field.holds(voxel) {
                self.field.values[channel][voxel]
            } else {
                0.0
            }
        })
    }
}
