//! The checks of a verdict in words: what was found, what it should be, what it means and what to do.

use stereology::pipeline::{Check, CheckName, Level, Opinion, OutlineDistance, Verdict};

use crate::figures::SynthesisReport;
use crate::number::{percent, significant};

/// A check for people.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// What is examined.
    pub(crate) name: &'static str,
    /// What was found.
    pub(crate) found: String,
    /// What it should be.
    pub(crate) should_be: String,
    /// How it turned out.
    pub(crate) level: Level,
    /// What it means, and what to do if it is not good.
    pub(crate) meaning: &'static str,
}

/// Every check of the verdict.
pub(crate) fn rows(input: &SynthesisReport) -> Vec<Row> {
    let row = |check: &Check| Row {
        name: title(check.name),
        found: found(check, input),
        should_be: should_be(check),
        level: check.level,
        meaning: meaning(check.name),
    };
    input.verdict.checks.iter().map(row).collect()
}

/// The verdict in a sentence.
pub(crate) fn sentence(verdict: &Verdict) -> String {
    let count = |level: Level| verdict.checks.iter().filter(|check| check.level == level).count();
    let checks = |n: usize| {
        if n == 1 {
            "1 check".to_owned()
        } else {
            format!("{n} checks")
        }
    };
    match verdict.level() {
        Level::Good => format!(
            "All {} are good: sections of this solid look and measure like the photograph.",
            checks(verdict.checks.len())
        ),
        Level::Care => format!(
            "Usable with care: {} of {} beyond the limit. Read where the result is weak before you rely on its figures.",
            checks(count(Level::Care)),
            verdict.checks.len()
        ),
        Level::Bad => format!(
            "Do not rely on this result yet: {} of {} failed. The list below states what to do.",
            checks(count(Level::Bad)),
            verdict.checks.len()
        ),
    }
}

/// One of the two verdicts: its level, and its worst check with what was found.
pub(crate) fn opinion(of: &Opinion, input: &SynthesisReport) -> String {
    let checks = &input.verdict.checks;
    let number = checks
        .iter()
        .filter(|check| check.name.is_appearance() == of.worst.is_appearance())
        .count();
    let worst = checks.iter().find(|check| check.name == of.worst);
    let worst = worst.map_or_else(String::new, |check| {
        format!("{}: {}.", title(check.name), found(check, input))
    });
    match of.level {
        Level::Good => format!("All {number} checks are good. The nearest to its limit: {worst}"),
        Level::Care | Level::Bad => format!("Worst of {number} checks: {worst}"),
    }
}

/// The level in a word.
pub(crate) fn word(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Care => "with care",
        Level::Bad => "bad",
    }
}

fn title(name: CheckName) -> &'static str {
    match name {
        CheckName::Outlines => "Outlines of the profiles",
        CheckName::ProfilesCounted => "Profiles counted",
        CheckName::GoodnessOfFit => "Particles explain the profiles",
        CheckName::VolumeFraction => "Volume fraction against area fraction",
        CheckName::Overlap => "No particles overlap",
        CheckName::SectionAreaFraction => "Area fraction of the solid's sections",
        CheckName::SectionSizes => "Profile sizes on the solid's sections",
        CheckName::SectionColours => "Colours of the solid's sections",
        CheckName::TotalInterval => "Number of particles",
        CheckName::ResegmentedSizes => "Profile sizes on sections segmented like the photograph",
        CheckName::ResegmentedAreaFraction => "Area fraction of sections segmented like the photograph",
        CheckName::SectionAxisRatios => "Axis ratios of the profiles on sections",
        CheckName::SectionSolidities => "Solidities of the profiles on sections",
        CheckName::Texture => "Texture of the solid's slices",
    }
}

fn found(check: &Check, input: &SynthesisReport) -> String {
    let (sizes, comparison) = (&input.sizes, &input.comparison);
    let fractions = |synthetic: f64, photo: f64| format!("{}, photograph {}", percent(synthetic), percent(photo));
    match check.name {
        CheckName::Outlines => match (check.level, check.value) {
            (Level::Bad, _) => "no binder colour found".to_owned(),
            (_, 0.0) => "no warning".to_owned(),
            (_, warnings) => format!("{warnings} of the warnings below"),
        },
        CheckName::ProfilesCounted => input.photo.profiles.to_string(),
        CheckName::GoodnessOfFit => format!(
            "deviance {} for {} degrees of freedom",
            significant(sizes.deviance),
            significant(sizes.degrees_of_freedom)
        ),
        CheckName::VolumeFraction => format!(
            "{} unfolded, {} on the photograph",
            percent(sizes.volume_fraction),
            percent(input.photo.area_fraction)
        ),
        CheckName::Overlap => overlap(check.value),
        CheckName::SectionAreaFraction => fractions(
            comparison.exact.area_fraction_synthetic,
            comparison.exact.area_fraction_photo,
        ),
        CheckName::SectionSizes | CheckName::ResegmentedSizes => {
            format!("difference of {} of the mean size", percent(check.value))
        }
        CheckName::SectionColours => format!("difference of {} of the range", percent(check.value)),
        CheckName::TotalInterval => sizes.total_interval.map_or_else(String::new, |(low, high)| {
            format!("{} to {} per cubic {}", significant(low), significant(high), input.unit)
        }),
        CheckName::ResegmentedAreaFraction => comparison.resegmented.as_ref().map_or_else(String::new, |of| {
            fractions(of.area_fraction_synthetic, of.area_fraction_photo)
        }),
        CheckName::SectionAxisRatios => outline(check, comparison.outlines.map(|of| of.axis_ratio)),
        CheckName::SectionSolidities => outline(check, comparison.outlines.map(|of| of.solidity)),
        CheckName::Texture => {
            let worst = comparison
                .spectrum
                .as_ref()
                .and_then(stereology::pipeline::ResidualSpectra::worst);
            match worst {
                Some((frequency, ratio)) => format!(
                    "power differs by a factor of {}; at worst {} times {} at {} cycles per pixel",
                    significant(10_f64.powf(check.value)),
                    significant(ratio.max(1.0 / ratio)),
                    if ratio < 1.0 { "too little" } else { "too much" },
                    significant(frequency)
                ),
                None => "unknown: there is no residual".to_owned(),
            }
        }
    }
}

