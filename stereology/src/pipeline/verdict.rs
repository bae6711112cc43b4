//! Whether to trust a solid and its numbers: every check with its value, its limit and its level.

use crate::pipeline::{Comparison, OutlineComparison, OutlineDistance};
use serde::Serialize;
use stereology_metrics::{Finding, Level};
use stereology_unfold::Estimate;

/// What a check examines. Serialised in kebab case: `goodness-of-fit`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckName {
    /// Number of warnings of the segmentation that make the outlines doubtful.
    Outlines,
    /// Number of profiles counted: at least the limit.
    ProfilesCounted,
    /// Deviance of the refolded profile counts, in standard deviations above its expectation.
    GoodnessOfFit,
    /// Relative difference between the unfolded volume fraction and the area fraction of the photograph.
    VolumeFraction,
    /// Largest penetration of two particles, in mean sizes; below zero: the smallest gap; -∞ if no two bounding spheres
    /// meet.
    Overlap,
    /// Relative difference between the area fractions of the solid's sections and of the photograph.
    SectionAreaFraction,
    /// Wasserstein-1 distance of the profile sizes of sections and photograph, in mean profile sizes.
    SectionSizes,
    /// Wasserstein-1 distance of the colours of sections and photograph, in units of the range 0 to 255.
    SectionColours,
    /// Width of the interval of the particles per volume, over their number.
    TotalInterval,
    /// [`SectionSizes`](Self::SectionSizes) of drawn sections, segmented like the photograph.
    ResegmentedSizes,
    /// [`SectionAreaFraction`](Self::SectionAreaFraction) of drawn sections, segmented like the photograph.
    ResegmentedAreaFraction,
    /// Wasserstein-1 distance of the axis ratios of profiles on drawn sections and photograph.
    SectionAxisRatios,
    /// Wasserstein-1 distance of the solidities of profiles on drawn sections and photograph.
    SectionSolidities,
    /// Error of the power spectrum of the residual texture: root mean square of log10 of the ratio.
    Texture,
}

impl CheckName {
    /// Whether the check is about the appearance of the solid; otherwise it is about numbers.
    #[must_use]
    pub fn is_appearance(self) -> bool {
        matches!(self, Self::SectionColours | Self::SectionSolidities | Self::Texture)
    }

    /// Whether values at or above the limit are good; otherwise values at or below it.
    #[must_use]
    pub fn is_at_least(self) -> bool {
        self == Self::ProfilesCounted
    }
}

/// A check: what was found, and the limit up to which it is good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What it examines; the variant documents the unit of `value` and `limit`.
    pub name: CheckName,
    /// What was found.
    pub value: f64,
    /// Limit of [`Level::Good`].
    pub limit: f64,
    /// How it turned out.
    pub level: Level,
}

impl Check {
    /// A check with the limits of good and of care.
    fn new(name: CheckName, value: f64, limits: Limits) -> Self {
        let within = |limit: f64| {
            if name.is_at_least() {
                value >= limit
            } else {
                value <= limit
            }
        };
        let level = if within(limits.good) {
            Level::Good
        } else if within(limits.care) {
            Level::Care
        } else {
            Level::Bad
        };
        Self {
            name,
            value,
            limit: limits.good,
            level,
        }
    }

    /// The value in units of its limit, to compare checks of one level; infinite if the value is not a number.
    fn severity(&self) -> f64 {
        let ratio = if self.name.is_at_least() {
            self.limit / self.value
        } else if self.value <= 0.0 {
            0.0
        } else {
            self.value / self.limit
        };
        if ratio.is_nan() { f64::INFINITY } else { ratio }
    }
}

/// The worst level of several checks, and the check that has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Opinion {
    /// The worst level.
    pub level: Level,
    /// The check farthest beyond its limit among those of this level.
    pub worst: CheckName,
}

/// The verdict on a solid: its numbers, its appearance, and all checks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Can densities, sizes and fractions be relied on?
    pub numbers: Opinion,
    /// Do sections of the solid look like the photograph?
    pub appearance: Opinion,
    /// Every check.
    pub checks: Vec<Check>,
}

