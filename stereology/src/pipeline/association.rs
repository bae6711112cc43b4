//! Whether particles of different colours have different sizes: the Kruskal-Wallis test.

use stereology_metrics::kruskal_wallis;

/// Whether sizes differ between groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Association {
    /// Probability that groups of one common distribution differ as much as these do; 1 if they cannot be tested.
    pub p_value: f64,
    /// Whether the p-value is below [`SIGNIFICANT`].
    pub together: bool,
}

/// Below this p-value size and group are taken to be associated.
pub const SIGNIFICANT: f64 = 0.01;

/// Tests whether `groups` of sizes have the same distribution ([`kruskal_wallis`]); groups of fewer than five sizes are
/// left out.
///
/// ```
/// use stereology::pipeline::association;
///
/// let small: Vec<f64> = (0..40).map(|i| 1.0 + 0.01 * f64::from(i)).collect();
/// let large: Vec<f64> = small.iter().map(|d| 2.0 * d).collect();
/// assert!(association(&[small.clone(), large]).together);
/// assert!(!association(&[small.clone(), small]).together);
/// ```
#[must_use]
pub fn association(groups: &[Vec<f64>]) -> Association {
    let p_value = kruskal_wallis(groups).map_or(1.0, |test| test.p_value);
    Association {
        p_value,
        together: p_value < SIGNIFICANT,
    }
}
