//! Exact distances of the points of a grid to the nearest point of the other region.

use ndarray::{Array3, ArrayView3, Axis, Zip};

/// Euclidean distance from every point of a two-region grid to the nearest point of the other region, in grid steps; infinite if there is one region only. A picture is a grid of one layer.
///
/// Exact: squares of distances are whole numbers. Cost: linear in points (Felzenszwalb & Huttenlocher 2012).
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_microgeometry::distance_to_other_region;
///
/// let half = Array3::from_shape_fn((1, 2, 6), |(_, _, x)| x < 3);
/// let distances = distance_to_other_region(half.view());
/// assert_eq!(distances.as_slice().unwrap()[..6], [3.0, 2.0, 1.0, 1.0, 2.0, 3.0]);
/// ```
#[must_use]
pub fn distance_to_other_region(positive: ArrayView3<'_, bool>) -> Array3<f64> {
    let mut to_negative = squares(positive, false);
    let to_positive = squares(positive, true);
    Zip::from(&mut to_negative)
        .and(&to_positive)
        .for_each(|a, b| *a = a.max(*b).sqrt());
    to_negative
}

/// Squared distances to the nearest point of the region.
fn squares(positive: ArrayView3<'_, bool>, region: bool) -> Array3<f64> {
    let mut out = positive.mapv(|p| if p == region { 0.0 } else { f64::INFINITY });
    let mut envelope = Envelope::default();
    for axis in [2, 1, 0] {
        if out.len_of(Axis(axis)) < 2 {
            continue;
        }
        let mut line = Vec::new();
        for mut lane in out.lanes_mut(Axis(axis)) {
            line.clear();
            line.extend(lane.iter().copied());
            envelope.apply(&mut line);
            lane.iter_mut().zip(&line).for_each(|(to, from)| *to = *from);
        }
    }
    out
}

/// Lower envelope of the parabolas (p − q)² + f(q).
#[derive(Default)]
struct Envelope {
    /// Parabolas on the envelope: q, f(q), and where each takes over.
    parts: Vec<(f64, f64, f64)>,
}

impl Envelope {
    fn apply(&mut self, line: &mut [f64]) {
        self.parts.clear();
        for (q, &f) in line.iter().enumerate() {
            if f.is_finite() {
                self.add(q as f64, f);
            }
        }
        if self.parts.is_empty() {
            return;
        }
        let mut part = 0;
        for (p, value) in line.iter_mut().enumerate() {
            let p = p as f64;
            while part + 1 < self.parts.len() && self.parts[part + 1].2 < p {
                part += 1;
            }
            let (q, f, _) = self.parts[part];
            *value = (p - q).powi(2) + f;
        }
    }

    fn add(&mut self, q: f64, f: f64) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(v, g, start)) = self.parts.last() {
            from = ((f + q * q) - (g + v * v)) / (2.0 * (q - v));
            if from > start {
                break;
            }
            self.parts.pop();
            from = f64::NEG_INFINITY;
        }
        self.parts.push((q, f, from));
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "squares of whole numbers are exact")]
mod tests {
    use super::distance_to_other_region;
    use ndarray::Array3;
    use proptest::prelude::*;

    proptest! {
        /// The nearest of all points of the other region.
        #[test]
        fn nearest_of_the_other_region(sides in prop::array::uniform3(1..6_usize), bits in prop::collection::vec(any::<bool>(), 125)) {
            let at = |(z, y, x): (usize, usize, usize)| bits[(z * sides[1] + y) * sides[2] + x];
            let grid = Array3::from_shape_fn((sides[0], sides[1], sides[2]), at);
            for (p, d) in distance_to_other_region(grid.view()).indexed_iter() {
                let step = |q: (usize, usize, usize)| {
                    let square = |a: usize, b: usize| (a.abs_diff(b) as f64).powi(2);
                    (square(p.0, q.0) + square(p.1, q.1) + square(p.2, q.2)).sqrt()
                };
                let others = grid.indexed_iter().filter(|(_, r)| **r != grid[p]);
                let nearest = others.map(|(q, _)| step(q)).fold(f64::INFINITY, f64::min);
                prop_assert_eq!(*d, nearest);
            }
        }
    }
}
