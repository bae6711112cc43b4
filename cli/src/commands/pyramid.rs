//! `stereology pyramid`: the sub-bands of an image.

use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::pyramid::SteerablePyramid;
use stereology::segment::read_grey;

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::pictures::{ImageLimit, warn};
use crate::values::count;

/// Decomposes an image into the sub-bands of a steerable pyramid and reports their statistics
///
/// Works on the stored grey values / 255 (colour: 0.299 R + 0.587 G + 0.114 B) and treats the image as periodic.
/// Reports for each sub-band its level (0 is the finest), orientation (null for the high-pass and low-pass residuals),
/// shape, mean square, minimum and maximum, and the largest error when the image is reconstructed from the sub-bands.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology pyramid granite.png --levels 4 --orientations 4 --json")]
pub struct Pyramid {
    /// Image (PNG, JPEG, TIFF, WebP, BMP, GIF)
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Number of pyramid levels [default: depends on the size of the image]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Number of orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
    #[command(flatten)]
    pub limit: ImageLimit,
}

/// JSON of `stereology pyramid`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PyramidFields {
    /// Width of the image in pixels.
    width: usize,
    /// Height of the image in pixels.
    height: usize,
    /// Number of levels.
    levels: usize,
    /// Number of orientations.
    orientations: usize,
    /// Statistics of each sub-band, the finest first.
    bands: Vec<Band>,
    /// Largest absolute error of the image reconstructed from the sub-bands.
    reconstruction_error: f64,
}

/// Statistics of one sub-band.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Band {
    /// Level; 0 is the finest.
    level: usize,
    /// Index of the orientation; null for the high-pass and the low-pass residual.
    orientation: Option<usize>,
    /// Rows and columns.
    shape: [usize; 2],
    /// Mean square of the coefficients.
    mean_square: f64,
    /// Least coefficient.
    min: f64,
    /// Greatest coefficient.
    max: f64,
}

impl Fields for PyramidFields {
    const COMMAND: &'static str = "pyramid";
}

impl Pyramid {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        // The image, its transform, and bands of doubles: at full size one per orientation and two residuals, and a
        // third more for all coarser levels.
        let bytes_per_pixel = 80 + 16 * self.orientations as u64;
        let mut notes = Notes::default();
        let read = read_grey(&self.image, &self.limit.options(bytes_per_pixel)).at(&self.image)?;
        warn(&mut notes, read.findings, &self.image);
        let picture = read.grey;
        let (height, width) = picture.dim();
        let levels = self
            .levels
            .unwrap_or_else(|| SteerablePyramid::<f64>::most_levels([height, width]).clamp(1, 4));
        let pyramid = SteerablePyramid::<f64>::new([height, width], levels, self.orientations).at(&self.image)?;
        let bands = pyramid.build(picture.view()).at(&self.image)?;
        let rebuilt = pyramid.reconstruct(&bands);
        let error = picture
            .iter()
            .zip(&rebuilt)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);

        notes.line(format!(
            "{width} x {height} pixels, {levels} levels, {} orientations",
            self.orientations
        ));
        notes.line("level  orientation       shape   mean square       min       max");
        let mut rows = Vec::new();
        for band in bands.summaries() {
            notes.line(format!(
                "{:5}  {:>11}  {:>10}  {:12.4e}  {:8.4}  {:8.4}",
                band.level,
                band.orientation.map_or("residual".to_owned(), |b| b.to_string()),
                format!("{} x {}", band.shape[1], band.shape[0]),
                band.mean_square,
                band.min,
                band.max
            ));
            rows.push(Band {
                level: band.level,
                orientation: band.orientation,
                shape: band.shape,
                mean_square: band.mean_square,
                min: band.min,
                max: band.max,
            });
        }
        notes.line(format!("largest reconstruction error {error:.1e}"));
        let fields = PyramidFields {
            width,
            height,
            levels,
            orientations: self.orientations,
            bands: rows,
            reconstruction_error: error,
        };
        Answer::new(&fields, notes)
    }
}
