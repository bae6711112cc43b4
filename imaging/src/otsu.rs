//! Otsu's threshold.

/// Otsu's threshold of a histogram of grey levels: it divides the values into two classes so that the variance between
/// the classes is largest (and that within them smallest). Values above it are the bright class. `counts[v]` is how
/// many values have level v; the threshold is in levels. `None` if fewer than two levels occur.
///
/// # Ties
///
/// All thresholds between the brightest value of the dark class and the darkest value of the bright class divide the
/// values alike. The middle between the two is returned: it has the widest margin on both sides, so it suits other
/// images of the same scene too, and inverting the grey levels inverts it. Where different divisions are equally good,
/// as of symmetric histograms, the one with fewer dark values is taken.
///
/// # Formula
///
/// ```text
/// σ_B²(t) = ω₀ ω₁ (μ₀ − μ₁)²        ω: fractions of values in the classes, μ: their mean levels
/// ```
///
/// # References
///
/// Otsu 1979, eq. (14).
///
/// # Examples
///
/// ```
/// use stereology_imaging::otsu;
///
/// let mut counts = [0; 256];
/// for level in [10, 12, 11, 200, 210_usize] {
///     counts[level] += 1;
/// }
/// assert_eq!(otsu(&counts), Some(106.0)); // half way from 12 to 200
/// assert_eq!(otsu(&[0, 7]), None);
/// ```
#[must_use]
pub fn otsu(counts: &[u64]) -> Option<f64> {
    let occurring = || counts.iter().enumerate().filter(|(_, count)| **count > 0);
    let total: f64 = occurring().map(|(_, count)| *count as f64).sum();
    let sum: f64 = occurring().map(|(level, count)| level as f64 * *count as f64).sum();
    let (mut dark, mut dark_sum) = (0.0, 0.0);
    let mut best: Option<(f64, f64)> = None;
    for ((level, &count), (next, _)) in occurring().zip(occurring().skip(1)) {
        dark += count as f64;
        dark_sum += level as f64 * count as f64;
        let bright = total - dark;
        let gap = dark_sum / dark - (sum - dark_sum) / bright;
        let between = dark * bright * gap * gap;
        // Differences within rounding are ties.
        if best.is_none_or(|(most, _)| between > most * (1.0 + 1e-9)) {
            best = Some((between, 0.5 * (level + next) as f64));
        }
    }
    best.map(|(_, threshold)| threshold)
}

#[cfg(test)]
mod tests {
    use super::otsu;
    use proptest::prelude::*;

    /// Sum over both classes of squared deviations from the class mean; what Otsu's threshold minimises.
    fn within(counts: &[u64], threshold: f64) -> f64 {
        [true, false]
            .map(|bright| {
                let class = || {
                    let levels = counts.iter().enumerate();
                    levels
                        .map(|(level, count)| (level as f64, *count as f64))
                        .filter(|(level, _)| (*level > threshold) == bright)
                };
                let n: f64 = class().map(|(_, count)| count).sum();
                let mean = class().map(|(level, count)| level * count).sum::<f64>() / n.max(1.0);
                class()
                    .map(|(level, count)| count * (level - mean).powi(2))
                    .sum::<f64>()
            })
            .iter()
            .sum()
    }

    proptest! {
        /// No threshold leaves less variance within the classes, and the threshold lies in the middle of its gap.
        #[test]
        fn no_threshold_leaves_less_variance_within(counts in prop::collection::vec(prop_oneof![Just(0_u64), 0_u64..50], 0..40)) {
            let levels: Vec<f64> = counts.iter().enumerate().filter(|(_, n)| **n > 0).map(|(level, _)| level as f64).collect();
            let Some(threshold) = otsu(&counts) else {
                prop_assert!(levels.len() < 2);
                return Ok(());
            };
            let least = (0..counts.len()).map(|t| within(&counts, t as f64)).fold(f64::INFINITY, f64::min);
            prop_assert!(within(&counts, threshold) <= least + 1e-6 * (1.0 + within(&counts, -1.0)));
            let below = levels.iter().copied().filter(|l| *l <= threshold).fold(f64::NEG_INFINITY, f64::max);
            let above = levels.iter().copied().filter(|l| *l > threshold).fold(f64::INFINITY, f64::min);
            prop_assert!((threshold - 0.5 * (below + above)).abs() < 1e-12);
        }
    }
}
