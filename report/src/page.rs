//! The page of a synthesis.

use askama::Template;
use image::RgbImage;
use stereology::pipeline::{CheckName, Level, ShapeDensity};

use crate::checks;
use crate::data_url;
use crate::figures::{Remark, SectionFigures, SizeFigures, SynthesisReport};
use crate::number::{counted, percent, significant};
use crate::plot::Plot;
use crate::size_plots;

/// An image as a data URL, and its width and height in pixels.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub(crate) url: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Picture {
    /// A photograph or rendering.
    pub(crate) fn of(image: &RgbImage) -> Self {
        Self {
            url: data_url::photograph(image),
            width: image.width(),
            height: image.height(),
        }
    }
}

/// An image with its caption.
pub(crate) struct Captioned {
    pub(crate) picture: Picture,
    pub(crate) caption: String,
}

#[derive(Template)]
#[template(path = "synthesis.html")]
struct SynthesisPage<'a> {
    name: &'a str,
    unit: &'a str,
    unit_name: &'a str,
    class: &'static str,
    word: &'static str,
    sentence: String,
    opinions: [OpinionBox; 2],
    by_shape: Vec<ShapeRow>,
    tiles: Vec<Tile>,
    weak: Vec<CheckRow>,
    checks: Vec<CheckRow>,
    remarks: Vec<Remark>,
    photo: Picture,
    overlay: Picture,
    sections: Vec<Captioned>,
    compared: Vec<ComparedRow>,
    profiles_found: String,
    profiles_counted: String,
    number_per_area: String,
    area_fraction: String,
    colours: Vec<ColourRow>,
    profile_plot: Plot,
    particle_plot: Plot,
    with_intervals: bool,
    below_limit: bool,
    shapes: Vec<(&'a str, String)>,
    size_rows: Vec<(String, String)>,
    cube: Picture,
    packing_rows: Vec<(String, String)>,
    texture: Option<Texture>,
    command: &'a str,
    parameters: &'a [(String, String)],
}

/// The verdict on numbers or on appearance.
struct OpinionBox {
    about: &'static str,
    class: &'static str,
    word: &'static str,
    text: String,
}

/// Estimates under one shape.
struct ShapeRow {
    shape: String,
    is_used: bool,
    values: [String; 5],
}

struct Tile {
    number: String,
    meaning: String,
}

#[derive(Clone)]
struct CheckRow {
    name: &'static str,
    found: String,
    should_be: String,
    class: &'static str,
    word: &'static str,
    meaning: &'static str,
}

#[derive(Clone)]
struct ComparedRow {
    what: String,
    photo: String,
    sections: String,
    difference: String,
}

struct ColourRow {
    rgb: String,
    material: String,
    profiles: String,
    mean_size: String,
}

struct Texture {
    plot: Plot,
    factor: String,
}

