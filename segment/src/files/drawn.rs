//! Outlines from files of other tools, and what of such a file is no outline.

use std::collections::BTreeMap;

use ndarray::Array2;
use stereology_metrics::Finding;

use crate::labels::outline::{Outline, Ring, fill_outlines};
use crate::labels::profile::distinct;

/// Pixels by which an outline may extend beyond the photo without being clipped: rounding of tools.
const BEYOND: f64 = 2.0;
/// Corners that approximate an ellipse.
const ELLIPSE: usize = 256;

/// What a file of outlines holds.
#[derive(Debug, Default)]
pub(crate) struct Drawing {
    pub(crate) outlines: Vec<Outline>,
    /// Numbers of what has no area, by what it is.
    left_out: BTreeMap<&'static str, usize>,
    pub(crate) findings: Vec<Finding>,
}

impl Drawing {
    /// Outlines with their numbers, if these are distinct and at least 1 in all, else numbered from 1.
    pub(crate) fn numbered(found: Vec<(Option<u32>, Vec<Vec<Ring>>)>) -> Self {
        let mut given: Vec<u32> = found.iter().filter_map(|f| f.0).filter(|id| *id > 0).collect();
        given.sort_unstable();
        given.dedup();
        let keep = given.len() == found.len();
        let outlines = (1..).zip(found).map(|(n, (id, components))| Outline {
            id: id.filter(|_| keep).unwrap_or(n),
            components,
        });
        Self {
            outlines: outlines.collect(),
            ..Self::default()
        }
    }

    /// Counts something without an area.
    pub(crate) fn leave_out(&mut self, what: &'static str) {
        *self.left_out.entry(what).or_default() += 1;
    }

    pub(crate) fn with_left_out(mut self, left_out: &[&'static str]) -> Self {
        left_out.iter().for_each(|what| self.leave_out(what));
        self
    }

    /// The label map of a photo of (height, width) pixels, with findings on what was clipped, covered or left out.
    ///
    /// # Errors
    ///
    /// There is no outline, or more than a quarter of them lie outside the photo.
    pub(crate) fn filled(mut self, (height, width): (usize, usize)) -> Result<(Array2<u32>, Vec<Finding>), String> {
        let what: Vec<String> = self.left_out.iter().map(|(what, n)| format!("{n} {what}")).collect();
        if self.outlines.is_empty() {
            let instead = if what.is_empty() {
                String::new()
            } else {
                format!(", but {}", what.join(", "))
            };
            return Err(format!(
                "it has no outline with an area{instead}; export polygons or masks"
            ));
        }
        let bounds = |outline: &Outline| {
            let corners = outline.components.iter().flatten().flatten();
            corners.fold(
                [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY],
                |b, c| [b[0].min(c[0]), b[1].min(c[1]), b[2].max(c[0]), b[3].max(c[1])],
            )
        };
        let (w, h) = (width as f64, height as f64);
        let (mut outside, mut clipped, mut first) = (0_usize, 0_usize, None);
        for [left, top, right, bottom] in self.outlines.iter().map(bounds) {
            if left >= w || top >= h || right <= 0.0 || bottom <= 0.0 {
                outside += 1;
            } else if left < -BEYOND || top < -BEYOND || right > w + BEYOND || bottom > h + BEYOND {
                clipped += 1;
            } else {
                continue;
            }
            first.get_or_insert(format!("from x = {left}, y = {top} to x = {right}, y = {bottom}"));
        }
        let first = first.unwrap_or_default();
        if 4 * outside > self.outlines.len() {
            return Err(format!(
                "{outside} of {} outlines lie outside the photo of {width}x{height} pixels (the first {first}); export outlines in pixels of this photo, not rotated, cropped or in map units",
                self.outlines.len()
            ));
        }
        if clipped > 0 {
            self.findings.push(Finding::new(
                "clipped-outlines",
                format!("{clipped} outlines extend beyond the photo of {width}x{height} pixels (the first {first}) and were clipped at its edges"),
            ));
        }
        let (labels, overlap) = fill_outlines(&self.outlines, (height, width));
        if overlap > 0 {
            self.findings.push(Finding::new(
                "overlapping-labels",
                format!("{overlap} pixels lie in more than one outline; they were assigned to the smaller one"),
            ));
        }
        let lost = self.outlines.len() - distinct(&labels).len();
        let mut reasons = what;
        if lost > 0 {
            reasons.push(format!(
                "{lost} without a pixel centre of their own (slivers, outside, or covered by others)"
            ));
        }
        if !reasons.is_empty() {
            let total = self.outlines.len() + self.left_out.values().sum::<usize>();
            self.findings.push(Finding::new(
                "lost-labels",
                format!(
                    "of {total} regions of the label file were left out: {}",
                    reasons.join(", ")
                ),
            ));
        }
        Ok((labels, self.findings))
    }
}

/// The ring of an ellipse with its centre and semi-axes, turned by an angle in radians.
pub(crate) fn ellipse([x, y]: [f64; 2], [a, b]: [f64; 2], turn: f64) -> Ring {
    let (sin, cos) = turn.sin_cos();
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / ELLIPSE as f64;
        let (u, v) = (a * angle.cos(), b * angle.sin());
        [x + u * cos - v * sin, y + u * sin + v * cos]
    };
    (0..ELLIPSE).map(corner).collect()
}

/// The ring of a rectangle from its corner and sides.
pub(crate) fn rectangle([x, y]: [f64; 2], [w, h]: [f64; 2]) -> Ring {
    vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
}

/// A ring without the corner that closes it.
pub(crate) fn opened(mut ring: Ring) -> Ring {
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    ring
}
