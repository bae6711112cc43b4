//! Cores of regions: the pixels deep enough inside a particle to show its unmixed colour.

use std::collections::VecDeque;

use ndarray::Array2;
use stereology_imaging::{connected_components, distance_transform};

use crate::conversions::{index, whole_part};

/// Depth, in pixels, beyond which blur no longer mixes the binder into a particle's colour.
pub(crate) const CORE_DEPTH: f32 = 3.0;
/// The same for small regions, as a fraction of the greatest depth within three pixels.
const CORE_SHARE: f32 = 0.9;
/// The colour of a core pixel is the mean over the core pixels up to this far in each direction.
const AROUND: usize = 2;
/// No core.
const NONE: u32 = u32::MAX;

/// For each pixel of a mask and of a rim around it, the colour of the particle core it belongs to.
///
/// A core pixel lies at least three pixels deep, or in the deeper part of a small region. Its colour is the mean over
/// the core pixels up to two pixels around it; other pixels take the colour of the nearest core pixel. Pixels more than
/// `reach` pixels outside the mask get `None`.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
///
/// let deviation = Array2::from_shape_fn((20, 20), |(_, x)| [x as f32, 0.0, 0.0]);
/// let mask = Array2::from_shape_fn((20, 20), |(_, x)| x >= 10);
/// let cores = stereology_segment::core_colours(&deviation, &mask, 1);
/// assert_eq!(cores[[10, 10]], cores[[10, 12]]); // three pixels deep is pixel 12
/// assert!(cores[[10, 9]].is_some() && cores[[10, 8]].is_none());
/// ```
#[must_use]
pub fn core_colours(deviation: &Array2<[f32; 3]>, mask: &Array2<bool>, reach: u8) -> Array2<Option<[f32; 3]>> {
    let cores = Cores::new(deviation, mask, reach, CORE_DEPTH);
    Array2::from_shape_fn(mask.dim(), |p| cores.of(p).map(|(colour, _)| colour))
}

/// The core of every pixel.
pub(crate) struct Cores {
    /// The core pixel that each pixel belongs to, or [`NONE`].
    pub(crate) source: Array2<u32>,
    /// Core pixels in reading order: colour, and the greatest depth in their component of the mask.
    pub(crate) known: Vec<([f32; 3], f32)>,
}

impl Cores {
    pub(crate) fn new(deviation: &Array2<[f32; 3]>, mask: &Array2<bool>, reach: u8, core_depth: f32) -> Self {
        let (height, width) = mask.dim();
        let depth = distance_transform(mask.view());
        let (components, count) = connected_components(mask.view(), |m| m);
        let mut largest = vec![0.0_f32; count as usize + 1];
        for (&component, &d) in components.iter().zip(&depth) {
            let l = &mut largest[component as usize];
            *l = l.max(d);
        }
        let mut core = highest_around(&depth, whole_part(f64::from(core_depth)));
        core.zip_mut_with(&depth, |c, &d| {
            *c = f32::from(u8::from(d > 0.0 && (d >= core_depth || d >= CORE_SHARE * *c)));
        });
        let mut source = Array2::from_elem((height, width), NONE);
        let mut known = Vec::new();
        let mut means = RowMeans::new(deviation, &core);
        for y in 0..height {
            means.at_row(y, |x, colour| {
                source[[y, x]] = index(known.len());
                known.push((colour, largest[components[[y, x]] as usize]));
            });
        }
        let mut cores = Self { source, known };
        cores.spread(mask, reach);
        cores
    }

    /// Colour of a pixel's core, and the greatest depth in the core's component of the mask.
    pub(crate) fn of(&self, p: (usize, usize)) -> Option<([f32; 3], f32)> {
        self.known.get(self.source[p] as usize).copied()
    }

    /// Gives every other pixel of the mask and of its rim the nearest core.
    fn spread(&mut self, mask: &Array2<bool>, reach: u8) {
        let (height, width) = mask.dim();
        let mask = mask.as_standard_layout();
        let (Some(mask), Some(source)) = (mask.as_slice(), self.source.as_slice_mut()) else {
            return;
        };
        let pixels = height * width;
        let mut queue = VecDeque::new();
        // Only core pixels at the border of their region have neighbours without a core.
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                let is_open = |inside: bool, q: usize| inside && source[q] == NONE;
                if source[i] != NONE
                    && (is_open(i >= width, i.wrapping_sub(width))
                        || is_open(x > 0, i.wrapping_sub(1))
                        || is_open(x + 1 < width, i + 1)
                        || is_open(i + width < pixels, i + width))
                {
                    queue.push_back((index(i), index(x), 0_u8));
                }
            }
        }
        while let Some((i, x, outside)) = queue.pop_front() {
            let (i, x) = (i as usize, x as usize);
            let from = source[i];
            let mut assign = |inside: bool, q: usize, x: usize| {
                if inside && source[q] == NONE {
                    let steps = if mask[q] { 0 } else { outside + 1 };
                    if steps <= reach {
                        source[q] = from;
                        queue.push_back((index(q), index(x), steps));
                    }
                }
            };
            assign(i >= width, i.wrapping_sub(width), x);
            assign(x > 0, i.wrapping_sub(1), x.wrapping_sub(1));
            assign(x + 1 < width, i + 1, x + 1);
            assign(i + width < pixels, i + width, x);
        }
    }
}

