//! The page: what it says and in which order.

use std::fmt::Write;

use image::RgbImage;
use stereology::pipeline::{Check, CheckName, Level};

use super::{ComparisonFigures, PackingFigures, PhotoFigures, ReportInput, SectionFigures, SizeFigures};
use super::{pictures, plots, trust};
use crate::numbers::{counted, percent, significant};
use crate::warnings::advice;

/// The report as HTML.
pub fn page(input: &ReportInput) -> String {
    let mut html = String::with_capacity(1 << 20);
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{name}: the solid behind the photograph</title>\n<style>\n{style}</style>\n</head>\n<body>\n\
         <h1>{name}: the solid behind the photograph</h1>\n\
         <p class=\"lead\">Profiles on the photograph were measured, unfolded to particles per volume, packed into a box that repeats, and given the \
         photograph's colours and texture. This page tells how far the solid can be trusted. Lengths are in {unit}.</p>\n",
        name = escaped(&input.photo_name),
        style = include_str!("style.css"),
        unit = if input.unit == "px" {
            "pixels".to_owned()
        } else {
            escaped(&input.unit)
        },
    );
    verdict(&mut html, input);
    all_warnings(&mut html, input);
    comparison(&mut html, &input.comparison, &input.photo);
    photograph(&mut html, &input.photo, &input.unit);
    sizes(&mut html, &input.sizes, &input.comparison, &input.unit);
    packing(&mut html, input);
    texture(&mut html, &input.comparison);
    repeat(&mut html, input);
    html.push_str("</body>\n</html>\n");
    html
}

fn verdict(html: &mut String, input: &ReportInput) {
    let level = input.verdict.level();
    let word = match level {
        Level::Good => "Trustworthy",
        Level::Care => "Trustworthy with care",
        Level::Bad => "Not trustworthy yet",
    };
    let _ = writeln!(
        html,
        "<div class=\"verdict {}\"><strong>{word}</strong><p>{} {}</p></div>",
        class(level),
        escaped(&trust::sentence(&input.verdict)),
        escaped(&trust::opinions(&input.verdict))
    );
    let unit = &input.unit;
    let interval = |interval: Option<(f64, f64)>| {
        interval.map_or(String::new(), |(low, high)| {
            format!(" ({} to {})", significant(low), significant(high))
        })
    };
    let tiles = [
        (counted(input.photo.profiles), "profiles counted".to_owned()),
        (
            percent(input.photo.area_fraction),
            "of the photograph's area is particles".to_owned(),
        ),
        (
            significant(input.sizes.total),
            format!("particles per cubic {unit}{}", interval(input.sizes.total_interval)),
        ),
        (
            format!("{} {unit}", significant(input.sizes.mean_size)),
            "mean particle size".to_owned(),
        ),
        (
            counted(input.packing.particles),
            format!("particles packed, {} of the volume", percent(input.packing.fraction)),
        ),
        (
            percent(input.comparison.exact.size_w1),
            "of the mean: how far profile sizes on the solid are from the photograph's".to_owned(),
        ),
    ];
    html.push_str("<div class=\"tiles\">\n");
    for (number, what) in tiles {
        let _ = writeln!(
            html,
            "<div class=\"tile\"><b>{number}</b><span>{}</span></div>",
            escaped(&what)
        );
    }
    html.push_str("</div>\n");

    let rows = trust::rows(input);
    let weak: Vec<_> = rows.iter().filter(|check| check.level != Level::Good).collect();
    if !weak.is_empty() {
        html.push_str("<h3>Where the result is weak</h3>\n<ul>\n");
        for check in weak {
            let _ = writeln!(
                html,
                "<li><strong class=\"{}\">{}</strong>: {}. {}</li>",
                class(check.level),
                check.name,
                escaped(&check.found),
                check.meaning
            );
        }
        html.push_str("</ul>\n");
    }
    html.push_str("<h3>All checks</h3>\n<table>\n<tr><th>Check</th><th>Found</th><th>Should be</th><th></th></tr>\n");
    for check in &rows {
        let _ = writeln!(
            html,
            "<tr title=\"{}\"><td>{}</td><td>{}</td><td>{}</td><td class=\"{}\">{}</td></tr>",
            escaped(check.meaning),
            check.name,
            escaped(&check.found),
            escaped(&check.should_be),
            class(check.level),
            trust::word(check.level)
        );
    }
    html.push_str("</table>\n");
}

fn class(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Care => "fair",
        Level::Bad => "poor",
    }
}

