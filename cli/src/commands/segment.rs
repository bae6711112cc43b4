//! `stereology segment`: from a photograph to profiles.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use image::RgbImage;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::profiles;
use stereology::files::table_head::TableHead;
use stereology::grid::LengthUnit;
use stereology::segment::{
    self, PhotoOptions, SegmentOptions, Segmentation, read_label_file, read_photo_with, write_labels,
};

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, OutputFolder, write_json};
use crate::pictures::Exif;
use crate::progress::{Step, go_on};
use crate::values::{BinderArgument, CategoriesArgument, pair, positive};
use crate::warnings::Warning;
use stereology_report::{percent, significant};

/// Finds the profiles of particles in a photograph of a plane section
///
/// Separates particles from the binder (the matrix between them), outlines and measures each profile, and decomposes
/// the photograph into mean colours and a residual texture. A photograph without separable particles (no binder colour,
/// or no particles) is refused or gives a warning; outline the particles with another tool and import its label map
/// with --labels.
///
/// Writes into DIR: labels.tif (0 = binder), profiles.csv (id, x, y, area, size, r, g, b, category, touches_edge,
/// weight, left, top, right, bottom, pixels, axis_ratio, ellipticity, solidity, orientation; colours 0 to 255,
/// orientation in degrees from the rows towards larger y; the last four are empty below 50 pixels), overlay.png (look
/// at this first), binder.png, means.png, residual.tif (f32, photo / 255 - means, exact), residual.png (for viewing)
/// and summary.json. Without PHOTO, only labels.tif, profiles.csv (without r, g, b), overlay.png and summary.json.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology segment photo.jpg -o out --min-area 30 --categories 3")]
pub struct Segment {
    /// Photograph of a plane section (PNG, JPEG, TIFF, WebP, BMP, GIF; grey or colour, with or without alpha); may be
    /// omitted with --labels, for sizes without colours
    #[arg(value_name = "PHOTO", required_unless_present = "labels")]
    pub photo: Option<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: Output,
    /// Also write the labels to this file, to correct them in another tool and import them with --labels; the extension
    /// selects the format: .tif, .png, .npy (napari), .zip (Fiji's ROI manager), .geojson (QGIS), .json (COCO); may be
    /// repeated
    #[arg(long, value_name = "FILE")]
    pub labels_out: Vec<Output>,
    /// Refuse photographs with more pixels; segmentation needs about 100 bytes per pixel
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
    /// Import this label map instead of segmenting: TIFF, PNG or .npy with numbers (0 = binder), an image with one
    /// colour per profile, a binary mask, polygons of GeoJSON, COCO, LabelMe or VIA, ImageJ ROI zip
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Whether the orientation that a camera noted in the photograph is applied
    #[arg(long, value_enum, default_value_t = Exif::Auto)]
    pub exif: Exif,
    /// Colour of the binder, 0 to 255, or the number N, from 0, of one of the photograph's main colours [default: found
    /// in the photograph]
    #[arg(long, value_name = "R,G,B|N")]
    pub binder: Option<BinderArgument>,
    /// Minimum area of a profile in pixels
    #[arg(long, value_name = "PX", value_parser = positive)]
    pub min_area: Option<f64>,
    /// Number of colour categories of the particles, or the criterion that selects it: `separated` (colours with gaps
    /// between them), `silhouette` or `gap` [default: separated]
    #[arg(long, value_name = "K|HOW")]
    pub categories: Option<CategoriesArgument>,
    /// Standard deviation of the Gaussian filter before segmentation, in pixels (of a photograph more blurred than 1.35
    /// pixels: in multiples of its blur)
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    pub smoothing: f32,
    /// Low and high hysteresis thresholds, in standard deviations of the binder colour
    #[arg(long, value_name = "LOW,HIGH", default_value = "5,9", value_parser = pair)]
    pub thresholds: [f32; 2],
    /// Minimum peak-to-saddle height for splitting touching particles: in pixels, and as a fraction of the peak
    #[arg(long, value_name = "PX,FRACTION", default_value = "0.7,0.1", value_parser = pair)]
    pub rise: [f32; 2],
    /// Whether holes in profiles are filled, or kept for particles with annular sections
    #[arg(long, value_enum, default_value_t = Holes::Fill)]
    pub holes: Holes,
    /// Rule for profiles at the edge of the photograph
    #[arg(long, value_enum, default_value_t = EdgeRule::Frame)]
    pub edge_rule: EdgeRule,
}

