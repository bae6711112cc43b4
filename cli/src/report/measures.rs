//! The page of `stereology measure`: figures beside their floors, and the curves behind them.

use std::fmt::Write;

use image::RgbImage;
use stereology::metrics::{Comparison, Figure};

use super::page::{escaped, figure_to_scale, table};
use super::plots;
use crate::numbers::significant;

/// What the page shows.
#[derive(Clone, Debug)]
pub struct MeasureReport<'a> {
    /// Name of the exemplar's file.
    pub exemplar_name: String,
    /// Name of the volume's file.
    pub volume_name: String,
    /// The exemplar, or its middle slice.
    pub exemplar: Option<RgbImage>,
    /// Captions and middle slices of the volume.
    pub slices: Vec<(String, RgbImage)>,
    /// Slices that were measured.
    pub number: usize,
    /// What was found.
    pub comparison: &'a Comparison,
    /// The command that makes this result again.
    pub command: String,
    /// Every parameter and its value.
    pub parameters: Vec<(String, String)>,
}

/// Title and meaning of each figure, in the order of [`Comparison::figures`].
const MEANINGS: [(&str, &str); 15] = [
    (
        "Grey levels",
        "Kullback-Leibler divergence of the histograms of 64 bins, nats",
    ),
    (
        "Contrast",
        "standard deviation, mean of the slices, over the exemplar's",
    ),
    ("Skewness", "of grey levels, mean of the slices"),
    ("Orientations", "divergence of the histograms of 36 directions, nats"),
    ("Coherence", "how decided the directions are, 0 to 1"),
    ("Fringe length", "mean of the fringes that lie inside a window, pixels"),
    (
        "Fringe length by ends",
        "twice the length seen over the ends seen, pixels: free of the window's choice",
    ),
    ("Tortuosity", "length of a fringe over the distance of its ends"),
    (
        "Two-point correlation",
        "root mean square difference of S2 of the bright phase",
    ),
    ("Lineal path", "largest difference, rows and columns"),
    ("Chords", "mean chord of the bright phase over the exemplar's"),
    ("Local porosity", "Wasserstein distance"),
    ("Patches of 7 pixels", "sliced Wasserstein distance"),
    ("Patches of 16 pixels", "sliced Wasserstein distance"),
    (
        "Sharpness",
        "mean gradient over the exemplar's: below 1 is blur, above 1 noise or seams",
    ),
];

/// The page as HTML: one file, without scripts or links.
pub fn measures_page(report: &MeasureReport<'_>) -> String {
    let mut html = String::with_capacity(1 << 18);
    let (exemplar, volume) = (escaped(&report.exemplar_name), escaped(&report.volume_name));
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{volume} beside {exemplar}</title>\n<style>\n{}</style>\n</head>\n<body>\n<h1>{volume} beside {exemplar}</h1>\n\
         <p class=\"lead\">How like the slices of the volume are to the exemplar, by {} slices. A figure is judged by its floor: how far from the ideal two halves of the exemplar are from each other.</p>\n",
        include_str!("style.css"),
        report.number
    );
    pictures(&mut html, report);
    figures(&mut html, report.comparison);
    curves(&mut html, report.comparison);
    let _ = writeln!(
        html,
        "<h2>To repeat it</h2>\n<pre>{}</pre>\n<h3>Every parameter</h3>",
        escaped(&report.command)
    );
    let rows: Vec<_> = report
        .parameters
        .iter()
        .map(|(name, value)| (name.clone(), format!("<code>{}</code>", escaped(value))))
        .collect();
    table(&mut html, &rows);
    html.push_str("</body>\n</html>\n");
    html
}

fn pictures(html: &mut String, report: &MeasureReport<'_>) {
    html.push_str("<h2>Pictures</h2>\n<div class=\"row same-scale\">\n");
    if let Some(exemplar) = &report.exemplar {
        figure_to_scale(html, exemplar, "Exemplar");
    }
    for (caption, slice) in &report.slices {
        figure_to_scale(html, slice, caption);
    }
    html.push_str("</div>\n");
}

