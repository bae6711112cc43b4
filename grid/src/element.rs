//! The sample types of volumes and their names in each format.

use crate::hdf5::Type;
use std::io::{self, Write};

/// A sample type of a volume: `u8` (colours, categories), `u32` (ids), `f32` (distances, residuals).
///
/// Sealed: all formats support these three.
pub trait Element: Encoded {}

impl Element for u8 {}
impl Element for u32 {}
impl Element for f32 {}

/// The names of a sample type in the formats, and its little-endian bytes.
pub trait Encoded: Copy + Default + PartialEq + Send + Sync + 'static {
    /// NumPy's type descriptor.
    const NPY: &'static str;
    /// NRRD's type name.
    const NRRD: &'static str;
    /// VTK's type name.
    const VTK: &'static str;
    /// Zarr's type name.
    const ZARR: &'static str;
    /// TIFF's sample format: 1 unsigned, 3 floating point.
    const TIFF_SAMPLE: u16;
    /// Bits of a sample.
    const BITS: u16;
    /// The type in HDF5.
    const HDF5: Type;
    /// The type in DREAM.3D.
    const DREAM3D: &'static str;
    /// DREAM.3D's name of an array with one such sample per cell.
    const CELLS: &'static str;
    /// Writes the samples as little-endian bytes.
    fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()>;
    /// The samples of little-endian bytes; a remainder shorter than a sample is ignored.
    fn decode(bytes: &[u8]) -> Vec<Self>;
    /// One sample for several of a finer grid: the rounded mean, or of ids the first.
    fn mean(samples: &[Self]) -> Self;
}

impl Encoded for u8 {
    const NPY: &'static str = "|u1";
    const NRRD: &'static str = "uint8";
    const VTK: &'static str = "UInt8";
    const ZARR: &'static str = "uint8";
    const TIFF_SAMPLE: u16 = 1;
    const BITS: u16 = 8;
    const HDF5: Type = Type::Unsigned(1);
    const DREAM3D: &'static str = "uint8_t";
    const CELLS: &'static str = "values";

    fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()> {
        out.write_all(samples)
    }

    fn decode(bytes: &[u8]) -> Vec<Self> {
        bytes.to_vec()
    }

    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "means of eight bytes at most")]
    fn mean(samples: &[Self]) -> Self {
        let (sum, all) = (
            samples.iter().map(|&sample| u32::from(sample)).sum::<u32>(),
            samples.len() as u32,
        );
        ((2 * sum + all) / (2 * all).max(1)) as Self
    }
}

macro_rules! four_bytes {
    ($type:ty, $npy:literal, $nrrd:literal, $vtk:literal, $zarr:literal, $tiff:literal, $hdf5:expr, $dream3d:literal, $cells:literal, $mean:expr) => {
        impl Encoded for $type {
            const NPY: &'static str = $npy;
            const NRRD: &'static str = $nrrd;
            const VTK: &'static str = $vtk;
            const ZARR: &'static str = $zarr;
            const TIFF_SAMPLE: u16 = $tiff;
            const BITS: u16 = 32;
            const HDF5: Type = $hdf5;
            const DREAM3D: &'static str = $dream3d;
            const CELLS: &'static str = $cells;

            fn write(samples: &[Self], out: &mut dyn Write) -> io::Result<()> {
                let mut bytes = [[0; 4]; 4096];
                for block in samples.chunks(4096) {
                    for (place, sample) in bytes.iter_mut().zip(block) {
                        *place = sample.to_le_bytes();
                    }
                    out.write_all(bytes[..block.len()].as_flattened())?;
                }
                Ok(())
            }

            fn decode(bytes: &[u8]) -> Vec<Self> {
                let samples = bytes.as_chunks().0.iter();
                samples.map(|sample| <$type>::from_le_bytes(*sample)).collect()
            }

            #[inline]
            fn mean(samples: &[Self]) -> Self {
                $mean(samples)
            }
        }
    };
}

// DREAM.3D reads ids as i32: the same bytes below 2^31.
four_bytes!(
    u32,
    "<u4",
    "uint32",
    "UInt32",
    "uint32",
    1,
    Type::Signed(4),
    "int32_t",
    "FeatureIds",
    |samples: &[u32]| samples.first().copied().unwrap_or_default()
);
four_bytes!(
    f32,
    "<f4",
    "float",
    "Float32",
    "float32",
    3,
    Type::Float32,
    "float",
    "values",
    |samples: &[f32]| samples.iter().sum::<f32>() / samples.len().max(1) as f32
);