/// Treatment of holes in profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Holes {
    /// Holes are part of the profile
    Fill,
    /// Holes are binder
    Keep,
}

/// Rule for profiles at the edge of the photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EdgeRule {
    /// Unbiased counting frame: profiles that touch the two forbidden sides are excluded
    Frame,
    /// Profiles entirely inside, weighted by the reciprocal probability of being so (Miles-Lantuejoul)
    MilesLantuejoul,
    /// All profiles, truncated ones too: biased, for comparison
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
            Some(CategoriesArgument::Silhouette) => options.with_silhouette(),
            Some(CategoriesArgument::Separated) | None => options,
        }
    }
}

impl Segment {
    /// The segmentation, and findings on how its files were read.
    fn found(&self, seed: u64, step: &Step) -> Result<(Segmentation, Vec<Warning>), Failure> {
        let options = self.choices.options(seed);
        let read = PhotoOptions {
            most_pixels: self.max_pixels,
            exif: self.choices.exif.choice(),
            ..PhotoOptions::default()
        };
        let photo = self
            .photo
            .as_ref()
            .map(|path| read_photo_with(path, &read).at(path))
            .transpose()?;
        match (photo, &self.photo, &self.choices.labels) {
            (Some(read), Some(path), None) => {
                let options = options.with_compression(read.compression);
                let found = segment::segment(&read.photo, &options, &|done| step.at(done)).at(path)?;
                Ok((found, read.findings))
            }
            (Some(read), _, Some(path)) => {
                let labels = read.labels(path).at(path)?;
                let found = Segmentation::from_labels(&read.photo, labels.labels, &options).at(path)?;
                Ok((found, [read.findings, labels.findings].concat()))
            }
            (None, _, Some(path)) => {
                let labels = read_label_file(path).at(path)?;
                let found = Segmentation::of_sizes(labels.labels, &options).at(path)?;
                Ok((found, labels.findings))
            }
            _ => Err(Failure::usage("give a PHOTO, or --labels FILE")),
        }
    }

    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        everywhere.refuse_unit_of_pixels()?;
        let labels_out: Vec<PathBuf> = self
            .labels_out
            .iter()
            .map(|output| everywhere.outputs.file(output))
            .collect::<Result<_, _>>()?;
        let folder = everywhere.outputs.folder(&self.output)?;
        let step = Step::begin("segmenting", everywhere.quiet);
        let (found, mut findings) = self.found(everywhere.seed, &step)?;
        let options = self.choices.options(everywhere.seed);
        drop(step);
        go_on()?;
        let mut notes = Notes::default();
        findings.extend(found.findings.iter().cloned());
        for finding in &findings {
            notes.warn(Warning::new(finding.code, finding.message.clone()));
        }
        let (window, scale) = (found.window, everywhere.scale);
        let counted = found.profiles.iter().filter(|profile| profile.weight > 0.0).count();
        notes
            .line(format!(
                "{} profiles found, of which the edge rule counts {counted}",
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
                self.output.name().join("overlay.png").display()
            ));
        let head = profiles::head(&found, scale, everywhere.unit, options.edge_rule);
        write_files(&folder, &found, scale, &head)?;
        for path in &labels_out {
            write_labels(path, found.labels.view()).at(path)?;
        }
        let answer = Answer::new(&SegmentFields::of(&found, scale, everywhere.unit), notes)?;
        write_json(&folder.file("summary.json"), &answer.summary())?;
        go_on()?;
        Ok(answer)
    }
}

