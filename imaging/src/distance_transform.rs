//! Exact Euclidean distance transforms of images and volumes.

use ndarray::{Array2, Array3, ArrayView2, ArrayView3, Axis, Zip};
use rayon::prelude::*;

/// Euclidean distance of every pixel of a mask, axes (y, x), to the nearest pixel outside it, in pixels; 0 outside. The
/// edge of the image does not count as outside. Infinite if the mask is everything.
///
/// Distances along columns are counted in f32; the rest is exact up to the rounding of the result to f32.
///
/// # Complexity
///
/// Linear in pixels, those of the mask counting most. Rows are worked on in parallel.
///
/// # References
///
/// Felzenszwalb & Huttenlocher 2012.
///
/// # Examples
///
/// ```
/// let mask = ndarray::Array2::from_shape_fn((1, 7), |(_, x)| x > 0);
/// assert_eq!(stereology_imaging::distance_transform(mask.view())[[0, 5]], 5.0);
/// ```
#[must_use]
pub fn distance_transform(mask: ArrayView2<'_, bool>) -> Array2<f32> {
    let (height, width) = mask.dim();
    // Distance along the column, then the lower envelope of parabolas along the row.
    let mut out = Array2::zeros((height, width));
    let mut above = vec![f32::INFINITY; width];
    for (mut row, inside) in out.outer_iter_mut().zip(mask.outer_iter()) {
        for ((d, above), inside) in row.iter_mut().zip(&mut above).zip(inside) {
            *above = if *inside { *above + 1.0 } else { 0.0 };
            *d = *above;
        }
    }
    let mut below = vec![f32::INFINITY; width];
    for mut row in out.outer_iter_mut().rev() {
        for (d, below) in row.iter_mut().zip(&mut below) {
            *below = (*below + 1.0).min(*d);
            *d = *below;
        }
    }
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .for_each_init(Envelope::default, |envelope, mut row| {
            if let Some(row) = row.as_slice_mut() {
                envelope.apply(row, |d| f64::from(*d).powi(2), rounded_root);
            }
        });
    out
}

/// Square of the Euclidean distance of every voxel of a mask, axes (z, y, x), to the nearest voxel outside it, in
/// voxels; 0 outside. The faces of the volume do not count as outside. Infinite if the mask is everything. An image is
/// a volume of one layer.
///
/// Exact: squares of distances are whole numbers.
///
/// # Complexity
///
/// Linear in voxels. Slabs are worked on in parallel.
///
/// # References
///
/// Felzenszwalb & Huttenlocher 2012.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
///
/// let outside_a_corner = Array3::from_shape_fn((4, 5, 6), |p| p != (0, 0, 0));
/// let squares = stereology_imaging::squared_distance_transform(outside_a_corner.view());
/// assert_eq!(squares[[3, 4, 5]], 9.0 + 16.0 + 25.0);
/// ```
#[must_use]
pub fn squared_distance_transform(mask: ArrayView3<'_, bool>) -> Array3<f64> {
    let mut out = mask.mapv(|inside| if inside { f64::INFINITY } else { 0.0 });
    for axis in [2, 1, 0] {
        if out.len_of(Axis(axis)) < 2 {
            continue;
        }
        // Slabs along the longer of the other axes.
        let other = [0, 1, 2].into_iter().filter(|other| *other != axis);
        let slabs = other.max_by_key(|other| out.len_of(Axis(*other))).unwrap_or(0);
        let along = if slabs < axis { axis - 1 } else { axis };
        out.axis_iter_mut(Axis(slabs)).into_par_iter().for_each_init(
            || (Envelope::default(), Vec::new()),
            |(envelope, line), mut slab| {
                for mut lane in slab.lanes_mut(Axis(along)) {
                    line.clear();
                    line.extend(lane.iter().copied());
                    envelope.apply(line, |square| *square, |square| square);
                    lane.iter_mut().zip(&*line).for_each(|(to, from)| *to = *from);
                }
            },
        );
    }
    out
}

/// Euclidean distance of every voxel of a volume of two regions, axes (z, y, x), to the nearest voxel of the other
/// region, in voxels; infinite if there is one region only. An image is a volume of one layer.
///
/// # Complexity
///
/// That of two [`squared_distance_transform`]s.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
///
/// let half = Array3::from_shape_fn((1, 2, 6), |(_, _, x)| x < 3);
/// let distances = stereology_imaging::distance_to_other_region(half.view());
/// assert_eq!(distances.as_slice().unwrap()[..6], [3.0, 2.0, 1.0, 1.0, 2.0, 3.0]);
/// ```
#[must_use]
pub fn distance_to_other_region(region: ArrayView3<'_, bool>) -> Array3<f64> {
    let mut distances = squared_distance_transform(region);
    let outside = squared_distance_transform(region.mapv(|inside| !inside).view());
    // Each voxel is in one region: the transform of the other is 0 there.
    Zip::from(&mut distances)
        .and(&outside)
        .for_each(|inside, outside| *inside = inside.max(*outside).sqrt());
    distances
}

