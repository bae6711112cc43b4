//! The page of measures: values beside their floors, and the curves behind them.

use askama::Template;
use image::RgbImage;
use stereology::metrics::{Comparison, Figure};

use crate::number::significant;
use crate::page::{Captioned, Picture};
use crate::plot::{self, Plot};

/// Content of the page.
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
    /// Number of slices measured.
    pub number: usize,
    /// The comparison.
    pub comparison: &'a Comparison,
    /// The command that repeats the computation.
    pub command: String,
    /// Every parameter with its value.
    pub parameters: Vec<(String, String)>,
}

/// Title and meaning of each measure, in the order of [`Comparison::figures`].
const MEANINGS: [(&str, &str); 15] = [
    (
        "Grey levels",
        "Kullback-Leibler divergence of the histograms of 64 bins, nats",
    ),
    (
        "Contrast",
        "standard deviation, mean of the slices, over that of the exemplar",
    ),
    ("Skewness", "of grey levels, mean of the slices"),
    ("Orientations", "divergence of the histograms of 36 directions, nats"),
    ("Coherence", "of the structure tensor, 0 to 1"),
    ("Fringe length", "mean of the fringes that lie inside a window, pixels"),
    (
        "Fringe length by ends",
        "twice the visible length over the visible ends, pixels: independent of the choice of the window",
    ),
    ("Tortuosity", "length of a fringe over the distance between its ends"),
    (
        "Two-point correlation",
        "root mean square difference of S2 of the bright phase",
    ),
    ("Lineal path", "largest difference, rows and columns"),
    ("Chords", "mean chord of the bright phase over that of the exemplar"),
    ("Local porosity", "Wasserstein distance"),
    ("Patches of 7 pixels", "sliced Wasserstein distance"),
    ("Patches of 16 pixels", "sliced Wasserstein distance"),
    (
        "Sharpness",
        "mean gradient over that of the exemplar: below 1 is blur, above 1 noise or seams",
    ),
];

#[derive(Template)]
#[template(path = "measures.html")]
struct MeasuresPage<'a> {
    exemplar: &'a str,
    volume: &'a str,
    number: usize,
    pictures: Vec<Captioned>,
    rows: Vec<Row>,
    curves: Vec<Curve>,
    command: &'a str,
    parameters: &'a [(String, String)],
}

struct Row {
    title: &'static str,
    meaning: &'static str,
    value: String,
    ideal: String,
    floor: String,
    in_floors: String,
    class: &'static str,
}

struct Curve {
    plot: Plot,
    caption: String,
}

impl MeasureReport<'_> {
    /// The page as HTML: one file without scripts and links.
    ///
    /// # Errors
    ///
    /// [`askama::Error`] if the template cannot be rendered.
    pub fn page(&self) -> Result<String, askama::Error> {
        let captioned = |caption: &str, image: &RgbImage| Captioned {
            picture: Picture::of(image),
            caption: caption.to_owned(),
        };
        let exemplar = self.exemplar.iter().map(|image| captioned("Exemplar", image));
        let slices = self.slices.iter().map(|(caption, image)| captioned(caption, image));
        MeasuresPage {
            exemplar: &self.exemplar_name,
            volume: &self.volume_name,
            number: self.number,
            pictures: exemplar.chain(slices).collect(),
            rows: rows(self.comparison),
            curves: curves(self.comparison),
            command: &self.command,
            parameters: &self.parameters,
        }
        .render()
    }
}

fn rows(found: &Comparison) -> Vec<Row> {
    let shown = |value: Option<f64>| value.map_or_else(|| "not measurable".to_owned(), significant);
    let measures = found.figures().into_iter().zip(MEANINGS);
    measures
        .map(|((_, figure), (title, meaning))| {
            let Figure { value, ideal, floor } = figure;
            let in_floors = figure.in_floors();
            Row {
                title,
                meaning,
                value: shown(value),
                ideal: shown(ideal),
                floor: shown(floor),
                in_floors: shown(in_floors),
                class: match in_floors {
                    Some(floors) if floors <= 1.0 => "good",
                    Some(floors) if floors <= 2.0 => "fair",
                    Some(_) => "poor",
                    None => "soft",
                },
            }
        })
        .collect()
}

fn curves(found: &Comparison) -> Vec<Curve> {
    let curves = &found.curves;
    let bins = |n: usize, width: f64, start: f64| -> Vec<f64> { (0..n).map(|i| start + width * i as f64).collect() };
    let lags = |pair: &[Vec<f64>; 2]| bins(pair[0].len(), 1.0, 0.0);
    let grey = plot::pair(
        &bins(64, 1.0 / 64.0, 0.5 / 64.0),
        &curves.grey,
        "grey level",
        "fraction of pixels",
    );
    let directions = plot::pair(
        &bins(36, 5.0, 0.0),
        &curves.orientation,
        "direction of the texture (degrees)",
        "fraction of pixels",
    );
    let deviations = plot::slices(&curves.deviations, "slice, of all measured", "standard deviation");
    let skewnesses = plot::slices(&curves.skewnesses, "slice, of all measured", "skewness");
    let fringes = format!(
        "Distribution function of the fringe lengths inside windows of {} x {} pixels: {} fringes in the exemplar, {} in the volume. Period {} pixels.",
        curves.window[1],
        curves.window[0],
        curves.fringe_lengths[0].len(),
        curves.fringe_lengths[1].len(),
        curves.period.map_or_else(|| "-".to_owned(), significant)
    );
    let porosity = format!(
        "Fractions of the bright phase (above grey level {}) in squares of {} pixels.",
        significant(f64::from(curves.threshold)),
        curves.cell
    );
    let plots: [(Plot, String); 12] = [
        (grey, "Grey levels.".to_owned()),
        (directions, "Directions from the structure tensor.".to_owned()),
        (
            deviations,
            "Contrast of each slice; the line is that of the exemplar.".to_owned(),
        ),
        (
            skewnesses,
            "Skewness of each slice; the line is that of the exemplar.".to_owned(),
        ),
        (
            plot::pair(&lags(&curves.two_point), &curves.two_point, "distance (pixels)", "S2"),
            "Two-point correlation of the bright phase, mean over directions.".to_owned(),
        ),
        (
            plot::pair(
                &lags(&curves.two_point_along),
                &curves.two_point_along,
                "distance along rows (pixels)",
                "S2",
            ),
            "The same along rows.".to_owned(),
        ),
        (
            plot::pair(
                &lags(&curves.two_point_across),
                &curves.two_point_across,
                "distance along columns (pixels)",
                "S2",
            ),
            "The same along columns.".to_owned(),
        ),
        (
            plot::pair(
                &lags(&curves.lineal_path),
                &curves.lineal_path,
                "length (pixels)",
                "probability",
            ),
            "Lineal-path function: segments that lie entirely in the bright phase.".to_owned(),
        ),
        (
            plot::pair(
                &bins(curves.chords[0].len(), 1.0, 1.0),
                &curves.chords,
                "chord (pixels)",
                "fraction",
            ),
            "Chords of the bright phase.".to_owned(),
        ),
        (
            plot::pair(
                &bins(20, 0.05, 0.025),
                &curves.local_porosity,
                "fraction of the bright phase",
                "fraction of squares",
            ),
            porosity,
        ),
        (plot::distribution(&curves.fringe_lengths, "length (pixels)"), fringes),
        (
            plot::distribution(&curves.tortuosities, "tortuosity"),
            "The same for their tortuosities.".to_owned(),
        ),
    ];
    plots
        .into_iter()
        .map(|(plot, caption)| Curve { plot, caption })
        .collect()
}
