//! What JPEG compression has done to a photograph's colours, from the tables in its file.

use std::f64::consts::PI;

/// Errors of the colours of a photograph that was stored as a JPEG.
///
/// JPEG rounds the cosine coefficients of blocks of 8 x 8 samples of lightness (Y) and hue (Cb, Cr) to multiples of the
/// quantisation table, and often stores hue at half the resolution. Flat regions keep their colour; in blocks that a
/// border crosses, the lowest coefficients have errors of up to half a step, spread over the block.
///
/// # Formula
///
/// ```text
/// σ² = Σ q² / (12 · 64)     over the six lowest coefficients, u + v ≤ 2, of step q
/// ```
///
/// # References
///
/// ISO/IEC 10918-1, Digital compression and coding of continuous-tone still images, B.2.2 and B.2.4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compression {
    /// Standard deviations of the errors of Y, Cb and Cr in blocks with a border, of values from 0 to 1. Zero for hue
    /// if the photo is grey.
    pub errors: [f64; 3],
    /// Pixels per sample of hue, along rows and columns: 2 and 2 for 4:2:0.
    pub subsampling: [u8; 2],
}

/// Orders (u, v) of the lowest coefficients, in the order in which tables are stored.
const LOWEST_ORDERS: [[u8; 2]; 6] = [[0, 0], [1, 0], [0, 1], [0, 2], [1, 1], [2, 0]];
/// Side of a block, samples.
const SIDE: f64 = 8.0;
/// Markers of segments, and those of frames: C0 to CF but for C4, C8 and CC.
const TABLES: u8 = 0xdb;
const SCAN: u8 = 0xda;

impl Compression {
    /// From the bytes of a JPEG file; `None` if they are no JPEG, or of one without the tables of its components.
    ///
    /// # Examples
    ///
    /// ```
    /// use image::codecs::jpeg::JpegEncoder;
    ///
    /// let mut bytes = Vec::new();
    /// JpegEncoder::new_with_quality(&mut bytes, 50).encode_image(&image::RgbImage::new(32, 32))?;
    /// let compression = stereology_segment::Compression::of(&bytes).expect("a JPEG has tables");
    /// // The standard's tables begin with steps from 10 to 16 for lightness, from 17 to 24 for hue.
    /// assert!((compression.errors[0] * 255.0 - 1.12).abs() < 0.05);
    /// assert!((compression.errors[1] * 255.0 - 1.81).abs() < 0.1);
    /// assert_eq!(stereology_segment::Compression::of(b"P6 32 32 255"), None);
    /// # Ok::<(), image::ImageError>(())
    /// ```
    #[must_use]
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
        let mut steps: [Option<f64>; 4] = [None; 4];
        // Sampling along rows and columns, and table, of each component.
        let mut components: Vec<([u8; 2], usize)> = Vec::new();
        loop {
            let [0xff, marker, high, low, ..] = *rest else {
                return None;
            };
            if marker == 0xff {
                // A filling byte.
                rest = &rest[1..];
                continue;
            }
            let length = usize::from(u16::from_be_bytes([high, low]));
            let segment = rest.get(4..2 + length)?;
            match marker {
                TABLES => read_tables(segment, &mut steps)?,
                SCAN => break,
                0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&marker) => {
                    let listed = segment.get(6..)?.chunks_exact(3);
                    components = listed.map(|c| ([c[1] >> 4, c[1] & 15], usize::from(c[2]))).collect();
                }
                _ => {}
            }
            rest = rest.get(2 + length..)?;
        }
        let error = |component: usize| {
            let &(_, table) = components.get(component)?;
            steps.get(table).copied().flatten()
        };
        let per_sample = |side: usize| match components.as_slice() {
            [(luma, _), (hue, _), ..] if hue[side] > 0 => (luma[side] / hue[side]).max(1),
            _ => 1,
        };
        Some(Self {
            errors: [error(0)?, error(1).unwrap_or(0.0), error(2).unwrap_or(0.0)],
            subsampling: [per_sample(0), per_sample(1)],
        })
    }

    /// Covariance of the errors of encoded R, G, B, values from 0 to 1, that remain in averages over a Gaussian of
    /// `sigma` pixels.
    ///
    /// The coefficient (u, v) of a block of B pixels is a cosine of wavelengths 2B / u and 2B / v there and independent
    /// of those of other blocks. Averages keep this fraction of its variance, up to the shape of the block:
    ///
    /// ```text
    /// exp(−(π σ / B)² (u² + v²)) / (1 + 4π σ² / B²)
    /// ```
    pub(crate) fn covariance(&self, sigma: f64) -> [[f64; 3]; 3] {
        // R = Y + 1.402 Cr, G = Y − 0.344 Cb − 0.714 Cr, B = Y + 1.772 Cb (JFIF).
        let colours = [[1.0, 0.0, 1.402], [1.0, -0.344, -0.714], [1.0, 1.772, 0.0]];
        let samples = f64::from(self.subsampling[0].max(self.subsampling[1]));
        let [lightness, hue] = [1.0, samples].map(|pixels| remaining(sigma / (SIDE * pixels)));
        let variances: [f64; 3] =
            std::array::from_fn(|k| self.errors[k].powi(2) * if k == 0 { lightness } else { hue });
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| colours[i][k] * colours[j][k] * variances[k]).sum())
        })
    }

    /// Standard deviation of the blur that subsampled hue has, pixels: that of samples of the subsampled size, and of
    /// linear interpolation between them.
    pub(crate) fn hue_spread(&self) -> f32 {
        let size = f32::from(self.subsampling[0].max(self.subsampling[1]));
        (0.25 * (size * size - 1.0)).sqrt()
    }
}

