//! Strips and tiles of a TIFF: decompressed, with predictors undone.

use std::io::Read;

use super::page::{Format, Page, Photometric};

/// Most memory for the dictionary of LZMA, kilobytes.
const LZMA_KILOBYTES: u32 = 1 << 18;

/// The bytes of strip or tile number `i`: `rows` rows of `row` bytes, samples in the file's byte order.
pub(super) fn chunk(page: &Page<'_>, i: usize, row: usize, rows: usize) -> Result<Vec<u8>, String> {
    let stored = page.chunks.get(i).copied().unwrap_or_default();
    let mut reversed = Vec::new();
    let stored = if page.reversed_bits && page.compression != 7 {
        reversed.extend(stored.iter().map(|b| b.reverse_bits()));
        &reversed
    } else {
        stored
    };
    let wanted = row * rows;
    let mut bytes = decompressed(page, stored, wanted)?;
    if bytes.len() < wanted {
        return Err(format!(
            "the TIFF is damaged or truncated: its strip or tile {i} has {} of {wanted} bytes",
            bytes.len()
        ));
    }
    bytes.truncate(wanted);
    let step = if page.planar { 1 } else { page.samples };
    match page.predictor {
        2 => bytes.chunks_mut(row).for_each(|row| add_differences(row, page, step)),
        3 if page.format == Format::Float => bytes.chunks_mut(row).for_each(|row| join_bytes(row, page, step)),
        _ => {}
    }
    Ok(bytes)
}

/// Undoes the compression; at most `wanted` bytes are produced.
fn decompressed(page: &Page<'_>, stored: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    let up_to = |reader: &mut dyn Read| {
        let mut out = Vec::new();
        // What a damaged stream gave before its error is too short, which is reported.
        let _ = reader.take(wanted as u64).read_to_end(&mut out);
        out
    };
    Ok(match page.compression {
        1 => stored.get(..wanted).unwrap_or(stored).to_vec(),
        2..=4 => fax(page, stored, wanted)?,
        5 => lzw(stored, wanted),
        7 => jpeg(page, stored, wanted)?,
        8 | 32_946 => up_to(&mut flate2::read::ZlibDecoder::new(stored)),
        32_773 => unpacked(stored, wanted),
        34_925 => up_to(&mut lzma_rust2::XzReader::new_mem_limit(stored, true, LZMA_KILOBYTES)),
        50_000 | 34_926 => match ruzstd::decoding::StreamingDecoder::new(stored) {
            Ok(mut decoder) => up_to(&mut decoder),
            Err(error) => return Err(format!("the TIFF's Zstandard data is damaged ({error})")),
        },
        50_001 => {
            let image = image::load_from_memory_with_format(stored, image::ImageFormat::WebP);
            let image = image.map_err(|e| format!("the TIFF's WebP data is damaged ({e})"))?;
            match page.samples {
                4 => image.into_rgba8().into_raw(),
                _ => image.into_rgb8().into_raw(),
            }
        }
        other => {
            let name = match other {
                6 => "old-style JPEG",
                33_003 | 33_005 | 34_712 => "JPEG 2000",
                34_887 => "LERC",
                50_002 | 52_546 => "JPEG XL",
                _ => "a kind that is not supported",
            };
            return Err(format!(
                "the TIFF is compressed as {name} (number {other}); save it uncompressed, or with LZW, Deflate or Zstandard"
            ));
        }
    })
}

/// Lempel, Ziv and Welch's compression as TIFF has it; what precedes an error is kept.
fn lzw(stored: &[u8], wanted: usize) -> Vec<u8> {
    let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    let mut out = vec![0; wanted];
    let (mut from, mut to) = (0, 0);
    loop {
        let step = decoder.decode_bytes(&stored[from..], &mut out[to..]);
        from += step.consumed_in;
        to += step.consumed_out;
        if !matches!(step.status, Ok(weezl::LzwStatus::Ok)) || to == wanted {
            break;
        }
    }
    out.truncate(to);
    out
}

/// Runs and copies of Macintosh's PackBits.
fn unpacked(stored: &[u8], wanted: usize) -> Vec<u8> {
    let mut out = Vec::new();
    let mut rest = stored;
    while let [control, tail @ ..] = rest {
        if out.len() >= wanted {
            break;
        }
        let copied = match control {
            0..=127 => {
                let part = &tail[..tail.len().min(usize::from(*control) + 1)];
                out.extend_from_slice(part);
                part.len()
            }
            128 => 0,
            129.. => {
                out.extend(tail.first().into_iter().cycle().take(257 - usize::from(*control)));
                tail.len().min(1)
            }
        };
        rest = &tail[copied..];
    }
    out
}

