//! Findings on a table of profiles before any fit: sizes that cannot be, or that were altered on their way.

use std::f64::consts::PI;
use stereology_metrics::Finding;

/// Profiles below this number are not judged.
const FEWEST: usize = 10;
/// Sizes that are multiples of a step are rounded if the largest is no more than this number of steps, or the median
/// no more than half of it.
const COARSE_STEPS: f64 = 100.0;

/// Findings on the equivalent circular diameters of profiles on an examined `area`.
///
/// `weights`, one per profile, are those of [`ProfileCounts::from_sizes`](crate::ProfileCounts::from_sizes). Sizes that
/// are not positive and finite are ignored. Codes:
///
/// - `impossible-area`: the profiles cover more than the area by more than 2.5 standard errors of their sum, or one of
///   them does.
/// - `outlier`: the largest profile, or the two or three largest, are more than twice as large as the next one, and too
///   large for the tail below (Hill's estimator, p below 0.003).
/// - `rounded-sizes`: all sizes are multiples of one step, at most 100 of which make the largest or 50 the
///   median; or all sizes are equal.
/// - `duplicate-rows`: more sizes are repeated exactly than their resolution explains.
///
/// Complexity: n log n.
///
/// ```
/// let mut sizes: Vec<f64> = (1..=100).map(|k| (f64::from(k) * 0.7).sin().abs() + 0.1).collect();
/// assert!(stereology_unfold::profile_findings(&sizes, None, 1e3).is_empty());
/// sizes.push(100.0);
/// let codes: Vec<&str> = stereology_unfold::profile_findings(&sizes, None, 1e3).iter().map(|of| of.code).collect();
/// assert_eq!(codes, ["impossible-area", "outlier"]);
/// ```
#[must_use]
pub fn profile_findings(sizes: &[f64], weights: Option<&[f64]>, area: f64) -> Vec<Finding> {
    let weight = |k: usize| weights.map_or(1.0, |weights| weights.get(k).copied().unwrap_or(0.0));
    let counted: Vec<(f64, f64)> = (0..sizes.len())
        .map(|k| (sizes[k], weight(k)))
        .filter(|(size, weight)| *size > 0.0 && size.is_finite() && *weight > 0.0)
        .collect();
    let mut sorted: Vec<f64> = counted.iter().map(|(size, _)| *size).collect();
    sorted.sort_by(f64::total_cmp);
    let mut findings = Vec::new();
    findings.extend(impossible_area(&counted, area));
    if sorted.len() >= FEWEST {
        findings.extend(outlier(&sorted));
        match rounded(&sorted) {
            Some(finding) => findings.push(finding),
            None => findings.extend(duplicates(&sorted)),
        }
    }
    findings
}

/// Standard errors by which profiles must exceed their area: the area fraction of a sample scatters, most of all where
/// large profiles count more than once to make up for those at the edges.
const BEYOND: f64 = 2.5;

fn impossible_area(counted: &[(f64, f64)], area: f64) -> Option<Finding> {
    let of_one = |size: f64| 0.25 * PI * size * size;
    let largest = counted.iter().map(|(size, _)| of_one(*size)).fold(0.0, f64::max);
    let covered: f64 = counted.iter().map(|(size, weight)| of_one(*size) * weight).sum();
    let variance: f64 = counted
        .iter()
        .map(|(size, weight)| (of_one(*size) * weight).powi(2))
        .sum();
    let message = if largest > area {
        format!("the largest profile has an area of {largest:.4}, more than the examined area {area:.4}")
    } else if covered > area + BEYOND * variance.sqrt() {
        format!("the profiles cover {covered:.4}, more than the examined area {area:.4}")
    } else {
        return None;
    };
    Some(Finding::new(
        "impossible-area",
        format!("{message}: check the area, its unit, and whether sizes are diameters"),
    ))
}

/// The number of profiles that may stand apart from the others.
const APART: usize = 3;
/// The number of sizes that determine the tail.
const TAIL: usize = 60;
/// A finding is reported below this p-value. Most tails are lighter than the power law that Hill's estimator assumes:
/// of a thousand samples of lognormal or gamma-distributed sizes less than one is below.
const UNLIKELY: f64 = 3e-3;

/// Judges the ratios of the largest sizes to the next ones by the tail below: for sizes in decreasing order, k times
/// the logarithm of the ratio of the k-th to the next is exponential with the same mean for all k.
fn outlier(sorted: &[f64]) -> Option<Finding> {
    let n = sorted.len();
    (1..=APART.min(n / 5)).rev().find_map(|apart| {
        let (first, second) = (sorted[n - apart], sorted[n - apart - 1]);
        let tail = (n / 5).clamp(5, TAIL).min(n - apart - 2);
        let base = sorted[n - apart - 1 - tail];
        let spacings = sorted[n - apart - tail..n - apart]
            .iter()
            .map(|size| (size / base).ln());
        let hill = spacings.sum::<f64>() / tail as f64;
        let step = apart as f64 * (first / second).ln();
        let ratio = if hill > 0.0 { step / hill } else { f64::INFINITY };
        let tests = if apart == 1 { 1.0 } else { APART as f64 };
        let p = (tests * (1.0 + ratio / tail as f64).powf(-(tail as f64))).min(1.0);
        let which = if apart == 1 {
            format!("the largest profile ({first:.4}) is")
        } else {
            format!("the {apart} largest profiles (from {first:.4} on) are")
        };
        (first > 2.0 * second && p < UNLIKELY).then(|| {
            Finding::new(
                "outlier",
                format!(
                    "{which} {:.1} times as large as the next one (p = {p:.1e}): check whether it is a profile",
                    first / second
                ),
            )
        })
    })
}

