//! Findings on a table of profiles before any fit: sizes that cannot be, or that were altered on their way.

use std::f64::consts::PI;
use stereology_metrics::Finding;

/// Profiles below this number are not judged.
const FEWEST: usize = 10;
/// A finding is reported below this p-value.
const ALARM: f64 = 1e-3;
/// Sizes that are multiples of a step are rounded if the largest is no more than this number of steps.
const COARSE_STEPS: f64 = 100.0;

/// Findings on the equivalent circular diameters of profiles on an examined `area`.
///
/// `weights`, one per profile, are those of [`ProfileCounts::from_sizes`](crate::ProfileCounts::from_sizes). Sizes that
/// are not positive and finite are ignored. Codes:
///
/// - `impossible-area`: the profiles cover more than the area, or one of them does.
/// - `outlier`: the largest profile is too large for the distribution of the next ones (Hill's estimator of the tail, p
///   below 0.001) and more than twice as large as the second.
/// - `rounded-sizes`: all sizes are multiples of one step, at most 100 of which make the largest; or all sizes are
///   equal.
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
    let covered: f64 = counted
        .iter()
        .map(|(size, weight)| 0.25 * PI * size * size * weight)
        .sum();
    let mut findings = Vec::new();
    findings.extend(impossible_area(covered, sorted.last().copied().unwrap_or(0.0), area));
    if sorted.len() >= FEWEST {
        findings.extend(outlier(&sorted));
        match rounded(&sorted) {
            Some(finding) => findings.push(finding),
            None => findings.extend(duplicates(&sorted)),
        }
    }
    findings
}

fn impossible_area(covered: f64, largest: f64, area: f64) -> Option<Finding> {
    let one = 0.25 * PI * largest * largest;
    let message = if one > area {
        format!("the largest profile has an area of {one:.4}, more than the examined area {area:.4}")
    } else if covered > area {
        format!("the profiles cover {covered:.4}, more than the examined area {area:.4}")
    } else {
        return None;
    };
    Some(Finding::new(
        "impossible-area",
        format!("{message}: check the area, its unit, and whether sizes are diameters"),
    ))
}

/// Judges the ratio of the largest size to the second by the tail of the next ones: their logarithmic spacings are
/// exponential.
fn outlier(sorted: &[f64]) -> Option<Finding> {
    let n = sorted.len();
    let (first, second) = (sorted[n - 1], sorted[n - 2]);
    let tail = (n / 5).clamp(5, 20).min(n - 3);
    let base = sorted[n - 2 - tail];
    let hill = sorted[n - 1 - tail..n - 1]
        .iter()
        .map(|size| (size / base).ln())
        .sum::<f64>()
        / tail as f64;
    let step = (first / second).ln();
    let ratio = if hill > 0.0 { step / hill } else { f64::INFINITY };
    let p = (1.0 + ratio / tail as f64).powf(-(tail as f64));
    (first > 2.0 * second && p < ALARM).then(|| {
        Finding::new(
            "outlier",
            format!(
                "the largest profile ({first:.4}) is {:.1} times as large as the next one (p = {p:.1e}): check whether it is a profile",
                first / second
            ),
        )
    })
}

/// The step of which all sizes are multiples, if it is coarse.
fn rounded(sorted: &[f64]) -> Option<Finding> {
    let largest = sorted[sorted.len() - 1];
    let gaps = sorted
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|gap| *gap > 1e-9 * largest);
    let step = gaps.fold(f64::INFINITY, f64::min);
    if step.is_infinite() {
        return Some(Finding::new(
            "rounded-sizes",
            format!(
                "all {} profiles have the same size {largest:.4}: sections of any particles differ in size",
                sorted.len()
            ),
        ));
    }
    let is_multiple = |size: &f64| (size / step - (size / step).round()).abs() < 1e-4;
    (largest / step <= COARSE_STEPS && sorted.iter().all(is_multiple)).then(|| {
        Finding::new(
            "rounded-sizes",
            format!(
                "all sizes are multiples of {step:.4}: use sizes that are not rounded, the fit treats them as exact"
            ),
        )
    })
}

/// Repeated sizes, against the number that is expected at the resolution of the sizes.
fn duplicates(sorted: &[f64]) -> Option<Finding> {
    let n = sorted.len() as f64;
    // Sizes measured in pixels have areas that are multiples of a pixel's.
    let areas: Vec<f64> = sorted.iter().map(|size| size * size).collect();
    let largest = areas[areas.len() - 1];
    let same = |a: f64, b: f64| b - a <= 1e-12 * largest;
    let gaps = areas.windows(2).filter(|pair| !same(pair[0], pair[1]));
    let step = gaps.map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let range = areas[areas.len() * 3 / 4] - areas[0];
    let expected = n * (1.0 - (-n * step / range.max(step)).exp());
    let is_repeated =
        |k: usize| (k > 0 && same(areas[k - 1], areas[k])) || (k + 1 < areas.len() && same(areas[k], areas[k + 1]));
    let repeated = (0..areas.len()).filter(|&k| is_repeated(k)).count() as f64;
    (repeated > 0.1 * n && repeated > 5.0 + 3.0 * expected).then(|| {
        Finding::new(
            "duplicate-rows",
            format!(
                "{repeated} of {n} sizes occur more than once, where {expected:.0} are expected at their resolution: rows were probably repeated, and the \
                 intervals are too narrow"
            ),
        )
    })
}
