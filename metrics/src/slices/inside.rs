//! Slices of a volume that fills only a part of its box: the parts of them that can be measured.

use std::ops::Range;

use ndarray::{ArrayView2, ArrayView3, ArrayView4, Axis};

use super::family::{Family, sections};

/// The largest rectangle of pixels (rows, columns) that lies wholly inside a mask, by its shorter side and then its
/// area; `None` if no pixel is inside. Of equal rectangles the first is returned. Cost: linear in the pixels.
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::largest_rectangle;
///
/// let disc = Array2::from_shape_fn((41, 41), |(y, x)| (y as f64 - 20.0).hypot(x as f64 - 20.0) < 20.0);
/// let (rows, columns) = largest_rectangle(disc.view()).unwrap();
/// assert_eq!((rows.len(), columns.len()), (29, 29)); // the square in the circle: 20 √2 and one
/// ```
#[must_use]
pub fn largest_rectangle(mask: ArrayView2<'_, bool>) -> Option<(Range<usize>, Range<usize>)> {
    let (_, width) = mask.dim();
    // Pixels inside above each pixel of a row, itself included.
    let mut heights = vec![0_usize; width];
    let mut most = (0, 0);
    let mut best = None;
    for (y, row) in mask.rows().into_iter().enumerate() {
        for (height, &inside) in heights.iter_mut().zip(row) {
            *height = if inside { *height + 1 } else { 0 };
        }
        // Columns of increasing height; a lower column ends the rectangles of the higher ones before it.
        let mut open: Vec<(usize, usize)> = Vec::new();
        for x in 0..=width {
            let height = heights.get(x).copied().unwrap_or(0);
            let mut from = x;
            while let Some(&(start, tall)) = open.last().filter(|(_, tall)| *tall >= height) {
                open.pop();
                from = start;
                let worth = (tall.min(x - start), tall * (x - start));
                if worth > most {
                    (most, best) = (worth, Some((y + 1 - tall..y + 1, start..x)));
                }
            }
            open.push((from, height));
        }
    }
    best
}

/// The slices of one family, each cut to the [`largest_rectangle`] inside a mask (z, y, x) of the volume's size, so
/// that a solid that fills a mesh is measured without the empty space around it.
///
/// Slices whose rectangle has a shorter side under `least` pixels, or under half of the family's greatest, are left
/// out. Empty if the mask and the volume have different sizes.
///
/// # Examples
///
/// ```
/// use ndarray::{Array3, Array4};
/// use stereology_metrics::{Family, sections_inside};
///
/// let square = |i: usize| (i as f64 - 20.0).powi(2);
/// let ball = Array3::from_shape_fn((41, 41, 41), |(z, y, x)| square(z) + square(y) + square(x) < 400.0);
/// let stone = Array4::from_shape_fn((41, 41, 41, 1), |(z, y, x, _)| if ball[[z, y, x]] { 0.5 } else { 0.0 });
/// let slices = sections_inside(stone.view(), ball.view(), Family::Xz, 8);
/// assert_eq!(slices.len(), 35);
/// assert!(slices.iter().all(|slice| slice.iter().all(|v| *v == 0.5)));
/// ```
#[must_use]
pub fn sections_inside<'a>(
    volume: ArrayView4<'a, f32>,
    mask: ArrayView3<'_, bool>,
    family: Family,
    least: usize,
) -> Vec<ArrayView3<'a, f32>> {
    let (nz, ny, nx, _) = volume.dim();
    if mask.dim() != (nz, ny, nx) {
        return Vec::new();
    }
    let cut: Vec<(ArrayView3<'a, f32>, usize)> = sections(volume, family)
        .into_iter()
        .zip(mask.axis_iter(family.normal()))
        .filter_map(|(slice, inside)| {
            let (rows, columns) = largest_rectangle(inside)?;
            let side = rows.len().min(columns.len());
            let slice = slice.slice_axis_move(Axis(0), rows.into());
            Some((slice.slice_axis_move(Axis(1), columns.into()), side))
        })
        .collect();
    let most = cut.iter().map(|(_, side)| *side).max().unwrap_or(0);
    cut.into_iter()
        .filter(|(_, side)| *side >= least && 2 * side >= most)
        .map(|(slice, _)| slice)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::largest_rectangle;
    use ndarray::Array2;
    use proptest::prelude::*;

    proptest! {
        /// As large as the largest of all rectangles, tried one by one.
        #[test]
        fn no_rectangle_is_larger(bits in prop::collection::vec(prop::bool::weighted(0.8), 42)) {
            let mask = Array2::from_shape_vec((6, 7), bits).unwrap();
            let mut most = None;
            for (top, left) in (0..6).flat_map(|y| (0..7).map(move |x| (y, x))) {
                for (bottom, right) in (top + 1..=6).flat_map(|y| (left + 1..=7).map(move |x| (y, x))) {
                    let whole = (top..bottom).all(|y| (left..right).all(|x| mask[[y, x]]));
                    let (h, w) = (bottom - top, right - left);
                    most = most.max(whole.then_some((h.min(w), h * w)));
                }
            }
            let found = largest_rectangle(mask.view());
            if let Some((rows, columns)) = &found {
                prop_assert!(rows.clone().all(|y| columns.clone().all(|x| mask[[y, x]])));
            }
            prop_assert_eq!(found.map(|(r, c)| (r.len().min(c.len()), r.len() * c.len())), most);
        }
    }
}
