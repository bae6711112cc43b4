//! Smooth filling of the pixels outside a mask, so that the border of the mask adds no step to the bands.

use ndarray::{Array2, ArrayView2};

/// Number of relaxation sweeps at each scale.
const SWEEPS: usize = 12;

/// Replaces the values outside the mask by the solution of the discrete Laplace equation with the values inside as
/// boundary, computed from coarse to fine. Values inside the mask are kept; values outside are never read. `O(N)`.
pub(crate) fn fill_outside(image: &mut Array2<f32>, mask: ArrayView2<'_, bool>) {
    let (height, width) = image.dim();
    if mask.iter().all(|&m| m) {
        return;
    }
    if height == 1 && width == 1 {
        image.fill(0.0);
        return;
    }
    let half = (height.div_ceil(2), width.div_ceil(2));
    let block = |y: usize, x: usize| {
        let rows = 2 * y..(2 * y + 2).min(height);
        rows.flat_map(move |v| (2 * x..(2 * x + 2).min(width)).map(move |u| [v, u]))
            .filter(|&at| mask[at])
    };
    let coarse_mask = Array2::from_shape_fn(half, |(y, x)| block(y, x).next().is_some());
    let mut coarse = Array2::from_shape_fn(half, |(y, x)| {
        block(y, x).map(|at| image[at]).sum::<f32>() / block(y, x).count().max(1) as f32
    });
    fill_outside(&mut coarse, coarse_mask.view());
    let outside: Vec<[usize; 2]> = mask
        .indexed_iter()
        .filter(|(_, m)| !**m)
        .map(|((y, x), _)| [y, x])
        .collect();
    for &[y, x] in &outside {
        image[[y, x]] = coarse[[y / 2, x / 2]];
    }
    for _ in 0..SWEEPS {
        for &[y, x] in &outside {
            let (mut sum, mut count) = (0.0, 0.0);
            let mut add = |at: [usize; 2]| {
                sum += image[at];
                count += 1.0;
            };
            if y > 0 {
                add([y - 1, x]);
            }
            if y + 1 < height {
                add([y + 1, x]);
            }
            if x > 0 {
                add([y, x - 1]);
            }
            if x + 1 < width {
                add([y, x + 1]);
            }
            image[[y, x]] = sum / count;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::fill_outside;
    use ndarray::Array2;

    /// A plane solves the Laplace equation: a hole in a plane is filled with the plane, and the values in the hole are
    /// not read.
    #[test]
    fn a_plane_is_filled_with_itself() {
        let plane = Array2::from_shape_fn((40, 50), |(y, x)| 0.02 * y as f32 - 0.01 * x as f32);
        let mask = Array2::from_shape_fn((40, 50), |(y, x)| (y as f32 - 20.0).hypot(x as f32 - 22.0) > 9.0);
        let mut holed = plane.clone();
        holed.zip_mut_with(&mask, |v, m| {
            if !m {
                *v = f32::NAN;
            }
        });
        fill_outside(&mut holed, mask.view());
        assert!(
            holed.iter().zip(&plane).all(|(a, b)| (a - b).abs() < 0.02),
            "range of the hole is 0.4"
        );
    }
}
