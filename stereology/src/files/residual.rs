//! `texture.npy`: the residual volume of a solid, axes (z, y, x, channel), f32; channels 0-2 are the binder's residual,
//! 3-5 that of the particles.

use crate::files::FileError;
use ndarray::{Array4, Axis, Ix4, concatenate};
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Format, VolumeShape, read_npy, write_volume};
use stereology_volume::Residual;

/// Writes `texture.npy`.
///
/// # Errors
///
/// [`FileError`] if it cannot be written, or the residuals of binder and particles differ in size.
pub fn write(path: &Path, residual: &Residual) -> Result<(), FileError> {
    let both = concatenate(Axis(3), &[residual.binder.view(), residual.particles.view()])
        .map_err(|_| FileError::value(path, "the residuals of binder and particles differ in size"))?;
    let (nz, ny, nx, channels) = both.dim();
    let spacing = [residual.voxel; 3];
    let slab = |z: usize, mut slab: ndarray::ArrayViewMut3<'_, f32>| {
        slab.assign(&both.index_axis(Axis(0), z));
        ControlFlow::Continue(())
    };
    Ok(write_volume::<f32>(
        path,
        Format::Npy,
        VolumeShape { nz, ny, nx, channels },
        spacing,
        slab,
    )?)
}

/// Reads `texture.npy`; `voxel` is the edge of a voxel.
///
/// # Errors
///
/// [`FileError`] if it cannot be read, or is not a residual volume.
pub fn read(path: &Path, voxel: f64) -> Result<Residual, FileError> {
    let both: Array4<f32> = read_npy::<f32>(path)?
        .into_dimensionality::<Ix4>()
        .ok()
        .filter(|array| array.dim().3 == 6)
        .ok_or_else(|| FileError::value(path, "not a residual volume: axes (z, y, x, 6) are expected"))?;
    let (nz, ny, nx, _) = both.dim();
    let both = both.as_standard_layout();
    let part = |from: usize| {
        let voxels = both.as_slice().unwrap_or_default().as_chunks::<6>().0.iter();
        let samples: Vec<[f32; 3]> = voxels
            .map(|both| [both[from], both[from + 1], both[from + 2]])
            .collect();
        Array4::from_shape_vec((nz, ny, nx, 3), samples.into_flattened())
    };
    let (binder, particles) = rayon::join(|| part(0), || part(3));
    let damaged = |error| FileError::value(path, error);
    Ok(Residual {
        binder: binder.map_err(damaged)?,
        particles: particles.map_err(damaged)?,
        voxel,
    })
}
