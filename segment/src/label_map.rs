//! Label maps in files: one number a profile, 0 for the binder.

use std::{
    io::{Cursor, Seek, Write},
    path::Path,
};

use image::DynamicImage;
use ndarray::{Array2, ArrayView2};
use stereology_grid::write_atomically;
use tiff::{
    decoder::{Decoder, DecodingResult, Limits},
    encoder::{TiffEncoder, colortype},
};

use crate::{error::SegmentError, photo::read_bytes};

/// Bytes of the samples of a label map: 20,000 x 20,000 of 32 bits.
const LARGEST_MAP: usize = 1_600_000_000;

/// Reads a label map, axes (y, x): TIFF of u8, u16, u32 or i32, or PNG of u8 or u16, as ImageGrains, StarDist, Cellpose and ImageJ write them. 0 is the binder.
///
/// # Errors
///
/// The file cannot be opened or decoded, or does not hold one channel of whole numbers of at least 0.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_segment::{read_labels, write_labels};
///
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("labels.tif");
/// let labels = array![[0, 1, 1], [0, 0, 70_000_u32]];
/// write_labels(&file, labels.view())?;
/// assert_eq!(read_labels(&file)?, labels);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_labels(path: impl AsRef<Path>) -> Result<Array2<u32>, SegmentError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    if bytes.starts_with(b"II*\0")
        || bytes.starts_with(b"MM\0*")
        || bytes.starts_with(b"II+\0")
        || bytes.starts_with(b"MM\0+")
    {
        return read_tiff(path, &bytes);
    }
    let refuse = |reason: String| SegmentError::Decode {
        path: path.into(),
        reason,
    };
    let picture = image::load_from_memory(&bytes).map_err(|e| refuse(e.to_string()))?;
    let shape = (picture.height() as usize, picture.width() as usize);
    let samples: Vec<u32> = match picture {
        DynamicImage::ImageLuma8(p) => p.into_raw().into_iter().map(u32::from).collect(),
        DynamicImage::ImageLuma16(p) => p.into_raw().into_iter().map(u32::from).collect(),
        other => return Err(format_error(path, format!("the pixels are {:?}", other.color()))),
    };
    shaped(path, shape, samples)
}

fn format_error(path: &Path, reason: String) -> SegmentError {
    SegmentError::LabelFormat {
        path: path.into(),
        reason,
    }
}

fn shaped(path: &Path, shape: (usize, usize), samples: Vec<u32>) -> Result<Array2<u32>, SegmentError> {
    let (found, wanted) = (samples.len(), shape.0 * shape.1);
    Array2::from_shape_vec(shape, samples).map_err(|_| {
        format_error(
            path,
            format!("{found} samples for {wanted} pixels: more than one channel"),
        )
    })
}

fn read_tiff(path: &Path, bytes: &[u8]) -> Result<Array2<u32>, SegmentError> {
    let refuse = |e: tiff::TiffError| SegmentError::Decode {
        path: path.into(),
        reason: e.to_string(),
    };
    // A header may claim any size; no map of ours is larger than this.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = LARGEST_MAP;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(refuse)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(refuse)?;
    let samples: Vec<u32> = match decoder.read_image().map_err(refuse)? {
        DecodingResult::U8(v) => v.into_iter().map(u32::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(u32::from).collect(),
        DecodingResult::U32(v) => v,
        DecodingResult::I32(v) => v
            .into_iter()
            .map(|l| u32::try_from(l).map_err(|_| format_error(path, format!("the label {l} is negative"))))
            .collect::<Result<_, _>>()?,
        DecodingResult::I16(v) => v
            .into_iter()
            .map(|l| u32::try_from(l).map_err(|_| format_error(path, format!("the label {l} is negative"))))
            .collect::<Result<_, _>>()?,
        _ => {
            return Err(format_error(
                path,
                "the samples are not 8-, 16- or 32-bit whole numbers".into(),
            ));
        }
    };
    shaped(path, (height as usize, width as usize), samples)
}

/// Writes a label map as a TIFF of one page, u16 where the largest label fits and u32 otherwise; the file appears whole or not at all.
///
/// # Errors
///
/// The file cannot be written.
///
/// # Examples
///
/// See [`read_labels`].
pub fn write_labels(path: impl AsRef<Path>, labels: ArrayView2<'_, u32>) -> Result<(), SegmentError> {
    let largest = labels.iter().copied().max().unwrap_or(0);
    let (width, height) = dimensions(labels.dim());
    let small: Option<Vec<u16>> = if largest <= u32::from(u16::MAX) {
        labels.iter().map(|&l| u16::try_from(l).ok()).collect()
    } else {
        None
    };
    let write = |out: &mut dyn WriteSeek| -> tiff::TiffResult<()> {
        let mut encoder = TiffEncoder::new(out)?;
        match &small {
            Some(samples) => encoder.write_image::<colortype::Gray16>(width, height, samples),
            None => {
                let samples: Vec<u32> = labels.iter().copied().collect();
                encoder.write_image::<colortype::Gray32>(width, height, &samples)
            }
        }
    };
    Ok(write_atomically(path, |out| write(out).map_err(std::io::Error::other))?)
}

/// What a TIFF encoder writes to.
pub(crate) trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Width and height of an array (y, x); a picture in memory has fewer than 2³² rows and columns.
pub(crate) fn dimensions((height, width): (usize, usize)) -> (u32, u32) {
    (
        u32::try_from(width).unwrap_or(u32::MAX),
        u32::try_from(height).unwrap_or(u32::MAX),
    )
}