/// The report of a synthesis as HTML: one file without scripts and links.
///
/// # Errors
///
/// [`askama::Error`] if the template cannot be rendered.
pub fn synthesis_page(report: &SynthesisReport) -> Result<String, askama::Error> {
    let level = report.verdict.level();
    let (photo, sizes, comparison) = (&report.photo, &report.sizes, &report.comparison);
    let checks: Vec<CheckRow> = checks::rows(report)
        .into_iter()
        .map(|row| CheckRow {
            name: row.name,
            found: row.found,
            should_be: row.should_be,
            class: class(row.level),
            word: checks::word(row.level),
            meaning: row.meaning,
        })
        .collect();
    let good = class(Level::Good);
    let remark = |of: &Remark| Remark {
        message: sentence(&of.message),
        ..of.clone()
    };
    let section = |(k, image): (usize, &RgbImage)| Captioned {
        picture: Picture::of(image),
        caption: format!("Section {} of the solid", k + 1),
    };
    let mut rows = compared("measured exactly", &comparison.exact, photo.profiles).to_vec();
    if let Some(again) = &comparison.resegmented {
        rows.extend(compared("segmented like the photograph", again, photo.profiles));
    }
    SynthesisPage {
        name: &report.photo_name,
        unit: &report.unit,
        unit_name: if report.unit == "px" { "pixels" } else { &report.unit },
        class: class(level),
        word: match level {
            Level::Good => "Trustworthy",
            Level::Care => "Trustworthy with care",
            Level::Bad => "Not trustworthy yet",
        },
        sentence: checks::sentence(&report.verdict),
        opinions: [
            ("Numbers", &report.verdict.numbers),
            ("Appearance", &report.verdict.appearance),
        ]
        .map(|(about, opinion)| OpinionBox {
            about,
            class: class(opinion.level),
            word: checks::word(opinion.level),
            text: checks::opinion(opinion, report),
        }),
        by_shape: sizes.by_shape.iter().map(|row| shape_row(row, sizes)).collect(),
        tiles: tiles(report),
        weak: checks.iter().filter(|row| row.class != good).cloned().collect(),
        checks,
        remarks: report.remarks.iter().map(remark).collect(),
        photo: Picture::of(&photo.picture),
        overlay: Picture {
            url: data_url::drawing(&photo.overlay),
            ..Picture::of(&photo.overlay)
        },
        sections: comparison.sections.iter().enumerate().map(section).collect(),
        compared: rows,
        profiles_found: counted(photo.profiles_found),
        profiles_counted: counted(photo.profiles),
        number_per_area: significant(photo.number_per_area),
        area_fraction: percent(photo.area_fraction),
        colours: colours(report),
        profile_plot: size_plots::profiles(sizes, &comparison.profiles_synthetic, &report.unit),
        particle_plot: size_plots::particles(sizes, &report.unit),
        with_intervals: sizes.interval.is_some(),
        below_limit: sizes.number_density.iter().any(Option::is_none),
        shapes: sizes
            .shapes
            .iter()
            .map(|(shape, fraction)| (shape.as_str(), percent(*fraction)))
            .collect(),
        size_rows: size_rows(report),
        cube: Picture::of(&report.packing.cube),
        packing_rows: packing_rows(report),
        texture: comparison.spectrum.as_ref().map(|spectra| Texture {
            plot: size_plots::spectra(spectra),
            factor: significant(10_f64.powf(spectra.log_error())),
        }),
        command: &report.command,
        parameters: &report.parameters,
    }
    .render()
}

pub(crate) fn class(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Care => "fair",
        Level::Bad => "poor",
    }
}

/// Total, its ratio to the reported one, mean size, volume fraction, p-value.
fn shape_row(row: &ShapeDensity, sizes: &SizeFigures) -> ShapeRow {
    let values = row.estimates.map_or_else(
        || ["-"; 5].map(str::to_owned),
        |of| {
            [
                significant(of.total),
                significant(of.total / sizes.total),
                significant(of.mean_size),
                percent(of.volume_fraction),
                of.p_value.map_or_else(|| "-".to_owned(), significant),
            ]
        },
    );
    ShapeRow {
        is_used: matches!(&sizes.shapes[..], [(shape, _)] if *shape == row.shape),
        shape: row.shape.clone(),
        values,
    }
}

fn tiles(report: &SynthesisReport) -> Vec<Tile> {
    let unit = &report.unit;
    let interval = report.sizes.total_interval.map_or(String::new(), |(low, high)| {
        format!(" ({} to {})", significant(low), significant(high))
    });
    let tile = |number: String, meaning: String| Tile { number, meaning };
    vec![
        tile(counted(report.photo.profiles), "profiles counted".to_owned()),
        tile(
            percent(report.photo.area_fraction),
            "of the photograph's area is particles".to_owned(),
        ),
        tile(
            significant(report.sizes.total),
            format!("particles per cubic {unit}{interval}"),
        ),
        tile(
            format!("{} {unit}", significant(report.sizes.mean_size)),
            "mean particle size".to_owned(),
        ),
        tile(
            counted(report.packing.particles),
            format!("particles packed, {} of the volume", percent(report.packing.fraction)),
        ),
        tile(
            percent(report.comparison.exact.size_w1),
            "of the mean: difference of profile sizes between solid and photograph".to_owned(),
        ),
    ]
}

