//! Volumes and images of any sample type, from files that any program wrote.

use crate::error::GridError;
use crate::sample_type::SampleType;
use crate::{npy, nrrd_reader, tiff_reader};
use ndarray::{Array4, ArrayD, Axis, Ix4};
use std::path::Path;

/// A volume as stored in a file: samples in the file's own unit, axes (z, y, x, channel). An image is a volume of one
/// slice.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredVolume {
    /// The samples, as the nearest single-precision numbers.
    pub samples: Array4<f32>,
    /// Their type in the file.
    pub sample_type: SampleType,
}

/// Reads a volume or an image: `.npy`, `.nrrd` (raw, gzip or text; the samples may be in a separate file) or `.tif`
/// (one page per z slice).
///
/// The axes of a `.npy` are (y, x), (z, y, x) or (z, y, x, channel); (y, x, 3) and (y, x, 4) are colour images. NRRD's
/// channel axis is given by its `kinds`; without them it is the axis of at most 4 samples among four. Samples may be
/// integers of 8 to 64 bits, signed or unsigned, or floating point, in either byte order. Memory: 4 bytes per sample,
/// and the file's own bytes while it is read.
///
/// # Errors
///
/// [`GridError::Io`]; [`GridError::UnreadableFormat`] for another extension; [`GridError::NotVolume`] if the file is
/// damaged, truncated or has unsupported contents; the message states which.
///
/// # Examples
///
/// ```
/// # use std::ops::ControlFlow;
/// # use stereology_grid::{Format, SampleType, VolumeShape, read_volume, write_volume};
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("steps.nrrd");
/// let shape = VolumeShape { nz: 2, ny: 3, nx: 4, channels: 1 };
/// write_volume::<u8>(&file, Format::Nrrd, shape, [1.0; 3], |z, mut slab| {
///     slab.fill(z as u8);
///     ControlFlow::Continue(())
/// })?;
/// let read = read_volume(&file)?;
/// assert_eq!(read.samples.dim(), (2, 3, 4, 1));
/// assert_eq!((read.samples[[1, 0, 0, 0]], read.sample_type), (1.0, SampleType::U8));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_volume(path: impl AsRef<Path>) -> Result<StoredVolume, GridError> {
    let path = path.as_ref();
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let (samples, sample_type) = match ending.as_deref() {
        Some("npy") => npy::read_samples(path)?,
        Some("nrrd" | "nhdr") => nrrd_reader::read_samples(path)?,
        Some("tif" | "tiff") => tiff_reader::read_samples(path)?,
        _ => return Err(GridError::UnreadableFormat { path: path.to_owned() }),
    };
    let shape = samples.shape().to_vec();
    let samples = with_four_axes(samples).ok_or_else(|| GridError::NotVolume {
        path: path.to_owned(),
        reason: format!(
            "has axes {shape:?}; a volume has (z, y, x) or (z, y, x, channel), an image (y, x) or (y, x, 3)"
        ),
    })?;
    if samples.is_empty() {
        return Err(GridError::NotVolume {
            path: path.to_owned(),
            reason: format!("holds no samples: its sizes are {shape:?}"),
        });
    }
    Ok(StoredVolume { samples, sample_type })
}

/// Axes (z, y, x, channel) from fewer.
fn with_four_axes(samples: ArrayD<f32>) -> Option<Array4<f32>> {
    let channels = |samples: &ArrayD<f32>| matches!(samples.shape().last(), Some(3 | 4));
    let samples = match samples.ndim() {
        2 => samples.insert_axis(Axis(0)).insert_axis(Axis(3)),
        3 if channels(&samples) => samples.insert_axis(Axis(0)),
        3 => samples.insert_axis(Axis(3)),
        _ => samples,
    };
    let samples = samples.into_dimensionality::<Ix4>().ok()?;
    Some(samples.as_standard_layout().into_owned())
}
