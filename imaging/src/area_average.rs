//! Reduced images: means over the area of each new pixel.

use ndarray::{Array2, ArrayView2, Axis};

/// The image at `size` (height, width), at most its own: every new pixel is the mean over its area, old pixels at its
/// sides in part.
///
/// # Panics
///
/// If a new side is zero or more than the old one.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # Examples
///
/// ```
/// let ramp = ndarray::Array2::from_shape_fn((2, 6), |(_, x)| [x as f32; 3]);
/// let reduced = stereology_imaging::area_average_rgb(ramp.view(), (1, 4));
/// assert!((reduced[[0, 0]][0] - 1.0 / 3.0).abs() < 1e-6); // pixel 0 and half of pixel 1
/// ```
#[must_use]
pub fn area_average_rgb(image: ArrayView2<'_, [f32; 3]>, size: (usize, usize)) -> Array2<[f32; 3]> {
    let (height, width) = image.dim();
    assert!(
        (1..=height).contains(&size.0) && (1..=width).contains(&size.1),
        "an area average reduces to at least one pixel"
    );
    let (rows, columns) = (overlaps(height, size.0), overlaps(width, size.1));
    let mut narrow = Array2::from_elem((height, size.1), [0.0_f32; 3]);
    for (mut out, row) in narrow.axis_iter_mut(Axis(0)).zip(image.axis_iter(Axis(0))) {
        for (o, parts) in out.iter_mut().zip(&columns) {
            for &(x, weight) in parts {
                (0..3).for_each(|c| o[c] += weight * row[x][c]);
            }
        }
    }
    let mut out = Array2::from_elem(size, [0.0_f32; 3]);
    for (mut row, parts) in out.axis_iter_mut(Axis(0)).zip(&rows) {
        for &(y, weight) in parts {
            row.zip_mut_with(&narrow.row(y), |o, n| (0..3).for_each(|c| o[c] += weight * n[c]));
        }
    }
    out
}

/// For each of `new` equal parts of a line of `old` pixels: the pixels in it and the fraction of the part that each
/// covers.
fn overlaps(old: usize, new: usize) -> Vec<Vec<(usize, f32)>> {
    // In units of 1 / new pixels, so that all limits are whole numbers.
    (0..new)
        .map(|i| {
            let (low, high) = (i * old, (i + 1) * old);
            (low / new..high.div_ceil(new))
                .map(|x| {
                    let covered = high.min((x + 1) * new) - low.max(x * new);
                    (x, covered as f32 / old as f32)
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Means keep the mean of the image, and an image of one colour.
        #[test]
        fn the_mean_stays(values in proptest::collection::vec(0.0..1.0_f32, 30..200), width in 3_usize..10, tenths in 2_usize..10) {
            let image = Array2::from_shape_fn((values.len() / width, width), |(y, x)| [values[y * width + x], 1.0, 0.5]);
            let side = |n: usize| (n * tenths / 10).max(1);
            let (height, width) = image.dim();
            let reduced = area_average_rgb(image.view(), (side(height), side(width)));
            let mean = |i: &Array2<[f32; 3]>| i.iter().map(|p| f64::from(p[0])).sum::<f64>() / i.len() as f64;
            prop_assert!((mean(&image) - mean(&reduced)).abs() < 1e-5);
            prop_assert!(reduced.iter().all(|p| (p[1] - 1.0).abs() < 1e-5 && (p[2] - 0.5).abs() < 1e-5));
        }
    }
}
