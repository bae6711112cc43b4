//! How far apart two samples are: the Wasserstein-1 distance.

/// Area between the distribution functions of two weighted samples of (value, weight): the mean distance that the mass of one must be moved to become the
/// other. In the unit of the values; infinite if a sample has no weight.
///
/// # Formula
///
/// ```text
/// W₁ = ∫ |F_a(x) − F_b(x)| dx
/// ```
///
/// ```
/// use stereology::pipeline::wasserstein;
///
/// // Half the mass moves from 1 to 3.
/// assert_eq!(wasserstein(&[(1.0, 1.0), (1.0, 1.0)], &[(1.0, 5.0), (3.0, 5.0)]), 1.0);
/// ```
#[must_use]
pub fn wasserstein(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let whole = |sample: &[(f64, f64)]| sample.iter().map(|(_, weight)| weight).sum::<f64>();
    let (mass_a, mass_b) = (whole(a), whole(b));
    if !(mass_a > 0.0 && mass_b > 0.0) {
        return f64::INFINITY;
    }
    let mut steps: Vec<(f64, f64)> = a
        .iter()
        .map(|&(x, w)| (x, w / mass_a))
        .chain(b.iter().map(|&(x, w)| (x, -w / mass_b)))
        .collect();
    steps.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    let mut difference = 0.0;
    let mut distance = 0.0;
    for pair in steps.windows(2) {
        difference += pair[0].1;
        distance += f64::abs(difference) * (pair[1].0 - pair[0].0);
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::wasserstein;
    use proptest::prelude::*;

    proptest! {
        /// Moving a whole sample by t moves every unit of its mass by |t|.
        #[test]
        fn a_shift_is_its_own_distance(values in prop::collection::vec(-10.0..10.0_f64, 1..50), shift in -5.0..5.0_f64) {
            let a: Vec<_> = values.iter().map(|&x| (x, 1.0)).collect();
            let b: Vec<_> = values.iter().map(|&x| (x + shift, 3.0)).collect();
            prop_assert!((wasserstein(&a, &b) - shift.abs()).abs() < 1e-9);
        }

        /// A metric: zero to itself, symmetric, and the triangle holds.
        #[test]
        fn it_is_a_metric(samples in prop::array::uniform3(prop::collection::vec((-10.0..10.0_f64, 0.1..2.0_f64), 1..20))) {
            let [a, b, c] = &samples;
            prop_assert!(wasserstein(a, a) < 1e-12);
            prop_assert!((wasserstein(a, b) - wasserstein(b, a)).abs() < 1e-9);
            prop_assert!(wasserstein(a, c) <= wasserstein(a, b) + wasserstein(b, c) + 1e-9);
        }
    }
}
