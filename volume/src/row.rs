//! Points on a line along x, as voxels lie: what is the same for all of them is worked out once.

#![allow(
    clippy::cast_possible_truncation,
    reason = "numbers of points, held between 0 and all"
)]

use crate::Solid;
use crate::cells::NONE;
use crate::colour::{Lanes, lanes};
use crate::residual::{Field, Places};

/// The points ((i + ½) step + shift, y, z) of the box, i = 0, 1, ...
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) y: f64,
    pub(crate) z: f64,
    step: f64,
    per_step: f64,
    shift: f64,
}

impl Row {
    pub(crate) fn new([y, z]: [f64; 2], step: f64, shift: f64) -> Self {
        Self {
            y,
            z,
            step,
            per_step: step.recip(),
            shift,
        }
    }

    pub(crate) fn x(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.step + self.shift
    }

    /// How many of the first `n` points lie at or before `x`.
    pub(crate) fn count_to(&self, x: f64, n: usize) -> usize {
        // To rounding; the points themselves decide.
        let mut count = (((x - self.shift) * self.per_step + 0.5) as usize).min(n);
        while count < n && self.x(count) <= x {
            count += 1;
        }
        while count > 0 && self.x(count - 1) > x {
            count -= 1;
        }
        count
    }
}

/// Index of a particle from the number that stands for it in a row of ids.
pub(crate) fn index(id: u32) -> Option<usize> {
    (id != NONE).then_some(id as usize)
}

impl Solid {
    /// Where the points of a row lie in the residuals of binder and particles: the same for all rows of one step and shift.
    pub(crate) fn places_along(&self, row: &Row, points: usize) -> Option<[Places; 2]> {
        let places = |field: &Field| field.places((0..points).map(|i| row.x(i)), self.lookup());
        self.fields().map(|fields| fields.map(places))
    }

    /// Adds to `sums` the colour at each point of a row whose ids and places are known: the same bits as at the points one by one.
    pub(crate) fn add_colours_along(&self, row: &Row, ids: &[u32], places: Option<&[Places; 2]>, sums: &mut [Lanes]) {
        let ready = self.fields().zip(places).map(|(fields, places)| {
            [0, 1].map(|part| fields[part].row([row.y, row.z], self.lookup()).ready_at(&places[part]))
        });
        let mut from = 0;
        for run in ids.chunk_by(|a, b| a == b) {
            let points = from..from + run.len();
            from = points.end;
            let id = index(run[0]);
            let mean = lanes(self.mean_colour(id));
            let sums = &mut sums[points.clone()];
            match &ready {
                None => sums.iter_mut().for_each(|sum| *sum += mean),
                Some(parts) => {
                    let details = parts[usize::from(id.is_some())].values(points);
                    for (sum, detail) in sums.iter_mut().zip(details) {
                        *sum += mean + detail;
                    }
                }
            }
        }
    }
}
