//! Whether to trust the result: every check with its figure, what it should be, and what a bad one means.

use super::{ReportInput, SizeFigures};
use crate::numbers::{percent, significant};

/// How a check came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// As it should be.
    Good,
    /// Usable with care.
    Fair,
    /// Wrong, or not known.
    Poor,
}

/// One check.
#[derive(Clone, Debug)]
pub struct Check {
    /// What is looked at.
    pub name: &'static str,
    /// What was found.
    pub found: String,
    /// What it should be.
    pub should_be: &'static str,
    /// How it came out.
    pub grade: Grade,
    /// What it means, and what to do if it is not good.
    pub meaning: &'static str,
}

/// The verdict over all checks.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The worst grade.
    pub grade: Grade,
    /// In one sentence.
    pub sentence: String,
    /// Every check.
    pub checks: Vec<Check>,
}

/// Up to `good` is good, up to `fair` is fair; more, or not a number, is poor.
fn graded(value: f64, good: f64, fair: f64) -> Grade {
    if value <= good {
        Grade::Good
    } else if value <= fair {
        Grade::Fair
    } else {
        Grade::Poor
    }
}

/// Warnings of the segmentation that make the outlines doubtful, and those that make them a guess.
const DOUBTFUL: [&str; 5] = [
    "unstable-count",
    "edge-heavy",
    "near-minimum",
    "clipped-labels",
    "split-label",
];
const GUESSED: [&str; 1] = ["no-binder"];

/// Those of the fit, and one more for each density that would be negative if it could: it no longer serves to fit.
pub(super) fn degrees_of_freedom(sizes: &SizeFigures) -> f64 {
    let largest = sizes.number_density.iter().flatten().copied().fold(0.0, f64::max);
    let at_zero = sizes
        .number_density
        .iter()
        .flatten()
        .filter(|density| **density < 1e-3 * largest)
        .count();
    sizes.degrees_of_freedom + at_zero as f64
}

