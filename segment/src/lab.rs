//! CIE L\*a\*b\*: differences of colour as the eye sees them.

use image::RgbImage;
use ndarray::{Array2, Axis};
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
