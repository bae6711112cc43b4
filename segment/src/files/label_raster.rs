//! Label maps as arrays of numbers or colours: TIFF, PNG and other images, NumPy.

use std::{
    io::{Cursor, Seek, Write},
    path::Path,
};

use image::metadata::Orientation;
use image::{ImageFormat, ImageReader, Limits};
use ndarray::{Array2, ArrayView2};
use tiff::encoder::{TiffEncoder, colortype};

use stereology_metrics::Finding;

use crate::conversions::index;
use crate::files::colour_labels::{ADVICE, colour_labels, number_labels, shaped};
use crate::files::decoding::{check_png, guarded};
use crate::files::tiff::{Photometric, Samples, float, main_page};

/// Pixels of a label map: 20,000 x 20,000.
const MOST_PIXELS: u64 = 400_000_000;

/// A label map as an image or array.
pub(crate) struct LabelRaster {
    pub(crate) labels: Array2<u32>,
    pub(crate) findings: Vec<Finding>,
    /// How the file says that it is turned to be upright; not applied.
    pub(crate) orientation: Orientation,
}

impl LabelRaster {
    pub(crate) fn of((labels, findings): (Array2<u32>, Vec<Finding>)) -> Self {
        Self {
            labels,
            findings,
            orientation: Orientation::NoTransforms,
        }
    }
}

/// Refuses a map that is neither of the photo's size, (height, width), nor of it turned by a quarter; and one that is
/// too large, where the photo's size is not known.
fn check_size([width, height]: [u64; 2], size: Option<(usize, usize)>) -> Result<(), String> {
    match size {
        Some((rows, columns)) => {
            let [rows, columns] = [rows as u64, columns as u64];
            if [width, height] != [columns, rows] && [width, height] != [rows, columns] {
                return Err(format!(
                    "the label map is {width}x{height} pixels, the photo {columns}x{rows}; export the labels at the photo's size, not rotated or cropped"
                ));
            }
        }
        None if width.saturating_mul(height) > MOST_PIXELS => {
            return Err(format!(
                "the label map is {width}x{height} pixels; at most {MOST_PIXELS} pixels are read"
            ));
        }
        None => {}
    }
    Ok(())
}

/// Labels of a TIFF as stored: numbers of any kind, never inverted for display, places of a palette; or colours.
pub(crate) fn parse_tiff(bytes: &[u8], size: Option<(usize, usize)>) -> Result<LabelRaster, String> {
    let (page, mut findings) = main_page(bytes, size)?;
    check_size([page.width as u64, page.height as u64], size)?;
    let samples = guarded(|| page.read())?;
    let shape = (page.height, page.width);
    let opacity = page.extra.first().is_some_and(|kind| matches!(kind, 1 | 2));
    let (labels, more) = match (page.colours(), page.samples, samples) {
        (1, 1, Samples::Bytes(v)) => (shaped(shape, v.into_iter().map(u32::from).collect())?, Vec::new()),
        (1, 1, Samples::Shorts(v)) => (shaped(shape, v.into_iter().map(u32::from).collect())?, Vec::new()),
        (1, 1, Samples::Whole(v)) => number_labels(shape, v.into_iter().map(|v| v as f64))?,
        (1, 1, Samples::Real(v)) => number_labels(shape, v.into_iter())?,
        (1, 2, samples) if opacity => number_labels(shape, seen(samples))?,
        (1, n, _) => {
            return Err(format!(
                "the TIFF has {n} channels or planes, of which one may hold the labels; save that one alone"
            ));
        }
        (3, n, samples) if matches!(page.photometric, Photometric::Rgb) => {
            let stored = wide(samples).ok_or_else(|| format!("the colours are no whole numbers; {ADVICE}"))?;
            let colours = stored
                .chunks_exact(n)
                .map(|p| [p[0], p[1], p[2], if n > 3 && opacity { p[3] } else { u16::MAX }]);
            colour_labels(shape, &colours.collect::<Vec<_>>())?
        }
        _ => return Err(format!("the pixels are {:?}; {ADVICE}", page.photometric)),
    };
    findings.extend(more);
    Ok(LabelRaster {
        labels,
        findings,
        orientation: Orientation::from_exif(page.orientation).unwrap_or(Orientation::NoTransforms),
    })
}

/// Numbers with an opacity behind each; 0 where nothing is to be seen.
fn seen(samples: Samples) -> Box<dyn Iterator<Item = f64>> {
    let values: Vec<f64> = match samples {
        Samples::Bytes(v) => v.into_iter().map(f64::from).collect(),
        Samples::Shorts(v) => v.into_iter().map(f64::from).collect(),
        Samples::Whole(v) => v.into_iter().map(|v| v as f64).collect(),
        Samples::Real(v) => v,
    };
    let mut values = values.into_iter();
    Box::new(std::iter::from_fn(move || {
        let (value, opacity) = (values.next()?, values.next()?);
        Some(if opacity > 0.0 { value } else { 0.0 })
    }))
}

