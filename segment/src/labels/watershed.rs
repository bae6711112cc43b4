//! h-maxima of a field and its watershed.

use std::cmp::Reverse;

use ndarray::Array2;
use stereology_imaging::DisjointSets;

use crate::conversions::{index, whole_part};

/// Steps of height that saddles are sorted by.
const STEPS: f32 = 64.0;
/// No pixel.
const NONE: u32 = u32::MAX;

/// The basin of every pixel (the pixels from which steepest ascent leads to one peak), and the saddles between basins.
///
/// Ascents stay near in memory, and only the saddles, a small fraction of the pixels, are sorted. Processing all pixels
/// from the highest down gives the same maxima and was three times slower on large regions.
pub(crate) struct Basins {
    width: usize,
    /// Basin of each pixel, [`NONE`] outside.
    of: Array2<u32>,
    /// Pixel at the peak of each basin, and its height.
    peaks: Vec<(u32, f32)>,
    /// Number of pixels of each basin.
    areas: Vec<usize>,
    /// Highest first: height, and the two basins.
    saddles: Vec<(f32, u32, u32)>,
}

impl Basins {
    /// Basins of the pixels whose part is not 0. Basins of different parts are not neighbours; pixels of one part are
    /// by sides and corners. `given` pixels are peaks whatever is around them.
    pub(crate) fn new(field: &Array2<f32>, parts: &Array2<u32>, given: impl Fn(usize) -> bool) -> Self {
        let (height, width) = field.dim();
        let (field, parts) = (field.as_standard_layout(), parts.as_standard_layout());
        let heights = field.as_slice().unwrap_or_default();
        let parts = parts.as_slice().unwrap_or_default();
        // A total order, so that ascents end: of equal pixels the first is the highest.
        let above = |a: usize, b: usize| heights[a] > heights[b] || (heights[a] >= heights[b] && a < b);
        let mut up = vec![NONE; heights.len()];
        for y in 0..height {
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            for x in 0..width {
                let i = y * width + x;
                if parts[i] == 0 {
                    continue;
                }
                let mut best = i;
                if !given(i) {
                    let (left, right) = (x.saturating_sub(1), (x + 2).min(width));
                    for row in rows.clone() {
                        for q in row * width + left..row * width + right {
                            if parts[q] == parts[i] && above(q, best) {
                                best = q;
                            }
                        }
                    }
                }
                up[i] = index(best);
            }
        }
        let mut peaks = Vec::new();
        let mut of = vec![NONE; heights.len()];
        let mut path = Vec::new();
        for start in 0..heights.len() {
            let mut i = start;
            if up[i] == NONE {
                continue;
            }
            while of[i] == NONE && up[i] as usize != i {
                path.push(i);
                i = up[i] as usize;
            }
            if of[i] == NONE {
                of[i] = index(peaks.len());
                peaks.push((index(i), heights[i]));
            }
            let basin = of[i];
            path.drain(..).for_each(|p| of[p] = basin);
        }
        let mut areas = vec![0_usize; peaks.len()];
        of.iter().filter(|o| **o != NONE).for_each(|&o| areas[o as usize] += 1);
        let mut saddles = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                let here = of[i];
                if here == NONE {
                    continue;
                }
                let mut meet = |q: usize| {
                    let there = of[q];
                    if there != here && there != NONE && parts[q] == parts[i] {
                        saddles.push((heights[i].min(heights[q]), here.min(there), here.max(there)));
                    }
                };
                if x + 1 < width {
                    meet(i + 1);
                }
                if y + 1 < height {
                    meet(i + width);
                    if x > 0 {
                        meet(i + width - 1);
                    }
                    if x + 1 < width {
                        meet(i + width + 1);
                    }
                }
            }
        }
        let of = Array2::from_shape_vec((height, width), of).unwrap_or_default();
        Self {
            width,
            of,
            peaks,
            areas,
            saddles: highest_first(&saddles),
        }
    }

    /// Basins whose peak stands at least `h(position, height)` above the saddle to any higher one, by decreasing
    /// height.
    fn h_maxima_of(&self, h: impl Fn([usize; 2], f32) -> f32) -> Vec<u32> {
        let rank = |basin: u32| {
            let (pixel, height) = self.peaks[basin as usize];
            (height, Reverse(pixel))
        };
        let mut sets = DisjointSets::new(index(self.peaks.len()));
        let mut ended = vec![false; self.peaks.len()];
        for &(saddle, a, b) in &self.saddles {
            let (a, b) = (sets.root(a), sets.root(b));
            if a == b {
                continue;
            }
            // The root of a set of joined basins is the highest of them.
            let (high, low) = if rank(a) > rank(b) { (a, b) } else { (b, a) };
            let (pixel, height) = self.peaks[low as usize];
            ended[low as usize] = height - saddle < h(self.place(pixel), height);
            sets.join(high, low);
        }
        let mut maxima: Vec<u32> = (0..index(self.peaks.len())).filter(|&i| !ended[i as usize]).collect();
        maxima.sort_by(|&a, &b| {
            let ((p, height), (q, other)) = (self.peaks[a as usize], self.peaks[b as usize]);
            other.total_cmp(&height).then(p.cmp(&q))
        });
        maxima
    }

    /// Number of each chosen basin, from 1, on its pixels and on those of every other basin that is joined to it by
    /// higher saddles than to the rest; 0 where there is none.
    fn grown(&self, numbers: impl IntoIterator<Item = (u32, u32)>) -> Array2<u32> {
        let named = self.named(numbers);
        self.of.mapv(|basin| named.get(basin as usize).copied().unwrap_or(0))
    }

    /// That number, for each basin.
    fn named(&self, numbers: impl IntoIterator<Item = (u32, u32)>) -> Vec<u32> {
        let mut sets = DisjointSets::new(index(self.peaks.len()));
        let mut label = vec![0_u32; self.peaks.len()];
        numbers.into_iter().for_each(|(basin, n)| label[basin as usize] = n);
        for &(_, a, b) in &self.saddles {
            let (a, b) = (sets.root(a), sets.root(b));
            let [first, second] = [label[a as usize], label[b as usize]];
            if a != b && (first == 0 || second == 0) {
                sets.join(a, b);
                label[a as usize] = first.max(second);
            }
        }
        (0..index(self.peaks.len()))
            .map(|i| label[sets.root(i) as usize])
            .collect()
    }

    /// Labels of the h-maxima, from 1 by decreasing height: each with its own basin and those joined to it.
    pub(crate) fn divided(&self, h: impl Fn([usize; 2], f32) -> f32) -> Array2<u32> {
        self.grown(self.h_maxima_of(h).into_iter().zip(1..))
    }

    /// How many of those labels have at least `least` pixels.
    pub(crate) fn count(&self, h: impl Fn([usize; 2], f32) -> f32, least: usize) -> usize {
        let maxima = self.h_maxima_of(h);
        let mut areas = vec![0_usize; maxima.len() + 1];
        for (number, area) in self.named(maxima.into_iter().zip(1..)).iter().zip(&self.areas) {
            areas[*number as usize] += area;
        }
        areas.iter().skip(1).filter(|a| **a >= least).count()
    }

    fn place(&self, pixel: u32) -> [usize; 2] {
        [pixel as usize / self.width, pixel as usize % self.width]
    }
}