/// Means of a quantity of outlines, and its distance.
fn outline(check: &Check, of: Option<OutlineDistance>) -> String {
    let means = of.map_or_else(String::new, |of| {
        format!(
            ": mean {}, photograph {}",
            significant(of.synthetic),
            significant(of.photo)
        )
    });
    format!("distance {}{means}", significant(check.value))
}

/// The largest penetration of a certificate, in mean sizes; below zero the smallest gap.
pub(crate) fn overlap(penetration: f64) -> String {
    if penetration == f64::NEG_INFINITY {
        "no two bounding spheres meet".to_owned()
    } else if penetration < 0.0 {
        format!("smallest gap {} of the mean size", significant(-penetration))
    } else {
        format!("largest overlap {} of the mean size", significant(penetration))
    }
}

fn should_be(check: &Check) -> String {
    let limit = check.limit;
    match check.name {
        CheckName::Outlines => "no warning".to_owned(),
        CheckName::ProfilesCounted => format!("{limit} or more"),
        CheckName::GoodnessOfFit => format!("deviance within {limit} standard deviations"),
        CheckName::Overlap => format!("overlap below {limit:e}"),
        CheckName::VolumeFraction | CheckName::SectionAreaFraction | CheckName::ResegmentedAreaFraction => {
            format!("within {}", percent(limit))
        }
        CheckName::SectionSizes | CheckName::SectionColours | CheckName::ResegmentedSizes => {
            format!("{} or less", percent(limit))
        }
        CheckName::SectionAxisRatios | CheckName::SectionSolidities => format!("{} or less", significant(limit)),
        CheckName::TotalInterval => format!("interval narrower than {} of the number", percent(limit)),
        CheckName::Texture => format!("factor of {} or less", significant(10_f64.powf(limit))),
    }
}

fn meaning(name: CheckName) -> &'static str {
    match name {
        CheckName::Outlines => {
            "All results depend on the outlines. Look at the overlay: is each particle outlined once, and nothing else? If not, set the binder's colour or import a label map."
        }
        CheckName::ProfilesCounted => {
            "The relative error of any count is at least one over its square root; the bins of large and of small particles have the fewest profiles. A photograph of a larger area helps, and so do fewer bins."
        }
        CheckName::GoodnessOfFit => {
            "Sections of the fitted particles must give the observed profile histogram. If they do not, the shape is wrong, or profiles are merged or split."
        }
        CheckName::VolumeFraction => {
            "On average they are equal (Delesse) for all shapes. A difference indicates a wrong shape, or small profiles that were missed. The packing uses the fraction of the photograph."
        }
        CheckName::Overlap => {
            "Overlapping particles would give sections of wrong size and number. A separate pass proves for every pair of neighbours that they do not overlap."
        }
        CheckName::SectionAreaFraction => {
            "The fraction of particles on sections of the solid, measured exactly at many depths."
        }
        CheckName::SectionSizes => {
            "Mean change of size that would turn the sizes on sections into those of the photograph (Wasserstein-1 distance). If it is large: too few bins, a wrong shape, or sizes left out."
        }
        CheckName::SectionColours => {
            "Mean change that would turn the mean colours of profiles and binder into those of the photograph. If it is large: colours missing among the categories, or a wrong area fraction."
        }
        CheckName::TotalInterval => {
            "How well the counts determine the particles per volume, especially the small ones. For a narrower interval use fewer bins, a larger --min-size, or photographs of a larger area."
        }
        CheckName::ResegmentedSizes | CheckName::ResegmentedAreaFraction => {
            "Images of the solid's sections, segmented like the photograph: these are the only checks that reveal a bias of the segmentation itself."
        }
        CheckName::SectionAxisRatios => {
            "Minor over major axis of each profile, on sections segmented like the photograph. A difference means that the particles have another shape than the assumed one; the table of shapes shows by how much that changes the number of particles."
        }
        CheckName::SectionSolidities => {
            "Area of each profile over that of its convex hull: 1 for convex outlines. If the solid's profiles are more convex, its particles are too smooth, or touching particles of the photograph were outlined as one."
        }
        CheckName::Texture => {
            "Power of the residual texture by spatial frequency, photograph compared with sections (root mean square, weighted by power). If they differ much, the texture has structures that this synthesis cannot reproduce, or too little of the photograph is away from outlines to measure it."
        }
    }
}