/// Mean over the lowest coefficients of the fraction of their variance that remains in averages over a Gaussian of
/// `sigma` blocks.
fn remaining(sigma: f64) -> f64 {
    let falling = (PI * sigma).powi(2);
    let shares = LOWEST_ORDERS.map(|[u, v]| (-falling * f64::from(u * u + v * v)).exp());
    shares.iter().sum::<f64>() / shares.len() as f64 / (1.0 + 4.0 * PI * sigma * sigma)
}

/// Reads the tables of a segment: the standard deviation that the lowest steps of each give.
fn read_tables(mut segment: &[u8], steps: &mut [Option<f64>; 4]) -> Option<()> {
    while let Some((&kind, rest)) = segment.split_first() {
        let bytes = if kind >> 4 == 0 { 1 } else { 2 };
        let table = rest.get(..64 * bytes)?;
        let squares = table.chunks_exact(bytes).take(LOWEST_ORDERS.len()).map(|step| {
            let step = step.iter().fold(0.0, |value, byte| 256.0 * value + f64::from(*byte));
            (step / 255.0).powi(2)
        });
        *steps.get_mut(usize::from(kind & 15))? = Some((squares.sum::<f64>() / (12.0 * SIDE * SIDE)).sqrt());
        segment = rest.get(64 * bytes..)?;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::Compression;
    use image::RgbImage;
    use image::codecs::jpeg::JpegEncoder;
    use proptest::prelude::*;

    fn encoded(quality: u8) -> Vec<u8> {
        let level = |v: u32| u8::try_from(v % 256).unwrap();
        let photo = RgbImage::from_fn(40, 24, |x, y| image::Rgb([level(5 * x), level(9 * y), 77]));
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, quality)
            .encode_image(&photo)
            .unwrap();
        bytes
    }

    proptest! {
        /// Errors decrease with quality, and truncated or arbitrary bytes give none and no panic.
        #[test]
        fn of_any_bytes(quality in 5_u8..95, cut in 0_usize..700, at in 2_usize..700, byte in any::<u8>()) {
            let bytes = encoded(quality);
            let [low, high] = [Compression::of(&bytes).unwrap(), Compression::of(&encoded(quality + 5)).unwrap()];
            prop_assert!((0..3).all(|k| low.errors[k] > high.errors[k]));
            let mut broken = bytes.clone();
            broken[at.min(bytes.len() - 1)] = byte;
            let _ = (Compression::of(&broken), Compression::of(&bytes[..cut.min(bytes.len())]));
        }
    }
}
