//! Outlines at half contrast: the true position of a blurred edge.

use ndarray::{Array2, Zip};

use crate::outlines::cores::{CORE_DEPTH, Cores};

/// Depth of cores in standard deviations of the blur, where that is more.
const CLEAR_OF_BLUR: f32 = 2.2;
/// Standard deviation of the blur of a sharp photo, pixels.
pub(crate) const SHARP: f32 = 0.8;
/// Pixels that an outline may move out in one call.
const REACH: u8 = 2;
/// 1 / (2 √(2π)): by how much a unit of curvature times blur lowers the contrast at an edge below a half.
const HALF_EDGE: f32 = 0.5 * 0.199_471_1;
/// Largest correction for curvature: beyond it the first order is not valid.
const MOST_CURVED: f32 = 0.12;

/// Mask of the pixels beyond half the step from the binder to their particle's core. The outline of a mask found by a
/// threshold depends on the threshold, and a low one, needed to find pale particles, makes every particle too large. At
/// half the step, a symmetric blur does not move a straight edge.
///
/// # Formula
///
/// ```text
/// keep p  ⇔  (p − b)·(c − b) ≥ (½ − s / (2 R √(2π))) |c − b|²        b binder, c core; differences scaled by the binder's scatter
/// ```
///
/// The edge of a disc of radius R is blurred below a half: to first order by s / (2 R √(2π)), s the standard deviation
/// of the blur. R is that of the largest disc inside the region.
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
    let cores = Cores::new(deviation, mask, REACH, CORE_DEPTH.max(CLEAR_OF_BLUR * blur));
    let mut out = Array2::from_elem(mask.dim(), false);
    Zip::from(&mut out)
        .and(&cores.source)
        .and(deviation)
        .for_each(|keep, core, d| {
            let Some((c, radius)) = cores.known.get(*core as usize) else {
                return;
            };
            let (along, step) = (
                d[0] * c[0] + d[1] * c[1] + d[2] * c[2],
                c[0] * c[0] + c[1] * c[1] + c[2] * c[2],
            );
            let curvature = HALF_EDGE * blur / radius.max(1.0);
            *keep = along >= (0.5 - curvature.min(MOST_CURVED)) * step;
        });
    out
}
