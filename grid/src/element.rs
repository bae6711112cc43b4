//! The sample types of our volumes and what each format calls them.

use std::io::{self, Seek, Write};
use tiff::TiffResult;
use tiff::encoder::{DirectoryEncoder, TiffKind};
use tiff::tags::SampleFormat;

/// A sample type of a volume: `u8` (colours, categories), `u32` (ids), `f32` (distances, residuals).
///
/// Sealed: the formats agree on these three.
pub trait Element: Encoded {}

impl Element for u8 {}
impl Element for u32 {}
impl Element for f32 {}

/// What the formats call a sample type, and its little-endian bytes.
pub trait Encoded: Copy + Default + Send + Sync + 'static {
    /// NumPy's type descriptor.
    const NPY: &'static str;
    /// NRRD's type name.
    const NRRD: &'static str;
    /// VTK's type name.
    const VTK: &'static str;
    /// Writes the samples as little-endian bytes.
    fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()>;
    /// TIFF's sample format.
    const TIFF_SAMPLE: SampleFormat;
    /// Writes the samples into a TIFF file, in its byte order, and says where they begin.
    fn write_page<W: Write + Seek, K: TiffKind>(
        tiff: &mut DirectoryEncoder<'_, W, K>,
        samples: &[Self],
    ) -> TiffResult<u64>;
    /// The samples of little-endian bytes; a rest shorter than a sample is left out.
    fn decode(bytes: &[u8]) -> Vec<Self>;
}

impl Encoded for u8 {
    const NPY: &'static str = "|u1";
    const NRRD: &'static str = "uint8";
    const VTK: &'static str = "UInt8";
    const TIFF_SAMPLE: SampleFormat = SampleFormat::Uint;

    fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()> {
        out.write_all(samples)
    }

    fn write_page<W: Write + Seek, K: TiffKind>(
        tiff: &mut DirectoryEncoder<'_, W, K>,
        samples: &[Self],
    ) -> TiffResult<u64> {
        tiff.write_data(samples)
    }

    fn decode(bytes: &[u8]) -> Vec<Self> {
        bytes.to_vec()
    }
}

macro_rules! four_bytes {
    ($type:ty, $npy:literal, $nrrd:literal, $vtk:literal, $tiff:ident) => {
        impl Encoded for $type {
            const NPY: &'static str = $npy;
            const NRRD: &'static str = $nrrd;
            const VTK: &'static str = $vtk;
            const TIFF_SAMPLE: SampleFormat = SampleFormat::$tiff;

            fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()> {
                let mut bytes = [0; 4 * 1024];
                for block in samples.chunks(1024) {
                    for (place, sample) in bytes.chunks_exact_mut(4).zip(block) {
                        place.copy_from_slice(&sample.to_le_bytes());
                    }
                    out.write_all(&bytes[..4 * block.len()])?;
                }
                Ok(())
            }

            fn write_page<W: Write + Seek, K: TiffKind>(
                tiff: &mut DirectoryEncoder<'_, W, K>,
                samples: &[Self],
            ) -> TiffResult<u64> {
                tiff.write_data(samples)
            }

            fn decode(bytes: &[u8]) -> Vec<Self> {
                bytes
                    .chunks_exact(4)
                    .map(|b| <$type>::from_le_bytes([b[0], b[1], b[2], b[3]]))
                    .collect()
            }
        }
    };
}

four_bytes!(u32, "<u4", "uint32", "UInt32", Uint);
four_bytes!(f32, "<f4", "float", "Float32", IEEEFP);
