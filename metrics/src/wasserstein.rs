//! The Wasserstein-1 distance: how different two samples of a quantity are.

use std::iter;

/// Wasserstein-1 distance of two samples of (value, weight): the mean distance by which the weight of one must be moved
/// to become the other.
///
/// In the unit of the values; infinite if a sample has no weight. Cost: that of sorting.
///
/// # Formula
///
/// ```text
/// W₁ = ∫ |F_a(x) − F_b(x)| dx        F: fraction of the weight at values up to x
/// ```
///
/// ```
/// use stereology_metrics::wasserstein;
///
/// // Half the weight moves from 1 to 3.
/// assert_eq!(wasserstein(&[(1.0, 1.0), (1.0, 1.0)], &[(1.0, 5.0), (3.0, 5.0)]), 1.0);
/// ```
#[must_use]
pub fn wasserstein(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let total = |sample: &[(f64, f64)]| sample.iter().map(|(_, weight)| weight).sum::<f64>();
    let (total_a, total_b) = (total(a), total(b));
    if !(total_a > 0.0 && total_b > 0.0) {
        return f64::INFINITY;
    }
    let mut steps: Vec<(f64, f64)> = a
        .iter()
        .map(|&(x, w)| (x, w / total_a))
        .chain(b.iter().map(|&(x, w)| (x, -w / total_b)))
        .collect();
    steps.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    area_between(steps)
}

/// Wasserstein-1 distance of two samples of equal weights, each sorted, of any numbers of values. Zero if one is empty.
/// Cost: linear.
///
/// ```
/// use stereology_metrics::wasserstein_sorted;
///
/// assert_eq!(wasserstein_sorted(&[0.0, 1.0], &[1.0, 2.0]), 1.0);
/// assert_eq!(wasserstein_sorted(&[0.0, 0.0, 3.0], &[1.0]), 4.0 / 3.0);
/// ```
#[must_use]
pub fn wasserstein_sorted(a: &[f32], b: &[f32]) -> f64 {
    if a.is_empty() || b.is_empty() {
        return 0.0;
    }
    // Each distribution function times the product of both numbers of values: whole numbers, which add without
    // rounding.
    let (step_a, step_b) = (b.len() as f64, -(a.len() as f64));
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    let steps = iter::from_fn(|| {
        let next_is_a = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) => x <= y,
            (next, _) => next.is_some(),
        };
        let (value, step) = if next_is_a {
            (a.next(), step_a)
        } else {
            (b.next(), step_b)
        };
        value.map(|&x| (f64::from(x), step))
    });
    area_between(steps) / (step_a * -step_b)
}

/// Wasserstein-1 distance, in bins, of two histograms over the same bins, each with the sum 1; the shorter one is
/// continued with zeros.
///
/// ```
/// use stereology_metrics::wasserstein_of_bins;
///
/// assert_eq!(wasserstein_of_bins([0.5, 0.5], [0.5, 0.0, 0.0, 0.5]), 1.0); // half of all, by two bins
/// ```
#[must_use]
pub fn wasserstein_of_bins(a: impl IntoIterator<Item = f64>, b: impl IntoIterator<Item = f64>) -> f64 {
    let (mut a, mut b) = (a.into_iter(), b.into_iter());
    let differences = iter::from_fn(|| match (a.next(), b.next()) {
        (None, None) => None,
        (a, b) => Some(a.unwrap_or_default() - b.unwrap_or_default()),
    });
    // What rounding leaves of the difference after the last bin counts as one bin more.
    let steps = differences.chain(iter::once(0.0)).enumerate();
    area_between(steps.map(|(bin, difference)| (bin as f64, difference)))
}

/// Area under the absolute value of a step function, given as (place, step) with increasing places.
fn area_between(steps: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let mut steps = steps.into_iter();
    let Some((mut place, mut height)) = steps.next() else {
        return 0.0;
    };
    let mut area = 0.0;
    for (next, step) in steps {
        area += height.abs() * (next - place);
        height += step;
        place = next;
    }
    area
}

