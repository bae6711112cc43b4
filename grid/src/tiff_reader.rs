//! Reader of TIFF files: every page is a z slice.

use crate::error::GridError;
use crate::sample_type::SampleType;
use ndarray::{ArrayD, IxDyn};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};

/// The samples, axes (z, y, x, channel).
pub(crate) fn read_samples(path: &Path) -> Result<(ArrayD<f32>, SampleType), GridError> {
    let file = File::open(path).map_err(GridError::io(path))?;
    pages(BufReader::new(file)).map_err(|reason| GridError::NotVolume {
        path: path.to_owned(),
        reason,
    })
}

fn pages(file: impl Read + Seek) -> Result<(ArrayD<f32>, SampleType), String> {
    let damaged = |error: tiff::TiffError| format!("cannot be read as TIFF: {error}");
    // A damaged header must not allocate all the memory.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 1 << 32;
    let mut decoder = Decoder::new(file).map_err(damaged)?.with_limits(limits);
    let mut first: Option<([usize; 3], SampleType)> = None;
    let (mut samples, mut slices) = (Vec::new(), 0);
    loop {
        let (width, height) = decoder.dimensions().map_err(damaged)?;
        let (width, height) = (width as usize, height as usize);
        let (channels, bits) = match decoder.colortype().map_err(damaged)? {
            ColorType::Gray(bits) => (1, bits),
            ColorType::GrayA(bits) => (2, bits),
            ColorType::RGB(bits) => (3, bits),
            ColorType::RGBA(bits) => (4, bits),
            other => return Err(format!("its colours are {other:?}; save it as grey or RGB")),
        };
        let (page, kind) = values(decoder.read_image().map_err(damaged)?, bits, width)?;
        let shape = [height, width, channels];
        let (of_first, kind_of_first) = *first.get_or_insert((shape, kind));
        if (of_first, kind_of_first) != (shape, kind) || page.len() != height * width * channels {
            return Err(format!(
                "page {} is {width} x {height} of {channels} channels ({kind:?}), unlike the first page; save slices of one size and type",
                slices + 1
            ));
        }
        samples.extend(page);
        slices += 1;
        if !decoder.more_images() {
            break;
        }
        decoder.next_image().map_err(damaged)?;
    }
    let Some(([height, width, channels], kind)) = first else {
        return Err("has no page".into());
    };
    // An opacity channel is kept here; callers that measure ignore it.
    let samples = ArrayD::from_shape_vec(IxDyn(&[slices, height, width, channels]), samples)
        .map_err(|error| error.to_string())?;
    Ok((samples, kind))
}

/// Samples of a page as single-precision numbers.
#[allow(clippy::cast_possible_truncation, reason = "the nearest f32 is the result")]
fn values(page: DecodingResult, bits: u8, width: usize) -> Result<(Vec<f32>, SampleType), String> {
    fn all<T: Copy>(samples: Vec<T>, value: impl Fn(T) -> f32) -> Vec<f32> {
        samples.into_iter().map(value).collect()
    }
    Ok(match page {
        // One bit per pixel, rows padded to whole bytes.
        DecodingResult::U8(packed) if bits == 1 => {
            let row = width.div_ceil(8).max(1);
            let bit = |row: &[u8], x: usize| f32::from(row[x / 8] >> (7 - x % 8) & 1);
            let unpacked = packed
                .chunks_exact(row)
                .flat_map(|row| (0..width).map(move |x| bit(row, x)));
            (unpacked.collect(), SampleType::Bool)
        }
        DecodingResult::U8(_) if bits < 8 => {
            return Err(format!("holds samples of {bits} bits; save it with 8"));
        }
        DecodingResult::U8(samples) => (all(samples, f32::from), SampleType::U8),
        DecodingResult::I8(samples) => (all(samples, f32::from), SampleType::I8),
        DecodingResult::U16(samples) => (all(samples, f32::from), SampleType::U16),
        DecodingResult::I16(samples) => (all(samples, f32::from), SampleType::I16),
        DecodingResult::U32(samples) => (all(samples, |v| v as f32), SampleType::U32),
        DecodingResult::I32(samples) => (all(samples, |v| v as f32), SampleType::I32),
        DecodingResult::U64(samples) => (all(samples, |v| v as f32), SampleType::U64),
        DecodingResult::I64(samples) => (all(samples, |v| v as f32), SampleType::I64),
        DecodingResult::F32(samples) => (samples, SampleType::F32),
        DecodingResult::F64(samples) => (all(samples, |v| v as f32), SampleType::F64),
        DecodingResult::F16(samples) => (all(samples, f32::from), SampleType::F32),
    })
}