/// JSON of `stereology segment`, and `segment` in that of `stereology synthesize`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SegmentFields {
    /// Number of profiles found.
    profiles: usize,
    /// Unit of all lengths; null if it is not known, or pixels.
    unit: Option<&'static str>,
    /// Fraction of the area inside profiles.
    area_fraction: f64,
    /// Profiles per unit area.
    number_per_area: f64,
    /// Detection limit: the size of the smallest profile that is kept.
    min_size: f64,
    /// Number of colour categories.
    categories: usize,
    /// The photograph.
    window: WindowFields,
    /// Profiles that the edge rule counts.
    counted: usize,
    /// Colour of the binder (r, g, b), 0 to 255; null without a photograph.
    binder: Option<[f64; 3]>,
    /// Colour categories of the particles; empty without a photograph.
    category_colours: Vec<CategoryFields>,
    /// Test whether sizes differ between categories; null if there is one category.
    size_by_category: Option<TestFields>,
}

/// The photograph and the examined area.
#[derive(Debug, Serialize, JsonSchema)]
pub struct WindowFields {
    /// Width of the photograph.
    width: f64,
    /// Height of the photograph.
    height: f64,
    /// Area of the photograph.
    area: f64,
    /// Area in which profiles are counted: that of the photograph less what the edge rule leaves out.
    counted_area: f64,
}

/// A colour category.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CategoryFields {
    /// Mean colour (r, g, b), 0 to 255.
    colour: [f64; 3],
    /// Number of profiles.
    profiles: usize,
    /// Mean size of the profiles; null if there are none.
    mean_size: Option<f64>,
}

/// A test of significance.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TestFields {
    /// Name of the test.
    test: &'static str,
    /// Test statistic.
    statistic: f64,
    /// Probability of such a statistic if the null hypothesis holds.
    p_value: f64,
}

impl Fields for SegmentFields {
    const COMMAND: &'static str = "segment";
}

impl SegmentFields {
    /// The fields of a segmentation; lengths are multiplied by `scale` to be in `unit`.
    pub fn of(found: &Segmentation, scale: f64, unit: Option<LengthUnit>) -> Self {
        let mean_size = |category: usize| {
            let sizes: Vec<f64> = found
                .profiles
                .iter()
                .filter(|p| usize::from(p.category) == category)
                .map(|p| p.size * scale)
                .collect();
            Some(sizes.iter().sum::<f64>() / sizes.len() as f64).filter(|mean| mean.is_finite())
        };
        let categories = found.categories.iter().filter(|_| found.has_colours);
        let colours = categories.enumerate().map(|(k, category)| CategoryFields {
            colour: category.colour.map(|c| 255.0 * c),
            profiles: category.profiles,
            mean_size: mean_size(k),
        });
        Self {
            profiles: found.profiles.len(),
            unit: unit.map(LengthUnit::symbol),
            area_fraction: found.area_fraction,
            number_per_area: found.number_per_area / (scale * scale),
            min_size: found.min_size * scale,
            categories: found.categories.len(),
            window: WindowFields {
                width: found.window.width as f64 * scale,
                height: found.window.height as f64 * scale,
                area: (found.window.width * found.window.height) as f64 * scale * scale,
                counted_area: found.window.area * scale * scale,
            },
            counted: found.profiles.iter().filter(|profile| profile.weight > 0.0).count(),
            binder: found.has_colours.then(|| found.binder.colour.map(|c| 255.0 * c)),
            category_colours: colours.collect(),
            size_by_category: found.size_by_category.map(|test| TestFields {
                test: "kruskal-wallis",
                statistic: test.statistic,
                p_value: test.p_value,
            }),
        }
    }
}

/// Writes all files of a segmentation except the summary; lengths are multiplied by `scale`.
pub fn write_files(folder: &OutputFolder, found: &Segmentation, scale: f64, head: &TableHead) -> Result<(), Failure> {
    let labels = folder.file("labels.tif");
    write_labels(&labels, found.labels.view()).at(&labels)?;
    profiles::write(folder.file("profiles.csv"), found, scale, head).or_fail()?;
    let save = |name: &str, picture: RgbImage| {
        let path = folder.file(name);
        picture.save(&path).at(&path)
    };
    save("overlay.png", found.overlay())?;
    if !found.has_colours {
        return Ok(());
    }
    save("binder.png", found.binder_image())?;
    save("means.png", found.means())?;
    save("residual.png", found.residual_image())?;
    let residual = folder.file("residual.tif");
    found.write_residual(&residual).at(&residual)
}