/// Whole numbers as 16 bits.
fn wide(samples: Samples) -> Option<Vec<u16>> {
    match samples {
        Samples::Bytes(v) => Some(v.into_iter().map(u16::from).collect()),
        Samples::Shorts(v) => Some(v),
        Samples::Whole(_) | Samples::Real(_) => None,
    }
}

/// Labels of a PNG, BMP, GIF or WebP: grey numbers of 1 to 16 bits, places of a PNG's palette, or colours.
pub(crate) fn parse_image(bytes: &[u8], size: Option<(usize, usize)>) -> Result<LabelRaster, String> {
    let text = |e: image::ImageError| e.to_string();
    let format = image::guess_format(bytes).map_err(text)?;
    if format == ImageFormat::Png {
        check_png(bytes)?;
        if matches!(bytes.get(25), Some(0 | 3)) {
            return guarded(|| parse_png(bytes, size));
        }
    }
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(Limits::no_limits());
        reader
    };
    let (width, height) = guarded(|| reader().into_dimensions().map_err(text))?;
    check_size([u64::from(width), u64::from(height)], size)?;
    let image = guarded(|| reader().decode().map_err(text))?;
    let short = image.color().bytes_per_pixel() / image.color().channel_count() > 1;
    let opacity = image.color().has_alpha();
    let colours: Vec<[u16; 4]> = if short {
        image.into_rgba16().pixels().map(|p| p.0).collect()
    } else {
        image.into_rgba8().pixels().map(|p| p.0.map(u16::from)).collect()
    };
    let colours: Vec<[u16; 4]> = if opacity {
        colours
    } else {
        colours.into_iter().map(|[r, g, b, _]| [r, g, b, u16::MAX]).collect()
    };
    Ok(LabelRaster::of(colour_labels(
        (height as usize, width as usize),
        &colours,
    )?))
}

/// Labels of a PNG of one channel, 1 to 16 bits; the indices of one with a palette.
fn parse_png(bytes: &[u8], size: Option<(usize, usize)>) -> Result<LabelRaster, String> {
    let limits = png::Limits {
        bytes: usize::try_from(2 * MOST_PIXELS).unwrap_or(usize::MAX),
    };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let (_, depth) = reader.output_color_type();
    check_size([reader.info().width, reader.info().height].map(u64::from), size)?;
    let length = reader.output_buffer_size().ok_or("it is too large")?;
    let mut buffer = vec![0; length];
    let info = reader.next_frame(&mut buffer).map_err(|e| e.to_string())?;
    let shape = (info.height as usize, info.width as usize);
    let mut samples: Vec<u32> = match depth {
        png::BitDepth::Sixteen => buffer
            .chunks_exact(2)
            .map(|b| u32::from(u16::from_be_bytes([b[0], b[1]])))
            .collect(),
        png::BitDepth::Eight => buffer.into_iter().map(u32::from).collect(),
        depth => unpack(&buffer, shape.1, depth as u8).map(u32::from).collect(),
    };
    let black = black_place(reader.info());
    let mut findings = Vec::new();
    if let Some(black) = black.filter(|black| samples.contains(black)) {
        // Label 0 is free: its place takes the number that black had.
        samples.iter_mut().for_each(|l| {
            *l = if *l == black {
                0
            } else if *l == 0 {
                black
            } else {
                *l
            }
        });
        findings.push(Finding::new(
            "binder-colour",
            format!("black, place {black} of the PNG's palette, was taken as the binder"),
        ));
    }
    Ok(LabelRaster::of((shaped(shape, samples)?, findings)))
}

/// The place of black in a palette that does not begin with it.
fn black_place(info: &png::Info<'_>) -> Option<u32> {
    let palette = info.palette.as_ref()?;
    let mut colours = palette.chunks_exact(3);
    let place = colours.position(|c| c == [0, 0, 0])?;
    u32::try_from(place).ok().filter(|place| *place > 0)
}

