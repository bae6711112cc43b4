//! Goodness of fit: do the refolded counts explain the observed ones?

use crate::expectation_maximisation::maximise;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use stereology_metrics::Finding;

/// Expected counts per pooled bin: Pearson's statistic follows the chi-square distribution well from here on.
const POOLED: f64 = 5.0;
/// A finding is reported below this p-value, so that at most one table in a thousand raises it by chance.
const ALARM: f64 = 1e-3;

/// The p-value of the model: of the fit, or of the distribution of largest likelihood if that is higher.
///
/// A fit that is smooth, or has few bins, does not follow every distribution: then its misfit does not contradict the
/// model. So a low p-value of the fit is compared with that of the best of all distributions on the size bins of
/// `fine`.
pub(crate) fn p_value_of_model(fine: &DMatrix<f64>, counts: &[f64], expected: &[f64], parameters: f64) -> Option<f64> {
    let of_fit = p_value(counts, expected, parameters);
    if of_fit.is_none_or(|p| p >= ALARM) {
        return of_fit;
    }
    let best = maximise(fine, counts, 0.0, CLOSE, STEPS).densities;
    let refolded = fine * DVector::from_column_slice(&best);
    // A narrow mode that lies between two bins occupies both of them with one parameter.
    let is_occupied = |j: usize| best[j] * fine.column(j).sum() > 0.5;
    let modes = (0..best.len())
        .filter(|&j| is_occupied(j) && (j == 0 || !is_occupied(j - 1)))
        .count();
    let of_best = p_value(counts, refolded.as_slice(), modes as f64);
    [of_fit, of_best].into_iter().flatten().reduce(f64::max)
}

/// The likelihood of the best distribution is maximised up to this difference of its logarithm, in at most so many
/// steps.
const CLOSE: f64 = 0.5;
const STEPS: usize = 3_000;

/// The p-value of the counts under the expected ones: Pearson's X² over neighbouring bins pooled to five expected
/// profiles or more.
///
/// # Formula
///
/// ```text
/// X² = Σ (n − μ)² / μ,   p = P(χ² > X²) with the pooled bins less the parameters in effect as degrees of freedom
/// ```
///
/// `None` without a degree of freedom.
pub(crate) fn p_value(counts: &[f64], expected: &[f64], parameters: f64) -> Option<f64> {
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut n, mut mu) = (0.0, 0.0);
    let mut last = (0.0, 0.0);
    for (count, mean) in counts.iter().zip(expected) {
        n += count;
        mu += mean;
        if mu >= POOLED {
            statistic += (n - mu) * (n - mu) / mu;
            bins += 1.0;
            last = (n, mu);
            (n, mu) = (0.0, 0.0);
        }
    }
    // What remains at the end belongs to the last pooled bin.
    let (last_n, last_mu) = last;
    if last_mu > 0.0 {
        let (whole_n, whole_mu) = (last_n + n, last_mu + mu);
        statistic += (whole_n - whole_mu).powi(2) / whole_mu - (last_n - last_mu).powi(2) / last_mu;
    }
    let freedom = bins - parameters;
    if freedom < 1.0 {
        return None;
    }
    let law = ChiSquared::new(freedom).ok()?;
    Some(law.sf(statistic.max(0.0)))
}

/// `poor-fit`, from the p-value.
pub(crate) fn poor_fit(p_value: Option<f64>) -> Option<Finding> {
    let p = p_value.filter(|p| *p < ALARM)?;
    Some(Finding::new(
        "poor-fit",
        format!(
            "no size distribution of particles of this shape explains the profiles (p = {p:.1e}): the shape, the edge rule, rounding, or profiles that are \
             missing, merged or split may be the cause"
        ),
    ))
}

/// `missing-fines`: below the smallest profile the fit expects profiles, but there are none.
///
/// Sections near the edge of a particle make small profiles of particles of every size, so a gap below the smallest
/// profile means that small profiles were not detected. With μ expected and none observed, p = e^−μ.
pub(crate) fn missing_fines(counts: &[f64], expected: &[f64], smallest_edge: impl Fn(usize) -> f64) -> Option<Finding> {
    let first = counts.iter().position(|n| *n > 0.0)?;
    let below: f64 = expected[..first].iter().sum();
    let p = (-below).exp();
    (p < ALARM).then(|| {
        Finding::new(
            "missing-fines",
            format!(
                "there is no profile below {:.4}, where the fit expects {below:.0} (p = {p:.1e}): small profiles were probably not detected; give the \
                 smallest size that is detected reliably as the threshold",
                smallest_edge(first)
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{missing_fines, p_value, poor_fit};

    /// Counts equal to their expectations fit perfectly; doubled counts do not fit.
    #[test]
    fn the_p_value_separates_good_fits_from_bad_ones() {
        let expected = [2.0, 4.0, 10.0, 20.0, 10.0, 3.0];
        assert!(p_value(&expected, &expected, 1.0).is_some_and(|p| p > 0.999));
        let doubled = expected.map(|mean| 2.0 * mean);
        let p = p_value(&doubled, &expected, 1.0);
        assert!(p.is_some_and(|p| p < 1e-6) && poor_fit(p).is_some());
        assert_eq!(p_value(&[1.0], &[1.0], 0.0), None);
    }

    #[test]
    fn a_gap_below_the_smallest_profile_is_found() {
        assert!(missing_fines(&[0.0, 0.0, 50.0], &[4.0, 6.0, 40.0], |_| 0.5).is_some());
        assert_eq!(missing_fines(&[1.0, 0.0, 50.0], &[4.0, 6.0, 40.0], |_| 0.5), None);
    }
}