/// The step of which all sizes are multiples, if it is coarse.
fn rounded(sorted: &[f64]) -> Option<Finding> {
    let largest = sorted[sorted.len() - 1];
    if sorted[0] >= largest * (1.0 - 1e-9) {
        return Some(Finding::new(
            "rounded-sizes",
            format!(
                "all {} profiles have the same size {largest:.4}: sections of any particles differ in size",
                sorted.len()
            ),
        ));
    }
    let finest = 0.99 * largest.min(2.0 * sorted[sorted.len() / 2]) / COARSE_STEPS;
    let step = sorted
        .iter()
        .try_fold(largest, |step, &size| common_step(step, size, finest))?;
    Some(Finding::new(
        "rounded-sizes",
        format!("all sizes are multiples of {step:.4}: use sizes that are not rounded, the fit treats them as exact"),
    ))
}

/// The greatest common divisor of two lengths that were rounded in their fourth digit, by Euclid's algorithm; `None` if
/// it is below `finest`.
fn common_step(a: f64, b: f64, finest: f64) -> Option<f64> {
    let (mut large, mut small) = (a.max(b), a.min(b));
    let none = 1e-4 * large;
    while small > none {
        let rest = large - small * (large / small).round();
        (large, small) = (small, rest.abs());
    }
    (large >= finest).then_some(large)
}

/// Sizes are compared with those at up to this number of steps of their resolution.
const STEPS: f64 = 10.0;
/// Standard errors by which repeated sizes must exceed their expectation, and the fraction of the profiles.
const REPEATED: (f64, f64) = (5.0, 0.05);

/// Repeated sizes, against the number that is expected at the resolution of the sizes.
///
/// At a resolution s, as many pairs of sizes are equal as differ by 1 s, 2 s, ..., but for a factor of two: differences
/// have two signs. Sizes measured in pixels have areas that are multiples of a pixel's, so areas are tried too.
fn duplicates(sorted: &[f64]) -> Option<Finding> {
    let areas: Vec<f64> = sorted.iter().map(|size| size * size).collect();
    let (excess, equal, expected) = [sorted, &areas]
        .into_iter()
        .map(excess_pairs)
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    (excess > REPEATED.0 && equal - expected > REPEATED.1 * sorted.len() as f64).then(|| {
        Finding::new(
            "duplicate-rows",
            format!(
                "{equal} pairs of sizes are equal, where {expected:.0} are expected at their resolution: rows were probably repeated, and the intervals are \
                 too narrow"
            ),
        )
    })
}

/// By how many standard errors pairs of equal values are too many; their number; the number that is expected.
fn excess_pairs(sorted: &[f64]) -> (f64, f64, f64) {
    let n = sorted.len();
    let same = 1e-9 * sorted[n - 1];
    let gaps = sorted
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|gap| *gap > same);
    let step = gaps.fold(f64::INFINITY, f64::min);
    // Pairs up to a distance: every value with those above it, in one pass.
    let pairs = |distance: f64| {
        let mut above = 0;
        let mut sum = 0.0;
        for (k, value) in sorted.iter().enumerate() {
            while above < n && sorted[above] - value <= distance {
                above += 1;
            }
            sum += (above - k - 1) as f64;
        }
        sum
    };
    let equal = pairs(same);
    let near = pairs((STEPS + 0.5) * step) - equal;
    let expected = near / (2.0 * STEPS);
    // Of λ values per step on average, pairs of equal ones vary by 1 + 2 λ times Poisson's variance.
    let crowding = 1.0 + 4.0 * expected / n as f64;
    let variance = 1.0 + crowding * (expected + near / (4.0 * STEPS * STEPS));
    ((equal - expected) / variance.sqrt(), equal, expected)
}

#[cfg(test)]
mod tests {
    use super::{common_step, excess_pairs};
    use proptest::prelude::*;

    proptest! {
        /// Multiples of a step have it as their common step.
        #[test]
        fn steps_are_found(step in 0.01..10.0_f64, a in 1_u32..30, b in 1_u32..30) {
            let gcd = |mut a: u32, mut b: u32| {
                while b > 0 {
                    (a, b) = (b, a % b);
                }
                a
            };
            let found = common_step(step * f64::from(a), step * f64::from(b), 0.5 * step).unwrap();
            prop_assert!((found / step - f64::from(gcd(a, b))).abs() < 1e-3);
        }

        /// Whole numbers drawn at random have as many equal pairs as expected; with every value twice they have not.
        #[test]
        fn equal_pairs_of_whole_numbers_are_expected(seed in 1_u64..1_000_000, range in 1_500_u64..5_000) {
            let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mut draw = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((state >> 33) % range + 1) as f64
            };
            let mut values: Vec<f64> = (0..500).map(|_| draw()).collect();
            values.sort_by(f64::total_cmp);
            prop_assert!(excess_pairs(&values).0 < 6.0);
            let twice: Vec<f64> = values.iter().flat_map(|value| [*value; 2]).collect();
            prop_assert!(excess_pairs(&twice).0 > 6.0);
        }
    }
}
