//! The Kruskal-Wallis test: whether several groups of values have the same distribution.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Smallest group that is tested: with fewer values the χ² law of the statistic is a poor approximation.
const SMALLEST_GROUP: usize = 5;

/// Result of the Kruskal-Wallis test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KruskalWallis {
    /// H, corrected for ties; it grows with the differences of the groups' mean ranks.
    pub statistic: f64,
    /// Number of groups tested, less one.
    pub degrees_of_freedom: usize,
    /// Probability of an H at least as large if all groups have the same distribution.
    pub p_value: f64,
}

/// Tests whether `groups` of values have the same distribution, by their ranks.
///
/// Groups of fewer than five values are left out, since the p-value is that of the limit of large groups. `None` if
/// fewer than two groups remain or all values are equal. Cost: that of sorting.
///
/// # Formula
///
/// ```text
/// H = (12 / (N (N + 1)) Σ R_g² / n_g − 3 (N + 1)) / (1 − Σ (t³ − t) / (N³ − N))
/// H ~ χ² with groups − 1 degrees of freedom
/// ```
///
/// R_g is the sum of the ranks of group g among all N values (tied values have their mean rank), and t are the numbers
/// of tied values.
///
/// # References
///
/// Kruskal & Wallis 1952.
///
/// # Examples
///
/// ```
/// use stereology_metrics::kruskal_wallis;
///
/// let small: Vec<f64> = (0..40).map(|i| 1.0 + 0.01 * f64::from(i)).collect();
/// let large: Vec<f64> = small.iter().map(|d| 2.0 * d).collect();
/// assert!(kruskal_wallis(&[&small, &large]).unwrap().p_value < 1e-6);
/// assert!(kruskal_wallis(&[&small, &small]).unwrap().p_value > 0.99);
/// assert_eq!(kruskal_wallis(&[&small]), None);
/// ```
#[must_use]
pub fn kruskal_wallis<G: AsRef<[f64]>>(groups: &[G]) -> Option<KruskalWallis> {
    let groups: Vec<&[f64]> = groups
        .iter()
        .map(AsRef::as_ref)
        .filter(|group| group.len() >= SMALLEST_GROUP)
        .collect();
    if groups.len() < 2 {
        return None;
    }
    let mut values: Vec<(f64, usize)> = groups
        .iter()
        .enumerate()
        .flat_map(|(g, group)| group.iter().map(move |&value| (value, g)))
        .collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let n = values.len() as f64;
    let mut rank_sums = vec![0.0; groups.len()];
    let mut ties = 0.0;
    let mut before = 0;
    for tied in values.chunk_by(|a, b| a.0.total_cmp(&b.0).is_eq()) {
        let length = tied.len() as f64;
        let mean_rank = before as f64 + 0.5 * (length + 1.0);
        for &(_, group) in tied {
            rank_sums[group] += mean_rank;
        }
        ties += length.powi(3) - length;
        before += tied.len();
    }
    let untied = 1.0 - ties / (n.powi(3) - n);
    if untied <= 0.0 {
        return None;
    }
    let squares: f64 = rank_sums
        .iter()
        .zip(&groups)
        .map(|(r, group)| r * r / group.len() as f64)
        .sum();
    let statistic = (12.0 / (n * (n + 1.0)) * squares - 3.0 * (n + 1.0)) / untied;
    let degrees_of_freedom = groups.len() - 1;
    let law = ChiSquared::new(degrees_of_freedom as f64).ok()?;
    Some(KruskalWallis {
        statistic,
        degrees_of_freedom,
        p_value: law.sf(statistic.max(0.0)),
    })
}

#[cfg(test)]
mod tests {
    use super::kruskal_wallis;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng, seq::SliceRandom};
    use rand_chacha::ChaCha8Rng;

    proptest! {
        /// Ranks do not change with an increasing function of the values, nor the statistic with the order of groups.
        #[test]
        fn only_ranks_count(a in prop::collection::vec(0_i32..20, 5..30), b in prop::collection::vec(0_i32..20, 5..30), c in prop::collection::vec(0_i32..20, 5..30)) {
            let of = |group: &[i32], f: &dyn Fn(f64) -> f64| group.iter().map(|&v| f(f64::from(v))).collect::<Vec<f64>>();
            let (same, cube) = (|v: f64| v, |v: f64| v.powi(3) - 7.0);
            let plain = kruskal_wallis(&[of(&a, &same), of(&b, &same), of(&c, &same)]);
            let changed = kruskal_wallis(&[of(&c, &cube), of(&a, &cube), of(&b, &cube)]);
            prop_assert_eq!(plain.is_some(), changed.is_some());
            if let (Some(plain), Some(changed)) = (plain, changed) {
                prop_assert!((plain.statistic - changed.statistic).abs() < 1e-9);
                prop_assert_eq!(plain.degrees_of_freedom, 2);
            }
        }
    }

    /// The p-value is that of random exchanges of the values between groups, which is exact, up to the approximation
    /// for groups of 8 to 20 values with ties.
    #[test]
    fn p_values_are_those_of_random_exchanges() {
        const EXCHANGES: usize = 4000;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for shift in [0.0, 2.0, 4.0] {
            let sizes = [8, 12, 20];
            let mut values: Vec<f64> = (0..40)
                .map(|i| (10.0 * rng.random::<f64>() + if i < 8 { shift } else { 0.0 }).round())
                .collect();
            let statistic = |values: &[f64]| {
                let (a, rest) = values.split_at(sizes[0]);
                let (b, c) = rest.split_at(sizes[1]);
                kruskal_wallis(&[a, b, c]).unwrap()
            };
            let found = statistic(&values);
            let as_large = (0..EXCHANGES).filter(|_| {
                values.shuffle(&mut rng);
                statistic(&values).statistic >= found.statistic - 1e-9
            });
            let exact = as_large.count() as f64 / EXCHANGES as f64;
            assert!((found.p_value - exact).abs() < 0.04, "{found:?}, {exact}");
        }
    }

    /// Small groups, single groups and equal values cannot be tested.
    #[test]
    fn what_cannot_be_tested() {
        let group: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(kruskal_wallis(&[&group[..], &group[..4]]), None);
        assert_eq!(kruskal_wallis(&[[3.0; 6], [3.0; 6]]), None);
    }
}
