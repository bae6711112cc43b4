//! The solid while it is made, for those who want to watch.

use ndarray::Array4;

use crate::field::Field;

/// The solid as it stands after an iteration: what [`synthesize_solid_watched`](crate::synthesize_solid_watched) shows.
#[derive(Clone, Copy)]
pub struct Iteration<'a> {
    /// How many levels are still to come; 0 at the finest.
    pub coarser_by: usize,
    /// Number of the iteration at this level, from 1.
    pub number: usize,
    /// Mean energy of a neighbourhood, as in [`LevelReport`](crate::LevelReport).
    pub energy: f64,
    pub(crate) field: &'a Field,
    /// Channels that are no features.
    pub(crate) colours: usize,
}

impl Iteration<'_> {
    /// Values (z, y, x, channel) at this level's size, copied; 0 outside the mask. Of phases these are indicators, one a phase (two
    /// phases share the second's), because phases are settled at the end.
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
