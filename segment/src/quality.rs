//! What to know before trusting a segmentation: is there a binder, are there enough profiles, would other thresholds find others?

use ndarray::Array2;
use stereology_imaging::connected_components;

use crate::{
    finding::Finding,
    hills::Hills,
    options::{EdgeRule, SegmentOptions},
    refine::half_contrast,
    regions::{fill_holes, hysteresis, open},
    segmentation::{SHARP, Segmentation, drop_faint},
    split::{rising, split_by_shape},
};

/// Fewest profiles that make a distribution of sizes.
const FEW: usize = 50;
/// Percent of the profiles at the photo's edge that is worth a warning.
const EDGE: f64 = 20.0;
/// Percent of the profiles near the least area that is worth a warning.
const SMALL: f64 = 10.0;
/// Factors that show whether a number was a matter of luck.
const MOVED: [f32; 3] = [0.8, 1.0, 1.2];
/// Side of the part of the photo in which other thresholds are tried, pixels.
const JUDGED: usize = 600;
/// Change of the number of profiles, percent, that is worth a warning.
const UNSTABLE: f64 = 10.0;
/// Area fractions beyond which something is wrong, or unusual.
const USUAL: std::ops::RangeInclusive<f64> = 0.01..=0.7;
/// Share of the photo that a binder covers at least.
pub(crate) const LEAST_SHARE: f64 = 0.2;
/// Area fraction at which nothing is left to be a binder.
const ALL: f64 = 0.85;

impl Segmentation {
    pub(crate) fn judge_profiles(&mut self, options: &SegmentOptions, cut_short: bool) {
        if !USUAL.contains(&self.area_fraction) {
            self.findings.push(Finding::new("area-fraction", format!("{:.2} % of the photo are profiles, which is unusual for particles in a binder: look at the overlay", 100.0 * self.area_fraction)));
        }
        let n = self.profiles.len();
        let percent = |k: usize| 100.0 * k as f64 / n.max(1) as f64;
        if n < FEW {
            self.findings.push(Finding::new("few-profiles", format!("{n} profiles; size distributions need at least 50, better some hundreds: use a larger photo, or several")));
        }
        let cut = self.profiles.iter().filter(|p| p.touches_edge).count();
        if options.edge_rule == EdgeRule::Frame && cut_short {
            self.findings.push(Finding::new("edge-heavy", "profiles reach over more than half the photo; the counting frame is cut short and favours small ones: use a larger photo".into()));
        } else if percent(cut) > EDGE {
            self.findings.push(Finding::new(
                "edge-heavy",
                format!(
                    "{:.0} % of the profiles are cut by the photo's edge; use a larger photo",
                    percent(cut)
                ),
            ));
        }
        let small = self
            .profiles
            .iter()
            .filter(|p| p.area < 1.5 * options.min_area as f64)
            .count();
        if percent(small) > SMALL {
            self.findings.push(Finding::new("near-minimum", format!("{:.0} % of the profiles are within half of the least area of {} pixels: many more may be too small to be seen; use a photo of higher resolution", percent(small), options.min_area)));
        }
    }

    /// What the number of profiles would be with other thresholds and another rise: each a fifth lower, as it is and a fifth higher.
    pub(crate) fn judge_count(&mut self, thresholds: [usize; 3], rise: [usize; 3]) {
        let change = |[lower, here, higher]: [usize; 3]| {
            100.0 * lower.abs_diff(here).max(higher.abs_diff(here)) as f64 / here.max(1) as f64
        };
        for (name, counts) in [("thresholds", thresholds), ("rise", rise)] {
            let ([lower, here, higher], change) = (counts, change(counts));
            // A photo of a few particles: one more or less is no change worth a word.
            if change > UNSTABLE && lower.abs_diff(here).max(higher.abs_diff(here)) > 2 {
                self.findings.push(Finding::new("unstable-count", format!("with the {name} a fifth lower or higher the number of profiles in the middle of the photo changes by {change:.0} %: {lower}, {here}, {higher}; look at the overlay, or give the {name}")));
            }
        }
    }

    pub(crate) fn judge_binder(&mut self, share: f64, clear: bool) {
        let advice = "give its colour if there is one, or import a label map drawn by hand or by another tool";
        if share < LEAST_SHARE {
            let share = 100.0 * share;
            self.findings.push(Finding::new(
                "no-binder",
                format!("the likeliest binder covers only {share:.0} % of the photo; {advice}"),
            ));
        } else if !clear {
            self.findings.push(Finding::new("no-binder", format!("most of what differs from the likeliest binder differs by little: its colours go over into those of the rest, and outlines are arbitrary; {advice}")));
        } else if self.area_fraction > ALL {
            let percent = 100.0 * self.area_fraction;
            self.findings.push(Finding::new(
                "no-binder",
                format!("{percent:.0} % of the photo would be particles; {advice}"),
            ));
        }
    }
}

/// Numbers of profiles in the middle of the photo with thresholds a fifth lower, as they are and a fifth higher: the recipe without its repetitions.
pub(crate) fn counts_by_threshold(
    distance: &Array2<f32>,
    deviation: &Array2<[f32; 3]>,
    [low, high]: [f32; 2],
    options: &SegmentOptions,
) -> [usize; 3] {
    let (distance, deviation) = (middle(distance), middle(deviation));
    let blur = options.smoothing.hypot(SHARP);
    MOVED.map(|f| {
        let mut mask = hysteresis(&distance, f * low, f * high);
        fill_holes(&mut mask, |hole, around| hole <= options.min_area.max(around / 20));
        open(&mut mask);
        mask = half_contrast(&deviation, &mask, blur);
        open(&mut mask);
        let (parts, _) = connected_components(mask.view(), |m| m);
        let mut labels = split_by_shape(&parts, options.rise);
        drop_faint(&mut labels, &distance, &deviation, f * high, options.min_area);
        let mut areas = vec![0_usize; 1 + labels.iter().copied().max().unwrap_or(0) as usize];
        labels.iter().for_each(|&l| areas[l as usize] += 1);
        areas[1..].iter().filter(|a| **a >= options.min_area).count()
    })
}

/// The middle of a picture, [`JUDGED`] pixels wide and high at most.
fn middle<T: Copy>(picture: &Array2<T>) -> Array2<T> {
    let (height, width) = picture.dim();
    let (rows, columns) = (height.min(JUDGED), width.min(JUDGED));
    let (top, left) = ((height - rows) / 2, (width - columns) / 2);
    Array2::from_shape_fn((rows, columns), |(y, x)| picture[[top + y, left + x]])
}

/// Numbers of hills with a rise a fifth lower, as it is and a fifth higher.
pub(crate) fn counts_by_rise(hills: &Hills, dim: (usize, usize), options: &SegmentOptions) -> [usize; 3] {
    MOVED.map(|f| hills.count(rising(dim, options.rise.map(|r| f * r)), options.min_area))
}
