//! Photographs in files.

use std::{io::Cursor, path::Path};

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, RgbImage};

use crate::error::SegmentError;

/// Reads a PNG, JPEG or TIFF photograph as 8-bit sRGB: 16-bit samples are rounded, grey becomes three equal channels, palettes are looked up, transparency is laid over white, and the camera's EXIF
/// orientation is applied, so that up is up.
///
/// # Errors
///
/// [`SegmentError::Open`], [`SegmentError::EmptyFile`], or [`SegmentError::Decode`] for text, unknown formats and files cut short.
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
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let refuse = |reason: String| SegmentError::Decode {
        path: path.into(),
        reason,
    };
    let reader = ImageReader::new(Cursor::new(&bytes))
        .with_guessed_format()
        .map_err(|e| refuse(e.to_string()))?;
    if reader.format().is_none() {
        return Err(refuse("its first bytes are of no known picture format".into()));
    }
    if reader.format() == Some(ImageFormat::Jpeg) && !has_end(&bytes) {
        return Err(refuse("the file is cut short: the JPEG's end is missing".into()));
    }
    let mut decoder = reader.into_decoder().map_err(|e| refuse(e.to_string()))?;
    let orientation = decoder.orientation().map_err(|e| refuse(e.to_string()))?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(|e| refuse(e.to_string()))?;
    picture.apply_orientation(orientation);
    Ok(over_white(picture))
}

/// Whether a JPEG's last scan is followed by the end marker; decoders fill what is missing with grey.
fn has_end(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|w| w == [0xff, marker]);
    last(0xd9) > last(0xda)
}

/// All bytes of a file that has some.
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

/// 8-bit sRGB; what is transparent shows white.
fn over_white(picture: DynamicImage) -> RgbImage {
    if !picture.color().has_alpha() {
        return picture.into_rgb8();
    }
    let picture = picture.into_rgba8();
    RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
        let [r, g, b, a] = picture.get_pixel(x, y).0.map(u32::from);
        // Rounded; at most 255 because the weights sum to 255.
        image::Rgb([r, g, b].map(|c| ((c * a + 255 * (255 - a) + 127) / 255) as u8))
    })
}