/// The highest value of the square of `radius` around each pixel.
fn highest_around(field: &Array2<f32>, radius: usize) -> Array2<f32> {
    let (height, width) = field.dim();
    let mut across = field.as_standard_layout().into_owned();
    for (mut out, row) in across.outer_iter_mut().zip(field.outer_iter()) {
        let (row, Some(out)) = (row.to_vec(), out.as_slice_mut()) else {
            continue;
        };
        for step in 1..=radius.min(width.saturating_sub(1)) {
            let higher = |(o, v): (&mut f32, &f32)| *o = o.max(*v);
            out[step..].iter_mut().zip(&row).for_each(higher);
            out.iter_mut().zip(&row[step..]).for_each(higher);
        }
    }
    let mut out = across.clone();
    for (y, mut row) in out.outer_iter_mut().enumerate() {
        for j in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            row.zip_mut_with(&across.row(j), |o, v| *o = o.max(*v));
        }
    }
    out
}

/// Channels, and the number of core pixels.
const SUMMED: usize = 4;

/// Means over the core pixels around, row by row: sums along five rows, then down them.
struct RowMeans<'a> {
    deviation: &'a Array2<[f32; 3]>,
    core: &'a Array2<f32>,
    /// Core pixels of one row, zeros elsewhere and at both ends.
    row: Vec<f32>,
    /// Sums along rows, row y in slot y modulo their number.
    sums: Vec<Vec<f32>>,
    /// Sums down the rows.
    total: Vec<f32>,
    /// Rows summed so far.
    next: usize,
}

impl<'a> RowMeans<'a> {
    fn new(deviation: &'a Array2<[f32; 3]>, core: &'a Array2<f32>) -> Self {
        let width = core.dim().1;
        Self {
            deviation,
            core,
            row: vec![0.0; SUMMED * (width + 2 * AROUND)],
            sums: vec![vec![0.0; SUMMED * width]; 2 * AROUND + 1],
            total: vec![0.0; SUMMED * width],
            next: 0,
        }
    }

    /// Calls `put` with the mean at every core pixel of row `y`; rows must be requested in order.
    fn at_row(&mut self, y: usize, mut put: impl FnMut(usize, [f32; 3])) {
        let height = self.core.dim().0;
        let last = (y + AROUND + 1).min(height);
        while self.next < last {
            self.sum_row(self.next);
            self.next += 1;
        }
        let row = self.core.row(y);
        if row.iter().all(|c| *c == 0.0) {
            return;
        }
        let slots = self.sums.len();
        self.total.fill(0.0);
        for j in y.saturating_sub(AROUND)..last {
            let pairs = self.total.iter_mut().zip(&self.sums[j % slots]);
            pairs.for_each(|(t, s)| *t += s);
        }
        for ((x, core), sum) in row.iter().enumerate().zip(self.total.chunks_exact(SUMMED)) {
            if *core > 0.0 {
                put(x, [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]);
            }
        }
    }

    fn sum_row(&mut self, y: usize) {
        let inside = self.row.chunks_exact_mut(SUMMED).skip(AROUND);
        for ((out, core), d) in inside.zip(self.core.row(y)).zip(self.deviation.row(y)) {
            let values = if *core > 0.0 { [d[0], d[1], d[2], 1.0] } else { [0.0; 4] };
            out.copy_from_slice(&values);
        }
        let slots = self.sums.len();
        let sums = &mut self.sums[y % slots];
        sums.fill(0.0);
        for shift in 0..=2 * AROUND {
            let pairs = sums.iter_mut().zip(&self.row[SUMMED * shift..]);
            pairs.for_each(|(s, r)| *s += r);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Core colours are means over the core pixels of a square.
        #[test]
        fn means_of_squares(width in 1_usize..14, inside in proptest::collection::vec(proptest::bool::weighted(0.9), 1..200)) {
            let height = inside.len() / width;
            let mask = Array2::from_shape_fn((height, width), |(y, x)| inside[y * width + x]);
            let deviation = Array2::from_shape_fn(mask.dim(), |(y, x)| [(x * 7 + y * 3) as f32 % 11.0, x as f32, 1.0]);
            let depth = distance_transform(mask.view());
            let square = |y: usize, x: usize, r: usize| {
                (y.saturating_sub(r)..(y + r + 1).min(height)).flat_map(move |j| (x.saturating_sub(r)..(x + r + 1).min(width)).map(move |i| (j, i)))
            };
            let is_core = |(y, x): (usize, usize)| {
                let deepest = square(y, x, 3).map(|q| depth[q]).fold(0.0, f32::max);
                mask[(y, x)] && (depth[(y, x)] >= CORE_DEPTH || depth[(y, x)] >= CORE_SHARE * deepest)
            };
            let found = core_colours(&deviation, &mask, 0);
            for (p, _) in mask.indexed_iter().filter(|(p, _)| is_core(*p)) {
                let around: Vec<[f32; 3]> = square(p.0, p.1, 2).filter(|q| is_core(*q)).map(|q| deviation[q]).collect();
                for c in 0..3 {
                    let mean = around.iter().map(|d| d[c]).sum::<f32>() / around.len() as f32;
                    prop_assert!((found[p].unwrap()[c] - mean).abs() < 1e-4);
                }
            }
            prop_assert!(found.iter().zip(&mask).all(|(f, m)| f.is_none() || *m));
        }
    }
}