/// The figures that a verdict is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Findings of the segmentation.
    pub findings: Vec<Finding>,
    /// Number of profiles counted.
    pub profiles: usize,
    /// Deviance of the refolded profile counts.
    pub deviance: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Particles per volume.
    pub total: Estimate,
    /// Volume fraction of the unfolded particles.
    pub volume_fraction: f64,
    /// Area fraction of the photograph.
    pub area_fraction: f64,
    /// Smallest gap between two particles whose bounding spheres meet, in mean particle sizes
    /// ([`Certificate`](stereology_anneal::Certificate)); infinite if there are none, below zero if particles overlap.
    pub smallest_gap: f64,
    /// Exact sections of the solid, compared with the photograph.
    pub exact: Comparison,
    /// Drawn sections segmented like the photograph.
    pub resegmented: Option<Comparison>,
    /// Outlines of drawn sections.
    pub outlines: Option<OutlineComparison>,
    /// Error of the power spectrum of the residual
    /// ([`ResidualSpectra::log_error`](crate::pipeline::ResidualSpectra::log_error)).
    pub texture_error: Option<f64>,
}

/// Limits of [`Level::Good`] and [`Level::Care`].
#[derive(Clone, Copy)]
struct Limits {
    good: f64,
    care: f64,
}

impl Limits {
    /// The limits, or what the numbers of profiles can distinguish if that is more.
    fn of_samples(self, distance: &OutlineDistance) -> Self {
        Self {
            good: self.good.max(SAMPLING.good * distance.expected),
            care: self.care.max(SAMPLING.care * distance.expected),
        }
    }
}

/// Warnings of the segmentation after which the outlines need a look: some profiles may be missed, merged or clipped,
/// most are not.
const DOUBTFUL: [&str; 5] = [
    "unstable-count",
    "edge-heavy",
    "near-minimum",
    "clipped-labels",
    "split-label",
];
/// Without a binder colour the choice between particles and binder is a guess, and every figure depends on it.
const GUESSED: &str = "no-binder";

