//! Label maps as arrays of numbers: TIFF, PNG, NumPy.

use std::{
    io::{Cursor, Seek, Write},
    path::Path,
};

use ndarray::{Array2, ArrayView2};
use tiff::{
    ColorType,
    decoder::{Decoder, DecodingResult, Limits},
    encoder::{TiffEncoder, colortype},
    tags::Tag,
};

use stereology_metrics::Finding;

use crate::conversions::{index, whole_part};

/// Bytes of the samples of a label map: 20,000 x 20,000 of 32 bits.
const LARGEST_MAP: usize = 1_600_000_000;
/// Advice for files whose samples are not labels.
const ADVICE: &str = "give one channel of whole numbers, 0 for the binder";

/// Labels of a TIFF as stored: numbers of 1 to 64 bits, floats if whole, never inverted for display.
pub(crate) fn parse_tiff(bytes: &[u8]) -> Result<(Array2<u32>, Vec<Finding>), String> {
    // A header may state any size; larger maps are not supported.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = LARGEST_MAP;
    let text = |e: tiff::TiffError| e.to_string();
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(text)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(text)?;
    let colour = decoder.colortype().map_err(text)?;
    let inverted = decoder
        .find_tag(Tag::PhotometricInterpretation)
        .ok()
        .flatten()
        .and_then(|v| v.into_u16().ok())
        == Some(0);
    let bits = match colour {
        ColorType::Gray(bits) | ColorType::Palette(bits) => bits,
        other => return Err(format!("the pixels are {other:?}; {ADVICE}")),
    };
    let (rows, columns) = (height as usize, width as usize);
    let flip = |v: u64, bits: u8| if inverted { !v & (u64::MAX >> (64 - bits)) } else { v };
    let samples: Result<Vec<u32>, String> = match decoder.read_image().map_err(text)? {
        DecodingResult::U8(v) if bits < 8 => {
            let unpacked = unpack(&v, columns, bits);
            unpacked.map(|l| whole(flip(u64::from(l), bits) as f64)).collect()
        }
        DecodingResult::U8(v) => v.into_iter().map(|l| whole(flip(u64::from(l), 8) as f64)).collect(),
        DecodingResult::U16(v) => v.into_iter().map(|l| whole(flip(u64::from(l), 16) as f64)).collect(),
        DecodingResult::U32(v) => v.into_iter().map(|l| whole(flip(u64::from(l), 32) as f64)).collect(),
        DecodingResult::U64(v) => v.into_iter().map(|l| whole(flip(l, 64) as f64)).collect(),
        DecodingResult::I8(v) => v.into_iter().map(|l| whole(f64::from(l))).collect(),
        DecodingResult::I16(v) => v.into_iter().map(|l| whole(f64::from(l))).collect(),
        DecodingResult::I32(v) => v.into_iter().map(|l| whole(f64::from(l))).collect(),
        DecodingResult::I64(v) => v.into_iter().map(|l| whole(l as f64)).collect(),
        DecodingResult::F32(v) => v.into_iter().map(|l| whole(f64::from(l))).collect(),
        DecodingResult::F64(v) => v.into_iter().map(whole).collect(),
        _ => Err(format!("the samples are of an unsupported type; {ADVICE}")),
    };
    let mut pages = 1;
    while decoder.more_images() && decoder.next_image().is_ok() {
        pages += 1;
    }
    let findings = (pages > 1).then(|| {
        Finding::new(
            "first-page",
            format!("the TIFF has {pages} pages; the first one was read: save only the page that belongs to the photo"),
        )
    });
    Ok((shaped((rows, columns), samples?)?, findings.into_iter().collect()))
}

/// Labels of a PNG of one channel, 1 to 16 bits; the indices of one with a palette.
pub(crate) fn parse_png(bytes: &[u8]) -> Result<Array2<u32>, String> {
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: LARGEST_MAP });
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let (colour, depth) = reader.output_color_type();
    if !matches!(colour, png::ColorType::Grayscale | png::ColorType::Indexed) {
        return Err(format!("the pixels are {colour:?}; {ADVICE}"));
    }
    let size = reader
        .output_buffer_size()
        .filter(|n| *n <= LARGEST_MAP)
        .ok_or("it is too large")?;
    let mut buffer = vec![0; size];
    let info = reader.next_frame(&mut buffer).map_err(|e| e.to_string())?;
    let shape = (info.height as usize, info.width as usize);
    let samples = match depth {
        png::BitDepth::Sixteen => buffer
            .chunks_exact(2)
            .map(|b| u32::from(u16::from_be_bytes([b[0], b[1]])))
            .collect(),
        png::BitDepth::Eight => buffer.into_iter().map(u32::from).collect(),
        depth => unpack(&buffer, shape.1, depth as u8).map(u32::from).collect(),
    };
    shaped(shape, samples)
}

/// Labels of a NumPy array of two axes (or with further ones of length 1): whole numbers of any kind.
pub(crate) fn parse_npy(bytes: &[u8]) -> Result<Array2<u32>, String> {
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
    let (order, kind) = kind.split_at(1);
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
    let number = |b: &[u8]| -> Result<u32, String> {
        let mut little = [0_u8; 8];
        for (to, from) in little.iter_mut().zip(b.iter()) {
            *to = *from;
        }
        if order == ">" {
            little[..size].reverse();
        }
        let bits = u64::from_le_bytes(little);
        match (kind.as_bytes()[0], size) {
            (b'b' | b'u', 1 | 2 | 4 | 8) => whole(bits as f64),
            (b'i', 1 | 2 | 4 | 8) => {
                let unused = 64 - 8 * index(size);
                whole(((bits << unused).cast_signed() >> unused) as f64)
            }
            (b'f', 4) => whole(f64::from(f32::from_le_bytes([
                little[0], little[1], little[2], little[3],
            ]))),
            (b'f', 8) => whole(f64::from_bits(bits)),
            _ => Err(format!("numbers of type {order}{kind}; {ADVICE}")),
        }
    };
    let samples = data.chunks_exact(size).map(number).collect::<Result<Vec<_>, _>>()?;
    if fortran {
        return Ok(shaped((width, height), samples)?
            .reversed_axes()
            .as_standard_layout()
            .into_owned());
    }
    shaped((height, width), samples)
}

/// A label as a whole number of at least 0.
fn whole(value: f64) -> Result<u32, String> {
    if value < 0.0 {
        return Err(format!("the label {value} is negative; {ADVICE}"));
    }
    if value.fract() != 0.0 || value > f64::from(u32::MAX) {
        return Err(format!(
            "the label {value} is not a whole number of at most 32 bits; {ADVICE}"
        ));
    }
    Ok(index(whole_part(value)))
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

fn shaped(shape: (usize, usize), samples: Vec<u32>) -> Result<Array2<u32>, String> {
    let (found, wanted) = (samples.len(), shape.0 * shape.1);
    Array2::from_shape_vec(shape, samples)
        .map_err(|_| format!("{found} samples for {wanted} pixels: more than one channel; {ADVICE}"))
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
