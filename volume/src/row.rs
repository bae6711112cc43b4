//! Points on a line along x, as voxels lie: what is the same for all of them is worked out once.

use crate::Solid;
use crate::cells::NONE;
use crate::colour::add;

/// The points ((i + ½) step + shift, y, z) of the box, i = 0, 1, ...
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) y: f64,
    pub(crate) z: f64,
    pub(crate) step: f64,
    pub(crate) shift: f64,
}

impl Row {
    pub(crate) fn x(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.step + self.shift
    }

    /// How many of the first `n` points lie at or before `x`.
    pub(crate) fn count_to(&self, x: f64, n: usize) -> usize {
        let (mut low, mut high) = (0, n);
        while low < high {
            let middle = low.midpoint(high);
            if self.x(middle) <= x {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// Index of a particle from the number that stands for it in a row of ids.
pub(crate) fn index(id: u32) -> Option<usize> {
    (id != NONE).then_some(id as usize)
}

impl Solid {
    /// Adds to `sums` the colour at each point of a row whose ids are known: the same bits as at the points one by one.
    pub(crate) fn add_colours_along(&self, row: &Row, ids: &[u32], sums: &mut [[f32; 3]]) {
        let fields = self.residual_along(row, ids.len());
        for (i, (sum, &id)) in sums.iter_mut().zip(ids).enumerate() {
            let id = index(id);
            let mean = self.mean_colour(id);
            let colour = match &fields {
                None => mean,
                Some(fields) => add(mean, fields[usize::from(id.is_some())].at(row.x(i))),
            };
            *sum = add(*sum, colour);
        }
    }
}
