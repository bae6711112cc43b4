//! `stereology segment`: a photograph -> profiles.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use stereology::files::profiles;
use stereology::segment::{self, SegmentOptions, Segmentation, read_labels_for, read_photo_up_to, write_labels};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::{percent, significant};
use crate::outputs::{OutputFolder, check_file, write_json};
use crate::progress::{Step, go_on};
use crate::values::{BinderArgument, CategoriesArgument, pair, positive};
use crate::warnings::Warning;

/// Finds the profiles of particles on a photograph of a cut
///
/// Tells particles from the binder between them, outlines each profile, measures it, and takes the photograph apart into mean colours and residual texture.
/// A photograph without separable particles (no binder colour, or nothing in it) is refused or warned of: outline such particles with another tool and import
/// its label map with --labels.
///
/// Writes into DIR: labels.tif (0 = binder), profiles.csv (id, x, y, area, size, r, g, b, category,
/// touches_edge, weight; colours 0 to 255), overlay.png (look at this first),
/// binder.png, means.png, residual.tif (f32, photo / 255 - means, exact), residual.png (its picture) and summary.json.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology segment photo.jpg -o out --min-area 30 --categories 3")]
pub struct Segment {
    /// Photograph (PNG, JPEG, TIFF; 8 or 16 bits, grey or colour, with or without alpha)
    #[arg(value_name = "PHOTO")]
    pub photo: PathBuf,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Write the labels to further files too, to correct them in another tool and come back with --labels; the ending tells the kind: .tif, .png, .npy (napari), .zip (Fiji's ROI manager), .geojson (QGIS),
    /// .json (COCO)
    #[arg(long, value_name = "FILE")]
    pub labels_out: Vec<PathBuf>,
    /// Refuse photographs of more pixels; segmenting takes about 100 bytes a pixel
    #[arg(long, value_name = "N", default_value_t = 150_000_000)]
    pub max_pixels: u64,
    #[command(flatten)]
    pub choices: Choices,
}

/// How to segment.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Segmentation")]
#[group(id = "segment-choices")]
pub struct Choices {
    /// Label map of another tool instead of segmenting: TIFF, PNG or .npy of numbers (0 = binder), GeoJSON polygons, ImageJ ROI zip, COCO annotations
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Colour of the binder, 0 to 255, or N for the Nth of the photograph's main colours, from 0 [default: found in the photograph]
    #[arg(long, value_name = "R,G,B|N")]
    pub binder: Option<BinderArgument>,
    /// Smallest area of a profile in pixels
    #[arg(long, value_name = "PX", value_parser = positive)]
    pub min_area: Option<f64>,
    /// Number of colour categories of the particles, or how to choose it: `silhouette` or `gap` [default: silhouette]
    #[arg(long, value_name = "K|HOW")]
    pub categories: Option<CategoriesArgument>,
    /// Standard deviation of the smoothing before segmenting, in pixels
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    pub smoothing: f32,
    /// Distances to the binder, in its standard deviations, at which a particle ends and which it must reach
    #[arg(long, value_name = "LOW,HIGH", default_value = "5,9", value_parser = pair)]
    pub thresholds: [f32; 2],
    /// Height above their neck from which touching parts are particles of their own: pixels, and share of their depth
    #[arg(long, value_name = "PX,SHARE", default_value = "0.7,0.1", value_parser = pair)]
    pub rise: [f32; 2],
    /// Holes in profiles: filled, or kept (for particles with annular sections)
    #[arg(long, value_enum, default_value_t = Holes::Fill)]
    pub holes: Holes,
    /// Which profiles at the photograph's edge count, and how much
    #[arg(long, value_enum, default_value_t = EdgeRule::Frame)]
    pub edge_rule: EdgeRule,
}

/// What becomes of holes in profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Holes {
    /// Part of the profile
    Fill,
    /// Binder
    Keep,
}

/// How profiles at the photograph's edge are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EdgeRule {
    /// Unbiased counting frame: profiles that touch two of the sides are left out
    Frame,
    /// Profiles wholly inside, weighted by the chance to be so
    MilesLantuejoul,
    /// All, cut ones as they are: biased, for comparison
    All,
}

impl Choices {
    /// The options of the segmentation; areas in pixels.
    pub fn options(&self, seed: u64) -> SegmentOptions {
        let mut options = SegmentOptions::default()
            .with_seed(seed)
            .with_holes(match self.holes {
                Holes::Fill => segment::Holes::Fill,
                Holes::Keep => segment::Holes::Keep,
            })
            .with_edge_rule(match self.edge_rule {
                EdgeRule::Frame => segment::EdgeRule::AssociatedPoint,
                EdgeRule::MilesLantuejoul => segment::EdgeRule::MilesLantuejoul,
                EdgeRule::All => segment::EdgeRule::All,
            });
        let ([low, high], [pixels, share]) = (self.thresholds, self.rise);
        options = options
            .with_smoothing(self.smoothing)
            .with_thresholds(low, high)
            .with_rise(pixels, share);
        options = match self.binder {
            Some(BinderArgument::Colour(rgb)) => options.with_binder(rgb.map(|channel| f64::from(channel) / 255.0)),
            Some(BinderArgument::MainColour(number)) => options.with_main_colour(number),
            None => options,
        };
        if let Some(area) = self.min_area {
            options = options.with_min_area(area.ceil() as usize);
        }
        match self.categories {
            Some(CategoriesArgument::Count(categories)) => options.with_categories(categories),
            Some(CategoriesArgument::Gap) => options.with_gap(),
            Some(CategoriesArgument::Silhouette) | None => options,
        }
    }
}