/// Checks the result.
pub fn verdict(input: &ReportInput) -> Verdict {
    let (photo, sizes, packing, comparison) = (&input.photo, &input.sizes, &input.packing, &input.comparison);
    let warned = |codes: &[&str]| {
        input
            .warnings
            .iter()
            .any(|warning| codes.contains(&warning.code.as_str()))
    };
    let off = |value: f64, reference: f64| (value / reference - 1.0).abs();
    let mut checks = vec![
        Check {
            name: "Outlines of the profiles",
            found: if warned(&GUESSED) {
                "no binder colour found".to_owned()
            } else if warned(&DOUBTFUL) {
                "warned of, see below".to_owned()
            } else {
                "no warning".to_owned()
            },
            should_be: "no warning",
            grade: if warned(&GUESSED) {
                Grade::Poor
            } else if warned(&DOUBTFUL) {
                Grade::Fair
            } else {
                Grade::Good
            },
            meaning: "Everything follows from the outlines. Look at the overlay: is each particle outlined once, and nothing else? If not, set the binder's colour or import a label map.",
        },
        Check {
            name: "Profiles counted",
            found: photo.profiles.to_string(),
            should_be: "250 or more",
            grade: match photo.profiles {
                250.. => Grade::Good,
                50.. => Grade::Fair,
                _ => Grade::Poor,
            },
            meaning: "The relative error of any count is at least one over its square root; the bins of large and of small particles hold the fewest. A photograph of a larger area helps, fewer bins too.",
        },
        Check {
            name: "Particles explain the profiles",
            found: format!(
                "deviance {} for {} degrees of freedom",
                significant(sizes.deviance),
                degrees_of_freedom(sizes)
            ),
            should_be: "deviance within 3 standard deviations",
            grade: {
                let deviations =
                    (sizes.deviance - sizes.degrees_of_freedom) / (2.0 * sizes.degrees_of_freedom.max(1.0)).sqrt();
                graded(deviations, 3.0, 6.0)
            },
            meaning: "The fitted particles, cut again, must show the profile histogram that was observed. If they do not, the shape is wrong, or profiles are merged or broken.",
        },
        Check {
            name: "Volume fraction against area fraction",
            found: format!(
                "{} unfolded, {} on the photograph",
                percent(sizes.volume_fraction),
                percent(photo.area_fraction)
            ),
            should_be: "within 10 %",
            grade: graded(off(sizes.volume_fraction, photo.area_fraction), 0.10, 0.25),
            meaning: "On average they are equal (Delesse), whatever the shapes. A difference shows a wrong shape, or small profiles that were missed. The packing uses the photograph's.",
        },
        Check {
            name: "No particles overlap",
            found: if packing.certified {
                "certified by a separate pass".to_owned()
            } else {
                format!("largest overlap {} of the mean size", significant(packing.max_overlap))
            },
            should_be: "certified",
            grade: if packing.certified { Grade::Good } else { Grade::Poor },
            meaning: "Overlapping particles would make the sections wrong in size and number.",
        },
        Check {
            name: "Area fraction of the solid's sections",
            found: format!(
                "{}, photograph {}",
                percent(comparison.exact.area_fraction_synthetic),
                percent(comparison.exact.area_fraction_photo)
            ),
            should_be: "within 5 %",
            grade: graded(
                off(
                    comparison.exact.area_fraction_synthetic,
                    comparison.exact.area_fraction_photo,
                ),
                0.05,
                0.10,
            ),
            meaning: "The share of particles on a cut through the solid, measured exactly at many depths.",
        },
        Check {
            name: "Profile sizes on the solid's sections",
            found: format!("apart by {} of the mean size", percent(comparison.exact.size_w1)),
            should_be: "10 % or less",
            grade: graded(comparison.exact.size_w1, 0.10, 0.20),
            meaning: "How far the sizes would have to move, on average, to become the photograph's (Wasserstein-1). If large: too few bins, a wrong shape, or sizes left out.",
        },
        Check {
            name: "Colours of the solid's sections",
            found: format!("apart by {} of the range", percent(comparison.exact.colour_distance)),
            should_be: "3 % or less",
            grade: graded(comparison.exact.colour_distance, 0.03, 0.06),
            meaning: "How far the mean colours of profiles and binder would have to move to become the photograph's. If far: colours missing among the categories, or a wrong area fraction.",
        },
    ];
    if let Some((low, high)) = sizes.total_interval {
        checks.push(Check {
            name: "Number of particles",
            found: format!("{} to {} per cubic {}", significant(low), significant(high), input.unit),
            should_be: "an interval narrower than half its value",
            grade: graded((high - low) / sizes.total, 0.5, 1.0),
            meaning: "How well the counts determine the particles per volume, small ones above all. A wide interval: use fewer bins, a larger --min-size, or photographs of a larger area.",
        });
    }
    if let Some(again) = &comparison.resegmented {
        checks.push(Check {
            name: "Sections segmented like the photograph",
            found: format!(
                "sizes apart by {} of the mean, area fraction {} for {}",
                percent(again.size_w1),
                percent(again.area_fraction_synthetic),
                percent(again.area_fraction_photo)
            ),
            should_be: "sizes within 20 %, area fraction within 10 %",
            grade: graded(again.size_w1, 0.20, 0.35)
                .max(graded(off(again.area_fraction_synthetic, again.area_fraction_photo), 0.10, 0.20)),
            meaning: "Pictures of the solid's sections put through the same segmentation: the only check that shows a bias of the segmentation itself.",
        });
    }
    if let Some(spectrum) = &comparison.spectrum {
        let error = spectrum.log_error();
        checks.push(Check {
            name: "Texture of the solid's slices",
            found: match spectrum.worst() {
                Some((frequency, ratio)) => format!(
                    "power apart by a factor of {}; at worst {} times {} at {} cycles per pixel",
                    significant(10_f64.powf(error)),
                    significant(ratio.max(1.0 / ratio)),
                    if ratio < 1.0 { "too little" } else { "too much" },
                    significant(frequency)
                ),
                None => "unknown: there is no residual".to_owned(),
            },
            should_be: "1.5 or less",
            grade: graded(error, 1.5_f64.log10(), 2.5_f64.log10()),
            meaning: "Power of the residual texture by fineness, photograph against sections (root mean square, weighted by power). If far, the texture has forms that this synthesis cannot make, or too little of the photograph lies away from outlines to learn it.",
        });
    }
    let grade = checks.iter().map(|check| check.grade).max().unwrap_or(Grade::Poor);
    let count = |grade| checks.iter().filter(|check| check.grade == grade).count();
    let checks_of = |n: usize| {
        if n == 1 {
            "1 check".to_owned()
        } else {
            format!("{n} checks")
        }
    };
    let sentence = match grade {
        Grade::Good => format!(
            "All {} came out well: sections of this solid look and measure like the photograph.",
            checks_of(checks.len())
        ),
        Grade::Fair => format!(
            "Usable with care: {} of {} fell short a little. Read where the result is weak before relying on its figures.",
            checks_of(count(Grade::Fair)),
            checks.len()
        ),
        Grade::Poor => format!(
            "Do not rely on this result yet: {} of {} failed. What to do stands below.",
            checks_of(count(Grade::Poor)),
            checks.len()
        ),
    };
    Verdict {
        grade,
        sentence,
        checks,
    }
}
