//! The built-in sample: a synthetic test image of a section through a known packing.

use image::{ImageError, ImageFormat, RgbImage};
use serde::Deserialize;

/// The test image that stands for a photograph, 912 × 672 pixels: slate and brick chips and larger ochre pebbles of two
/// shapes in a pale binder, with texture, uneven light, blur and noise.
///
/// # Errors
///
/// None in practice: the image is part of the program.
///
/// # Examples
///
/// ```
/// assert_eq!(stereology::sample::photo()?.dimensions(), (912, 672));
/// # Ok::<(), image::ImageError>(())
/// ```
pub fn photo() -> Result<RgbImage, ImageError> {
    Ok(image::load_from_memory_with_format(PHOTO, ImageFormat::Png)?.into_rgb8())
}

/// The solid that [`photo`] is a section of. Lengths in pixels.
///
/// # Errors
///
/// None in practice: the file is part of the program.
///
/// # Examples
///
/// ```
/// let truth = stereology::sample::truth()?;
/// assert!((truth.shapes.iter().map(|of| of.share).sum::<f64>() - 1.0).abs() < 1e-12);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn truth() -> Result<Truth, serde_json::Error> {
    serde_json::from_slice(TRUTH)
}

const PHOTO: &[u8] = include_bytes!("../assets/sample.png");
const TRUTH: &[u8] = include_bytes!("../assets/sample.json");

/// The solid behind the sample.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct Truth {
    /// Shapes of the particles and their fractions by number.
    pub shapes: Vec<ShapeShare>,
    /// Particles per unit volume.
    pub total_number_density: f64,
    /// Their mean size.
    pub mean_size: f64,
    /// Volume fraction of the particles.
    pub volume_fraction: f64,
    /// Area fraction of the profiles.
    pub area_fraction: f64,
    /// Edges of size bins.
    pub edges: Vec<f64>,
    /// Particles per unit volume in each.
    pub number_density: Vec<f64>,
    /// Colour categories.
    pub categories: Vec<TrueCategory>,
    /// Mean colour of the binder, sRGB-encoded / 255.
    pub binder: [f64; 3],
    /// Sizes of the profiles of one period.
    pub profile_sizes: Vec<f64>,
}

/// A shape and its fraction of the particles.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct ShapeShare {
    /// Specification of the shape.
    pub shape: String,
    /// Its fraction by number.
    pub share: f64,
}

/// A colour category of the sample.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct TrueCategory {
    /// Name of the colour.
    pub name: String,
    /// Its mean colour, sRGB-encoded / 255.
    pub colour: [f64; 3],
    /// Particles per unit volume in each size bin.
    pub number_density: Vec<f64>,
}