/// Counting sort by height in steps of 1/64, stable.
fn highest_first(saddles: &[(f32, u32, u32)]) -> Vec<(f32, u32, u32)> {
    let step = |s: &(f32, u32, u32)| whole_part(f64::from(s.0.clamp(0.0, 16_000.0) * STEPS));
    let peak = saddles.iter().map(step).max().unwrap_or(0);
    let mut starts = vec![0_usize; peak + 2];
    saddles.iter().for_each(|s| starts[peak - step(s) + 1] += 1);
    (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
    let mut sorted = vec![(0.0, 0, 0); saddles.len()];
    for s in saddles {
        let slot = &mut starts[peak - step(s)];
        sorted[*slot] = *s;
        *slot += 1;
    }
    sorted
}

/// h-maxima of a positive field: maxima that stand at least `h([y, x], height)` above the saddle to any higher one. A
/// number from 1 for each at its peak pixel, in order of decreasing height, 0 elsewhere.
///
/// Every pixel belongs to the basin of the peak to which its highest neighbours (of 8) lead. Basins are joined over
/// their saddles, the highest first; where two meet, the lower peak is no maximum if it stands less than `h` above the
/// saddle. Saddles are compared in steps of 1/64.
///
/// # Complexity
///
/// Nearly linear in pixels.
///
/// # Examples
///
/// ```
/// let field = ndarray::array![[1.0_f32, 3.0, 2.5, 2.8, 1.0, 5.0]];
/// let peaks = stereology_segment::h_maxima(&field, |_, _| 1.0);
/// assert_eq!(peaks, ndarray::array![[0, 2, 0, 0, 0, 1]]);
/// ```
#[must_use]
pub fn h_maxima(field: &Array2<f32>, h: impl Fn([usize; 2], f32) -> f32) -> Array2<u32> {
    let basins = Basins::new(field, &field.mapv(|v| u32::from(v > 0.0)), |_| false);
    let mut out = Array2::zeros(field.dim());
    for (number, basin) in (1..).zip(basins.h_maxima_of(h)) {
        out[basins.place(basins.peaks[basin as usize].0)] = number;
    }
    out
}

/// Watershed: every pixel of `mask` gets the marker to which the highest path leads. Paths go from pixel to pixel by
/// sides and corners, and a path is as high as its lowest pixel. Parts of the mask without a marker stay 0.
///
/// The border between markers runs where steepest ascents part; basins without a marker join the neighbour across their
/// highest saddle, where saddles within 1/64 count as equal (Cousty et al. 2009). Flooding by a priority queue (Meyer
/// 1994) gives the same up to single pixels of the borders and basins whose saddles count as equal, in n log n.
///
/// # Complexity
///
/// Nearly linear in pixels.
///
/// # References
///
/// Meyer 1994; Cousty, Bertrand, Najman & Couprie 2009.
///
/// # Examples
///
/// ```
/// use ndarray::{Array2, array};
/// let field = array![[3.0_f32, 2.0, 1.0, 2.0, 3.0, 0.0]];
/// let labels = stereology_segment::watershed(&field, &array![[1, 0, 0, 0, 2, 0]], &field.mapv(|v| v > 0.0));
/// assert_eq!(labels, array![[1, 1, 1, 2, 2, 0]]);
/// ```
#[must_use]
pub fn watershed(field: &Array2<f32>, markers: &Array2<u32>, mask: &Array2<bool>) -> Array2<u32> {
    let markers = markers.as_standard_layout();
    let given = markers.as_slice().unwrap_or_default();
    let basins = Basins::new(field, &mask.mapv(u32::from), |i| given[i] != 0);
    let peaks = (0..).zip(&basins.peaks);
    basins.grown(
        peaks
            .map(|(basin, peak)| (basin, given[peak.0 as usize]))
            .filter(|(_, n)| *n != 0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outlines::regions::neighbours8;
    use proptest::prelude::*;
    use std::collections::BinaryHeap;
    use stereology_imaging::{distance_transform, gaussian_filter};

    /// Pixels from the highest down, joined one by one.
    fn maxima(field: &Array2<f32>, h: f32) -> Array2<u32> {
        let width = field.dim().1;
        let at = |i: u32| [i as usize / width, i as usize % width];
        let height = |i: u32| field[at(i)];
        let mut order: Vec<u32> = (0..index(field.len())).filter(|&i| height(i) > 0.0).collect();
        order.sort_by(|&a, &b| height(b).total_cmp(&height(a)).then(a.cmp(&b)));
        let mut sets = DisjointSets::new(index(field.len()));
        let mut reached = vec![false; field.len()];
        let mut ended = vec![false; field.len()];
        for &i in &order {
            reached[i as usize] = true;
            for q in neighbours8(at(i), field.dim()) {
                let q = index(q[0] * width + q[1]);
                if !reached[q as usize] {
                    continue;
                }
                let (a, b) = (sets.root(q), sets.root(i));
                let (high, low) = if (height(a), Reverse(a)) > (height(b), Reverse(b)) {
                    (a, b)
                } else {
                    (b, a)
                };
                if high != low {
                    ended[low as usize] |= height(low) - height(i) < h;
                    sets.join(high, low);
                }
            }
        }
        let mut out = Array2::zeros(field.dim());
        order.retain(|&i| !ended[i as usize]);
        (1..).zip(order).for_each(|(n, i)| out[at(i)] = n);
        out
    }

    /// Height of the lowest pixel on the highest path from each pixel of the mask to one of the chosen markers, by
    /// flooding with a priority queue; 0 where there is none.
    fn highest_paths(
        field: &Array2<f32>,
        markers: &Array2<u32>,
        mask: &Array2<bool>,
        chosen: impl Fn(u32) -> bool,
    ) -> Array2<f32> {
        let mut paths = Array2::zeros(field.dim());
        let mut heap: BinaryHeap<(u32, [usize; 2])> = markers
            .indexed_iter()
            .filter(|(_, marker)| **marker != 0 && chosen(**marker))
            .map(|((y, x), _)| (field[[y, x]].to_bits(), [y, x]))
            .collect();
        while let Some((level, p)) = heap.pop() {
            if paths[p] > 0.0 {
                continue;
            }
            paths[p] = f32::from_bits(level);
            for q in neighbours8(p, field.dim()) {
                if mask[q] && paths[q] == 0.0 {
                    heap.push((field[q].to_bits().min(level), q));
                }
            }
        }
        paths
    }

    /// Smoothed distances from the outside of a few discs.
    fn discs(places: &[(usize, usize, usize)]) -> Array2<f32> {
        let mask = Array2::from_shape_fn((40, 50), |(y, x)| {
            places
                .iter()
                .any(|&(j, i, r)| (y as f64 - j as f64).hypot(x as f64 - i as f64) < r as f64 + 4.0)
        });
        gaussian_filter(distance_transform(mask.view()).mapv(|d| d.min(1e4)).view(), 1.0)
    }

    proptest! {
        /// Joining basins over saddles finds the maxima that joining all pixels finds.
        #[test]
        fn maxima_as_by_pixels(width in 1_usize..12, values in proptest::collection::vec(0_u8..40, 1..140), h in 1_u8..12) {
            let height = values.len() / width;
            // Multiples of the sorting's step.
            let field = Array2::from_shape_fn((height, width), |(y, x)| f32::from(values[y * width + x]) / 64.0);
            let h = f32::from(h) / 64.0;
            prop_assert_eq!(h_maxima(&field, |_, _| h), maxima(&field, h));
        }

        /// No marker has a higher path than the one that a pixel gets, up to the step in which saddles are compared.
        #[test]
        fn watershed_follows_the_highest_path(places in proptest::collection::vec((5_usize..35, 5_usize..45, 2_usize..8), 1..6)) {
            let field = discs(&places);
            let mask = field.mapv(|v| v > 0.2);
            let markers = h_maxima(&field, |_, _| 0.7);
            let labels = watershed(&field, &markers, &mask);
            let highest = highest_paths(&field, &markers, &mask, |_| true);
            for label in 0..=markers.iter().copied().max().unwrap_or(0) {
                let own = highest_paths(&field, &markers, &mask, |marker| marker == label);
                for (p, _) in labels.indexed_iter().filter(|(_, l)| **l == label) {
                    prop_assert!(highest[p] - own[p] <= 1.0 / STEPS, "{p:?} {} {}", highest[p], own[p]);
                    prop_assert_eq!(label == 0, !mask[p] || highest[p] == 0.0);
                }
            }
        }
    }
}