fn all_warnings(html: &mut String, input: &ReportInput) {
    html.push_str("<h2>Warnings</h2>\n");
    if input.warnings.is_empty() {
        html.push_str("<p>None.</p>\n");
        return;
    }
    html.push_str("<ul>\n");
    for warning in &input.warnings {
        let to_do = advice(warning)
            .map(|advice| format!(" <em>{}</em>", escaped(advice)))
            .unwrap_or_default();
        let _ = writeln!(
            html,
            "<li><code>{}</code> {}{to_do}</li>",
            escaped(warning.code),
            escaped(&sentence(&warning.message))
        );
    }
    html.push_str("</ul>\n");
}

fn comparison(html: &mut String, figures: &ComparisonFigures, photo: &PhotoFigures) {
    html.push_str(
        "<h2>Photograph and solid</h2>\n<p>The photograph, and cuts through the solid at the same scale. Would you take them for the same material? The solid \
         repeats with the period of its box.</p>\n<div class=\"row same-scale\">\n",
    );
    figure_to_scale(html, &photo.picture, "Photograph");
    for (number, section) in figures.sections.iter().enumerate() {
        figure_to_scale(html, section, &format!("Section {} of the solid", number + 1));
    }
    html.push_str("</div>\n<table>\n<tr><th></th><th class=\"number\">Photograph</th><th class=\"number\">Sections</th><th class=\"number\">Apart by</th></tr>\n");
    let mut rows = |name: &str, section: &SectionFigures| {
        let _ = writeln!(
            html,
            "<tr><td>Area fraction, {name}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n\
             <tr><td>Profiles, {name}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">sizes: {}</td></tr>\n\
             <tr><td>Colours, {name}</td><td></td><td></td><td class=\"number\">{}</td></tr>",
            percent(section.area_fraction_photo),
            percent(section.area_fraction_synthetic),
            percent((section.area_fraction_synthetic / section.area_fraction_photo - 1.0).abs()),
            counted(photo.profiles),
            counted(section.profiles),
            percent(section.size_w1),
            percent(section.colour_distance),
        );
    };
    rows("measured exactly", &figures.exact);
    if let Some(again) = &figures.resegmented {
        rows("sections segmented like the photograph", again);
    }
    html.push_str("</table>\n");
}

fn photograph(html: &mut String, photo: &PhotoFigures, unit: &str) {
    html.push_str("<h2>What was found on the photograph</h2>\n<div class=\"row\">\n");
    let _ = writeln!(
        html,
        "<figure><img alt=\"Photograph\" src=\"{}\"><figcaption>The photograph, {} x {} pixels.</figcaption></figure>",
        pictures::photograph(&photo.picture),
        photo.picture.width(),
        photo.picture.height()
    );
    let _ = writeln!(
        html,
        "<figure><img alt=\"Outlines\" src=\"{}\"><figcaption>The outlines found. Each particle should be outlined once, and nothing else.</figcaption></figure>\n</div>",
        pictures::drawing(&photo.overlay)
    );
    let _ = writeln!(
        html,
        "<p>{} profiles found, {} of them counted by the edge rule: {} per square {unit}. They cover {} of the area.</p>",
        counted(photo.profiles_found),
        counted(photo.profiles),
        significant(photo.number_per_area),
        percent(photo.area_fraction),
    );
    let _ = writeln!(
        html,
        "<table>\n<tr><th>Colour</th><th>Of</th><th class=\"number\">Profiles</th><th class=\"number\">Mean profile size ({unit})</th></tr>\n\
         <tr><td>{}</td><td>binder</td><td></td><td></td></tr>",
        patch(photo.binder)
    );
    for (number, category) in photo.categories.iter().enumerate() {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>category {number}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>",
            patch(category.colour),
            counted(category.profiles),
            significant(category.mean_size)
        );
    }
    html.push_str("</table>\n");
}

fn sizes(html: &mut String, sizes: &SizeFigures, comparison: &ComparisonFigures, unit: &str) {
    html.push_str("<h2>Sizes</h2>\n<div class=\"row\">\n");
    let _ = writeln!(
        html,
        "<figure>{}<figcaption>Profiles on the photograph (bars), what the fitted particles would show (refolded), and what the solid's sections show. The \
         three should agree within the counting error.</figcaption></figure>",
        plots::profiles(sizes, &comparison.profiles_synthetic, unit)
    );
    let _ = writeln!(
        html,
        "<figure>{}<figcaption>Particles per unit volume: unfolded{}, and as packed. The packing is scaled to the photograph's area fraction.{}</figcaption></figure>\n</div>",
        plots::particles(sizes, unit),
        if sizes.interval.is_some() {
            ", with intervals"
        } else {
            ""
        },
        if sizes.number_density.iter().any(Option::is_none) {
            " Grey bins are below what the photograph shows."
        } else {
            ""
        }
    );
    let shapes: Vec<String> = sizes
        .shapes
        .iter()
        .map(|(shape, share)| format!("<code>{}</code> {}", escaped(shape), percent(*share)))
        .collect();
    let mut rows = vec![
        ("Particles".to_owned(), shapes.join(", ")),
        ("Method".to_owned(), escaped(&sizes.method)),
        (
            format!("Particles per cubic {unit}"),
            with_interval(sizes.total, sizes.total_interval),
        ),
        (format!("Mean size ({unit})"), significant(sizes.mean_size)),
        (
            "Volume fraction by unfolding".to_owned(),
            percent(sizes.volume_fraction),
        ),
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
            "Intervals".to_owned(),
            "not asked for; --bootstrap B gives them".to_owned(),
        ));
    }
    table(html, &rows);
}

