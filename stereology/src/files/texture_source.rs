//! A texture for a packing: the `texture.npy` of a solid, or a volume of colours in any format that can be read.

use crate::files::solid::texture_voxel;
use crate::files::{FileError, residual};
use ndarray::{Axis, concatenate};
use std::path::Path;
use stereology_grid::{SampleType, read_volume};
use stereology_volume::Residual;

/// A residual for a box with this longest side, from a file: the `texture.npy` of a solid, or a volume of colours.
///
/// The voxels of a volume have an edge near `voxel`, such that the volume repeats with the side; its mean is
/// subtracted, and particles and binder share it. A `texture.npy` beside its `solid.json` keeps the edge of its voxels.
///
/// # Errors
///
/// [`FileError`] if it cannot be read, or is neither.
pub fn read(path: impl AsRef<Path>, voxel: f64, side: f64) -> Result<Residual, FileError> {
    let path = path.as_ref();
    let fitted = |voxels: usize, voxel: f64| {
        let periods = (side / (voxels as f64 * voxel)).round().max(1.0);
        side / (voxels as f64 * periods)
    };
    let stored = read_volume(path)?;
    let (nz, ny, nx, channels) = stored.samples.dim();
    let longest = nz.max(ny).max(nx);
    if channels == 6 {
        let beside = path.with_file_name("solid.json");
        return match texture_voxel(&beside) {
            Some(edge) => residual::read(path, edge),
            None => residual::read(path, fitted(longest, voxel)),
        };
    }
    let white = match stored.sample_type {
        SampleType::U8 => 255.0,
        SampleType::U16 => 65_535.0,
        _ => 1.0,
    };
    let values = stored.samples.mapv(|value| value / white);
    let colours = match channels {
        1 => concatenate(Axis(3), &[values.view(); 3]).map_err(|error| FileError::value(path, error))?,
        3 => values,
        _ => {
            return Err(FileError::value(
                path,
                format!("has {channels} channels; a texture has 1, 3 or 6"),
            ));
        }
    };
    let means = colours
        .mean_axis(Axis(0))
        .and_then(|means| means.mean_axis(Axis(0)))
        .and_then(|means| means.mean_axis(Axis(0)));
    let Some(means) = means else {
        return Err(FileError::value(path, "holds no samples"));
    };
    let differences = colours - &means;
    Ok(Residual {
        binder: differences.clone(),
        particles: differences,
        voxel: fitted(longest, voxel),
    })
}
