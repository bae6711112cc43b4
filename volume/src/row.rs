//! Points on a line along x, such as voxel centres.

use crate::narrow::whole_u32;
use std::ops::Range;

/// Distance from the end of a chord, in steps, within which points are tested one by one: far more than rounding.
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

    /// The x of a point. The index has 32 bits because their conversion is fast.
    pub(crate) fn x(&self, i: u32) -> f64 {
        (f64::from(i) + 0.5) * self.step + self.shift
    }

    /// The range of the first `n` points whose x is between the two `possible` ones, and the range in it that is
    /// certainly between the two `sure` ones; either may be empty.
    pub(crate) fn between(&self, possible: [f64; 2], sure: [f64; 2], n: u32) -> [Range<u32>; 2] {
        // Number of points before x: one more than the whole number below.
        let before = |x: f64, slack: f64| whole_u32((x - self.shift) * self.per_step + (0.5 + slack)).min(n);
        let (from, end) = (before(possible[0], -SLACK), before(possible[1], SLACK));
        let end = end.max(from);
        let first = before(sure[0], SLACK).clamp(from, end);
        let last = before(sure[1], -SLACK).clamp(first, end);
        [from..end, first..last]
    }
}
