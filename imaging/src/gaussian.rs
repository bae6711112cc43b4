//! Gaussian filter of images.

use ndarray::{Array2, ArrayView2, Axis, Zip};
use rayon::prelude::*;

/// Gaussian filter of an image of one channel, axes (y, x): standard deviation `sigma` pixels, truncated at 4 sigma,
/// the image mirrored at its edges. Zero leaves it as it is.
///
/// # Complexity
///
/// Pixels times sigma: one pass along rows and one along columns. Rows are worked on in parallel.
///
/// # Examples
///
/// ```
/// let field = ndarray::Array2::from_elem((4, 5), 3.0_f32);
/// assert!((stereology_imaging::gaussian_filter(field.view(), 1.5)[[0, 0]] - 3.0).abs() < 1e-5);
/// ```
#[must_use]
pub fn gaussian_filter(image: ArrayView2<'_, f32>, sigma: f32) -> Array2<f32> {
    filter(image, sigma)
}

/// [`gaussian_filter`] of every channel of an image of three.
///
/// # Examples
///
/// ```
/// let mut spot = ndarray::Array2::from_elem((9, 9), [0.0_f32; 3]);
/// spot[[4, 4]] = [1.0; 3];
/// let smooth = stereology_imaging::gaussian_filter_rgb(spot.view(), 1.0);
/// let total: f32 = smooth.iter().map(|c| c[0]).sum();
/// assert!((total - 1.0).abs() < 1e-5 && (smooth[[4, 4]][0] - 0.159).abs() < 0.001);
/// ```
#[must_use]
pub fn gaussian_filter_rgb(image: ArrayView2<'_, [f32; 3]>, sigma: f32) -> Array2<[f32; 3]> {
    filter(image, sigma)
}

/// The channels of a pixel.
trait Pixel: Copy + Send + Sync {
    fn scaled(self, weight: f32) -> Self;

    /// Adds `weight` (a + b).
    fn add_pair(&mut self, weight: f32, a: Self, b: Self);

    /// The pixel and its pairs of neighbours, weighted.
    fn convolved(self, kernel: &[f32], pair: impl Fn(usize) -> [Self; 2]) -> Self {
        let mut sum = self.scaled(kernel[0]);
        for (step, &weight) in kernel.iter().enumerate().skip(1) {
            let [a, b] = pair(step);
            sum.add_pair(weight, a, b);
        }
        sum
    }
}

// The order of additions is part of the results: the last bits of a smoothed depth decide ties of the watershed.

impl Pixel for f32 {
    fn scaled(self, weight: f32) -> Self {
        weight * self
    }

    fn add_pair(&mut self, weight: f32, a: Self, b: Self) {
        *self += weight * a;
        *self += weight * b;
    }

    fn convolved(self, kernel: &[f32], pair: impl Fn(usize) -> [Self; 2]) -> Self {
        let sides = kernel.iter().enumerate().skip(1);
        let sum: f32 = sides
            .map(|(step, weight)| {
                let [a, b] = pair(step);
                weight * (a + b)
            })
            .sum();
        kernel[0] * self + sum
    }
}

impl Pixel for [f32; 3] {
    fn scaled(self, weight: f32) -> Self {
        self.map(|v| v * weight)
    }

    fn add_pair(&mut self, weight: f32, a: Self, b: Self) {
        for c in 0..3 {
            self[c] += weight * (a[c] + b[c]);
        }
    }
}

fn filter<P: Pixel>(image: ArrayView2<'_, P>, sigma: f32) -> Array2<P> {
    let Some(kernel) = half_kernel(sigma) else {
        return image.to_owned();
    };
    let (height, width) = image.dim();
    let mut along_rows = image.to_owned();
    along_rows
        .axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let source = image.row(y);
            for (x, out) in row.iter_mut().enumerate() {
                let inside = x + 1 >= kernel.len() && x + kernel.len() <= width;
                *out = source[x].convolved(&kernel, |step| {
                    let pair = if inside {
                        [x - step, x + step]
                    } else {
                        mirrored_pair(x, step, width)
                    };
                    pair.map(|x| source[x])
                });
            }
        });
    let mut out = along_rows.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            row.map_inplace(|p| *p = p.scaled(kernel[0]));
            for (i, &weight) in kernel.iter().enumerate().skip(1) {
                let [up, down] = mirrored_pair(y, i, height);
                Zip::from(&mut row)
                    .and(along_rows.row(up))
                    .and(along_rows.row(down))
                    .for_each(|out, up, down| out.add_pair(weight, *up, *down));
            }
        });
    out
}

