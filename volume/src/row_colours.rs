//! The colours of the points of a row.

use crate::colour::fill_plain;
use crate::narrow::number;
use crate::residual::Field;
use crate::residual_row::{Details, Places, SPARE_POINTS};
use crate::row::Row;
use crate::solid::Solid;
use crate::strip::Runs;

/// Buffers for the colours of a row.
#[derive(Debug)]
pub(crate) struct RowColours {
    details: [Details; 2],
    colours: Vec<f32>,
}

impl RowColours {
    /// For rows of this many points.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            details: Default::default(),
            colours: vec![0.0; 3 * (points + SPARE_POINTS)],
        }
    }
}

impl Solid {
    /// The positions of the points of a row in the residuals of binder and particles, the same for all rows with the
    /// same step and shift.
    pub(crate) fn places_along(&self, row: &Row, points: usize) -> Option<[Places; 2]> {
        let places = |field: &Field| field.places((0..number(points)).map(|i| row.x(i)), self.lookup());
        self.fields().map(|fields| fields.map(places))
    }

    /// The colours of the points of a row whose runs and places are known, three channels each: the same bits as
    /// [`Self::colour_at`] of each point.
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