/// The relative standard error of a count is at least 1 / √n: 6 % at 250 profiles, 14 % at 50. With ten bins, 250
/// profiles are 25 per bin and 50 are five, the fewest for which the deviance means anything.
const PROFILES: Limits = Limits {
    good: 250.0,
    care: 50.0,
};
/// The deviance of a correct model is χ², with as many degrees of freedom as the fit has
/// (`Unfolding::degrees_of_freedom`) and a standard deviation of the root of twice their number. With 7 to 40 of them a
/// correct model exceeds 3 standard deviations about once in 100 to 200 times and 6 less than once in 5,000.
const DEVIATIONS: Limits = Limits { good: 3.0, care: 6.0 };
/// Delesse: both fractions have one expectation, whatever the shapes. The area fraction of some hundred profiles has a
/// standard error of 5 to 10 %, so that a larger difference means a wrong shape or missed profiles. At 25 % sizes would
/// have to be wrong by 8 % (cube root) to explain it. Same limit as the warning `fraction-mismatch`.
const VOLUME_FRACTION: Limits = Limits { good: 0.10, care: 0.25 };
/// The certificate allows 10⁻¹² of a size for the rounding of coordinates. A thousand times that is still rounding;
/// 10⁻⁶ of a size is far below a voxel, but more than rounding can do.
const PENETRATION: Limits = Limits { good: 1e-9, care: 1e-6 };
/// Exact sections at 96 depths: their area fraction has a standard error of 1 to 2 % about the volume fraction of the
/// packing, which is the photograph's. Beyond 5 % the packing has lost or gained particles; beyond 10 % it exceeds the
/// error of the photograph's own area fraction.
const AREA_FRACTION: Limits = Limits { good: 0.05, care: 0.10 };
/// Two samples of one distribution with 250 profiles are 3 to 5 % of the mean apart, and sizes are spread over bins of
/// about a tenth of the mean, so 10 % is within noise and bins. 20 % is a shift of one bin or more, visible in the
/// histograms.
const SIZES: Limits = Limits { good: 0.10, care: 0.20 };
/// 3 % of the range is 8 of 255 levels, hardly visible side by side; 6 % is 15 levels, a visible change of colour.
const COLOURS: Limits = Limits { good: 0.03, care: 0.06 };
/// A width of half the value is about ± 25 %, usual for some hundred profiles. At a width of the value itself, the ends
/// differ by a factor of three.
const INTERVAL: Limits = Limits { good: 0.5, care: 1.0 };
/// Drawn sections and photograph both carry the errors of the segmentation, which doubles the limits of the exact
/// sections; 35 % is more than it adds on photographs whose outlines are right.
const RESEGMENTED_SIZES: Limits = Limits { good: 0.20, care: 0.35 };
/// Twice the limits of exact sections, as for sizes.
const RESEGMENTED_AREA_FRACTION: Limits = Limits { good: 0.10, care: 0.20 };
/// An axis ratio of .05 more or less is not visible side by side. A difference of .05 to .25 means another shape than
/// the assumed one: particles of axes 1 : .7 : .5 measured as spheres are 12 % too many, cubes 150 %, so that the
/// number needs care. .25 is the difference of spheres from particles twice as long as wide.
const AXIS_RATIOS: Limits = Limits { good: 0.05, care: 0.25 };
/// A digitised disc of 200 pixels has a solidity of .98, with a spread of .005 between places on the grid. .02 is a
/// convex outline against one with a few dents, .05 against a ragged one, or against two touching particles as one
/// profile.
const SOLIDITIES: Limits = Limits { good: 0.02, care: 0.05 };
/// Expected distances of two samples of one distribution that are good whatever the limit, and that need care: the
/// distance of two samples exceeds twice its expectation about once in 100 times, four times it practically never.
const SAMPLING: Limits = Limits { good: 2.0, care: 4.0 };
/// log10 of a factor of 1.5 and of 2.5 in power, 1.2 and 1.6 in contrast: the first is hardly visible side by side, the
/// second is a coarser or finer texture.
const TEXTURE: Limits = Limits {
    good: 0.176_091,
    care: 0.397_940,
};

