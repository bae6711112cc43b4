//! Findings on a result: the symptoms that section 5.2 of the paper names, and those of the fit.

use crate::estimator::Fit;
use crate::kernel::Kernel;
use crate::options::{Method, UnfoldOptions};
use crate::problem::Problem;
use crate::profile_counts::ProfileCounts;
use stereology_metrics::Finding;

/// The inverse gave negative densities.
const NEGATIVE: &str = "negative-bins";
/// Densities of neighbouring bins oscillate.
const OSCILLATING: &str = "oscillating-bins";

/// A finding that names the number of equal bins that cures it: the largest below `bins` for which `unfold_again`,
/// which unfolds the same profiles in that many bins, does not return the same code.
///
/// Only `negative-bins` and `oscillating-bins` are cured by fewer bins; other findings are returned unchanged.
///
/// ```
/// use stereology_unfold::{Finding, with_cure};
/// let found = Finding::new("negative-bins", "one density is negative");
/// let cured = with_cure(&found, 10, &|bins| if bins > 6 { vec![found.clone()] } else { Vec::new() });
/// assert_eq!(cured.message, "one density is negative. The largest number of equal bins without it is 6");
/// ```
#[must_use]
pub fn with_cure(finding: &Finding, bins: usize, unfold_again: &dyn Fn(usize) -> Vec<Finding>) -> Finding {
    if finding.code != NEGATIVE && finding.code != OSCILLATING {
        return finding.clone();
    }
    let without = |fewer: &usize| unfold_again(*fewer).iter().all(|other| other.code != finding.code);
    match (1..bins).rev().find(without) {
        None => finding.clone(),
        Some(1) => Finding::new(
            finding.code,
            format!("{}. The largest number of bins without it is 1", finding.message),
        ),
        Some(enough) => Finding::new(
            finding.code,
            format!(
                "{}. The largest number of equal bins without it is {enough}",
                finding.message
            ),
        ),
    }
}

/// Bin numbers from 1, as in tables.
fn numbered(bins: &[usize]) -> String {
    bins.iter()
        .map(|bin| (bin + 1).to_string())
        .collect::<Vec<_>>()
        .join(", ")
}

/// All findings on a fit. Codes: `negative-bins`, `few-profiles-in-bin`, `oscillating-bins`, `threshold-moved`,
/// `not-converged`.
pub(crate) fn findings(
    problem: &Problem,
    counts: &ProfileCounts,
    kernel: &Kernel,
    options: &UnfoldOptions,
    fit: &Fit,
    coarse: &[f64],
) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !fit.negative.is_empty() {
        let bins: Vec<usize> = fit.negative.iter().map(|&(k, _)| problem.reported[k]).collect();
        let cut = -fit.negative.iter().map(|&(_, density)| density).sum::<f64>() / coarse.iter().sum::<f64>();
        findings.push(Finding::new(
            NEGATIVE,
            format!(
                "{} of the densities were negative (bins {}) and were set to zero, {:.1} % of the total: small profiles may be missing, or there are too many \
                 bins for the profiles; use fewer bins, a threshold, or the method auto",
                bins.len(),
                numbered(&bins),
                100.0 * cut
            ),
        ));
    }
    let edges = kernel.sizes().reported_edges().iter().copied();
    let above: Vec<f64> = edges.filter(|&edge| edge >= problem.threshold).collect();
    if above.len() > 1 {
        findings.extend(few_profiles(&above, |x| cumulative(counts, problem.first_row, x)));
    }
    // A smooth estimate has no noise to magnify, and the gaps of a sparse one are its answer.
    if !matches!(fit.method, Method::Penalised | Method::Sparse) {
        findings.extend(oscillation(coarse));
    }
    if let Some(requested) = options.min_size
        && problem.threshold > requested * (1.0 + 1e-9)
    {
        findings.push(Finding::new(
            "threshold-moved",
            format!(
                "the threshold {requested} lies inside a profile bin, which was left out entirely: profiles above {} were used",
                problem.threshold
            ),
        ));
    }
    if !fit.converged {
        findings.push(Finding::new(
            "not-converged",
            format!(
                "not converged after {} iterations: allow more, or a larger tolerance",
                fit.iterations
            ),
        ));
    }
    findings
}