fn packing(html: &mut String, input: &ReportInput) {
    let (packing, unit): (&PackingFigures, _) = (&input.packing, &input.unit);
    let of_overlap = |check: &&Check| check.name == CheckName::Overlap;
    let overlap = match input.verdict.checks.iter().find(of_overlap) {
        Some(check) if check.level == Level::Good => {
            format!(
                "none, by a separate pass over all pairs: {}",
                trust::overlap(check.value)
            )
        }
        Some(check) => trust::overlap(check.value),
        None => "unknown".to_owned(),
    };
    html.push_str("<h2>The solid</h2>\n<div class=\"row\">\n");
    let _ = writeln!(
        html,
        "<figure class=\"narrow\"><img alt=\"One period of the solid\" src=\"{}\"><figcaption>One period of the solid.</figcaption></figure>\n<div class=\"narrow\">",
        pictures::photograph(&packing.cube)
    );
    let sides: Vec<String> = packing.sides.iter().map(|side| significant(*side)).collect();
    table(
        html,
        &[
            ("Particles".to_owned(), counted(packing.particles)),
            (format!("Box ({unit})"), sides.join(" x ")),
            ("Fraction inside particles".to_owned(), percent(packing.fraction)),
            ("Fraction asked for".to_owned(), percent(packing.requested_fraction)),
            ("Overlap".to_owned(), overlap),
            ("Rounds of relaxation".to_owned(), counted(packing.iterations)),
        ],
    );
    html.push_str("</div>\n</div>\n");
}

fn texture(html: &mut String, comparison: &ComparisonFigures) {
    let Some(spectrum) = &comparison.spectrum else { return };
    html.push_str("<h2>Texture</h2>\n");
    let _ = writeln!(
        html,
        "<figure class=\"narrow\">{}<figcaption>Power of the residual (photograph minus mean colours) by fineness, away from outlines. Slices of the residual volume should follow \
         the photograph; they are apart by a factor of {} (root mean square).</figcaption></figure>",
        plots::spectra(spectrum),
        significant(10_f64.powf(spectrum.log_error()))
    );
}

fn repeat(html: &mut String, input: &ReportInput) {
    let _ = writeln!(
        html,
        "<h2>To repeat it</h2>\n<p>The same program, photograph and command give the same bytes in every file.</p>\n<pre>{}</pre>\n<h3>Every parameter</h3>",
        escaped(&input.command)
    );
    let rows: Vec<_> = input
        .parameters
        .iter()
        .map(|(name, value)| (name.clone(), format!("<code>{}</code>", escaped(value))))
        .collect();
    table(html, &rows);
}

fn with_interval(value: f64, interval: Option<(f64, f64)>) -> String {
    match interval {
        Some((low, high)) => format!("{} ({} to {})", significant(value), significant(low), significant(high)),
        None => significant(value),
    }
}

/// Rows of a name and a value; values are HTML.
pub(super) fn table(html: &mut String, rows: &[(String, String)]) {
    html.push_str("<table>\n");
    for (name, value) in rows {
        let _ = writeln!(
            html,
            "<tr><td class=\"name\">{}</td><td>{value}</td></tr>",
            escaped(name)
        );
    }
    html.push_str("</table>\n");
}

/// A picture as wide, relative to its neighbours, as it has pixels.
pub(super) fn figure_to_scale(html: &mut String, picture: &RgbImage, caption: &str) {
    let _ = writeln!(
        html,
        "<figure style=\"flex-grow: {}\"><img alt=\"{caption}\" src=\"{}\"><figcaption>{caption}</figcaption></figure>",
        picture.width(),
        pictures::photograph(picture)
    );
}

fn patch(colour: [f64; 3]) -> String {
    let [r, g, b] = colour.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8);
    format!(
        "<span class=\"patch\" style=\"background: rgb({r}, {g}, {b})\"></span> <span class=\"soft\">{r}, {g}, {b}</span>"
    )
}

/// With a capital at its beginning and a full stop at its end.
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

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
