//! Findings on the reliability of a segmentation: is there a binder, are there enough profiles, does their number
//! depend on the thresholds?

use ndarray::Array2;
use stereology_imaging::connected_components;

use crate::ground::seen::LEAST_COVERED;
use crate::labels::flecks::remove_flecks;
use crate::labels::profile::Profile;
use crate::labels::split::{required_rise, split_by_shape};
use crate::labels::watershed::Basins;
use crate::options::SegmentOptions;
use crate::outlines::half_contrast::{SHARP, half_contrast};
use crate::outlines::regions::{fill_holes, hysteresis, open};
use stereology_metrics::Finding;

/// Fewest profiles for a size distribution.
const FEW: usize = 50;
/// Percentage of profiles at the photo's edge beyond which there is a warning.
const EDGE: f64 = 20.0;
/// Percentage of profiles near the minimum area above which there is a warning.
const SMALL: f64 = 10.0;
/// Factors by which a parameter is varied.
const FACTORS: [f32; 3] = [0.8, 1.0, 1.2];
/// Side of the central part of the photo in which other thresholds are tried, pixels.
const TRIED_SIDE: usize = 600;
/// Change of the number of profiles, percent, beyond which there is a warning.
const UNSTABLE: f64 = 10.0;
/// Range of usual area fractions.
const USUAL: std::ops::RangeInclusive<f64> = 0.01..=0.7;
/// Area fraction beyond which hardly anything is left to be a binder.
const ALL: f64 = 0.85;

/// Findings on the profiles themselves: an unusual area fraction, too few profiles, many at the edge or near the least
/// area.
pub(crate) fn profile_findings(
    profiles: &[Profile],
    area_fraction: f64,
    frame_limited: bool,
    options: &SegmentOptions,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !USUAL.contains(&area_fraction) {
        findings.push(Finding::new(
            "area-fraction",
            format!(
                "profiles cover {:.2} % of the photo, which is unusual for particles in a binder: look at the overlay",
                100.0 * area_fraction
            ),
        ));
    }
    let n = profiles.len();
    let percent = |k: usize| 100.0 * k as f64 / n.max(1) as f64;
    if n < FEW {
        findings.push(Finding::new("few-profiles", format!("{n} profiles; size distributions need at least 50, preferably several hundred: use a larger photo, or several")));
    }
    let cut = percent(profiles.iter().filter(|p| p.touches_edge).count());
    if frame_limited {
        findings.push(Finding::new("edge-heavy", "profiles extend over more than half the photo; the counting frame is limited and favours small ones: use a larger photo"));
    } else if cut > EDGE {
        findings.push(Finding::new(
            "edge-heavy",
            format!("{cut:.0} % of the profiles are cut by the photo's edge; use a larger photo"),
        ));
    }
    let is_small = |p: &&Profile| p.area < 1.5 * options.min_area as f64;
    let small = percent(profiles.iter().filter(is_small).count());
    if small > SMALL {
        findings.push(Finding::new("near-minimum", format!("{small:.0} % of the profiles are within half of the minimum area of {} pixels: many more may be too small to be detected; use a photo of higher resolution", options.min_area)));
    }
    findings
}

/// How the number of profiles changes with other thresholds and another rise: each a fifth lower, as it is and a fifth
/// higher.
pub(crate) fn count_findings(thresholds: [usize; 3], rise: [usize; 3]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (name, [lower, here, higher]) in [("thresholds", thresholds), ("rise", rise)] {
        let difference = lower.abs_diff(here).max(higher.abs_diff(here));
        let change = 100.0 * difference as f64 / here.max(1) as f64;
        // In a photo of a few particles, one more or less is no instability.
        if change > UNSTABLE && difference > 2 {
            findings.push(Finding::new("unstable-count", format!("with the {name} a fifth lower or higher the number of profiles in the middle of the photo changes by {change:.0} %: {lower}, {here}, {higher}; look at the overlay, or give the {name}")));
        }
    }
    findings
}

/// Warns if there is probably no binder. The binder covers the fraction `covered` of the photo; `is_clear` if the
/// colours of the particles differ clearly from it.
pub(crate) fn binder_finding(covered: f64, is_clear: bool, area_fraction: f64) -> Option<Finding> {
    let advice = "give its colour if there is one, or import a label map drawn by hand or by another tool";
    let percent = |fraction: f64| 100.0 * fraction;
    let message = if covered < LEAST_COVERED {
        format!(
            "the most likely binder colour covers only {:.0} % of the photo; {advice}",
            percent(covered)
        )
    } else if !is_clear {
        format!(
            "most pixels that differ from the most likely binder colour differ only slightly: the colours overlap, and outlines are arbitrary; {advice}"
        )
    } else if area_fraction > ALL {
        format!(
            "particles would cover {:.0} % of the photo; {advice}",
            percent(area_fraction)
        )
    } else {
        return None;
    };
    Some(Finding::new("no-binder", message))
}

/// Numbers of profiles in the middle of the photo with thresholds a fifth lower, as they are and a fifth higher: by the
/// same steps, but with one iteration of each.
pub(crate) fn counts_by_threshold(
    distance: &Array2<f32>,
    deviation: &Array2<[f32; 3]>,
    [low, high]: [f32; 2],
    options: &SegmentOptions,
) -> [usize; 3] {
    let (distance, deviation) = (middle(distance), middle(deviation));
    let blur = options.smoothing.hypot(SHARP);
    FACTORS.map(|f| {
        let mut mask = hysteresis(&distance, f * low, f * high);
        fill_holes(&mut mask, |hole, around| hole <= options.min_area.max(around / 20));
        open(&mut mask);
        mask = half_contrast(&deviation, &mask, blur);
        open(&mut mask);
        let (parts, _) = connected_components(mask.view(), |m| m);
        let mut labels = split_by_shape(&parts, options.rise);
        remove_flecks(&mut labels, &distance, &deviation, f * high, options.min_area);
        let mut areas = vec![0_usize; 1 + labels.iter().copied().max().unwrap_or(0) as usize];
        labels.iter().for_each(|&l| areas[l as usize] += 1);
        areas[1..].iter().filter(|a| **a >= options.min_area).count()
    })
}

/// The middle of an image, at most [`TRIED_SIDE`] pixels wide and high.
fn middle<T: Copy>(image: &Array2<T>) -> Array2<T> {
    let (height, width) = image.dim();
    let (rows, columns) = (height.min(TRIED_SIDE), width.min(TRIED_SIDE));
    let (top, left) = ((height - rows) / 2, (width - columns) / 2);
    Array2::from_shape_fn((rows, columns), |(y, x)| image[[top + y, left + x]])
}

/// Numbers of labels with a minimum peak-to-saddle height a fifth lower, as it is and a fifth higher.
pub(crate) fn counts_by_rise(basins: &Basins, dim: (usize, usize), options: &SegmentOptions) -> [usize; 3] {
    FACTORS.map(|f| basins.count(required_rise(dim, options.rise.map(|r| f * r)), options.min_area))
}