fn figures(html: &mut String, found: &Comparison) {
    let said = |value: Option<f64>| value.map_or_else(|| "not measurable".to_owned(), significant);
    html.push_str(
        "<h2>Figures</h2>\n<table>\n<tr><th>Figure</th><th class=\"number\">Volume</th><th class=\"number\">Ideal</th><th class=\"number\">Floor</th><th class=\"number\">Floors off</th></tr>\n",
    );
    for ((_, figure), (title, meaning)) in found.figures().into_iter().zip(MEANINGS) {
        let Figure { value, ideal, floor } = figure;
        let off = figure.in_floors();
        let class = match off {
            Some(off) if off <= 1.0 => "good",
            Some(off) if off <= 2.0 => "fair",
            Some(_) => "poor",
            None => "soft",
        };
        let _ = writeln!(
            html,
            "<tr><td>{title}<br><span class=\"soft\">{meaning}</span></td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number {class}\">{}</td></tr>",
            said(value),
            said(ideal),
            said(floor),
            said(off)
        );
    }
    html.push_str("</table>\n");
}

fn curves(html: &mut String, found: &Comparison) {
    let curves = &found.curves;
    let bins = |n: usize, width: f64, start: f64| -> Vec<f64> { (0..n).map(|i| start + width * i as f64).collect() };
    let lags = |pair: &[Vec<f64>; 2]| bins(pair[0].len(), 1.0, 0.0);
    let grey = plots::pair(
        &bins(64, 1.0 / 64.0, 0.5 / 64.0),
        &curves.grey,
        "grey level",
        "share of pixels",
    );
    let directions = plots::pair(
        &bins(36, 5.0, 0.0),
        &curves.orientation,
        "direction of the texture (degrees)",
        "share of pixels",
    );
    let deviations = plots::slices(&curves.deviations, "slice, of all measured", "standard deviation");
    let skewnesses = plots::slices(&curves.skewnesses, "slice, of all measured", "skewness");
    let fringes = format!(
        "Fringes no longer than a length, among those inside windows of {} x {} pixels: {} in the exemplar, {} in the volume. Period {} pixels.",
        curves.window[1],
        curves.window[0],
        curves.fringe_lengths[0].len(),
        curves.fringe_lengths[1].len(),
        curves.period.map_or_else(|| "-".to_owned(), significant)
    );
    let porosity = format!(
        "Shares of the bright phase (above grey level {}) in squares of {} pixels.",
        significant(f64::from(curves.threshold)),
        curves.cell
    );
    let plots = [
        (grey, "Grey levels."),
        (directions, "Directions by the structure tensor."),
        (deviations, "Contrast of each slice; the line is the exemplar's."),
        (skewnesses, "Skewness of each slice; the line is the exemplar's."),
        (
            plots::pair(&lags(&curves.two_point), &curves.two_point, "distance (pixels)", "S2"),
            "Two-point correlation of the bright phase, mean over directions.",
        ),
        (
            plots::pair(
                &lags(&curves.two_point_along),
                &curves.two_point_along,
                "distance along rows (pixels)",
                "S2",
            ),
            "The same along rows.",
        ),
        (
            plots::pair(
                &lags(&curves.two_point_across),
                &curves.two_point_across,
                "distance along columns (pixels)",
                "S2",
            ),
            "The same along columns.",
        ),
        (
            plots::pair(
                &lags(&curves.lineal_path),
                &curves.lineal_path,
                "length (pixels)",
                "probability",
            ),
            "Lineal path: segments that lie wholly in the bright phase.",
        ),
        (
            plots::pair(
                &bins(curves.chords[0].len(), 1.0, 1.0),
                &curves.chords,
                "chord (pixels)",
                "share",
            ),
            "Chords of the bright phase.",
        ),
        (
            plots::pair(
                &bins(20, 0.05, 0.025),
                &curves.local_porosity,
                "share of the bright phase",
                "share of squares",
            ),
            &porosity,
        ),
        (plots::distribution(&curves.fringe_lengths, "length (pixels)"), &fringes),
        (
            plots::distribution(&curves.tortuosities, "tortuosity"),
            "The same for their windings.",
        ),
    ];
    html.push_str("<h2>Curves</h2>\n<div class=\"row\">\n");
    for (plot, caption) in plots {
        let _ = writeln!(html, "<figure>{plot}<figcaption>{caption}</figcaption></figure>");
    }
    html.push_str("</div>\n");
}
