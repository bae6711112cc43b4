//! How many offsets show a profile up to each area, exactly, where areas are quadratics of the offset.

/// A quadratic c₀ + c₁ h + c₂ h² that others are added to and taken from without a trace.
///
/// A nearly horizontal triangle has coefficients of 1 / Δh²; after it is gone, plain sums would keep its rounding errors. Here the error of
/// every addition is kept beside the sum (two-sum), so that what was added and taken away leaves nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Quadratic {
    sum: [f64; 3],
    error: [f64; 3],
}

impl Quadratic {
    pub(crate) fn add(&mut self, terms: [f64; 3]) {
        for ((sum, error), term) in self.sum.iter_mut().zip(&mut self.error).zip(terms) {
            let total = *sum + term;
            let part = total - *sum;
            *error += (*sum - (total - part)) + (term - part);
            *sum = total;
        }
    }

    pub(crate) fn subtract(&mut self, terms: [f64; 3]) {
        self.add(terms.map(|term| -term));
    }

    pub(crate) fn coefficients(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.sum[k] + self.error[k])
    }
}

/// Lengths of offsets by area, for areas up to given bounds, and the first moments.
#[derive(Clone, Debug)]
pub(crate) struct DepthMeasure {
    /// Increasing areas, from 0 on; the last one is A_max.
    bounds: Vec<f64>,
    /// Length that is below bound k but not below k − 1 over its whole piece.
    from: Vec<f64>,
    /// Length below bound k of pieces that cross it.
    crossing: Vec<f64>,
    pub(crate) moments: Moments,
}

/// ∫ over offsets of what a section shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    /// Profiles.
    pub(crate) profiles: f64,
    /// Holes.
    pub(crate) holes: f64,
    /// Area.
    pub(crate) area: f64,
    /// Largest area met.
    pub(crate) largest: f64,
}

impl DepthMeasure {
    pub(crate) fn new(bounds: Vec<f64>) -> Self {
        let zeros = vec![0.0; bounds.len()];
        Self {
            from: zeros.clone(),
            crossing: zeros,
            bounds,
            moments: Moments::default(),
        }
    }

    /// Adds a profile of area `quadratic` at the offsets between `low` and `high`.
    pub(crate) fn add_profile(&mut self, quadratic: [f64; 3], low: f64, high: f64) {
        let [c0, c1, c2] = quadratic;
        let length = high - low;
        // About `low`: area = a + b t + c t², 0 ≤ t ≤ length.
        let (a, b, c) = (c0 + low * (c1 + low * c2), c1 + 2.0 * c2 * low, c2);
        self.moments.profiles += length;
        self.moments.area += length * (a + length * (0.5 * b + length * c / 3.0));
        let turn = if c == 0.0 { 0.0 } else { -0.5 * b / c };
        if turn > 0.0 && turn < length {
            let top = a + 0.5 * b * turn;
            self.add_monotone(top, 0.0, c, turn);
            self.add_monotone(top, 0.0, c, length - turn);
        } else {
            self.add_monotone(a, b, c, length);
        }
    }

    /// Adds offsets t from 0 to `length` with the monotone area a + b t + c t².
    fn add_monotone(&mut self, a: f64, b: f64, c: f64, length: f64) {
        let end = a + length * (b + length * c);
        let (least, most) = if a < end { (a, end) } else { (end, a) };
        self.moments.largest = self.moments.largest.max(most);
        // The last bound is A_max: everything is below it, should rounding lift a section above, too.
        let last = self.bounds.len() - 1;
        let mut k = self.bounds[..last].partition_point(|&bound| bound < least);
        while k < last && self.bounds[k] < most {
            // The root on the monotone stretch; b and the root have the sign of the direction, so nothing cancels.
            let rise = self.bounds[k] - a;
            let root = (b * b + 4.0 * c * rise).max(0.0).sqrt();
            let slope = b + root.copysign(end - a);
            let t = if slope == 0.0 {
                0.0
            } else {
                (2.0 * rise / slope).clamp(0.0, length)
            };
            self.crossing[k] += if end > a { t } else { length - t };
            k += 1;
        }
        self.from[k] += length;
    }

    /// Length of offsets with a profile of area up to each bound.
    pub(crate) fn cumulative(&self) -> Vec<f64> {
        let mut whole = 0.0;
        self.from
            .iter()
            .zip(&self.crossing)
            .map(|(from, crossing)| {
                whole += from;
                whole + crossing
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{DepthMeasure, Quadratic};
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    proptest! {
        /// The exact lengths are those of a fine scan over offsets.
        #[test]
        fn lengths_agree_with_a_scan(c0 in -1.0..1.0_f64, c1 in -2.0..2.0_f64, c2 in -2.0..2.0_f64, low in -1.0..1.0_f64, length in 0.01..1.0_f64) {
            let bounds: Vec<f64> = (0..=20).map(|k| f64::from(k) * 0.3).collect();
            let mut measure = DepthMeasure::new(bounds.clone());
            measure.add_profile([c0, c1, c2], low, low + length);
            let steps = 20_000;
            let area = |s: i32| {
                let h = low + length * (f64::from(s) + 0.5) / f64::from(steps);
                c0 + h * (c1 + h * c2)
            };
            for (bound, exact) in bounds.iter().zip(measure.cumulative()).take(20) {
                let below = (0..steps).filter(|&s| area(s) <= *bound).count();
                assert_abs_diff_eq!(exact, length * below as f64 / f64::from(steps), epsilon = 3.0 * length / f64::from(steps));
            }
            let mean = (0..steps).map(area).sum::<f64>() / f64::from(steps);
            assert_abs_diff_eq!(measure.moments.area, length * mean, epsilon = 1e-6);
        }

        /// What is added and taken away leaves no trace, however large it was.
        #[test]
        fn sums_forget(small in -1.0..1.0_f64, large in prop::collection::vec(-1e15..1e15_f64, 1..20)) {
            let mut sum = Quadratic::default();
            sum.add([small; 3]);
            for &term in &large {
                sum.add([term; 3]);
            }
            for &term in &large {
                sum.subtract([term; 3]);
            }
            assert_abs_diff_eq!(sum.coefficients()[1], small, epsilon = 1e-15);
        }
    }
}
