//! Outlines at half contrast: where a blurred edge really is.

use std::collections::VecDeque;

use ndarray::{Array2, Zip};

use crate::{
    regions::{connected_pieces, neighbours4},
    watershed::distance_transform,
};

/// Depth, in pixels, beyond which blur no longer mixes the binder into a particle's colour.
const CORE_DEPTH: f32 = 3.0;
/// The same in standard deviations of the blur.
const CLEAR_OF_BLUR: f32 = 2.2;
/// The same for small regions, as a share of the greatest depth within three pixels.
const CORE_SHARE: f32 = 0.9;
/// Pixels that an outline may move out in one call.
const REACH: u8 = 2;
/// 1 / (2 √(2π)): what a unit of curvature times blur takes from half the contrast.
const HALF_EDGE: f32 = 0.5 * 0.199_471_1;
/// Most that curvature may take away: beyond, the first order is no guide.
const MOST_CURVED: f32 = 0.12;

/// For each pixel of a mask and of a rim around it, the colour of the particle core it belongs to.
///
/// A core pixel lies at least three pixels deep, or in the deeper part of a small region; other pixels take the nearest core's colour, averaged over the core pixels two around. Pixels beyond the rim, `reach`
/// pixels out of the mask, get `None`.
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
    cores(deviation, mask, reach, CORE_DEPTH).mapv(|core| core.map(|(colour, _)| colour))
}

/// [`core_colours`], with the greatest depth in the core's piece of the mask.
fn cores(
    deviation: &Array2<[f32; 3]>,
    mask: &Array2<bool>,
    reach: u8,
    core_depth: f32,
) -> Array2<Option<([f32; 3], f32)>> {
    let dim = mask.dim();
    let depth = distance_transform(mask);
    let (pieces, count) = connected_pieces(mask, |m| m);
    let mut largest = vec![0.0_f32; count as usize + 1];
    for (&piece, &d) in pieces.iter().zip(&depth) {
        let l = &mut largest[piece as usize];
        *l = l.max(d);
    }
    let square = |[y, x]: [usize; 2], radius: usize| {
        let columns = x.saturating_sub(radius)..(x + radius + 1).min(dim.1);
        (y.saturating_sub(radius)..(y + radius + 1).min(dim.0)).flat_map(move |j| columns.clone().map(move |i| [j, i]))
    };
    let mut core = Array2::from_elem(dim, false);
    let mut places = Vec::new();
    for ((y, x), &d) in depth.indexed_iter() {
        let deepest_around = || {
            square([y, x], core_depth as usize)
                .map(|q| depth[q])
                .fold(0.0, f32::max)
        };
        if mask[[y, x]] && (d >= core_depth || d >= CORE_SHARE * deepest_around()) {
            core[[y, x]] = true;
            places.push([y, x]);
        }
    }
    let mut out = Array2::from_elem(dim, None);
    let mut queue = VecDeque::new();
    for p in places {
        let mut sum = [0.0_f32; 4];
        for q in square(p, 2).filter(|q| core[*q]) {
            let d = deviation[q];
            (0..3).for_each(|c| sum[c] += d[c]);
            sum[3] += 1.0;
        }
        let colour = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]];
        out[p] = Some((colour, largest[pieces[p] as usize]));
        // Only cores at the border of their region have anything to pass on.
        if neighbours4(p, dim).any(|q| !core[q]) {
            queue.push_back((p, 0_u8));
        }
    }
    while let Some((p, outside)) = queue.pop_front() {
        let colour = out[p];
        for q in neighbours4(p, dim) {
            let steps = if mask[q] { 0 } else { outside + 1 };
            if out[q].is_none() && steps <= reach {
                out[q] = colour;
                queue.push_back((q, steps));
            }
        }
    }
    out
}

/// Mask of the pixels that stand beyond half the step from the binder to their particle's core. The outline of a mask found by a threshold follows the threshold, and a low one, needed to find pale particles,
/// makes every particle too large; at half the step a symmetric blur leaves a straight edge where it was.
///
/// # Formula
///
/// ```text
/// keep p  ⇔  (p − b)·(c − b) ≥ (½ − s / (2 R √(2π))) |c − b|²        b binder, c core; differences scaled by the binder's scatter
/// ```
///
/// The edge of a disc of radius R is blurred below a half: to first order by s / (2 R √(2π)), s the standard deviation of the blur. R is that of the largest disc inside the region.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// // A blurred edge at x = 10, a mask that reaches one pixel too far out.
/// let ramp = Array2::from_shape_fn((8, 24), |(_, x)| [20.0 / (1.0 + (-(x as f32 - 9.5)).exp()), 0.0, 0.0]);
/// let mask = Array2::from_shape_fn((8, 24), |(_, x)| x >= 9);
/// let refined = stereology_segment::half_contrast(&ramp, &mask, 0.0);
/// assert!(refined.indexed_iter().all(|((_, x), &m)| m == (x >= 10)));
/// ```
#[must_use]
pub fn half_contrast(deviation: &Array2<[f32; 3]>, mask: &Array2<bool>, blur: f32) -> Array2<bool> {
    let mut out = Array2::from_elem(mask.dim(), false);
    Zip::from(&mut out)
        .and(&cores(deviation, mask, REACH, CORE_DEPTH.max(CLEAR_OF_BLUR * blur)))
        .and(deviation)
        .for_each(|keep, core, d| {
            let Some((c, radius)) = core else { return };
            let (along, step) = (
                d[0] * c[0] + d[1] * c[1] + d[2] * c[2],
                c[0] * c[0] + c[1] * c[1] + c[2] * c[2],
            );
            let curvature = HALF_EDGE * blur / radius.max(1.0);
            *keep = along >= (0.5 - curvature.min(MOST_CURVED)) * step;
        });
    out
}
