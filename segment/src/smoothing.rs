//! Gaussian smoothing of pictures and fields.

use ndarray::{Array2, Axis, Zip};
use rayon::prelude::*;

/// Gaussian smoothing of standard deviation `sigma` pixels, truncated at 4 sigma, the picture mirrored at its edges. Zero leaves it as it is.
///
/// # Complexity
///
/// Pixels times sigma.
///
/// # Examples
///
/// ```
/// let mut spot = ndarray::Array2::from_elem((9, 9), [0.0_f32; 3]);
/// spot[[4, 4]] = [1.0; 3];
/// let smooth = stereology_segment::smooth(&spot, 1.0);
/// let total: f32 = smooth.iter().map(|c| c[0]).sum();
/// assert!((total - 1.0).abs() < 1e-5 && (smooth[[4, 4]][0] - 0.159).abs() < 0.001);
/// ```
#[must_use]
pub fn smooth(picture: &Array2<[f32; 3]>, sigma: f32) -> Array2<[f32; 3]> {
    let Some(kernel) = gaussian(sigma) else {
        return picture.clone();
    };
    let (height, width) = picture.dim();
    let mut across = picture.clone();
    across
        .axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let source = picture.row(y);
            let at = |x: usize| source[x];
            for (x, out) in row.iter_mut().enumerate() {
                *out = convolve(&kernel, x, width, at);
            }
        });
    let mut out = picture.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let [centre, sides @ ..] = kernel.as_slice() else {
                return;
            };
            Zip::from(&mut row)
                .and(across.row(y))
                .for_each(|o, c| *o = c.map(|v| v * centre));
            for (i, weight) in sides.iter().enumerate() {
                let (up, down) = (mirror(y, -(i as isize) - 1, height), mirror(y, i as isize + 1, height));
                Zip::from(&mut row)
                    .and(across.row(up))
                    .and(across.row(down))
                    .for_each(|o, u, d| {
                        for c in 0..3 {
                            o[c] += weight * (u[c] + d[c]);
                        }
                    });
            }
        });
    out
}

/// Gaussian smoothing of a field, mirrored at the edges. Zero sigma leaves it as it is.
///
/// # Examples
///
/// ```
/// let field = ndarray::Array2::from_elem((4, 5), 3.0_f32);
/// assert!((stereology_segment::smooth_field(&field, 1.5)[[0, 0]] - 3.0).abs() < 1e-5);
/// ```
#[must_use]
pub fn smooth_field(field: &Array2<f32>, sigma: f32) -> Array2<f32> {
    let Some(kernel) = gaussian(sigma) else {
        return field.clone();
    };
    let (height, width) = field.dim();
    let mut across = field.clone();
    across
        .axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let source = field.row(y);
            for (x, out) in row.iter_mut().enumerate() {
                let sides = kernel.iter().enumerate().skip(1);
                let sum: f32 = sides
                    .map(|(i, w)| w * (source[mirror(x, -(i as isize), width)] + source[mirror(x, i as isize, width)]))
                    .sum();
                *out = kernel[0] * source[x] + sum;
            }
        });
    let mut out = field.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            row.assign(&across.row(y));
            row *= kernel[0];
            for (i, w) in kernel.iter().enumerate().skip(1) {
                row.scaled_add(*w, &across.row(mirror(y, -(i as isize), height)));
                row.scaled_add(*w, &across.row(mirror(y, i as isize, height)));
            }
        });
    out
}

/// One half of a Gaussian whose both halves sum to 1: centre first. `None` if it is a point.
fn gaussian(sigma: f32) -> Option<Vec<f32>> {
    if sigma.is_nan() || sigma <= 0.0 {
        return None;
    }
    // A few dozen taps at most.
    let reach = (4.0 * sigma).ceil() as usize;
    let half: Vec<f32> = (0..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let total = 2.0 * half.iter().sum::<f32>() - half[0];
    Some(half.into_iter().map(|w| w / total).collect())
}

/// Index `i + step` of a line of `n`, mirrored at its ends as often as needed.
fn mirror(i: usize, step: isize, n: usize) -> usize {
    let n = n as isize;
    let k = (i as isize + step).rem_euclid(2 * n);
    (if k < n { k } else { 2 * n - 1 - k }).unsigned_abs()
}

fn convolve(kernel: &[f32], x: usize, width: usize, at: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
    let mut sum = at(x).map(|v| v * kernel[0]);
    let inside = x + 1 >= kernel.len() && x + kernel.len() <= width;
    for (i, weight) in kernel.iter().enumerate().skip(1) {
        let (l, r) = if inside {
            (x - i, x + i)
        } else {
            (mirror(x, -(i as isize), width), mirror(x, i as isize, width))
        };
        let (l, r) = (at(l), at(r));
        for c in 0..3 {
            sum[c] += weight * (l[c] + r[c]);
        }
    }
    sum
}
