//! CIE L\*a\*b\* and smoothing: differences of colour as the eye sees them.

use image::RgbImage;
use ndarray::{Array2, Axis, Zip};
use rayon::prelude::*;

/// White of the D65 illuminant, CIE XYZ.
const WHITE: [f32; 3] = [0.950_47, 1.0, 1.088_83];

/// CIE L\*a\*b\* (D65) of a colour of sRGB-encoded values / 255.
///
/// # Formula
///
/// ```text
/// L* = 116 f(Y/Yn) − 16,  a* = 500 (f(X/Xn) − f(Y/Yn)),  b* = 200 (f(Y/Yn) − f(Z/Zn)),  f(t) = ∛t, linear below (6/29)³
/// ```
///
/// # References
///
/// CIE 15:2004; IEC 61966-2-1 (sRGB).
///
/// # Examples
///
/// ```
/// let [l, a, b] = stereology_segment::lab([1.0, 1.0, 1.0]);
/// assert!((l - 100.0).abs() < 0.01 && a.abs() < 0.01 && b.abs() < 0.01);
/// ```
#[must_use]
pub fn lab(srgb: [f32; 3]) -> [f32; 3] {
    lab_of_linear(srgb.map(linear))
}

fn linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

fn lab_of_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    let x = 0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
    let z = 0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b;
    let f = |t: f32| {
        if t > 216.0 / 24389.0 {
            t.cbrt()
        } else {
            t * (841.0 / 108.0) + 4.0 / 29.0
        }
    };
    let [fx, fy, fz] = [f(x / WHITE[0]), f(y / WHITE[1]), f(z / WHITE[2])];
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// Values of every pixel / 255, axes (y, x).
///
/// # Examples
///
/// ```
/// let photo = image::RgbImage::from_pixel(2, 1, image::Rgb([0, 51, 255]));
/// assert_eq!(stereology_segment::encoded_image(&photo)[[0, 1]], [0.0, 0.2, 1.0]);
/// ```
#[must_use]
pub fn encoded_image(photo: &RgbImage) -> Array2<[f32; 3]> {
    let (width, height) = (photo.width() as usize, photo.height() as usize);
    let mut pixels = photo.pixels();
    Array2::from_shape_simple_fn((height, width), || {
        pixels.next().map_or([0.0; 3], |p| p.0.map(|v| f32::from(v) / 255.0))
    })
}

/// [`lab`] of every pixel of a picture of encoded values / 255, axes (y, x).
///
/// # Examples
///
/// ```
/// let black = ndarray::Array2::from_elem((1, 2), [0.0; 3]);
/// assert!(stereology_segment::lab_image(&black)[[0, 0]][0].abs() < 1e-4);
/// ```
#[must_use]
pub fn lab_image(encoded: &Array2<[f32; 3]>) -> Array2<[f32; 3]> {
    // A table of the power law, read between its entries: off by less than 1e-5.
    let table: Vec<f32> = (0..=4096).map(|i| linear(i as f32 / 4096.0)).collect();
    let decoded = |v: f32| {
        let at = v.clamp(0.0, 1.0) * 4096.0;
        let i = (at as usize).min(4095);
        table[i] + (at - i as f32) * (table[i + 1] - table[i])
    };
    let mut out = encoded.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .for_each(|mut row| row.iter_mut().for_each(|p| *p = lab_of_linear(p.map(decoded))));
    out
}

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

/// One half of a Gaussian whose both halves sum to 1: centre first. `None` if it is a point.
pub(crate) fn gaussian(sigma: f32) -> Option<Vec<f32>> {
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
pub(crate) fn mirror(i: usize, step: isize, n: usize) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the colour calculators of B. Lindbloom.
    #[test]
    fn known_colours() {
        for (srgb, expected) in [
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
            ([0.5, 0.5, 0.5], [53.39, 0.0, 0.0]),
        ] {
            for (found, wanted) in lab(srgb).iter().zip(expected) {
                assert!((found - wanted).abs() < 0.03, "{srgb:?}: {found} {wanted}");
            }
        }
    }
}
