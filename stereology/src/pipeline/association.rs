//! Do particles of different colours have different sizes? The Kruskal-Wallis test.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Whether sizes differ between groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Association {
    /// Probability that groups of one common distribution differ as much as these do.
    pub p_value: f64,
    /// Is it below [`SIGNIFICANT`]?
    pub together: bool,
}

/// Below this p-value size and group are taken to go together.
pub const SIGNIFICANT: f64 = 0.01;

/// Kruskal-Wallis test of `groups` of sizes; groups of fewer than five are left out, and of fewer than two groups nothing can be said (p = 1).
///
/// # Formula
///
/// ```text
/// H = (12 / (N (N + 1)) Σ R_g² / n_g − 3 (N + 1)) / (1 − Σ (t³ − t) / (N³ − N)),   H ~ χ² with groups − 1 degrees of freedom
/// ```
///
/// R_g the sum of the ranks of group g among all N sizes, ties at their mean rank, t the lengths of the runs of ties.
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
    let groups: Vec<&Vec<f64>> = groups.iter().filter(|group| group.len() >= 5).collect();
    let mut sizes: Vec<(f64, usize)> = groups
        .iter()
        .enumerate()
        .flat_map(|(g, group)| group.iter().map(move |&size| (size, g)))
        .collect();
    if groups.len() < 2 {
        return Association {
            p_value: 1.0,
            together: false,
        };
    }
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let n = sizes.len() as f64;
    let mut rank_sums = vec![0.0; groups.len()];
    let mut ties = 0.0;
    let mut start = 0;
    for run in sizes.chunk_by(|a, b| a.0.total_cmp(&b.0).is_eq()) {
        let length = run.len() as f64;
        let mean_rank = start as f64 + 0.5 * (length + 1.0);
        for &(_, group) in run {
            rank_sums[group] += mean_rank;
        }
        ties += length.powi(3) - length;
        start += run.len();
    }
    let spread: f64 = rank_sums
        .iter()
        .zip(&groups)
        .map(|(r, group)| r * r / group.len() as f64)
        .sum();
    let untied = 1.0 - ties / (n.powi(3) - n);
    if untied <= 0.0 {
        return Association {
            p_value: 1.0,
            together: false,
        };
    }
    let h = (12.0 / (n * (n + 1.0)) * spread - 3.0 * (n + 1.0)) / untied;
    let p_value = ChiSquared::new((groups.len() - 1) as f64).map_or(1.0, |law| law.sf(h.max(0.0)));
    Association {
        p_value,
        together: p_value < SIGNIFICANT,
    }
}
