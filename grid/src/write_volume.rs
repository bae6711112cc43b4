//! A volume written to a file of any format, one z slab at a time, and resumed after an interruption.

use crate::disk_room::{bytes_in, refuse_without_room};
use crate::element::Element;
use crate::error::GridError;
use crate::format::Format;
use crate::frame::Frame;
use crate::names::partial_name;
use crate::slabs::Slabs;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;
use crate::{framed, zarr};
use ndarray::ArrayViewMut3;
use std::ops::ControlFlow;
use std::path::Path;

/// Writes a volume whose slabs `fill` computes.
///
/// `fill(z, slab)` is called for z = 0, 1, ..., nz − 1 with a view (y, x, channel). At first the view holds zeros,
/// later the samples of an earlier slab. `size` is the size of a voxel along x, y, z, with its unit if it has one; .npy
/// stores neither, HDF5 no unit. One slab is written while the next is computed. Memory: two slabs; for Zarr 32 more,
/// and 32 of each coarser resolution. The file appears under its name when it is complete.
///
/// # Errors
///
/// Before anything is written: [`GridError::Empty`], [`GridError::Uncountable`], [`GridError::Channels`] (VTI, TIFF and
/// Zarr hold 1 or 3), [`GridError::Spacing`], [`GridError::NoRoom`] (the file system has fewer bytes free than the file
/// needs), [`GridError::SlabTooLarge`]. While writing: [`GridError::Cancelled`] if `fill` breaks, [`GridError::Io`];
/// nothing is left on disk then.
///
/// # Examples
///
/// A million voxels along each axis are refused before any memory or disk space is used:
///
/// ```
/// # use std::ops::ControlFlow;
/// use stereology_grid::{Format, GridError, VolumeShape, write_volume};
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("v.npy");
/// let shape = VolumeShape { nz: 1_000_000, ny: 1_000_000, nx: 1_000_000, channels: 3 };
/// let refused = write_volume::<u8>(file, Format::Npy, shape, [1.0; 3], |_, _| ControlFlow::Continue(()));
/// assert!(matches!(refused, Err(GridError::NoRoom { needed: 3_000_000_000_000_000_000, .. })));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_volume<T: Element>(
    path: impl AsRef<Path>,
    format: Format,
    shape: VolumeShape,
    size: impl Into<VoxelSize>,
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    write(path.as_ref(), format, shape, size.into(), false, fill)
}

/// Writes a volume as [`write_volume`] does, but continues `FILE.partial` if it exists, and keeps it if the call is
/// cancelled or fails. Until then it is locked, so that no other process continues it too. A file called `path` that
/// appears in the meantime is not replaced.
///
/// `FILE.partial` must be the beginning of the same volume: its head is compared, and its first and last complete slab
/// with what `fill` computes for them. So `fill` is called for those two slabs, then for every missing slab. The
/// resulting file equals one written without interruption.
///
/// # Errors
///
/// As [`write_volume`]; [`GridError::OtherPartial`] if `FILE.partial` is anything but the beginning of this volume,
/// which is left as it is; [`GridError::InUse`] if another process is writing it.
///
/// # Examples
///
/// ```
/// # use std::ops::ControlFlow;
/// use stereology_grid::{Format, GridError, VolumeShape, resume_volume};
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("ramp.nrrd");
/// let shape = VolumeShape { nz: 100, ny: 4, nx: 4, channels: 1 };
/// let write_up_to = |end: usize| {
///     resume_volume::<f32>(&file, Format::Nrrd, shape, [1.0; 3], |z, mut slab| {
///         slab.fill(z as f32);
///         if z < end { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
///     })
/// };
/// assert!(matches!(write_up_to(60), Err(GridError::Cancelled)));
/// assert!(!file.exists());
/// write_up_to(100)?; // computes slabs 0 and 59 again, and 60 to 99
/// assert!(file.exists());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn resume_volume<T: Element>(
    path: impl AsRef<Path>,
    format: Format,
    shape: VolumeShape,
    size: impl Into<VoxelSize>,
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    write(path.as_ref(), format, shape, size.into(), true, fill)
}

fn write<T: Element>(
    path: &Path,
    format: Format,
    shape: VolumeShape,
    size: VoxelSize,
    resume: bool,
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    let [bytes, slab_bytes] = shape.bytes::<T>()?;
    let channels = shape.channels;
    if !matches!(format, Format::Npy | Format::Nrrd | Format::Hdf5) && channels != 1 && channels != 3 {
        return Err(GridError::Channels { format, channels });
    }
    if !size.sides.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(GridError::Spacing { spacing: size.sides });
    }
    let held = if resume { bytes_in(&partial_name(path)) } else { 0 };
    // Checked before the frame is built: the directories of a TIFF's pages, as many as slabs, would fill the memory.
    refuse_without_room(path, bytes.saturating_sub(held))?;
    let frame = Frame::of::<T>(format, &shape, &size, bytes);
    let around = frame.as_ref().map_or(0, Frame::length);
    refuse_without_room(path, bytes.saturating_add(around).saturating_sub(held))?;
    let slabs = Slabs::new(shape, slab_bytes, fill)?;
    match frame {
        None => zarr::write(path, &shape, &size, resume, slabs),
        Some(frame) => framed::write(path, &frame, slab_bytes, resume, slabs),
    }
}
