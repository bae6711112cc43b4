//! The particle at each point of a row: the chords of the particles that the row meets divide it into runs.

use crate::cells::Cells;
use crate::images::{Image, NONE};
use crate::narrow::number;
use crate::row::Row;
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use stereology_shape::{Chords, UnitBody};

/// The particles met by rows at one z and neighbouring y.
#[derive(Debug)]
pub(crate) struct Strip<'a> {
    cells: &'a Cells,
    bodies: &'a [UnitBody],
    sections: Vec<Section>,
}

/// A particle's image cut by the plane of the rows.
#[derive(Debug)]
struct Section {
    image: Image,
    /// Squared radius of the circle in which its bounding ball meets the plane.
    circle: f64,
    /// Chords of the lines along x, relative to the image's centre.
    chords: Chords,
}

/// Consecutive points of a row in the same particle, or in none.
#[derive(Clone, Copy, Debug)]
struct Run {
    end: u32,
    id: u32,
}

/// A row divided into runs.
#[derive(Debug)]
pub(crate) struct Runs {
    points: u32,
    runs: Vec<Run>,
    spans: Vec<(Range<u32>, u32)>,
    ids: Vec<u32>,
}

impl Cells {
    /// The particles met by the rows at `z` and y from `ys[0]` to `ys[1]`.
    pub(crate) fn strip<'a>(&'a self, bodies: &'a [UnitBody], z: f64, ys: [f64; 2]) -> Strip<'a> {
        let circle = |image: &Image| image.outer_squared - (z - image.centre.z).powi(2);
        let beside = |image: &Image| (ys[0] - image.centre.y).max(image.centre.y - ys[1]).max(0.0);
        let near = self.images().near(z).iter();
        let mut met: Vec<&Image> = near.filter(|image| beside(image).powi(2) < circle(image)).collect();
        // So that runs are found nearly in order.
        met.sort_unstable_by(|a, b| a.centre.x.total_cmp(&b.centre.x));
        let section = |image: &Image| {
            let (shape, to_local) = self.placed(image.particle);
            let [along, across, up] = [0, 1, 2].map(|k| to_local.column(k).into_owned());
            let middle = Point3::from((z - image.centre.z) * up);
            Section {
                image: *image,
                circle: circle(image),
                chords: bodies[shape].chords(&middle, &across, &along),
            }
        };
        let sections = met.into_iter().map(section).collect();
        Strip {
            cells: self,
            bodies,
            sections,
        }
    }
}

impl Strip<'_> {
    /// Divides one of its rows into runs: the results of [`Cells::particle_at`] for all points, at the cost of one
    /// chord per particle.
    pub(crate) fn cut(&self, row: &Row, runs: &mut Runs) {
        runs.spans.clear();
        for section in &self.sections {
            let beside = row.y - section.image.centre.y;
            if beside * beside < section.circle {
                self.cut_out(section, row, runs);
            }
        }
        runs.join();
    }

    /// The points of the row in one section.
    fn cut_out(&self, section: &Section, row: &Row, runs: &mut Runs) {
        let Image { centre, particle, .. } = section.image;
        let chord = section.chords.at(row.y - centre.y);
        let at = |ends: [f64; 2]| [centre.x + ends[0], centre.x + ends[1]];
        let [possible, sure] = row.between(at(chord.possible), at(chord.sure), runs.points);
        if sure == possible {
            runs.add(sure, particle);
            return;
        }
        let inside = |i: &u32| {
            let offset = Vector3::new(row.x(*i), row.y, row.z) - centre.coords;
            offset.norm_squared() < section.image.outer_squared && self.cells.holds(self.bodies, particle, &offset)
        };
        let (before, after) = (possible.start..sure.start, sure.end..possible.end);
        before.filter(inside).for_each(|i| runs.add(i..i + 1, particle));
        runs.add(sure, particle);
        after.filter(inside).for_each(|i| runs.add(i..i + 1, particle));
    }
}

impl Runs {
    /// For rows of this many points.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            points: number(points),
            runs: Vec::new(),
            spans: Vec::new(),
            ids: Vec::new(),
        }
    }

    /// The runs in order, and the particle of each.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Range<usize>, Option<usize>)> {
        let mut from = 0;
        self.runs.iter().map(move |run| {
            let points = from..run.end as usize;
            from = points.end;
            (points, (run.id != NONE).then_some(run.id as usize))
        })
    }

    /// Inserts a span in order, nearly always at the end, or extends the span that it continues.
    fn add(&mut self, points: Range<u32>, id: u32) {
        if points.is_empty() {
            return;
        }
        let before = self.spans.iter().rposition(|(other, _)| other.start <= points.start);
        match before.map(|i| &mut self.spans[i]) {
            Some((last, same)) if *same == id && last.end == points.start => last.end = points.end,
            _ => self.spans.insert(before.map_or(0, |i| i + 1), (points, id)),
        }
    }

    /// Converts the spans to runs.
    fn join(&mut self) {
        self.runs.clear();
        let mut end = 0;
        for (points, id) in &self.spans {
            if points.start < end {
                return self.join_overlapping();
            }
            if points.start > end {
                self.runs.push(Run {
                    end: points.start,
                    id: NONE,
                });
            }
            end = points.end;
            self.runs.push(Run { end, id: *id });
        }
        if end < self.points {
            self.runs.push(Run {
                end: self.points,
                id: NONE,
            });
        }
    }

    /// Point by point: where particles overlap, the lowest index is visible.
    fn join_overlapping(&mut self) {
        self.ids.clear();
        self.ids.resize(self.points as usize, NONE);
        for (points, id) in &self.spans {
            self.ids[points.start as usize..points.end as usize]
                .iter_mut()
                .for_each(|seen| *seen = (*seen).min(*id));
        }
        self.runs.clear();
        let mut end = 0;
        for same in self.ids.chunk_by(|a, b| a == b) {
            end += number(same.len());
            self.runs.push(Run { end, id: same[0] });
        }
    }
}
