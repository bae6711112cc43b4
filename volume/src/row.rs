//! Points on a line along x, as voxels lie: what is the same for all of them is worked out once.

#![allow(
    clippy::cast_possible_truncation,
    reason = "numbers of points, held between 0 and all"
)]

use crate::Solid;
use crate::colour::fill_plain;
use crate::residual::Field;
use crate::residual_row::{Details, Places, SPARE_POINTS};
use crate::strip::Runs;
use std::ops::Range;

/// How near to the end of a chord, in steps, a point is asked by itself: far more than rounding.
const SLACK: f64 = 1e-6;

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

    /// The x of a point. Of 32 bits, as larger whole numbers are slow to turn.
    pub(crate) fn x(&self, i: u32) -> f64 {
        (f64::from(i) + 0.5) * self.step + self.shift
    }

    /// Of the first `n` points, those at x between the two `possible` ones, and of them those surely between the two `sure` ones; either may be empty.
    pub(crate) fn between(&self, possible: [f64; 2], sure: [f64; 2], n: u32) -> [Range<u32>; 2] {
        // How many points lie before: one more than the whole number below.
        let before = |x: f64, slack: f64| (((x - self.shift) * self.per_step + (0.5 + slack)) as u32).min(n);
        let (from, end) = (before(possible[0], -SLACK), before(possible[1], SLACK));
        let end = end.max(from);
        let first = before(sure[0], SLACK).clamp(from, end);
        let last = before(sure[1], -SLACK).clamp(first, end);
        [from..end, first..last]
    }
}

/// Where the colours of a row are worked out.
#[derive(Debug)]
pub(crate) struct RowColours {
    details: [Details; 2],
    colours: Vec<f32>,
}

impl RowColours {
    /// For rows of so many points.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            details: Default::default(),
            colours: vec![0.0; 3 * (points + SPARE_POINTS)],
        }
    }
}

impl Solid {
    /// Where the points of a row lie in the residuals of binder and particles: the same for all rows of one step and shift.
    pub(crate) fn places_along(&self, row: &Row, points: usize) -> Option<[Places; 2]> {
        let places = |field: &Field| field.places((0..points as u32).map(|i| row.x(i)), self.lookup());
        self.fields().map(|fields| fields.map(places))
    }

    /// The colours of the points of a row whose runs and places are known, three channels each: the same bits as at the points one by one.
    pub(crate) fn colours_along<'a>(
        &self,
        row: &Row,
        runs: &Runs,
        places: Option<&[Places; 2]>,
        into: &'a mut RowColours,
    ) -> &'a [f32] {
        let RowColours { details, colours } = into;
        match self.fields().zip(places) {
            None => {
                for (points, id) in runs.iter() {
                    fill_plain(self.mean_colour(id), &mut colours[3 * points.start..3 * points.end]);
                }
            }
            Some((fields, places)) => {
                let [of_binder, of_particles] = details;
                let ready = |part: usize, details| {
                    fields[part]
                        .row([row.y, row.z], self.lookup())
                        .detail(&places[part], details)
                };
                let (binder, particles) = (ready(0, of_binder), ready(1, of_particles));
                for (points, id) in runs.iter() {
                    let detail = if id.is_some() { &particles } else { &binder };
                    detail.write(points, self.mean_colour(id), colours);
                }
            }
        }
        &colours[..colours.len() - 3 * SPARE_POINTS]
    }
}