impl Segment {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        for path in &self.labels_out {
            check_file(path, everywhere.force)?;
        }
        let folder = OutputFolder::begin(&self.output, everywhere.force)?;
        let read = read_photo_up_to(&self.photo, self.max_pixels).at(&self.photo)?;
        let (photo, mut findings) = (read.photo, read.findings);
        let options = self.choices.options(everywhere.seed);
        let step = Step::begin("segmenting", everywhere.quiet);
        let found = match &self.choices.labels {
            Some(path) => {
                let size = (photo.height() as usize, photo.width() as usize);
                let read = read_labels_for(path, size).at(path)?;
                findings.extend(read.findings);
                Segmentation::from_labels(&photo, read.labels, &options).at(path)?
            }
            None => segment::segment(&photo, &options, &|done| step.at(done)).at(&self.photo)?,
        };
        drop(step);
        go_on()?;
        let mut answer = Answer::new("segment");
        for (name, value) in figures(&found, everywhere.scale) {
            answer.field(name, value);
        }
        findings.extend(found.findings.iter().cloned());
        for finding in &findings {
            answer.warn(Warning::new(finding.code, finding.message.clone()));
        }
        let (window, scale) = (found.window, everywhere.scale);
        let counted = found.profiles.iter().filter(|profile| profile.weight > 0.0).count();
        answer
            .line(format!(
                "{} profiles found, {counted} of them counted by the edge rule",
                found.profiles.len()
            ))
            .line(format!("area fraction      {}", percent(found.area_fraction)))
            .line(format!(
                "profiles per area  {}",
                significant(found.number_per_area / (scale * scale))
            ))
            .line(format!(
                "window             {} x {} pixels",
                window.width, window.height
            ))
            .line(format!("colour categories  {}", found.categories.len()))
            .line(format!(
                "look at            {}",
                self.output.join("overlay.png").display()
            ));
        write_files(&folder, &found, scale)?;
        for path in &self.labels_out {
            write_labels(path, found.labels.view()).at(path)?;
        }
        write_json(&folder.file("summary.json"), &answer.summary())?;
        go_on()?;
        folder.publish()?;
        Ok(answer)
    }
}

/// Fields of the summary, lengths times `scale`.
pub fn figures(found: &Segmentation, scale: f64) -> Vec<(&'static str, Value)> {
    let mean_size = |category: usize| {
        let sizes: Vec<f64> = found
            .profiles
            .iter()
            .filter(|p| usize::from(p.category) == category)
            .map(|p| p.size * scale)
            .collect();
        sizes.iter().sum::<f64>() / sizes.len() as f64
    };
    let colours: Vec<Value> = found
        .categories
        .iter()
        .enumerate()
        .map(|(k, category)| {
            json!({ "colour": category.colour.map(|c| 255.0 * c), "profiles": category.profiles, "mean_size": mean_size(k) })
        })
        .collect();
    vec![
        ("profiles", json!(found.profiles.len())),
        ("area_fraction", json!(found.area_fraction)),
        ("number_per_area", json!(found.number_per_area / (scale * scale))),
        ("min_size", json!(found.min_size * scale)),
        ("categories", json!(found.categories.len())),
        (
            "window",
            json!({
                "width": found.window.width as f64 * scale,
                "height": found.window.height as f64 * scale,
                "area": found.window.area * scale * scale,
            }),
        ),
        (
            "counted",
            json!(found.profiles.iter().filter(|profile| profile.weight > 0.0).count()),
        ),
        ("binder", json!(found.binder.colour.map(|c| 255.0 * c))),
        ("category_colours", json!(colours)),
        (
            "size_by_category",
            found.size_by_category.map_or(
                Value::Null,
                |test| json!({ "test": "kruskal-wallis", "statistic": test.statistic, "p_value": test.p_value }),
            ),
        ),
    ]
}

/// Writes all files of a segmentation but the summary, lengths times `scale`.
pub fn write_files(folder: &OutputFolder, found: &Segmentation, scale: f64) -> Result<(), Failure> {
    let labels = folder.file("labels.tif");
    write_labels(&labels, found.labels.view()).at(&labels)?;
    profiles::write(folder.file("profiles.csv"), found, scale).or_fail()?;
    for (name, picture) in [
        ("overlay.png", found.overlay()),
        ("binder.png", found.binder_picture()),
        ("means.png", found.means()),
        ("residual.png", found.residual_picture()),
    ] {
        let path = folder.file(name);
        picture.save(&path).at(&path)?;
    }
    let residual = folder.file("residual.tif");
    found.write_residual(&residual).at(&residual)
}