/// Rows of a fax, one bit per pixel; black is 1 where white is 0.
fn fax(page: &Page<'_>, stored: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    if page.compression != 4 || page.bits != 1 || page.samples != 1 {
        return Err(
            "the TIFF is compressed as a fax of group 3; save it uncompressed, or with LZW, Deflate or Zstandard"
                .into(),
        );
    }
    let width = u16::try_from(page.chunk[0]).map_err(|_| "the TIFF's fax is wider than 65,535 pixels".to_owned())?;
    let row = page.chunk[0].div_ceil(8);
    let mut out = Vec::new();
    fax::decoder::decode_g4(stored.iter().copied(), width, None, |transitions| {
        if out.len() >= wanted {
            return;
        }
        let start = out.len();
        out.resize(start + row, 0);
        for (x, colour) in fax::decoder::pels(transitions, width).enumerate() {
            // Decoded rows are as with white 0.
            if (colour == fax::Color::Black) == (page.photometric == Photometric::WhiteIsZero) {
                out[start + x / 8] |= 0x80 >> (x % 8);
            }
        }
    });
    Ok(out)
}

/// A strip or tile that is a JPEG of its own; its tables may be stored once for all.
fn jpeg(page: &Page<'_>, stored: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    use zune_jpeg::{JpegDecoder, zune_core::bytestream::ZCursor, zune_core::colorspace::ColorSpace};
    let whole = match (page.tables.strip_suffix(&[0xff, 0xd9]), stored.get(2..)) {
        (Some(tables), Some(image)) => [tables, image].concat(),
        _ => stored.to_vec(),
    };
    let damaged = |e: &dyn std::fmt::Display| format!("the TIFF's JPEG data is damaged ({e})");
    let mut decoder = JpegDecoder::new(ZCursor::new(&whole));
    decoder.decode_headers().map_err(|e| damaged(&e))?;
    let info = decoder.info().ok_or_else(|| damaged(&"no header"))?;
    let pixels = usize::from(info.width) * usize::from(info.height);
    let bytes = pixels * if page.planar { 1 } else { page.samples };
    if bytes > wanted.saturating_mul(2).max(1 << 24) {
        return Err(damaged(&format!("a tile of {} x {} pixels", info.width, info.height)));
    }
    let inside = decoder.input_colorspace().ok_or_else(|| damaged(&"no colours"))?;
    // Colours are converted where the page says that they are stored as lightness and hue.
    let outside = match page.photometric {
        Photometric::YCbCr if !page.planar => ColorSpace::RGB,
        _ => inside,
    };
    decoder.set_options(decoder.options().jpeg_set_out_colorspace(outside));
    let decoded = decoder.decode().map_err(|e| damaged(&e))?;
    // The last strip may be a higher image than its rows; tiles have their own width.
    let row = usize::from(info.width) * outside.num_components();
    let wide = page.chunk[0] * if page.planar { 1 } else { page.samples };
    if row == wide {
        return Ok(decoded);
    }
    if row < wide {
        return Err(damaged(&format!("a strip or tile of {} pixels", info.width)));
    }
    Ok(decoded
        .chunks(row)
        .flat_map(|r| r[..wide.min(r.len())].iter().copied())
        .collect())
}

/// Undoes horizontal differencing of a row.
fn add_differences(row: &mut [u8], page: &Page<'_>, step: usize) {
    let size = page.bits / 8;
    if !page.bits.is_multiple_of(8) || ![1, 2, 4, 8].contains(&size) {
        return;
    }
    for at in (step * size..row.len()).step_by(size) {
        let before = at - step * size;
        let mut carry = 0;
        for k in 0..size {
            // The smallest byte first.
            let k = if page.big_endian { size - 1 - k } else { k };
            let Some((sum, over)) = (|| {
                let sum = u16::from(*row.get(at + k)?) + u16::from(*row.get(before + k)?) + carry;
                Some((sum.to_le_bytes()[0], sum >> 8))
            })() else {
                return;
            };
            row[at + k] = sum;
            carry = over;
        }
    }
}

/// Undoes the floating point predictor of a row: the numbers' first bytes, then their second ones, ..., each the
/// difference to the byte before.
fn join_bytes(row: &mut [u8], page: &Page<'_>, step: usize) {
    for at in step..row.len() {
        row[at] = row[at].wrapping_add(row[at - step]);
    }
    let size = page.bits / 8;
    let count = row.len() / size.max(1);
    let planes = row.to_vec();
    for i in 0..count {
        for k in 0..size {
            let place = if page.big_endian { k } else { size - 1 - k };
            row[i * size + place] = planes[k * count + i];
        }
    }
}