/// One half of a Gaussian whose two halves sum to 1: centre first. `None` if it is a point.
#[allow(clippy::cast_possible_truncation, reason = "a few dozen taps: a positive number")]
fn half_kernel(sigma: f32) -> Option<Vec<f32>> {
    if sigma.is_nan() || sigma <= 0.0 {
        return None;
    }
    let reach = (4.0 * sigma).ceil() as usize;
    let half: Vec<f32> = (0..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let total = 2.0 * half.iter().sum::<f32>() - half[0];
    Some(half.into_iter().map(|w| w / total).collect())
}

/// Indices `i - step` and `i + step` of a line of `n`, mirrored at its ends as often as needed.
fn mirrored_pair(i: usize, step: usize, n: usize) -> [usize; 2] {
    let period = 2 * n;
    let mirrored = |k: usize| if k < n { k } else { period - 1 - k };
    let step = step % period;
    [mirrored((i + period - step) % period), mirrored((i + step) % period)]
}

#[cfg(test)]
mod tests {
    use super::{gaussian_filter, gaussian_filter_rgb};
    use ndarray::Array2;
    use proptest::prelude::*;

    /// Σ over the plane tiled by mirrored images, in two dimensions at once.
    fn directly(image: &Array2<f32>, sigma: f32) -> Array2<f64> {
        let sigma = f64::from(sigma);
        let reach = (1..).find(|reach| f64::from(*reach) >= 4.0 * sigma).unwrap_or(0);
        let (height, width) = image.dim();
        let mirrored = |k: isize, n: usize| {
            let k = k.rem_euclid(2 * n as isize) as usize;
            if k < n { k } else { 2 * n - 1 - k }
        };
        Array2::from_shape_fn((height, width), |(y, x)| {
            let (mut sum, mut total) = (0.0, 0.0);
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let weight = (-0.5 * f64::from(dy * dy + dx * dx) / (sigma * sigma)).exp();
                    let at = [
                        mirrored(y as isize + dy as isize, height),
                        mirrored(x as isize + dx as isize, width),
                    ];
                    sum += weight * f64::from(image[at]);
                    total += weight;
                }
            }
            sum / total
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Two passes along lines give the sum over the plane, also where the kernel is longer than the image; channels
        /// do not mix.
        #[test]
        fn two_passes_are_the_sum_over_the_plane(width in 1_usize..12, values in prop::collection::vec(0.0_f32..1.0, 1..90), sigma in 0.3_f32..3.0) {
            let height = values.len() / width;
            prop_assume!(height > 0);
            let image = Array2::from_shape_fn((height, width), |(y, x)| values[y * width + x]);
            let expected = directly(&image, sigma);
            let found = gaussian_filter(image.view(), sigma);
            let colours = gaussian_filter_rgb(image.mapv(|v| [0.0, v, 1.0]).view(), sigma);
            for ((f, c), e) in found.iter().zip(&colours).zip(&expected) {
                prop_assert!((f64::from(*f) - e).abs() < 1e-5, "{f} {e}");
                prop_assert!(c[0] == 0.0 && (c[1] - f).abs() < 1e-6 && (c[2] - 1.0).abs() < 1e-5);
            }
        }
    }

    /// No standard deviation, no filter.
    #[test]
    fn zero_sigma_changes_nothing() {
        let image = Array2::from_shape_fn((3, 4), |(y, x)| (y * 4 + x) as f32);
        assert_eq!(gaussian_filter(image.view(), 0.0), image);
    }
}
