//! The length of the offsets that show a profile up to each area: exact, because areas are quadratic functions of the
//! offset.

/// Length of the offsets whose profile area is at most each of the given bounds, and the first moments of the area.
#[derive(Clone, Debug)]
pub(crate) struct DepthMeasure {
    /// Increasing areas, from 0 on; the last one is A_max.
    bounds: Vec<f64>,
    /// Length of the pieces that lie entirely below bound k but not below bound k − 1.
    from: Vec<f64>,
    /// Length below bound k of the pieces that cross it.
    crossing: Vec<f64>,
    pub(crate) moments: Moments,
    /// Index where the last bound was found.
    near: usize,
    /// The state at [`begin`](Self::begin).
    kept: Kept,
}

#[derive(Clone, Debug, Default)]
struct Kept {
    from: Vec<f64>,
    crossing: Vec<f64>,
    moments: Moments,
}

/// Integrals over the offsets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    /// Profiles.
    pub(crate) profiles: f64,
    /// Holes.
    pub(crate) holes: f64,
    /// Area.
    pub(crate) area: f64,
    /// Squared area of each profile.
    pub(crate) area_squared: f64,
    /// Squared total area of the section.
    pub(crate) total_squared: f64,
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
            near: 0,
            kept: Kept::default(),
        }
    }

    /// Saves the present state.
    pub(crate) fn begin(&mut self) {
        self.kept.from.clone_from(&self.from);
        self.kept.crossing.clone_from(&self.crossing);
        self.kept.moments = self.moments;
    }

    /// Restores the state at [`begin`](Self::begin).
    pub(crate) fn undo(&mut self) {
        self.from.clone_from(&self.kept.from);
        self.crossing.clone_from(&self.kept.crossing);
        self.moments = self.kept.moments;
    }

    /// Adds a profile of area a + b t + c t² at the offsets 0 ≤ t ≤ `length`.
    pub(crate) fn add_profile(&mut self, area: [f64; 3], length: f64) {
        self.add_lengths(area, length);
        self.moments.area_squared += integral_of_square(area, length);
    }

    /// Adds a section that is one profile of area a + b t + c t² at the offsets 0 ≤ t ≤ `length`.
    pub(crate) fn add_section(&mut self, area: [f64; 3], length: f64) {
        self.add_lengths(area, length);
        let squares = integral_of_square(area, length);
        self.moments.area_squared += squares;
        self.moments.total_squared += squares;
    }

    fn add_lengths(&mut self, [a, b, c]: [f64; 3], length: f64) {
        self.moments.profiles += length;
        self.moments.area += length * (a + length * (0.5 * b + length * c * (1.0 / 3.0)));
        // The extremum lies inside if the slope changes its sign.
        let slope = b + 2.0 * c * length;
        if b * slope < 0.0 {
            let turn = -0.5 * b / c;
            let top = a + 0.5 * b * turn;
            self.add_monotone(top, 0.0, c, turn);
            self.add_monotone(top, 0.0, c, length - turn);
        } else {
            self.add_monotone(a, b, c, length);
        }
    }

    /// Adds a section of total area a + b t + c t² at the offsets 0 ≤ t ≤ `length`.
    pub(crate) fn add_total(&mut self, area: [f64; 3], length: f64) {
        self.moments.total_squared += integral_of_square(area, length);
    }

    /// Adds offsets t from 0 to `length` with the monotone area a + b t + c t².
    fn add_monotone(&mut self, a: f64, b: f64, c: f64, length: f64) {
        let end = a + length * (b + length * c);
        let (least, most) = if a < end { (a, end) } else { (end, a) };
        self.moments.largest = self.moments.largest.max(most);
        // The last bound is A_max: everything counts as below it, even if rounding puts an area slightly above.
        let last = self.bounds.len() - 1;
        let start = self.first_not_below(least);
        let sign = 1.0_f64.copysign(end - a);
        // Where the area decreases, the part below the bound follows the root.
        let (offset, turned) = if end > a { (0.0, 1.0) } else { (length, -1.0) };
        let stop = start
            + self.bounds[start..last]
                .iter()
                .take_while(|bound| **bound < most)
                .count();
        // A loop without early exit is vectorised.
        for (bound, crossing) in self.bounds[start..stop].iter().zip(&mut self.crossing[start..stop]) {
            // The root on the monotone piece: b and the square root have the same sign, so no digits cancel.
            let rise = bound - a;
            let slope = b + sign * (b * b + 4.0 * c * rise).max(0.0).sqrt();
            // 0 / 0, where the piece starts level at the bound, becomes 0.
            let t = (2.0 * rise / slope).max(0.0).min(length);
            *crossing += offset + turned * t;
        }
        self.from[stop] += length;
        // The next piece begins where this one ends.
        self.near = if end > a { stop } else { start };
    }

    /// The first bound that is not below an area. It is usually near the last one found, because areas are continuous.
    fn first_not_below(&mut self, area: f64) -> usize {
        let last = self.bounds.len() - 1;
        let mut k = self.near;
        for _ in 0..8 {
            if k > 0 && self.bounds[k - 1] >= area {
                k -= 1;
            } else if k < last && self.bounds[k] < area {
                k += 1;
            } else {
                self.near = k;
                return k;
            }
        }
        self.near = self.bounds[..last].partition_point(|&bound| bound < area);
        self.near
    }

    /// Length of the offsets with a profile area up to each bound.
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

/// ∫ (a + b t + c t²)² dt from 0 to `length`.
fn integral_of_square([a, b, c]: [f64; 3], length: f64) -> f64 {
    let l = length;
    l * (a * a + l * (a * b + l * ((b * b + 2.0 * a * c) * (1.0 / 3.0) + l * (0.5 * b * c + l * 0.2 * c * c))))
}

#[cfg(test)]
mod tests {
    use super::DepthMeasure;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    proptest! {
        /// The exact lengths are those of a fine scan over offsets.
        #[test]
        fn lengths_agree_with_a_scan(c0 in -1.0..1.0_f64, c1 in -2.0..2.0_f64, c2 in -2.0..2.0_f64, low in -1.0..1.0_f64, length in 0.01..1.0_f64) {
            let bounds: Vec<f64> = (0..=20).map(|k| f64::from(k) * 0.3).collect();
            let mut measure = DepthMeasure::new(bounds.clone());
            let about_low = [c0 + low * (c1 + low * c2), c1 + 2.0 * c2 * low, c2];
            measure.add_profile(about_low, length);
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
            let mean_square = (0..steps).map(|s| area(s).powi(2)).sum::<f64>() / f64::from(steps);
            assert_abs_diff_eq!(measure.moments.area_squared, length * mean_square, epsilon = 1e-5);
        }
    }
}
