//! `stereology pyramid`: the bands of a picture.

use std::path::{Path, PathBuf};

use clap::Args;
use ndarray::Array2;
use serde_json::json;
use stereology::pyramid::SteerablePyramid;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::values::count;

/// Takes a picture apart into the bands of a steerable pyramid and tells their statistics
///
/// Works on the stored grey values / 255 (colour: 0.299 R + 0.587 G + 0.114 B), as one period of a picture that repeats. For each band: level (0 is the
/// finest), orientation (null for the two residual bands), shape, mean square, minimum and maximum; and how exactly the bands rebuild the picture.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology pyramid granite.png --levels 4 --orientations 4 --json")]
pub struct Pyramid {
    /// Picture
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Levels of the pyramid [default: by size]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
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

        let mut answer = Answer::new("pyramid");
        answer.line(format!(
            "{width} x {height} pixels, {levels} levels, {} orientations",
            self.orientations
        ));
        answer.line("level  orientation       shape   mean square       min       max");
        let mut rows = Vec::new();
        for band in bands.summaries() {
            answer.line(format!(
                "{:5}  {:>11}  {:>10}  {:12.4e}  {:8.4}  {:8.4}",
                band.level,
                band.orientation.map_or("residual".to_owned(), |b| b.to_string()),
                format!("{} x {}", band.shape[1], band.shape[0]),
                band.mean_square,
                band.min,
                band.max
            ));
            rows.push(json!({
                "level": band.level, "orientation": band.orientation, "shape": band.shape,
                "mean_square": band.mean_square, "min": band.min, "max": band.max,
            }));
        }
        answer.line(format!("rebuilt to within {error:.1e}"));
        answer
            .field("width", width)
            .field("height", height)
            .field("levels", levels)
            .field("orientations", self.orientations)
            .field("bands", rows)
            .field("reconstruction_error", error);
        Ok(answer)
    }
}

/// Stored grey values / 255 (rows, columns); of colours 0.299 R + 0.587 G + 0.114 B.
fn grey(path: &Path) -> Result<Array2<f64>, Failure> {
    let picture = image::ImageReader::open(path)
        .and_then(image::ImageReader::with_guessed_format)
        .at(path)?
        .decode()
        .map_err(|error| format!("is no picture that can be read ({error}); PNG, JPEG and TIFF can"))
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
