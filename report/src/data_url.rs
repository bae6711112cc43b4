//! Images inside a page, as data URLs.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops;
use image::{ExtendedColorType, ImageEncoder, RgbImage};

/// Largest width of an image; larger ones are reduced.
const WIDEST: u32 = 1000;

/// A photograph as a data URL.
pub(crate) fn photograph(picture: &RgbImage) -> String {
    let reduced = reduce(picture);
    let mut bytes = Vec::new();
    let done = JpegEncoder::new_with_quality(&mut bytes, 90).write_image(
        reduced.as_raw(),
        reduced.width(),
        reduced.height(),
        ExtendedColorType::Rgb8,
    );
    if done.is_err() {
        return drawing(picture); // too large for JPEG
    }
    format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes))
}

/// An image with thin lines as a data URL, without loss.
pub(crate) fn drawing(picture: &RgbImage) -> String {
    let reduced = reduce(picture);
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
    match encoder.write_image(
        reduced.as_raw(),
        reduced.width(),
        reduced.height(),
        ExtendedColorType::Rgb8,
    ) {
        Ok(()) => format!("data:image/png;base64,{}", STANDARD.encode(bytes)),
        Err(_) => String::new(), // writing into memory fails only for an empty image
    }
}

fn reduce(picture: &RgbImage) -> RgbImage {
    let (width, height) = picture.dimensions();
    if width <= WIDEST {
        return picture.clone();
    }
    let reduced_height = (u64::from(height) * u64::from(WIDEST) + u64::from(width) / 2) / u64::from(width);
    let reduced_height = u32::try_from(reduced_height.max(1)).unwrap_or(height);
    imageops::resize(picture, WIDEST, reduced_height, imageops::FilterType::CatmullRom)
}
