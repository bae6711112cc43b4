//! What a reader of the result should know: the symptoms of the paper's section 5.2 and of the fit, as data.

use crate::estimator::Fit;
use crate::problem::Problem;
use crate::{Kernel, Method, ProfileCounts, UnfoldOptions};
use std::fmt;

/// A warning about a result. [`Finding::code`] is fixed for scripts; `Display` is for people.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// The inverse gave negative densities, which were set to zero (`negative-bins`).
    NegativeBins {
        /// Size bins, from 0.
        bins: Vec<usize>,
        /// The sum of what was cut off, over the sum of what stayed.
        share: f64,
        /// The largest number of equal bins without a negative density, if it was looked for ([`with_cure`](Self::with_cure)).
        enough: Option<usize>,
    },
    /// Some bins hold fewer than five profiles, but not none (`few-profiles-in-bin`).
    FewProfilesInBin {
        /// Profile bins merged to the size bins, from 0.
        bins: Vec<usize>,
        /// The largest number of equal bins with five or more profiles in every bin that has any; `None` if there are fewer than five in all.
        enough: Option<usize>,
    },
    /// Densities of neighbouring bins swing up and down threefold, three times in a row or more (`oscillating-bins`).
    OscillatingBins {
        /// First and last size bin of the longest such run, from 0.
        from: usize,
        /// Last bin of the run.
        to: usize,
        /// The largest number of equal bins without such a run, if it was looked for ([`with_cure`](Self::with_cure)).
        enough: Option<usize>,
    },
    /// The threshold is no profile edge; the bin it falls in was left out too (`threshold-moved`).
    ThresholdMoved {
        /// The threshold that was asked for.
        asked: f64,
        /// The one used.
        used: f64,
    },
    /// The iteration ended at its limit before its tolerance (`not-converged`).
    NotConverged {
        /// Steps done.
        iterations: usize,
    },
}

impl Finding {
    /// The fixed code of the warning.
    ///
    /// ```
    /// use stereology_unfold::Finding;
    /// assert_eq!(Finding::NegativeBins { bins: vec![0], share: 0.01, enough: None }.code(), "negative-bins");
    /// ```
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::NegativeBins { .. } => "negative-bins",
            Self::FewProfilesInBin { .. } => "few-profiles-in-bin",
            Self::OscillatingBins { .. } => "oscillating-bins",
            Self::ThresholdMoved { .. } => "threshold-moved",
            Self::NotConverged { .. } => "not-converged",
        }
    }

    /// The finding with the number of equal bins that cures it: the largest below `bins` at which `unfold_again`, which unfolds the same profiles in
    /// so many bins, does not come to the same finding. Findings that bins do not cure, or that name the number already, stay as they are.
    ///
    /// ```
    /// use stereology_unfold::Finding;
    /// let found = Finding::NegativeBins { bins: vec![0], share: 0.01, enough: None };
    /// let cured = found.with_cure(10, &|bins| if bins > 6 { vec![found.clone()] } else { Vec::new() });
    /// assert!(cured.to_string().contains("6 equal bins"));
    /// ```
    #[must_use]
    pub fn with_cure(&self, bins: usize, unfold_again: &dyn Fn(usize) -> Vec<Self>) -> Self {
        let mut cured = self.clone();
        if let Self::NegativeBins { enough, .. } | Self::OscillatingBins { enough, .. } = &mut cured {
            *enough = (1..bins)
                .rev()
                .find(|&fewer| unfold_again(fewer).iter().all(|finding| finding.code() != self.code()));
        }
        cured
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NegativeBins { bins, share, enough } => write!(
                f,
                "{} of the densities came out negative (bins {}) and were set to zero, {:.1} % of the total: small profiles may be missing, \
                 or bins are too many for the profiles; use {}, a threshold, or the method auto",
                bins.len(),
                numbered(bins),
                100.0 * share,
                fewer(*enough)
            ),
            Self::FewProfilesInBin { bins, enough } => {
                write!(
                    f,
                    "fewer than five profiles in bin {}: its density is uncertain; ",
                    numbered(bins)
                )?;
                match enough {
                    None => f.write_str("there are fewer than five in all, too few for any bin"),
                    Some(1) => f.write_str("1 bin would hold five or more"),
                    Some(enough) => write!(f, "{enough} equal bins would hold five or more each"),
                }
            }
            Self::OscillatingBins { from, to, enough } => write!(
                f,
                "densities swing up and down from bin {} to bin {}: noise of the counts, magnified; use {} or the method auto",
                from + 1,
                to + 1,
                fewer(*enough)
            ),
            Self::ThresholdMoved { asked, used } => {
                write!(
                    f,
                    "the threshold {asked} lies inside a profile bin, all of which was left out: profiles above {used} were used"
                )
            }
            Self::NotConverged { iterations } => {
                write!(
                    f,
                    "not converged after {iterations} iterations: allow more, or a larger tolerance"
                )
            }
        }
    }
}

/// What to use instead.
fn fewer(enough: Option<usize>) -> String {
    match enough {
        Some(1) => "1 bin".to_owned(),
        Some(bins) => format!("{bins} equal bins, the most without it"),
        None => "fewer bins".to_owned(),
    }
}

/// Bins as people count them, from 1.
fn numbered(bins: &[usize]) -> String {
    bins.iter()
        .map(|bin| (bin + 1).to_string())
        .collect::<Vec<_>>()
        .join(", ")
}

/// Everything a reader of a result should know.
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
        findings.push(Finding::NegativeBins {
            bins: fit.negative.iter().map(|&(k, _)| problem.reported[k]).collect(),
            share: -fit.negative.iter().map(|&(_, density)| density).sum::<f64>() / coarse.iter().sum::<f64>(),
            enough: None,
        });
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
    if let Some(asked) = options.min_size
        && problem.threshold > asked * (1.0 + 1e-9)
    {
        findings.push(Finding::ThresholdMoved {
            asked,
            used: problem.threshold,
        });
    }
    if !fit.converged {
        findings.push(Finding::NotConverged {
            iterations: fit.iterations,
        });
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
    Some(Finding::FewProfilesInBin { bins, enough })
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
    (best.1 - best.0 >= 3).then_some(Finding::OscillatingBins {
        from: best.0,
        to: best.1,
        enough: None,
    })
}

#[cfg(test)]
mod tests {
    use super::{Finding, few_profiles, oscillation};

    #[test]
    fn swings_are_told_from_slopes_and_peaks() {
        assert_eq!(oscillation(&[1.0, 10.0, 100.0, 10.0, 1.0]), None);
        assert_eq!(oscillation(&[0.0, 0.0, 1.0, 0.0, 0.0]), None);
        assert_eq!(
            oscillation(&[1.0, 1.1, 10.0, 1.0, 9.0, 9.0]),
            Some(Finding::OscillatingBins {
                from: 1,
                to: 4,
                enough: None
            })
        );
        assert_eq!(oscillation(&[1.0]), None);
    }

    #[test]
    fn few_profiles_name_the_number_of_bins_that_cures_them() {
        // 3 profiles up to 1, 20 up to 2, none above: two bins of 1.5 hold 11.5 and 8.5.
        let cumulative = |x: f64| 3.0 * x.min(1.0) + 17.0 * (x - 1.0).clamp(0.0, 1.0);
        assert_eq!(
            few_profiles(&[0.0, 1.0, 2.0, 3.0], cumulative),
            Some(Finding::FewProfilesInBin {
                bins: vec![0],
                enough: Some(2)
            })
        );
        assert_eq!(few_profiles(&[1.0, 2.0, 3.0], cumulative), None);
    }
}