/// Labels of a NumPy array of two axes (or with further ones of length 1): whole numbers of any kind.
pub(crate) fn parse_npy(bytes: &[u8]) -> Result<LabelRaster, String> {
    let damaged = || "the NumPy header cannot be understood".to_owned();
    let long = bytes.get(6).ok_or_else(damaged)? > &1;
    let length = bytes.get(8..if long { 12 } else { 10 }).ok_or_else(damaged)?;
    let length = length.iter().rev().fold(0_usize, |n, b| n << 8 | usize::from(*b));
    let start: usize = if long { 12 } else { 10 };
    let text = bytes.get(start..start.saturating_add(length)).ok_or_else(damaged)?;
    let text = String::from_utf8_lossy(text);
    let after = |key: &str| text.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
    let kind = after("descr")
        .and_then(|d| d.strip_prefix('\'')?.split_once('\''))
        .map(|d| d.0);
    let kind = kind.ok_or_else(damaged)?;
    if kind.contains('O') {
        return Err("it holds a pickled Python object (Cellpose's _seg.npy?), which may run code when read; save the label array itself, for example numpy.save('labels.npy', numpy.load(FILE, allow_pickle=True).item()['masks'])".into());
    }
    let fortran = after("fortran_order").is_some_and(|v| v.starts_with("True"));
    let sizes = after("shape")
        .and_then(|s| s.strip_prefix('(')?.split_once(')'))
        .ok_or_else(damaged)?
        .0;
    let sizes = sizes.split(',').map(str::trim).filter(|s| !s.is_empty());
    let sizes: Vec<usize> = sizes
        .map(|s| s.parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(damaged)?;
    let axes: Vec<usize> = match sizes.as_slice() {
        [_, _] => sizes.clone(),
        _ => sizes.iter().copied().filter(|n| *n != 1).collect(),
    };
    let &[height, width] = axes.as_slice() else {
        return Err(format!(
            "the array has shape {sizes:?}; a label map has two axes, rows and columns"
        ));
    };
    let data = &bytes[start + length..];
    let (order, kind) = kind.split_at_checked(1).ok_or_else(damaged)?;
    let size: usize = kind.get(1..).and_then(|n| n.parse().ok()).ok_or_else(damaged)?;
    let count = height
        .checked_mul(width)
        .filter(|n| n.checked_mul(size) == Some(data.len()));
    if count.is_none() || size == 0 {
        return Err(format!(
            "the header says {height} x {width} numbers of {size} bytes, but {} bytes follow; it is damaged or truncated",
            data.len()
        ));
    }
    let number = |b: &[u8]| -> Option<f64> {
        let mut little = [0_u8; 8];
        little.iter_mut().zip(b).for_each(|(to, from)| *to = *from);
        if order == ">" {
            little.get_mut(..size)?.reverse();
        }
        let bits = u64::from_le_bytes(little);
        match (kind.as_bytes().first()?, size) {
            (b'b' | b'u', 1 | 2 | 4 | 8) => Some(bits as f64),
            (b'i', 1 | 2 | 4 | 8) => {
                let unused = 64 - 8 * index(size);
                Some(((bits << unused).cast_signed() >> unused) as f64)
            }
            (b'f', 2 | 4 | 8) => Some(float(bits, 8 * size)),
            _ => None,
        }
    };
    if number(&[0; 8]).is_none() {
        return Err(format!("numbers of type {order}{kind}; {ADVICE}"));
    }
    let samples = data.chunks_exact(size).map(|b| number(b).unwrap_or(f64::NAN));
    if fortran {
        let (labels, findings) = number_labels((width, height), samples)?;
        return Ok(LabelRaster::of((
            labels.reversed_axes().as_standard_layout().into_owned(),
            findings,
        )));
    }
    Ok(LabelRaster::of(number_labels((height, width), samples)?))
}

/// Samples of fewer than eight bits, rows beginning on a byte.
fn unpack(packed: &[u8], columns: usize, bits: u8) -> impl Iterator<Item = u8> {
    let each = usize::from(8 / bits.max(1));
    let mask = u8::MAX >> (8 - bits.clamp(1, 8));
    packed.chunks(columns.div_ceil(each).max(1)).flat_map(move |row| {
        (0..columns).map(move |x| {
            row.get(x / each)
                .map_or(0, |b| b >> (8 - usize::from(bits) * (x % each + 1)) & mask)
        })
    })
}

/// Writes a TIFF of one page, u16 where the largest label fits and u32 otherwise.
pub(crate) fn write_tiff<W: Write + Seek>(out: W, labels: ArrayView2<'_, u32>) -> tiff::TiffResult<()> {
    let (width, height) = dimensions(labels.dim());
    let mut encoder = TiffEncoder::new(out)?;
    match narrow(labels) {
        Some(samples) => encoder.write_image::<colortype::Gray16>(width, height, &samples),
        None => {
            let samples: Vec<u32> = labels.iter().copied().collect();
            encoder.write_image::<colortype::Gray32>(width, height, &samples)
        }
    }
}

/// Labels as 16 bits, if they fit.
pub(crate) fn narrow(labels: ArrayView2<'_, u32>) -> Option<Vec<u16>> {
    labels.iter().map(|&l| u16::try_from(l).ok()).collect()
}

/// Writes a NumPy array of u32, axes (y, x).
pub(crate) fn write_npy(out: &mut dyn Write, labels: ArrayView2<'_, u32>) -> std::io::Result<()> {
    let (height, width) = labels.dim();
    let mut text = format!("{{'descr': '<u4', 'fortran_order': False, 'shape': ({height}, {width}), }}");
    let unpadded = 11 + text.len();
    text.push_str(&" ".repeat(unpadded.next_multiple_of(64) - unpadded));
    text.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&u16::try_from(text.len()).unwrap_or(u16::MAX).to_le_bytes())?;
    out.write_all(text.as_bytes())?;
    let samples: Vec<u8> = labels.iter().flat_map(|l| l.to_le_bytes()).collect();
    out.write_all(&samples)
}

/// Width and height of an array (y, x); an image in memory has fewer than 2³² rows and columns.
pub(crate) fn dimensions((height, width): (usize, usize)) -> (u32, u32) {
    (
        u32::try_from(width).unwrap_or(u32::MAX),
        u32::try_from(height).unwrap_or(u32::MAX),
    )
}

/// Whether a path is written in capitals or small letters, its ending.
pub(crate) fn ending(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default()
}
