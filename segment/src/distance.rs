//! Depth of a mask: how far each pixel lies from what is outside.

use ndarray::{Array2, Axis};
use rayon::prelude::*;

/// Euclidean distance of every pixel of a mask to the nearest pixel outside it, 0 outside; the photo's edge is no outside. Infinite if the mask is everything.
///
/// # Complexity
///
/// Linear in pixels (Felzenszwalb & Huttenlocher 2012), those of the mask counting most.
///
/// # Examples
///
/// ```
/// let mask = ndarray::Array2::from_shape_fn((1, 7), |(_, x)| x > 0);
/// assert_eq!(stereology_segment::distance_transform(&mask)[[0, 5]], 5.0);
/// ```
#[must_use]
pub fn distance_transform(mask: &Array2<bool>) -> Array2<f32> {
    let (height, width) = mask.dim();
    // Distance along the column, then the lower envelope of parabolas along the row.
    let mut out = Array2::from_shape_simple_fn((height, width), || 0.0_f32);
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
                envelope.apply(row);
            }
        });
    out
}

/// Lower envelope of the parabolas (p − q)² + f(q)² over a stretch of a row.
#[derive(Default)]
struct Envelope {
    /// Parabolas on the envelope: q, f(q)², and where each takes over.
    vertices: Vec<(f64, f64, f64)>,
}

impl Envelope {
    /// Turns distances along columns into distances. Between two pixels outside nothing further away can be nearer.
    fn apply(&mut self, row: &mut [f32]) {
        let width = row.len();
        let mut x = 0;
        while x < width {
            if row[x] == 0.0 {
                x += 1;
                continue;
            }
            let start = x;
            while x < width && row[x] > 0.0 {
                x += 1;
            }
            self.vertices.clear();
            let first = start.saturating_sub(1);
            for (q, d) in (first..).zip(&row[first..(x + 1).min(width)]) {
                if d.is_finite() {
                    self.add(q as f64, f64::from(*d).powi(2));
                }
            }
            if self.vertices.is_empty() {
                row[start..x].fill(f32::INFINITY);
            }
            let mut p = start;
            for (k, &(q, f, _)) in self.vertices.iter().enumerate() {
                // A parabola holds up to the pixel where the next one takes over.
                let end = self
                    .vertices
                    .get(k + 1)
                    .map_or(x, |next| (next.2.floor() + 1.0).max(0.0) as usize);
                let end = end.clamp(p, x);
                for (p, d) in (p..).zip(&mut row[p..end]) {
                    *d = ((p as f64 - q).powi(2) + f).sqrt() as f32;
                }
                p = end;
            }
        }
    }

    fn add(&mut self, q: f64, f: f64) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(v, fv, start)) = self.vertices.last() {
            from = ((f + q * q) - (fv + v * v)) / (2.0 * (q - v));
            if from > start {
                break;
            }
            self.vertices.pop();
            from = f64::NEG_INFINITY;
        }
        self.vertices.push((q, f, from));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The nearest of all pixels outside.
        #[test]
        fn nearest_outside(width in 1_usize..16, inside in proptest::collection::vec(proptest::bool::weighted(0.8), 1..200)) {
            let height = inside.len() / width;
            let mask = Array2::from_shape_fn((height, width), |(y, x)| inside[y * width + x]);
            for ((y, x), &d) in distance_transform(&mask).indexed_iter() {
                let outside = mask.indexed_iter().filter(|(_, m)| !**m);
                let nearest = outside.map(|((j, i), _)| (y as f64 - j as f64).hypot(x as f64 - i as f64)).fold(f64::INFINITY, f64::min);
                let near = f64::from(d) - nearest;
                prop_assert!(d.is_infinite() && nearest.is_infinite() || near.abs() < 1e-5, "{d} {nearest}");
            }
        }
    }
}