#[cfg(test)]
mod tests {
    use super::{wasserstein, wasserstein_of_bins, wasserstein_sorted};
    use proptest::prelude::*;

    proptest! {
        /// Moving a whole sample by t moves every unit of its weight by |t|.
        #[test]
        fn a_shift_is_its_own_distance(values in prop::collection::vec(-10.0..10.0_f64, 1..50), shift in -5.0..5.0_f64) {
            let a: Vec<_> = values.iter().map(|&x| (x, 1.0)).collect();
            let b: Vec<_> = values.iter().map(|&x| (x + shift, 3.0)).collect();
            prop_assert!((wasserstein(&a, &b) - shift.abs()).abs() < 1e-9);
        }

        /// A metric: zero to itself, symmetric, and the triangle inequality holds.
        #[test]
        fn it_is_a_metric(samples in prop::array::uniform3(prop::collection::vec((-10.0..10.0_f64, 0.1..2.0_f64), 1..20))) {
            let [a, b, c] = &samples;
            prop_assert!(wasserstein(a, a) < 1e-12);
            prop_assert!((wasserstein(a, b) - wasserstein(b, a)).abs() < 1e-9);
            prop_assert!(wasserstein(a, c) <= wasserstein(a, b) + wasserstein(b, c) + 1e-9);
        }

        /// Of two samples of one number of values the sorted values are paired.
        #[test]
        fn sorted_samples_are_paired(pairs in prop::collection::vec((-10.0_f32..10.0, -10.0_f32..10.0), 1..40)) {
            let (mut a, mut b): (Vec<f32>, Vec<f32>) = pairs.into_iter().unzip();
            a.sort_by(f32::total_cmp);
            b.sort_by(f32::total_cmp);
            let paired = a.iter().zip(&b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs()).sum::<f64>() / a.len() as f64;
            prop_assert!((wasserstein_sorted(&a, &b) - paired).abs() < 1e-12);
        }

        /// Samples of any two numbers of values, and histograms, agree with the weighted samples that they stand for.
        #[test]
        fn all_forms_agree(mut a in prop::collection::vec(-10.0_f32..10.0, 1..30), mut b in prop::collection::vec(-10.0_f32..10.0, 1..30), shares in prop::collection::vec((0.01_f64..1.0, 0.01_f64..1.0), 1..12)) {
            a.sort_by(f32::total_cmp);
            b.sort_by(f32::total_cmp);
            let weighted = |values: &[f32]| values.iter().map(|&x| (f64::from(x), 1.0)).collect::<Vec<_>>();
            prop_assert!((wasserstein_sorted(&a, &b) - wasserstein(&weighted(&a), &weighted(&b))).abs() < 1e-12);
            let total = shares.iter().fold((0.0, 0.0), |sum, share| (sum.0 + share.0, sum.1 + share.1));
            let bins = |of: &dyn Fn(&(f64, f64)) -> f64| shares.iter().map(of).collect::<Vec<f64>>();
            let (p, q) = (bins(&|share| share.0 / total.0), bins(&|share| share.1 / total.1));
            let placed = |bins: &[f64]| bins.iter().enumerate().map(|(bin, &share)| (bin as f64, share)).collect::<Vec<_>>();
            let expected = wasserstein(&placed(&p), &placed(&q));
            prop_assert!((wasserstein_of_bins(p, q) - expected).abs() < 1e-12);
        }
    }

    /// An empty sample of equal weights is at no distance; a sample without weight at an infinite one.
    #[test]
    fn empty_samples() {
        assert_eq!(wasserstein_sorted(&[], &[1.0]).to_bits(), 0.0_f64.to_bits());
        assert!(wasserstein(&[], &[(1.0, 1.0)]).is_infinite());
    }
}
