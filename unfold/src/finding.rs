//! What a reader of the result should know: the symptoms of the paper's section 5.2 and of the fit, as data.

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
    },
    /// Some bins hold fewer than five profiles, but not none (`few-profiles-in-bin`).
    FewProfilesInBin {
        /// Profile bins merged to the size bins, from 0.
        bins: Vec<usize>,
        /// The largest number of equal bins with five or more profiles in every bin that has any.
        enough: usize,
    },
    /// Densities of neighbouring bins swing up and down threefold, three times in a row or more (`oscillating-bins`).
    OscillatingBins {
        /// First and last size bin of the longest such run, from 0.
        from: usize,
        /// Last bin of the run.
        to: usize,
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
    /// assert_eq!(Finding::NegativeBins { bins: vec![0], share: 0.01 }.code(), "negative-bins");
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
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NegativeBins { bins, share } => write!(
                f,
                "{} of the densities came out negative (bins {}) and were set to zero, {:.1} % of the total: small profiles may be missing, \
                 or bins are too many for the profiles; use fewer bins, a threshold, or the method nnls or em",
                bins.len(),
                numbered(bins),
                100.0 * share
            ),
            Self::FewProfilesInBin { bins, enough } => write!(
                f,
                "fewer than five profiles in bin {}: its density is uncertain; {enough} equal bins would hold five or more each",
                numbered(bins)
            ),
            Self::OscillatingBins { from, to } => write!(
                f,
                "densities swing up and down from bin {} to bin {}: noise of the counts, magnified; use fewer bins",
                from + 1,
                to + 1
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

/// Bins as people count them, from 1.
fn numbered(bins: &[usize]) -> String {
    bins.iter()
        .map(|bin| (bin + 1).to_string())
        .collect::<Vec<_>>()
        .join(", ")
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
    let enough = (1..edges.len() - 1)
        .rev()
        .find(|&n| (0..n).all(|k| !is_few(largest * k as f64 / n as f64, largest * (k + 1) as f64 / n as f64)))
        .unwrap_or(1);
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
            Some(Finding::OscillatingBins { from: 1, to: 4 })
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
                enough: 2
            })
        );
        assert_eq!(few_profiles(&[1.0, 2.0, 3.0], cumulative), None);
    }
}
