//! Orientation and coherence of a texture at each pixel, by the structure tensor.

use ndarray::{Array2, Axis, Zip};
use std::f64::consts::PI;

/// Half the side of the square over which the structure tensor is averaged.
const REACH: usize = 3;

/// Direction and coherence of a texture at each pixel, without the border of 3 pixels.
///
/// # Formula
///
/// ```text
/// J = mean over 7 × 7 of g gᵀ                             g: Sobel's gradient (x, y)
/// angle = ½ atan2(2 Jxy, Jxx − Jyy) + π/2   (mod π)       along the texture, across the gradient; y runs down
/// coherence = √((Jxx − Jyy)² + 4 Jxy²) / (Jxx + Jyy)      1: one direction; 0: none
/// ```
///
/// # References
///
/// Urs et al. 2012, section 3.2, after Bigun et al. 1991.
#[derive(Clone, Debug, PartialEq)]
pub struct OrientationField {
    /// Direction of the texture, 0 to π from the columns' axis; NaN where the image is flat.
    pub angle: Array2<f64>,
    /// 0 to 1; NaN where the image is flat.
    pub coherence: Array2<f64>,
}

/// The directions of an image's texture; empty if the image is less than 7 pixels high or wide.
///
/// # Examples
///
/// A plane wave has one direction:
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::orientation_field;
///
/// let wave = Array2::from_shape_fn((40, 40), |(_, x)| (x as f32 * 0.7).sin());
/// let field = orientation_field(&wave);
/// assert_eq!(field.histogram(36)[18], 1.0); // 90 degrees: up and down
/// assert!((field.mean_coherence() - 1.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn orientation_field(image: &Array2<f32>) -> OrientationField {
    let (height, width) = image.dim();
    if height <= 2 * REACH || width <= 2 * REACH {
        let none = Array2::zeros((0, 0));
        return OrientationField {
            angle: none.clone(),
            coherence: none,
        };
    }
    let at = |y: usize, x: usize, dy: isize, dx: isize| {
        // The image is continued beyond its border by its border pixels.
        let place = |p: usize, d: isize, n: usize| p.saturating_add_signed(d).min(n - 1);
        f64::from(image[[place(y, dy, height), place(x, dx, width)]])
    };
    let gradient = Array2::from_shape_fn((height, width), |(y, x)| {
        let v = |dy, dx| at(y, x, dy, dx);
        let gx = v(-1, 1) + 2.0 * v(0, 1) + v(1, 1) - v(-1, -1) - 2.0 * v(0, -1) - v(1, -1);
        let gy = v(1, -1) + 2.0 * v(1, 0) + v(1, 1) - v(-1, -1) - 2.0 * v(-1, 0) - v(-1, 1);
        [gx, gy]
    });
    let smooth = |product: &dyn Fn(&[f64; 2]) -> f64| box_sums(&gradient.map(product));
    let (xx, xy, yy) = (
        smooth(&|g| g[0] * g[0]),
        smooth(&|g| g[0] * g[1]),
        smooth(&|g| g[1] * g[1]),
    );
    let mut angle = Array2::from_elem(xx.dim(), f64::NAN);
    let mut coherence = angle.clone();
    Zip::from(&mut angle)
        .and(&mut coherence)
        .and(&xx)
        .and(&xy)
        .and(&yy)
        .for_each(|angle, coherence, &xx, &xy, &yy| {
            // Rounding in the sums leaves about 1e-16 where the image is flat.
            if xx + yy > 1e-9 {
                *angle = (0.5 * (2.0 * xy).atan2(xx - yy) + PI / 2.0).rem_euclid(PI);
                *coherence = ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt() / (xx + yy);
            }
        });
    OrientationField { angle, coherence }
}

impl OrientationField {
    /// Fractions of directions in `bins` equal bins; the first is centred at 0, so that a wave along an axis lies in
    /// the middle of a bin. Flat pixels do not count.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to bins")]
    pub fn histogram(&self, bins: usize) -> Vec<f64> {
        let mut counts = vec![0_u64; bins.max(1)];
        for angle in self.angle.iter().filter(|angle| !angle.is_nan()) {
            counts[(angle / PI * bins as f64).round() as usize % bins.max(1)] += 1;
        }
        let total = counts.iter().sum::<u64>().max(1) as f64;
        counts.iter().map(|&n| n as f64 / total).collect()
    }

    /// Mean coherence of the pixels that are not flat; 0 if all are.
    #[must_use]
    pub fn mean_coherence(&self) -> f64 {
        let of = || self.coherence.iter().filter(|c| !c.is_nan());
        of().sum::<f64>() / of().count().max(1) as f64
    }
}

/// Sums over the squares of 2 `REACH` + 1 pixels that lie inside.
fn box_sums(field: &Array2<f64>) -> Array2<f64> {
    let along = |field: &Array2<f64>, axis: Axis| {
        let n = field.len_of(axis) - 2 * REACH;
        let mut sums = field.slice_axis(axis, (0..n).into()).to_owned();
        for shift in 1..=2 * REACH {
            sums += &field.slice_axis(axis, (shift..shift + n).into());
        }
        sums
    };
    along(&along(field, Axis(0)), Axis(1))
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "values of a test")]
mod tests {
    use super::orientation_field;
    use ndarray::Array2;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// A plane wave fills the bin of its direction, with coherence 1, up to rounding and the small anisotropy of
        /// Sobel's filter.
        #[test]
        fn a_plane_wave_fills_one_bin(degrees in 0.0_f64..180.0, period in 8.0_f64..16.0) {
            let angle = degrees.to_radians();
            // Along the texture: (cos, sin); across it: (-sin, cos).
            let wave = Array2::from_shape_fn((64, 64), |(y, x)| {
                let phase = (-(x as f64) * angle.sin() + y as f64 * angle.cos()) / period;
                (phase * std::f64::consts::TAU).sin() as f32
            });
            let field = orientation_field(&wave);
            // At the border Sobel's filter meets the flat continuation of the image.
            let inner = |(y, x): (usize, usize)| (2..56).contains(&y) && (2..56).contains(&x);
            for ((y, x), found) in field.angle.indexed_iter().filter(|(at, _)| inner(*at)) {
                prop_assert!(field.coherence[[y, x]] > 0.999);
                let apart = (found.to_degrees() - degrees).rem_euclid(180.0);
                prop_assert!(apart.min(180.0 - apart) < 1.0, "{} {degrees}", found.to_degrees());
            }
        }
    }

    /// Flat images have no direction, not that of rounding.
    #[test]
    fn flat_images_have_no_direction() {
        let field = orientation_field(&Array2::from_elem((20, 20), 0.3));
        assert!(field.angle.iter().all(|a| a.is_nan()));
        assert_eq!(
            (field.mean_coherence(), field.histogram(36).iter().sum::<f64>()),
            (0.0, 0.0)
        );
        assert!(orientation_field(&Array2::zeros((6, 20))).angle.is_empty());
    }
}