fn compared(how: &str, section: &SectionFigures, profiles: u64) -> [ComparedRow; 3] {
    [
        ComparedRow {
            what: format!("Area fraction, {how}"),
            photo: percent(section.area_fraction_photo),
            sections: percent(section.area_fraction_synthetic),
            difference: percent((section.area_fraction_synthetic / section.area_fraction_photo - 1.0).abs()),
        },
        ComparedRow {
            what: format!("Profiles, {how}"),
            photo: counted(profiles),
            sections: counted(section.profiles),
            difference: format!("sizes: {}", percent(section.size_w1)),
        },
        ComparedRow {
            what: format!("Colours, {how}"),
            photo: String::new(),
            sections: String::new(),
            difference: percent(section.colour_distance),
        },
    ]
}

fn colours(report: &SynthesisReport) -> Vec<ColourRow> {
    let rgb = |colour: [f64; 3]| {
        let bytes = colour.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round().to_string());
        bytes.join(", ")
    };
    let binder = ColourRow {
        rgb: rgb(report.photo.binder),
        material: "binder".to_owned(),
        profiles: String::new(),
        mean_size: String::new(),
    };
    let categories = report.photo.categories.iter().enumerate();
    std::iter::once(binder)
        .chain(categories.map(|(number, category)| ColourRow {
            rgb: rgb(category.colour),
            material: format!("category {number}"),
            profiles: counted(category.profiles),
            mean_size: significant(category.mean_size),
        }))
        .collect()
}

fn size_rows(report: &SynthesisReport) -> Vec<(String, String)> {
    let (sizes, unit) = (&report.sizes, &report.unit);
    let total = match sizes.total_interval {
        Some((low, high)) => format!(
            "{} ({} to {})",
            significant(sizes.total),
            significant(low),
            significant(high)
        ),
        None => significant(sizes.total),
    };
    let mut rows = vec![
        ("Method".to_owned(), sizes.method.clone()),
        (format!("Particles per cubic {unit}"), total),
        (format!("Mean size ({unit})"), significant(sizes.mean_size)),
        ("Unfolded volume fraction".to_owned(), percent(sizes.volume_fraction)),
        (
            "Deviance of the refolded counts".to_owned(),
            format!(
                "{} for {} degrees of freedom",
                significant(sizes.deviance),
                significant(sizes.degrees_of_freedom)
            ),
        ),
        (
            "Condition number of the kernel".to_owned(),
            significant(sizes.condition_number),
        ),
        ("Negative densities set to zero".to_owned(), counted(sizes.clamped_bins)),
    ];
    if sizes.interval.is_none() {
        rows.push((
            "Confidence intervals".to_owned(),
            "none; --bootstrap B computes them".to_owned(),
        ));
    }
    rows
}

fn packing_rows(report: &SynthesisReport) -> Vec<(String, String)> {
    let (packing, unit) = (&report.packing, &report.unit);
    let check = report
        .verdict
        .checks
        .iter()
        .find(|check| check.name == CheckName::Overlap);
    let overlap = match check {
        Some(check) if check.level == Level::Good => format!(
            "none, by a separate pass over all pairs: {}",
            checks::overlap(check.value)
        ),
        Some(check) => checks::overlap(check.value),
        None => "unknown".to_owned(),
    };
    vec![
        ("Particles".to_owned(), counted(packing.particles)),
        (format!("Box ({unit})"), packing.sides.map(significant).join(" x ")),
        ("Fraction inside particles".to_owned(), percent(packing.fraction)),
        ("Requested fraction".to_owned(), percent(packing.requested_fraction)),
        ("Overlap".to_owned(), overlap),
        ("Iterations".to_owned(), counted(packing.iterations)),
    ]
}

/// With a capital letter at its beginning and a full stop at its end.
fn sentence(text: &str) -> String {
    let mut letters = text.trim().chars();
    let mut sentence: String = letters
        .next()
        .map(|first| first.to_uppercase().to_string())
        .unwrap_or_default();
    sentence.push_str(letters.as_str());
    if !sentence.ends_with(['.', '!', '?']) {
        sentence.push('.');
    }
    sentence
}
