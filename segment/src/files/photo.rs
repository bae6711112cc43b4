//! Photographs from files, and as arrays.

use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, RgbImage};
use ndarray::Array2;

use crate::error::SegmentError;
use crate::files::compression::Compression;
use crate::files::picture::{Picture, Refusal, decode};
use stereology_metrics::Finding;

/// A photograph from a file, and findings on how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoFile {
    /// 8-bit sRGB, up is up.
    pub photo: RgbImage,
    /// The file's name.
    pub name: Option<String>,
    /// How the file was compressed, if it is a JPEG.
    pub compression: Option<Compression>,
    /// How the stored pixels were turned so that up is up, if programs that do not turn them may have made labels for
    /// them.
    pub turned: Option<Orientation>,
    /// `alpha-over-white`, `range-guessed`, `colour-profile`, `first-page`, `main-page`.
    pub findings: Vec<Finding>,
}

/// Whether the orientation that a camera noted in the file is applied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exif {
    /// The photo is turned upright; labels may belong to the pixels as stored.
    #[default]
    Auto,
    /// The photo is turned upright, and labels belong to it.
    Apply,
    /// The pixels are taken as stored, and labels belong to them.
    Ignore,
}

/// How a photograph is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotoOptions {
    /// Files of more pixels are refused before they are decoded.
    pub most_pixels: u64,
    /// Memory that the caller's work will take, bytes per pixel: for the message of a refusal.
    pub bytes_per_pixel: u64,
    /// Whether the orientation in the file is applied.
    pub exif: Exif,
}

impl Default for PhotoOptions {
    fn default() -> Self {
        Self {
            most_pixels: u64::MAX,
            bytes_per_pixel: SEGMENTING,
            exif: Exif::default(),
        }
    }
}

/// Reads a photograph as 8-bit sRGB: PNG, JPEG, TIFF, WebP, BMP or GIF, recognised by the contents.
///
/// Samples of 16 bits are rounded; where they use at most a quarter of their range, and for floating point and signed
/// samples, white is guessed. Grey becomes three equal channels, palettes are looked up, an embedded ICC profile is
/// applied, transparency is composited over white, and the camera's EXIF orientation is applied, so that up is up. Of
/// several pages or frames, the main or first one is read. [`read_photo_with`] reports what was guessed.
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
    Ok(read_photo_with(path, &PhotoOptions::default())?.photo)
}

/// [`read_photo`] with findings and options.
///
/// # Errors
///
/// As [`read_photo`], and [`SegmentError::TooLarge`].
///
/// # Examples
///
/// ```
/// use stereology_segment::{PhotoOptions, read_photo_with};
///
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("photo.png");
/// image::RgbaImage::from_pixel(40, 30, image::Rgba([10, 20, 30, 128])).save(&file)?;
/// let of_at_most = |most_pixels| PhotoOptions { most_pixels, ..PhotoOptions::default() };
/// assert!(read_photo_with(&file, &of_at_most(1000)).is_err());
/// let read = read_photo_with(&file, &of_at_most(1200))?;
/// assert_eq!(read.findings[0].code, "alpha-over-white");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_photo_with(path: impl AsRef<Path>, options: &PhotoOptions) -> Result<PhotoFile, SegmentError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let picture = decoded(path, &bytes, options)?;
    let turned = match options.exif {
        Exif::Auto => Some(picture.orientation).filter(|o| *o != Orientation::NoTransforms),
        Exif::Apply | Exif::Ignore => None,
    };
    Ok(PhotoFile {
        findings: picture.findings.clone(),
        compression: Compression::of(&bytes),
        name: path.file_name().map(|name| name.to_string_lossy().into_owned()),
        turned,
        photo: upright(picture, options).into_rgb8(),
    })
}

/// A picture's grey values from 0 to 1, and findings on how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct GreyFile {
    /// Grey values, axes (y, x): of colours 0.299 R + 0.587 G + 0.114 B of the encoded values.
    pub grey: Array2<f64>,
    /// As those of [`PhotoFile`].
    pub findings: Vec<Finding>,
}

/// Reads the grey values of a picture with all its bits, otherwise as [`read_photo_with`] does.
///
/// # Errors
///
/// As [`read_photo_with`].
///
/// # Examples
///
/// ```
/// use stereology_segment::{PhotoOptions, read_grey};
///
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("grey.png");
/// image::ImageBuffer::from_pixel(4, 3, image::Luma([32_000_u16])).save(&file)?;
/// assert_eq!(read_grey(&file, &PhotoOptions::default())?.grey[[0, 0]], 32_000.0 / 65_535.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_grey(path: impl AsRef<Path>, options: &PhotoOptions) -> Result<GreyFile, SegmentError> {
    let path = path.as_ref();
    let picture = decoded(path, &read_bytes(path)?, options)?;
    let findings = picture.findings.clone();
    let image = upright(picture, options);
    let shape = (image.height() as usize, image.width() as usize);
    let grey = |[r, g, b]: [f64; 3]| {
        let is_grey = r.to_bits() == g.to_bits() && g.to_bits() == b.to_bits();
        if is_grey { r } else { 0.299 * r + 0.587 * g + 0.114 * b }
    };
    let values: Vec<f64> = match image {
        DynamicImage::ImageLuma8(image) => image.pixels().map(|p| f64::from(p[0]) / 255.0).collect(),
        DynamicImage::ImageRgb8(image) => image.pixels().map(|p| grey(p.0.map(f64::from)) / 255.0).collect(),
        other => {
            let image = other.into_rgb16();
            image.pixels().map(|p| grey(p.0.map(f64::from)) / 65_535.0).collect()
        }
    };
    let grey = Array2::from_shape_vec(shape, values).map_err(|e| SegmentError::Decode {
        path: path.into(),
        reason: e.to_string(),
    })?;
    Ok(GreyFile { grey, findings })
}

fn decoded(path: &Path, bytes: &[u8], options: &PhotoOptions) -> Result<Picture, SegmentError> {
    let most = options.most_pixels.min(MOST_PIXELS);
    decode(bytes, most).map_err(|refusal| match refusal {
        Refusal::TooLarge(size) => too_large(size, most, options.bytes_per_pixel),
        Refusal::Unreadable(reason) => SegmentError::Decode {
            path: path.into(),
            reason,
        },
    })
}

fn upright(picture: Picture, options: &PhotoOptions) -> DynamicImage {
    let mut image = picture.image;
    if options.exif != Exif::Ignore {
        image.apply_orientation(picture.orientation);
    }
    image
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
pub(crate) const SEGMENTING: u64 = 100;

/// The refusal of a photo of more than `most` pixels, of which each takes so many bytes of memory.
pub(crate) fn too_large([width, height]: [u32; 2], most: u64, bytes_per_pixel: u64) -> SegmentError {
    SegmentError::TooLarge {
        width,
        height,
        most,
        gigabytes: (f64::from(width) * f64::from(height) * bytes_per_pixel as f64 / 1e9).ceil(),
    }
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
