//! The page of measures: values beside their floors, and the curves behind them.

use askama::Template;
use image::RgbImage;
use stereology::metrics::{BlockTest, Comparison, FeatureMeans, Figure};
use stereology::pipeline::Level;

use crate::checks;
use crate::number::significant;
use crate::page::{Captioned, Picture, class};
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
    /// The block test, if there were enough blocks.
    pub blocks: Option<&'a BlockTest>,
    /// Geometry of the phases.
    pub phases: Vec<PhaseRow>,
    /// The command that repeats the computation.
    pub command: String,
    /// Every parameter with its value.
    pub parameters: Vec<(String, String)>,
}

/// One quantity of a phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseRow {
    /// The phase: bright or dark.
    pub phase: &'static str,
    /// The quantity.
    pub quantity: &'static str,
    /// On the exemplar's image or slices, on the measured slices, in the exemplar's volume, in the volume.
    pub values: [Option<f64>; 4],
}

/// Title and meaning of each measure, in the order of [`Comparison::figures`].
const MEANINGS: [(&str, &str); 23] = [
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
    ("Patches of 31 pixels", "sliced Wasserstein distance"),
    (
        "Amplitudes across scales",
        "difference of their correlations at neighbouring scales: edges and flat areas at the same places",
    ),
    (
        "Phases across scales",
        "difference of their correlations at neighbouring scales: sharp edges and lines",
    ),
    (
        "Boundary",
        "length of the boundary between the phases over that of the exemplar",
    ),
    (
        "Euler number",
        "of the bright phase per 10,000 pixels: components minus holes",
    ),
    ("Dark chords", "mean chord of the dark phase over that of the exemplar"),
    (
        "Variation of chords",
        "of the bright phase: standard deviation over mean",
    ),
    (
        "Variation of dark chords",
        "of the dark phase: standard deviation over mean",
    ),
];

#[derive(Template)]
#[template(path = "measures.html")]
struct MeasuresPage<'a> {
    exemplar: &'a str,
    volume: &'a str,
    number: usize,
    pictures: Vec<Captioned>,
    verdict: Statement,
    blocks: Option<Blocks>,
    rows: Vec<Row>,
    phases: Vec<(String, [String; 4])>,
    curves: Vec<Curve>,
    command: &'a str,
    parameters: &'a [(String, String)],
}

/// A level with its sentence.
struct Statement {
    class: &'static str,
    text: String,
}

/// The block test.
struct Blocks {
    accuracy: String,
    statement: Statement,
    features: Vec<(String, [String; 3])>,
}

struct Row {
    title: &'static str,
    meaning: &'static str,
    value: String,
    ideal: String,
    floor: String,
    in_floors: String,
    level: &'static str,
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
            verdict: verdict(self.comparison, self.blocks),
            blocks: self.blocks.map(blocks),
            rows: rows(self.comparison),
            phases: self.phases.iter().map(phase).collect(),
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
                level: figure.level().map_or("", checks::word),
                class: figure.level().map_or("soft", class),
            }
        })
        .collect()
}

/// The verdict in a sentence.
fn verdict(found: &Comparison, test: Option<&BlockTest>) -> Statement {
    let titles = found.figures().into_iter().zip(MEANINGS);
    let of = |level: Level| -> Vec<&str> {
        let is_level = |((_, figure), _): &((&str, Figure), (&str, &str))| figure.level() == Some(level);
        titles.clone().filter(is_level).map(|(_, (title, _))| title).collect()
    };
    let (bad, care) = (of(Level::Bad), of(Level::Care));
    let of_figures = found.verdict().map(|(level, _)| level);
    let level = of_figures.into_iter().chain(test.map(BlockTest::level)).max();
    let listed = |what: &str, names: &[&str]| match names {
        [] => String::new(),
        names => format!(" {what}: {}.", names.join(", ").to_lowercase()),
    };
    let summary = match level {
        Some(Level::Good) => "The slices cannot be distinguished from the exemplar.",
        Some(Level::Care) => "The slices differ from the exemplar in some respect.",
        Some(Level::Bad) => "The slices do not look like the exemplar.",
        None => "Nothing could be judged: the exemplar has no floor.",
    };
    Statement {
        class: level.map_or("soft", class),
        text: format!("{summary}{}{}", listed("Bad", &bad), listed("With care", &care)),
    }
}

fn blocks(test: &BlockTest) -> Blocks {
    let meaning = match test.level() {
        Level::Good => "no better than chance would allow",
        Level::Care => "more than chance allows, but most features agree",
        Level::Bad => "a reader would see the difference",
    };
    let feature = |of: &FeatureMeans| {
        let values = [of.exemplar, of.solid, of.difference].map(significant);
        (of.name.replace('_', " "), values)
    };
    Blocks {
        accuracy: format!("{:.0} %", 100.0 * test.accuracy),
        statement: Statement {
            class: class(test.level()),
            text: format!(
                "A classifier finds the side of {:.0} % of {} blocks of {} pixels, p = {}: {meaning}.",
                100.0 * test.accuracy,
                2 * test.blocks,
                test.side,
                significant(test.p_value)
            ),
        },
        features: test.features.iter().take(6).map(feature).collect(),
    }
}

fn phase(row: &PhaseRow) -> (String, [String; 4]) {
    let shown = |value: Option<f64>| value.map_or_else(String::new, significant);
    (format!("{} phase: {}", row.phase, row.quantity), row.values.map(shown))
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
    let plots: [(Plot, String); 13] = [
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
                &bins(curves.dark_chords[0].len(), 1.0, 1.0),
                &curves.dark_chords,
                "chord (pixels)",
                "fraction",
            ),
            "Chords of the dark phase.".to_owned(),
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
