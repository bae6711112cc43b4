//! TIFF, one page a z, laid out as ImageJ lays out a stack: the samples of all pages in one piece, then the directories.
//!
//! ImageJ ignores the directories behind the first of a file that calls itself its stack, and other readers follow it; so the samples must not be interrupted.

use crate::element::Element;
use crate::{GridError, VolumeShape};
use std::io::{self, Seek, Write};
use std::path::Path;
use tiff::encoder::{DirectoryEncoder, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::{PhotometricInterpretation, ResolutionUnit, Tag};
use tiff::{TiffError, TiffResult};

/// Writes the slabs that `next(z, write)` hands to `write`, z by z.
pub(crate) fn write<T: Element, W: Write + Seek>(
    out: W,
    path: &Path,
    shape: &VolumeShape,
    spacing: [f64; 3],
    bytes: u64,
    next: impl FnMut(usize, &mut dyn FnMut(&[T]) -> io::Result<()>) -> Result<(), GridError>,
) -> Result<(), GridError> {
    // A page's directory takes some 300 bytes; the offsets of a standard TIFF have 32 bits.
    if bytes + 1024 * shape.nz as u64 <= u64::from(u32::MAX) {
        let tiff = TiffEncoder::<W, TiffKindStandard>::new_generic(out);
        stack(tiff, path, shape, spacing, bytes, next)
    } else {
        let tiff = TiffEncoder::<W, TiffKindBig>::new_generic(out);
        stack(tiff, path, shape, spacing, bytes, next)
    }
}

fn stack<T: Element, W: Write + Seek, K: TiffKind>(
    tiff: TiffResult<TiffEncoder<W, K>>,
    path: &Path,
    shape: &VolumeShape,
    spacing: [f64; 3],
    bytes: u64,
    mut next: impl FnMut(usize, &mut dyn FnMut(&[T]) -> io::Result<()>) -> Result<(), GridError>,
) -> Result<(), GridError> {
    let failed = |error| GridError::io(path)(unwrapped(error));
    let mut tiff = tiff.map_err(failed)?;
    let mut first = tiff.image_directory().map_err(failed)?;
    let mut offsets = Vec::with_capacity(shape.nz);
    for z in 0..shape.nz {
        next(z, &mut |samples| {
            offsets.push(T::write_page(&mut first, samples).map_err(unwrapped)?);
            Ok(())
        })?;
    }
    if bytes % 2 == 1 {
        first.write_data(0_u8).map_err(failed)?; // what follows begins at even places
    }
    describe::<T, W, K>(&mut first, shape, spacing, offsets[0]).map_err(failed)?;
    let mut description = format!(
        "ImageJ=1.54f\nimages={nz}\nslices={nz}\nspacing={}\nloop=false\n",
        spacing[2],
        nz = shape.nz
    );
    if description.len() % 2 == 0 {
        description.push('\n');
    }
    first
        .write_tag(Tag::ImageDescription, description.as_str())
        .and_then(|()| first.finish())
        .map_err(failed)?;
    for &offset in &offsets[1..] {
        let mut page = tiff.image_directory().map_err(failed)?;
        describe::<T, W, K>(&mut page, shape, spacing, offset)
            .and_then(|()| page.finish())
            .map_err(failed)?;
    }
    Ok(())
}

/// The tags of a page.
fn describe<T: Element, W: Write + Seek, K: TiffKind>(
    page: &mut DirectoryEncoder<'_, W, K>,
    shape: &VolumeShape,
    spacing: [f64; 3],
    offset: u64,
) -> TiffResult<()> {
    let VolumeShape { ny, nx, channels, .. } = *shape;
    let (width, height) = (u32::try_from(nx)?, u32::try_from(ny)?);
    let samples = [(); 3].map(|()| T::TIFF_SAMPLE.to_u16());
    let bits = [u16::try_from(8 * size_of::<T>())?; 3];
    let colours = if channels == 1 {
        PhotometricInterpretation::BlackIsZero
    } else {
        PhotometricInterpretation::RGB
    };
    page.write_tag(Tag::ImageWidth, width)?;
    page.write_tag(Tag::ImageLength, height)?;
    page.write_tag(Tag::BitsPerSample, &bits[..channels])?;
    page.write_tag(Tag::Compression, 1_u16)?;
    page.write_tag(Tag::PhotometricInterpretation, colours.to_u16())?;
    page.write_tag(Tag::StripOffsets, K::convert_offset(offset)?)?;
    page.write_tag(Tag::SamplesPerPixel, u16::try_from(channels)?)?;
    page.write_tag(Tag::RowsPerStrip, height)?;
    page.write_tag(
        Tag::StripByteCounts,
        K::convert_offset((nx * ny * channels * size_of::<T>()) as u64)?,
    )?;
    page.write_tag(Tag::XResolution, per_unit(spacing[0]))?;
    page.write_tag(Tag::YResolution, per_unit(spacing[1]))?;
    page.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
    page.write_tag(Tag::SampleFormat, &samples[..channels])?;
    Ok(())
}

/// Pixels per unit of length, to one part in a million where 32-bit fractions allow.
#[expect(clippy::cast_possible_truncation, reason = "clamped to the range of u32 before")]
fn per_unit(spacing: f64) -> Rational {
    let largest = f64::from(u32::MAX);
    if spacing >= 1.0 {
        let n = (largest / spacing).floor().clamp(1.0, 1e6);
        Rational {
            n: n as u32,
            d: (n * spacing).round().clamp(1.0, largest) as u32,
        }
    } else {
        let d = (largest * spacing).floor().clamp(1.0, 1e6);
        Rational {
            n: (d / spacing).round().clamp(1.0, largest) as u32,
            d: d as u32,
        }
    }
}

fn unwrapped(error: TiffError) -> io::Error {
    match error {
        TiffError::IoError(error) => error,
        other => io::Error::other(other),
    }
}
