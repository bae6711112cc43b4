//! Square neighbourhoods and their distances.

use crate::level::{LANES, Level};

/// Shape of a neighbourhood: the pixels that count and their layout.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// Pixels per side, odd.
    pub(crate) side: usize,
    /// Pixels to each side of the centre.
    pub(crate) half: usize,
    /// Samples of a row, padded.
    pub(crate) row: usize,
    /// Channels.
    pub(crate) channels: usize,
    /// 1 where a pixel counts, 0 elsewhere: `side` rows of `row` samples.
    pub(crate) weights: Vec<f32>,
}

impl Window {
    /// A window of `side` pixels; with `causal` only the rows before the central one, and the pixels before the centre
    /// in its own row, count.
    pub(crate) fn new(side: usize, channels: usize, causal: bool) -> Self {
        let half = side / 2;
        let row = side.div_ceil(LANES) * LANES;
        let mut weights = vec![0.0; side * row];
        for y in 0..side {
            for x in 0..side {
                if !causal || y < half || (y == half && x < half) {
                    weights[y * row + x] = 1.0;
                }
            }
        }
        Self {
            side,
            half,
            row,
            channels,
            weights,
        }
    }

    /// Samples of a window in the padded layout.
    pub(crate) fn len(&self) -> usize {
        self.channels * self.side * self.row
    }

    /// Pixels that count.
    pub(crate) fn count(&self) -> f32 {
        self.weights.iter().sum()
    }

    /// Sum, over channels and the pixels that count, of squared differences between a window of the solid and that
    /// about `place`; a number of at least `bound` if the sum reaches it.
    #[inline]
    pub(crate) fn distance(&self, level: &Level, place: usize, window: &[f32], weights: &[f32], bound: f32) -> f32 {
        if self.row == LANES {
            self.distance_of::<1>(level, place, window, weights, bound)
        } else {
            self.distance_of::<2>(level, place, window, weights, bound)
        }
    }

    #[inline]
    fn distance_of<const CHUNKS: usize>(
        &self,
        level: &Level,
        place: usize,
        window: &[f32],
        weights: &[f32],
        bound: f32,
    ) -> f32 {
        let top = place - self.half * level.width - self.half;
        let (weights, _) = weights.as_chunks::<LANES>();
        let mut sums = [0.0_f32; LANES];
        for (channel, window) in window.chunks_exact(self.side * CHUNKS * LANES).enumerate() {
            let (window, _) = window.as_chunks::<LANES>();
            let mut from = channel * level.stride + top;
            let rows = window.chunks_exact(CHUNKS).zip(weights.chunks_exact(CHUNKS));
            for (y, (row, weights)) in rows.enumerate() {
                let (theirs, _) = level.values[from..from + CHUNKS * LANES].as_chunks::<LANES>();
                for ((a, b), w) in row.iter().zip(theirs).zip(weights) {
                    for lane in 0..LANES {
                        let d = a[lane] - b[lane];
                        sums[lane] += d * d * w[lane];
                    }
                }
                if y % 2 == 1 && total(&sums) >= bound {
                    return f32::INFINITY;
                }
                from += level.width;
            }
        }
        total(&sums)
    }

    /// Copies the window of the exemplars about `place`.
    pub(crate) fn copy(&self, level: &Level, place: usize, into: &mut [f32]) {
        let top = place - self.half * level.width - self.half;
        for (i, row) in into.chunks_exact_mut(self.row).enumerate() {
            let from = i / self.side * level.stride + top + i % self.side * level.width;
            row.copy_from_slice(&level.values[from..from + self.row]);
        }
    }
}

#[inline]
fn total(sums: &[f32; LANES]) -> f32 {
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}

/// Weighted sum of squared differences; `a` and `b` contain one channel after the other.
#[inline]
pub(crate) fn weighted_distance(a: &[f32], b: &[f32], weights: &[f32]) -> f32 {
    let mut sums = [0.0_f32; LANES];
    let ((a, _), (b, _), (weights, _)) = (
        a.as_chunks::<LANES>(),
        b.as_chunks::<LANES>(),
        weights.as_chunks::<LANES>(),
    );
    for ((a, b), w) in a.iter().zip(b).zip(weights.iter().cycle()) {
        for lane in 0..LANES {
            let d = a[lane] - b[lane];
            sums[lane] += d * d * w[lane];
        }
    }
    sums.iter().sum()
}
