//! The samples of a TIFF's page as numbers.

use super::chunks::chunk;
use super::directory::number;
use super::page::{Format, Page, Photometric};

/// The samples of a page, pixel by pixel in reading order.
#[derive(Debug)]
pub(crate) enum Samples {
    /// Unsigned, of at most 8 bits.
    Bytes(Vec<u8>),
    /// Unsigned, of 9 to 16 bits.
    Shorts(Vec<u16>),
    /// Other whole numbers.
    Whole(Vec<i64>),
    /// Floating point.
    Real(Vec<f64>),
}

impl Page<'_> {
    /// Decodes the samples, as stored: neither inverted nor looked up in a palette. A JPEG's lightness and hue are
    /// converted to RGB.
    ///
    /// # Errors
    ///
    /// The file is damaged or truncated, or compressed in an unsupported way; the message names it.
    pub(crate) fn read(&self) -> Result<Samples, String> {
        if self.photometric == Photometric::YCbCr && !self.converted() && self.subsampling != [1, 1] {
            return Err("the TIFF stores hue at a lower resolution without JPEG; save it as RGB".into());
        }
        let count = self.width * self.height * self.samples;
        Ok(match (self.format, self.bits) {
            (Format::Unsigned, ..=8) => {
                let mut out = vec![0_u8; count];
                self.place(&mut |at, bits| out[at] = u8::try_from(bits).unwrap_or(u8::MAX))?;
                Samples::Bytes(out)
            }
            (Format::Unsigned, ..=16) => {
                let mut out = vec![0_u16; count];
                self.place(&mut |at, bits| out[at] = u16::try_from(bits).unwrap_or(u16::MAX))?;
                Samples::Shorts(out)
            }
            (Format::Float, bits) => {
                let mut out = vec![0.0; count];
                self.place(&mut |at, stored| out[at] = float(stored, bits))?;
                Samples::Real(out)
            }
            (format, bits) => {
                let unused = 64 - bits;
                let value = |stored: u64| match format {
                    Format::Signed => (stored << unused).cast_signed() >> unused,
                    _ => i64::try_from(stored).unwrap_or(i64::MAX),
                };
                let mut out = vec![0_i64; count];
                self.place(&mut |at, stored| out[at] = value(stored))?;
                Samples::Whole(out)
            }
        })
    }

    /// Gives `put` the place and the bits of every sample.
    fn place(&self, put: &mut dyn FnMut(usize, u64)) -> Result<(), String> {
        let [across, down] = self.grid();
        let [wide, high] = self.chunk;
        let (planes, together) = if self.planar {
            (self.samples, 1)
        } else {
            (1, self.samples)
        };
        let row_bytes = (wide * together * self.bits).div_ceil(8);
        let bytes = self.bits / 8;
        for i in 0..planes * across * down {
            let (plane, tile) = (i / (across * down), i % (across * down));
            let (left, top) = (tile % across * wide, tile / across * high);
            let (columns, rows) = (wide.min(self.width - left), high.min(self.height - top));
            let stored = chunk(self, i, row_bytes, rows)?;
            for (y, row) in stored.chunks_exact(row_bytes).enumerate() {
                let start = ((top + y) * self.width + left) * self.samples + plane;
                for k in 0..columns * together {
                    let value = if self.bits == 8 {
                        u64::from(row[k])
                    } else if self.bits.is_multiple_of(8) {
                        number(&row[k * bytes..(k + 1) * bytes], self.big_endian).unwrap_or(0)
                    } else {
                        packed(row, k * self.bits, self.bits)
                    };
                    put(start + if self.planar { k * self.samples } else { k }, value);
                }
            }
        }
        Ok(())
    }
}

/// A number of `bits` bits from bit `from` on, the largest first.
fn packed(row: &[u8], from: usize, bits: usize) -> u64 {
    (from..from + bits).fold(0, |value, at| {
        let bit = row.get(at / 8).map_or(0, |byte| byte >> (7 - at % 8) & 1);
        value << 1 | u64::from(bit)
    })
}

/// A floating point number of 16, 24, 32 or 64 bits.
pub(crate) fn float(stored: u64, bits: usize) -> f64 {
    let (exponent_bits, fraction_bits) = match bits {
        16 => (5_u32, 10_u32),
        24 => (7, 16),
        32 => (8, 23),
        _ => return f64::from_bits(stored),
    };
    let exponent = stored >> fraction_bits & ((1 << exponent_bits) - 1);
    let fraction = (stored & ((1 << fraction_bits) - 1)) as f64 / (1_u64 << fraction_bits) as f64;
    let bias = (1_i32 << (exponent_bits - 1)) - 1;
    let sign = if stored >> (exponent_bits + fraction_bits) & 1 == 1 {
        -1.0
    } else {
        1.0
    };
    let power = i32::try_from(exponent).unwrap_or(0) - bias;
    sign * match exponent {
        0 => fraction * 2_f64.powi(1 - bias),
        e if e == (1 << exponent_bits) - 1 => {
            if fraction > 0.0 {
                f64::NAN
            } else {
                f64::INFINITY
            }
        }
        _ => (1.0 + fraction) * 2_f64.powi(power),
    }
}
