//! TIFF, one page a z, with the spacing where ImageJ looks for it.

use crate::element::Element;
use crate::{GridError, VolumeShape};
use std::io::{self, Seek, Write};
use tiff::encoder::colortype::ColorType;
use tiff::encoder::{Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use tiff::tags::{ResolutionUnit, Tag};
use tiff::{TiffError, TiffResult};

/// What a page says of itself beside its samples.
pub struct Page {
    width: u32,
    height: u32,
    pub(crate) channels: usize,
    resolution: [Rational; 2],
    description: Option<String>,
}

/// Writes the slabs of `next`, z by z.
pub(crate) fn write<T: Element, W: Write + Seek>(
    out: W,
    shape: &VolumeShape,
    spacing: [f64; 3],
    bytes: u64,
    next: impl FnMut(usize, &mut dyn FnMut(&[T]) -> io::Result<()>) -> Result<(), GridError>,
    io_error: impl Fn(io::Error) -> GridError,
) -> Result<(), GridError> {
    // A page's directory takes some 300 bytes; the offsets of a standard TIFF have 32 bits.
    if bytes + 1024 * shape.nz as u64 <= u64::from(u32::MAX) {
        let tiff = TiffEncoder::<W, TiffKindStandard>::new_generic(out);
        pages(tiff.map_err(|e| io_error(unwrapped(e)))?, shape, spacing, next)
    } else {
        let tiff = TiffEncoder::<W, TiffKindBig>::new_generic(out);
        pages(tiff.map_err(|e| io_error(unwrapped(e)))?, shape, spacing, next)
    }
}

fn pages<T: Element, W: Write + Seek, K: TiffKind>(
    mut tiff: TiffEncoder<W, K>,
    shape: &VolumeShape,
    spacing: [f64; 3],
    mut next: impl FnMut(usize, &mut dyn FnMut(&[T]) -> io::Result<()>) -> Result<(), GridError>,
) -> Result<(), GridError> {
    let VolumeShape { nz, ny, nx, channels } = *shape;
    let pixels = |n: usize| u32::try_from(n).unwrap_or(u32::MAX); // wider pages than 2^32 are refused by the encoder
    let mut page = Page {
        width: pixels(nx),
        height: pixels(ny),
        channels,
        resolution: [per_unit(spacing[0]), per_unit(spacing[1])],
        description: Some(format!(
            "ImageJ=1.54f\nimages={nz}\nslices={nz}\nspacing={}\nloop=false\n",
            spacing[2]
        )),
    };
    for z in 0..nz {
        next(z, &mut |samples| {
            T::write_page(&mut tiff, &page, samples).map_err(unwrapped)
        })?;
        page.description = None;
    }
    Ok(())
}

pub(crate) fn write_page<C: ColorType, W: Write + Seek, K: TiffKind>(
    tiff: &mut TiffEncoder<W, K>,
    page: &Page,
    samples: &[C::Inner],
) -> TiffResult<()>
where
    [C::Inner]: TiffValue,
{
    let mut image = tiff.new_image::<C>(page.width, page.height)?;
    image.rows_per_strip(page.height)?;
    image.resolution_unit(ResolutionUnit::None);
    let [x, y] = &page.resolution;
    image.x_resolution(x.clone());
    image.y_resolution(y.clone());
    if let Some(description) = &page.description {
        image.encoder().write_tag(Tag::ImageDescription, description.as_str())?;
    }
    image.write_data(samples)
}

/// Pixels per unit of length, to one part in a million where 32-bit fractions allow.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the range of u32 before"
)]
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
