//! CIE L\*a\*b\*: differences of colour as the eye sees them.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

use crate::srgb::linear;

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
/// let [l, a, b] = stereology_imaging::lab([1.0, 1.0, 1.0]);
/// assert!((l - 100.0).abs() < 0.01 && a.abs() < 0.01 && b.abs() < 0.01);
/// ```
#[must_use]
pub fn lab(srgb: [f32; 3]) -> [f32; 3] {
    lab_of_lightness(relative_xyz(srgb.map(linear)).map(lightness))
}

/// [`lab`] of every pixel of an image of sRGB-encoded values / 255, axes (y, x).
///
/// # Accuracy
///
/// Both power laws are tabulated: L\*, a\* and b\* differ from those of [`lab`] by less than 0.005.
///
/// # Examples
///
/// ```
/// let black = ndarray::Array2::from_elem((1, 2), [0.0; 3]);
/// assert!(stereology_imaging::lab_image(black.view())[[0, 0]][0].abs() < 1e-4);
/// ```
#[must_use]
pub fn lab_image(srgb: ArrayView2<'_, [f32; 3]>) -> Array2<[f32; 3]> {
    let (decode, lightness) = (Table::new(linear, 4096), Table::new(lightness, 16_384));
    let mut out = srgb.to_owned();
    out.axis_iter_mut(Axis(0)).into_par_iter().for_each(|mut row| {
        for p in &mut row {
            *p = lab_of_lightness(relative_xyz(p.map(|v| decode.at(v))).map(|t| lightness.at(t)));
        }
    });
    out
}

/// X, Y, Z of linear light over those of white.
fn relative_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / WHITE[0],
        (0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b) / WHITE[1],
        (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / WHITE[2],
    ]
}

/// f(t) of the formula.
fn lightness(t: f32) -> f32 {
    if t > 216.0 / 24389.0 {
        t.cbrt()
    } else {
        t * (841.0 / 108.0) + 4.0 / 29.0
    }
}

fn lab_of_lightness([fx, fy, fz]: [f32; 3]) -> [f32; 3] {
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// A function from 0 to 1, tabulated.
struct Table(Vec<f32>);

impl Table {
    fn new(f: impl Fn(f32) -> f32, cells: u16) -> Self {
        Self((0..=cells).map(|i| f(f32::from(i) / f32::from(cells))).collect())
    }

    /// Linear between the table's points.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "between 0 and the number of cells")]
    fn at(&self, v: f32) -> f32 {
        let cells = self.0.len() - 1;
        let at = v.clamp(0.0, 1.0) * cells as f32;
        let i = (at as usize).min(cells - 1);
        self.0[i] + (at - i as f32) * (self.0[i + 1] - self.0[i])
    }
}

#[cfg(test)]
mod tests {
    use super::{lab, lab_image};
    use ndarray::Array2;

    /// The tables differ from the formula by less than the eye can see.
    #[test]
    fn tables_agree_with_the_formula() {
        let colours = Array2::from_shape_fn((64, 64), |(y, x)| {
            [x as f32 / 63.0, y as f32 / 63.0, ((x * 5 + y * 3) % 64) as f32 / 63.0]
        });
        for (found, encoded) in lab_image(colours.view()).iter().zip(&colours) {
            for (f, wanted) in found.iter().zip(lab(*encoded)) {
                assert!((f - wanted).abs() < 0.005, "{encoded:?}: {f} {wanted}");
            }
        }
    }

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
