//! Photographs from files, and as arrays.

use std::{io::Cursor, path::Path};

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, RgbImage};
use ndarray::Array2;

use crate::error::SegmentError;
use crate::files::compression::Compression;
use stereology_metrics::Finding;

/// A photograph from a file, and findings on how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoFile {
    /// 8-bit sRGB, up is up.
    pub photo: RgbImage,
    /// How the file was compressed, if it is a JPEG.
    pub compression: Option<Compression>,
    /// `alpha-over-white`.
    pub findings: Vec<Finding>,
}

/// Reads a PNG, JPEG or TIFF photograph as 8-bit sRGB: 16-bit samples are rounded, grey becomes three equal channels,
/// palettes are looked up, transparency is composited over white, and the camera's EXIF orientation is applied, so that
/// up is up.
///
/// # Errors
///
/// [`SegmentError::Open`], [`SegmentError::EmptyFile`], or [`SegmentError::Decode`] for text, unknown formats and
/// truncated files.
///
/// # Examples
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("photo.png");
/// image::RgbImage::from_pixel(4, 3, image::Rgb([10, 20, 30])).save(&file)?;
/// assert_eq!(stereology_segment::read_photo(&file)?.dimensions(), (4, 3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_photo(path: impl AsRef<Path>) -> Result<RgbImage, SegmentError> {
    Ok(read_photo_up_to(path, u64::MAX)?.photo)
}

/// [`read_photo`] with findings; files of more than `most` pixels are refused before they are decoded.
///
/// # Errors
///
/// As [`read_photo`], and [`SegmentError::TooLarge`].
///
/// # Examples
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("photo.png");
/// image::RgbaImage::from_pixel(40, 30, image::Rgba([10, 20, 30, 128])).save(&file)?;
/// assert!(stereology_segment::read_photo_up_to(&file, 1000).is_err());
/// let read = stereology_segment::read_photo_up_to(&file, 1200)?;
/// assert_eq!(read.findings[0].code, "alpha-over-white");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_photo_up_to(path: impl AsRef<Path>, most: u64) -> Result<PhotoFile, SegmentError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let refuse = |reason: String| SegmentError::Decode {
        path: path.into(),
        reason,
    };
    let mut reader = ImageReader::new(Cursor::new(&bytes))
        .with_guessed_format()
        .map_err(|e| refuse(e.to_string()))?;
    if reader.format().is_none() {
        return Err(refuse("its first bytes are of no known image format".into()));
    }
    if reader.format() == Some(ImageFormat::Jpeg) && !has_end(&bytes) {
        return Err(refuse("the file is truncated: the JPEG's end is missing".into()));
    }
    // The number of pixels is limited by `most`, before anything is decoded.
    reader.no_limits();
    let mut decoder = reader.into_decoder().map_err(|e| refuse(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels > most.min(MOST_PIXELS) {
        return Err(too_large([width, height], most.min(MOST_PIXELS)));
    }
    let orientation = decoder.orientation().map_err(|e| refuse(e.to_string()))?;
    let mut image = DynamicImage::from_decoder(decoder).map_err(|e| refuse(e.to_string()))?;
    image.apply_orientation(orientation);
    let through = match &image {
        p if !p.color().has_alpha() => 0,
        p => p.to_rgba8().pixels().filter(|p| p[3] < 255).count(),
    };
    let finding = || {
        Finding::new(
            "alpha-over-white",
            format!(
                "{:.1} % of the photo's pixels are transparent and were composited over white; save it without transparency if they are not meant to be white",
                100.0 * through as f64 / pixels as f64
            ),
        )
    };
    Ok(PhotoFile {
        findings: (through > 0).then(finding).into_iter().collect(),
        photo: over_white(image),
        compression: Compression::of(&bytes),
    })
}

/// Values of every pixel / 255, axes (y, x).
///
/// # Examples
///
/// ```
/// let photo = image::RgbImage::from_pixel(2, 1, image::Rgb([0, 51, 255]));
/// assert_eq!(stereology_segment::encoded_image(&photo)[[0, 1]], [0.0, 0.2, 1.0]);
/// ```
#[must_use]
pub fn encoded_image(photo: &RgbImage) -> Array2<[f32; 3]> {
    let (width, height) = (photo.width() as usize, photo.height() as usize);
    let mut pixels = photo.pixels();
    Array2::from_shape_simple_fn((height, width), || {
        pixels.next().map_or([0.0; 3], |p| p.0.map(|v| f32::from(v) / 255.0))
    })
}

/// Pixels that labels and indices of 32 bits can number.
pub(crate) const MOST_PIXELS: u64 = 1 << 31;
/// Memory that reading and segmenting take, bytes per pixel.
const BYTES_PER_PIXEL: f64 = 100.0;

/// The refusal of a photo of more than `most` pixels.
pub(crate) fn too_large([width, height]: [u32; 2], most: u64) -> SegmentError {
    SegmentError::TooLarge {
        width,
        height,
        most,
        gigabytes: (f64::from(width) * f64::from(height) * BYTES_PER_PIXEL / 1e9).ceil(),
    }
}

/// Whether a JPEG's last scan is followed by the end marker; decoders fill missing pixels with grey.
fn has_end(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|w| w == [0xff, marker]);
    last(0xd9) > last(0xda)
}

/// All bytes of a file that is not empty.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, SegmentError> {
    let bytes = std::fs::read(path).map_err(|source| SegmentError::Open {
        path: path.into(),
        source,
    })?;
    if bytes.is_empty() {
        return Err(SegmentError::EmptyFile { path: path.into() });
    }
    Ok(bytes)
}

/// 8-bit sRGB over a white background.
fn over_white(image: DynamicImage) -> RgbImage {
    if !image.color().has_alpha() {
        return image.into_rgb8();
    }
    let image = image.into_rgba8();
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, a] = image.get_pixel(x, y).0.map(u32::from);
        // Rounded; at most 255 because the weights sum to 255.
        image::Rgb([r, g, b].map(|c| u8::try_from((c * a + 255 * (255 - a) + 127) / 255).unwrap_or(255)))
    })
}