/// Profiles up to size `x` from a row on, spread evenly inside their bins.
fn cumulative(counts: &ProfileCounts, first_row: usize, x: f64) -> f64 {
    let bins = counts.edges().windows(2).zip(counts.counts()).skip(first_row);
    bins.map(|(bin, count)| count * ((x - bin[0]) / (bin[1] - bin[0])).clamp(0.0, 1.0))
        .sum()
}

/// Fewer profiles than this in a bin are few: five, as in tests of goodness of fit.
const FEW: f64 = 5.0;

/// Bins between `edges` with few counts but not none; `cumulative(x)` is the number of profiles up to size x.
pub(crate) fn few_profiles(edges: &[f64], cumulative: impl Fn(f64) -> f64) -> Option<Finding> {
    let is_few = |from: f64, to: f64| {
        let count = cumulative(to) - cumulative(from);
        count > 1e-9 && count < FEW
    };
    let bins: Vec<usize> = (0..edges.len() - 1)
        .filter(|&k| is_few(edges[k], edges[k + 1]))
        .collect();
    if bins.is_empty() {
        return None;
    }
    let largest = edges[edges.len() - 1];
    // Bins of other widths may have a cure in as many equal ones, or more.
    let enough = (1..edges.len())
        .rev()
        .find(|&n| (0..n).all(|k| !is_few(largest * k as f64 / n as f64, largest * (k + 1) as f64 / n as f64)));
    let cure = match enough {
        None => "there are fewer than five in all, too few for any bin".to_owned(),
        Some(1) => "1 bin would hold five or more".to_owned(),
        Some(enough) => format!("{enough} equal bins would hold five or more each"),
    };
    Some(Finding::new(
        "few-profiles-in-bin",
        format!(
            "fewer than five profiles in bin {}: its density is uncertain; {cure}",
            numbered(&bins)
        ),
    ))
}

/// The longest run of alternating threefold swings, if it has three swings or more.
pub(crate) fn oscillation(densities: &[f64]) -> Option<Finding> {
    let floor = 1e-3 * densities.iter().copied().fold(0.0, f64::max);
    let swing = |k: usize| {
        let (left, right) = (densities[k].max(floor), densities[k + 1].max(floor));
        if right > 3.0 * left {
            1
        } else if left > 3.0 * right {
            -1
        } else {
            0
        }
    };
    let (mut best, mut start) = ((0, 0), 0);
    for k in 0..densities.len().saturating_sub(1) {
        if swing(k) == 0 {
            start = k + 1;
        } else if k > start && swing(k) == swing(k - 1) {
            start = k;
        }
        if swing(k) != 0 && k + 1 - start > best.1 - best.0 {
            best = (start, k + 1);
        }
    }
    (best.1 - best.0 >= 3).then(|| {
        Finding::new(
            OSCILLATING,
            format!(
                "densities oscillate from bin {} to bin {}: amplified noise of the counts; use fewer bins or the method auto",
                best.0 + 1,
                best.1 + 1
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{few_profiles, oscillation};

    #[test]
    fn swings_are_distinguished_from_slopes_and_peaks() {
        assert_eq!(oscillation(&[1.0, 10.0, 100.0, 10.0, 1.0]), None);
        assert_eq!(oscillation(&[0.0, 0.0, 1.0, 0.0, 0.0]), None);
        let found = oscillation(&[1.0, 1.1, 10.0, 1.0, 9.0, 9.0]).unwrap();
        assert!(found.code == "oscillating-bins" && found.message.contains("from bin 2 to bin 5"));
        assert_eq!(oscillation(&[1.0]), None);
    }

    #[test]
    fn few_profiles_name_the_number_of_bins_that_cures_them() {
        // 3 profiles up to 1, 20 up to 2, none above: two bins of 1.5 hold 11.5 and 8.5.
        let cumulative = |x: f64| 3.0 * x.min(1.0) + 17.0 * (x - 1.0).clamp(0.0, 1.0);
        let found = few_profiles(&[0.0, 1.0, 2.0, 3.0], cumulative).unwrap();
        assert!(found.message.contains("in bin 1:") && found.message.contains("2 equal bins"));
        assert_eq!(few_profiles(&[1.0, 2.0, 3.0], cumulative), None);
    }
}