impl Verdict {
    /// Judges the evidence. A figure that is not a number is [`Level::Bad`].
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology::pipeline::{CheckName, Comparison, Evidence, Level, Verdict};
    /// use stereology::unfold::Estimate;
    ///
    /// let exact = Comparison {
    ///     profiles_photo: 300, profiles_synthetic: 4000, size_w1: 0.15, area_fraction_photo: 0.4, area_fraction_synthetic: 0.4, colour_distance: 0.01,
    /// };
    /// let verdict = Verdict::new(&Evidence {
    ///     findings: Vec::new(), profiles: 300, deviance: 90.0, degrees_of_freedom: 88, total: Estimate { value: 1e-4, interval: None },
    ///     volume_fraction: 0.41, area_fraction: 0.4, smallest_gap: 1e-5, exact, resegmented: None, outlines: None, texture_error: None,
    /// });
    /// assert_eq!((verdict.numbers.level, verdict.numbers.worst), (Level::Care, CheckName::SectionSizes));
    /// assert_eq!(verdict.appearance.level, Level::Good);
    /// ```
    #[must_use]
    pub fn new(evidence: &Evidence) -> Self {
        let of = evidence;
        let difference = |value: f64, reference: f64| (value / reference - 1.0).abs();
        let freedom = of.degrees_of_freedom as f64;
        // With no degrees of freedom left the spread is that of one.
        let deviations = (of.deviance - freedom) / (2.0 * freedom.max(1.0)).sqrt();
        let area = |of: &Comparison| difference(of.area_fraction_synthetic, of.area_fraction_photo);
        let colours = Check::new(CheckName::SectionColours, of.exact.colour_distance, COLOURS);
        let outlines = outlines(&of.findings);
        let mut checks = vec![
            outlines,
            Check::new(CheckName::ProfilesCounted, of.profiles as f64, PROFILES),
            Check::new(CheckName::GoodnessOfFit, deviations, DEVIATIONS),
            Check::new(
                CheckName::VolumeFraction,
                difference(of.volume_fraction, of.area_fraction),
                VOLUME_FRACTION,
            ),
            Check::new(CheckName::Overlap, -of.smallest_gap, PENETRATION),
            Check::new(CheckName::SectionAreaFraction, area(&of.exact), AREA_FRACTION),
            Check::new(CheckName::SectionSizes, of.exact.size_w1, SIZES),
            colours,
        ];
        if let Some(interval) = of.total.interval {
            let width = (interval.upper - interval.lower) / of.total.value;
            checks.push(Check::new(CheckName::TotalInterval, width, INTERVAL));
        }
        if let Some(again) = &of.resegmented {
            checks.push(Check::new(
                CheckName::ResegmentedSizes,
                again.size_w1,
                RESEGMENTED_SIZES,
            ));
            checks.push(Check::new(
                CheckName::ResegmentedAreaFraction,
                area(again),
                RESEGMENTED_AREA_FRACTION,
            ));
        }
        if let Some(outlines) = &of.outlines {
            let distances = [
                (CheckName::SectionAxisRatios, &outlines.axis_ratio, AXIS_RATIOS),
                (CheckName::SectionSolidities, &outlines.solidity, SOLIDITIES),
            ];
            checks.extend(distances.map(|(name, of, limits)| Check::new(name, of.distance, limits.of_samples(of))));
        }
        if let Some(error) = of.texture_error {
            checks.push(Check::new(CheckName::Texture, error, TEXTURE));
        }
        let of_kind = |appearance: bool| {
            checks
                .iter()
                .filter(move |check| check.name.is_appearance() == appearance)
        };
        Self {
            numbers: worst(outlines, of_kind(false)),
            appearance: worst(colours, of_kind(true)),
            checks,
        }
    }

    /// The worse of both levels.
    #[must_use]
    pub fn level(&self) -> Level {
        self.numbers.level.max(self.appearance.level)
    }
}

/// The check of the outlines: any doubtful finding needs care, a guessed binder is bad.
fn outlines(findings: &[Finding]) -> Check {
    let guessed = findings.iter().any(|finding| finding.code == GUESSED);
    let doubtful = |finding: &&Finding| finding.code == GUESSED || DOUBTFUL.contains(&finding.code);
    let count = findings.iter().filter(doubtful).count();
    Check {
        name: CheckName::Outlines,
        value: count as f64,
        limit: 0.0,
        level: match (guessed, count) {
            (true, _) => Level::Bad,
            (false, 0) => Level::Good,
            (false, _) => Level::Care,
        },
    }
}

fn worst<'a>(first: Check, checks: impl Iterator<Item = &'a Check>) -> Opinion {
    let worse = |a: Check, b: &Check| {
        let order = a.level.cmp(&b.level).then(a.severity().total_cmp(&b.severity()));
        if order.is_lt() { *b } else { a }
    };
    let worst = checks.fold(first, worse);
    Opinion {
        level: worst.level,
        worst: worst.name,
    }
}

#[cfg(test)]
mod tests {
    use super::{Check, CheckName, Evidence, Level, TEXTURE, Verdict};
    use crate::pipeline::{Comparison, OutlineComparison, OutlineDistance};
    use proptest::prelude::*;
    use stereology_metrics::Finding;
    use stereology_unfold::{Estimate, Interval};

    fn outlines(axis_ratio: f64, solidity: f64) -> OutlineComparison {
        let of = |photo: f64, distance: f64, expected: f64| OutlineDistance {
            photo,
            synthetic: photo + distance,
            distance,
            expected,
        };
        OutlineComparison {
            profiles_photo: 300,
            profiles_synthetic: 900,
            axis_ratio: of(0.7, axis_ratio, 0.015),
            solidity: of(0.95, solidity, 0.02),
        }
    }