#[allow(clippy::cast_possible_truncation, reason = "distances are rounded to f32 on purpose")]
fn rounded_root(square: f64) -> f32 {
    square.sqrt() as f32
}

/// Lower envelope of the parabolas (p − q)² + f(q) over a stretch of a line.
#[derive(Default)]
struct Envelope {
    /// Parabolas on the envelope: q, f(q), and where each takes over from the one before.
    parabolas: Vec<(f64, f64, f64)>,
}

impl Envelope {
    /// Replaces the distances f(q) at the points of a line, given by their squares, by the least √((p − q)² + f(q)²).
    /// Between two points at distance 0 no point farther away can be nearer, so each stretch between them is worked on
    /// alone.
    fn apply<T: Copy>(&mut self, line: &mut [T], square: impl Fn(&T) -> f64, of_square: impl Fn(f64) -> T) {
        let width = line.len();
        let is_inside = |value: &T| square(value) > 0.0;
        let mut x = 0;
        while x < width {
            if !is_inside(&line[x]) {
                x += 1;
                continue;
            }
            let start = x;
            while x < width && is_inside(&line[x]) {
                x += 1;
            }
            self.parabolas.clear();
            let first = start.saturating_sub(1);
            for (q, value) in (first..).zip(&line[first..(x + 1).min(width)]) {
                let f = square(value);
                if f.is_finite() {
                    self.add(q as f64, f);
                }
            }
            let mut p = start;
            for (k, &(q, f, _)) in self.parabolas.iter().enumerate() {
                // A parabola holds up to the point where the next one takes over.
                let end = self.parabolas.get(k + 1).map_or(x, |next| first_after(next.2));
                let end = end.clamp(p, x);
                for (p, value) in (p..).zip(&mut line[p..end]) {
                    *value = of_square((p as f64 - q).powi(2) + f);
                }
                p = end;
            }
        }
    }

    fn add(&mut self, q: f64, f: f64) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(v, g, start)) = self.parabolas.last() {
            from = ((f + q * q) - (g + v * v)) / (2.0 * (q - v));
            if from > start {
                break;
            }
            self.parabolas.pop();
            from = f64::NEG_INFINITY;
        }
        self.parabolas.push((q, f, from));
    }
}

/// The first point of a line beyond a place on it.
#[allow(
    clippy::cast_possible_truncation,
    reason = "casts of floats saturate, and the caller limits the result to the line"
)]
fn first_after(place: f64) -> usize {
    (place.floor() + 1.0) as usize
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "squares of whole numbers are exact")]
mod tests {
    use super::{distance_to_other_region, distance_transform, squared_distance_transform};
    use ndarray::{Array2, Array3};
    use proptest::prelude::*;

    fn square(p: (usize, usize, usize), q: (usize, usize, usize)) -> f64 {
        let of = |a: usize, b: usize| (a.abs_diff(b) as f64).powi(2);
        of(p.0, q.0) + of(p.1, q.1) + of(p.2, q.2)
    }

    proptest! {
        /// The distance is that to the nearest of all pixels outside.
        #[test]
        fn distance_to_the_nearest_pixel_outside(width in 1_usize..16, inside in prop::collection::vec(prop::bool::weighted(0.8), 1..200)) {
            let height = inside.len() / width;
            let mask = Array2::from_shape_fn((height, width), |(y, x)| inside[y * width + x]);
            for ((y, x), &d) in distance_transform(mask.view()).indexed_iter() {
                let outside = mask.indexed_iter().filter(|(_, m)| !**m);
                let nearest = outside.map(|((j, i), _)| square((0, y, x), (0, j, i))).fold(f64::INFINITY, f64::min);
                let error = f64::from(d) - nearest.sqrt();
                prop_assert!(d.is_infinite() && nearest.is_infinite() || error.abs() < 1e-6, "{d} {nearest}");
            }
        }

        /// The same in volumes, where masks are sparse and dense.
        #[test]
        fn distance_to_the_nearest_voxel_outside(
            sides in prop::array::uniform3(1..7_usize),
            density in 0.0_f64..1.0,
            levels in prop::collection::vec(0.0_f64..1.0, 343),
        ) {
            let [depth, height, width] = sides;
            let mask = Array3::from_shape_fn((depth, height, width), |(z, y, x)| levels[(z * 7 + y) * 7 + x] < density);
            let squares = squared_distance_transform(mask.view());
            let to_other = distance_to_other_region(mask.view());
            for (p, &inside) in mask.indexed_iter() {
                let others = mask.indexed_iter().filter(|(_, m)| **m != inside);
                let nearest = others.map(|(q, _)| square(p, q)).fold(f64::INFINITY, f64::min);
                prop_assert_eq!(squares[p], if inside { nearest } else { 0.0 });
                prop_assert_eq!(to_other[p], nearest.sqrt());
            }
        }
    }
}
