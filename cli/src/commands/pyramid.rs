//! `stereology pyramid`: the sub-bands of an image.

use std::path::{Path, PathBuf};

use clap::Args;
use ndarray::Array2;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::pyramid::SteerablePyramid;

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::values::count;

/// Decomposes an image into the sub-bands of a steerable pyramid and reports their statistics
///
/// Works on the stored grey values / 255 (colour: 0.299 R + 0.587 G + 0.114 B) and treats the image as periodic.
/// Reports for each sub-band its level (0 is the finest), orientation (null for the high-pass and low-pass residuals),
/// shape, mean square, minimum and maximum, and the largest error when the image is reconstructed from the sub-bands.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology pyramid granite.png --levels 4 --orientations 4 --json")]
pub struct Pyramid {
    /// Image (PNG, JPEG, TIFF)
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Number of pyramid levels [default: depends on the size of the image]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Number of orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
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
        let picture = grey(&self.image)?;
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

        let mut notes = Notes::default();
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

/// Stored grey values / 255 (rows, columns); for colours 0.299 R + 0.587 G + 0.114 B.
fn grey(path: &Path) -> Result<Array2<f64>, Failure> {
    let picture = image::ImageReader::open(path)
        .and_then(image::ImageReader::with_guessed_format)
        .at(path)?
        .decode()
        .map_err(|error| format!("cannot be read as an image ({error}); use PNG, JPEG or TIFF"))
        .at(path)?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let values: Vec<f64> = if picture.color().has_color() {
        let weighed = |rgb: [f64; 3]| 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
        match picture.color().bytes_per_pixel() / picture.color().channel_count() {
            1 => picture
                .to_rgb8()
                .pixels()
                .map(|p| weighed(p.0.map(f64::from)) / 255.0)
                .collect(),
            _ => picture
                .to_rgb16()
                .pixels()
                .map(|p| weighed(p.0.map(f64::from)) / 65535.0)
                .collect(),
        }
    } else {
        match picture.color().bytes_per_pixel() / picture.color().channel_count() {
            1 => picture.to_luma8().pixels().map(|p| f64::from(p.0[0]) / 255.0).collect(),
            _ => picture
                .to_luma16()
                .pixels()
                .map(|p| f64::from(p.0[0]) / 65535.0)
                .collect(),
        }
    };
    Array2::from_shape_vec((height, width), values).at(path)
}