    fn evidence() -> Evidence {
        let exact = Comparison {
            profiles_photo: 335,
            profiles_synthetic: 5200,
            size_w1: 0.046,
            area_fraction_photo: 0.41,
            area_fraction_synthetic: 0.405,
            colour_distance: 0.011,
        };
        let interval = Interval {
            lower: 2.1e-4,
            upper: 2.8e-4,
        };
        Evidence {
            findings: Vec::new(),
            profiles: 335,
            deviance: 8.1,
            degrees_of_freedom: 7,
            total: Estimate {
                value: 2.4e-4,
                interval: Some(interval),
            },
            volume_fraction: 0.43,
            area_fraction: 0.41,
            smallest_gap: 0.0,
            exact,
            resegmented: Some(Comparison { size_w1: 0.12, ..exact }),
            outlines: Some(outlines(0.03, 0.01)),
            texture_error: Some(0.05),
        }
    }

    fn level(change: impl FnOnce(&mut Evidence)) -> Level {
        let mut evidence = evidence();
        change(&mut evidence);
        Verdict::new(&evidence).level()
    }

    /// Each figure alone decides, and what is not a number is bad.
    #[test]
    fn the_verdict_is_its_worst_check() {
        assert_eq!(level(|_| ()), Level::Good);
        assert_eq!(level(|of| of.profiles = 60), Level::Care);
        assert_eq!(
            level(|of| of.findings.push(Finding::new("near-minimum", ""))),
            Level::Care
        );
        assert_eq!(
            level(|of| of.findings.push(Finding::new("box-rounded", ""))),
            Level::Good
        );
        assert_eq!(level(|of| of.findings.push(Finding::new("no-binder", ""))), Level::Bad);
        assert_eq!(level(|of| of.smallest_gap = -0.01), Level::Bad);
        assert_eq!(level(|of| of.texture_error = Some(0.2)), Level::Care);
        assert_eq!(level(|of| of.exact.size_w1 = f64::NAN), Level::Bad);
        assert_eq!(level(|of| of.deviance = 7.0 + 3.1 * 14.0_f64.sqrt()), Level::Care);
        assert_eq!(level(|of| of.outlines = Some(outlines(0.2, 0.01))), Level::Care);
        // What so few profiles cannot distinguish is good.
        assert_eq!(level(|of| of.outlines = Some(outlines(0.03, 0.039))), Level::Good);
        let mut ragged = evidence();
        ragged.outlines = Some(outlines(0.1, 0.09));
        let verdict = Verdict::new(&ragged);
        assert_eq!(verdict.numbers.worst, CheckName::SectionAxisRatios);
        assert_eq!(
            (verdict.appearance.level, verdict.appearance.worst),
            (Level::Bad, CheckName::SectionSolidities)
        );
        let mut poor = evidence();
        (poor.profiles, poor.exact.size_w1) = (240, 0.19);
        let verdict = Verdict::new(&poor);
        assert_eq!(verdict.numbers.worst, CheckName::SectionSizes);
        assert_eq!(verdict.appearance.level, Level::Good);
    }

    /// The limits of the texture are logarithms of factors of power.
    #[test]
    fn texture_limits_are_factors() {
        assert!((10_f64.powf(TEXTURE.good) - 1.5).abs() < 1e-5 && (10_f64.powf(TEXTURE.care) - 2.5).abs() < 1e-5);
    }

    #[test]
    fn names_and_levels_are_words() {
        let json = serde_json::to_value(Verdict::new(&evidence())).unwrap();
        assert_eq!(json["numbers"]["level"], "good");
        assert_eq!(json["checks"][1]["name"], "profiles-counted");
        assert_eq!(json["checks"][1]["limit"], 250.0);
    }

    proptest! {
        /// A worse figure never gives a better level.
        #[test]
        fn levels_follow_values(a in 0.0..2.0_f64, b in 0.0..2.0_f64) {
            let (low, high) = (a.min(b), a.max(b));
            let of = |value: f64| Check::new(CheckName::SectionSizes, value, super::SIZES).level;
            prop_assert!(of(low) <= of(high));
        }
    }
}
