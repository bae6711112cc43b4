//! What to know before trusting a segmentation: is there a binder, are there enough profiles, would other thresholds find others?

use ndarray::Array2;

use crate::{
    finding::Finding,
    options::{EdgeRule, SegmentOptions},
    pieces::{Contact, pieces},
    segmentation::Segmentation,
};

/// Fewest profiles that make a distribution of sizes.
const FEW: usize = 50;
/// Percent of the profiles at the photo's edge that is worth a warning.
const EDGE: f64 = 20.0;
/// Percent of the profiles near the least area that is worth a warning.
const SMALL: f64 = 10.0;
/// Change of the number of regions, percent of the profiles, that is worth a warning.
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

    /// Regions at thresholds a fifth lower and higher.
    pub(crate) fn judge_count(&mut self, distance: &Array2<f32>, [low, high]: [f32; 2], min_area: usize) {
        let [fewer, here, more] = [1.2, 1.0, 0.8].map(|f| regions(distance, f * low, f * high, min_area));
        let change = 100.0 * fewer.abs_diff(here).max(more.abs_diff(here)) as f64 / self.profiles.len().max(1) as f64;
        if change > UNSTABLE {
            self.findings.push(Finding::new("unstable-count", format!("moving the thresholds by a fifth changes the number of regions by {change:.0} % of the profiles: {here}, {more} with lower ones, {fewer} with higher; look at the overlay, or give the thresholds")));
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

/// Connected regions (8 neighbours) of at least `low`, somewhere `high`, and of an area.
fn regions(distance: &Array2<f32>, low: f32, high: f32, min_area: usize) -> usize {
    let (pieces, count) = pieces(&distance.mapv(|z| z >= low), |z| z, Contact::Corners);
    let mut areas = vec![(0_usize, false); count as usize + 1];
    for (&piece, &z) in pieces.iter().zip(distance) {
        let (area, strong) = &mut areas[piece as usize];
        *area += 1;
        *strong |= z >= high;
    }
    areas[1..]
        .iter()
        .filter(|(area, strong)| *strong && *area >= min_area)
        .count()
}
