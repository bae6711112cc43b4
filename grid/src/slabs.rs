//! A volume written one z slab at a time.

use crate::atomic::PartialFile;
use crate::element::Element;
use crate::{Format, GridError, npy, nrrd, tiff_stack, vti};
use ndarray::ArrayViewMut3;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// Voxels along each axis and channels of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeShape {
    /// Voxels along z, the slowest axis in the file: slabs, pages.
    pub nz: usize,
    /// Voxels along y.
    pub ny: usize,
    /// Voxels along x.
    pub nx: usize,
    /// Samples of a voxel: 3 for a colour, 1 for an id.
    pub channels: usize,
}

impl VolumeShape {
    /// Array sizes, slowest first; no channel axis where there is one channel.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        match self.channels {
            1 => vec![self.nz, self.ny, self.nx],
            n => vec![self.nz, self.ny, self.nx, n],
        }
    }

    /// Bytes of the whole and of one slab.
    fn bytes<T: Element>(&self) -> Result<[u64; 2], GridError> {
        let Self { nz, ny, nx, channels } = *self;
        if [nz, ny, nx, channels].contains(&0) {
            return Err(GridError::Empty { nx, ny, nz, channels });
        }
        let slab = [ny, nx, channels]
            .iter()
            .try_fold(size_of::<T>() as u64, |bytes, &n| bytes.checked_mul(n as u64));
        slab.and_then(|slab| Some([slab.checked_mul(nz as u64)?, slab]))
            .ok_or(GridError::Uncountable { nx, ny, nz, channels })
    }
}

/// Writes a volume whose slabs `fill` computes: `fill(z, slab)` is called for z = 0, 1, ..., nz − 1 with a view (y, x, channel) that holds zeros at first and whatever was left in it later.
///
/// `spacing` is the size of a voxel along x, y, z in the unit of length of your choice; .npy has no place for it. Memory: one slab. The file appears under its name when it is whole.
///
/// # Errors
///
/// Before anything is written: [`GridError::Empty`], [`GridError::Uncountable`], [`GridError::Channels`] (VTI and TIFF show 1 or 3), [`GridError::Spacing`], [`GridError::NoRoom`] (the file system has fewer bytes free than the file
/// needs), [`GridError::SlabTooLarge`]. On the way: [`GridError::Cancelled`] if `fill` breaks, [`GridError::Io`]; then nothing is left behind.
///
/// # Examples
///
/// A million voxels along each axis are refused before memory or disk is asked for:
///
/// ```
/// # use std::ops::ControlFlow;
/// use stereology_grid::{Format, GridError, VolumeShape, write_volume};
/// let folder = tempfile::tempdir()?;
/// let shape = VolumeShape { nz: 1_000_000, ny: 1_000_000, nx: 1_000_000, channels: 3 };
/// let refused = write_volume::<u8>(folder.path().join("v.npy"), Format::Npy, shape, [1.0; 3], |_, _| ControlFlow::Continue(()));
/// assert!(matches!(refused, Err(GridError::NoRoom { needed: 3_000_000_000_000_000_128, .. })));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_volume<T: Element>(
    path: impl AsRef<Path>,
    format: Format,
    shape: VolumeShape,
    spacing: [f64; 3],
    mut fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    let path = path.as_ref();
    let [bytes, slab_bytes] = shape.bytes::<T>()?;
    let VolumeShape { nz, channels, .. } = shape;
    if matches!(format, Format::Vti | Format::Tiff) && channels != 1 && channels != 3 {
        return Err(GridError::Channels { format, channels });
    }
    if !spacing.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(GridError::Spacing { spacing });
    }
    let (header, footer) = match format {
        Format::Npy => (npy::header::<T>(&shape), &b""[..]),
        Format::Nrrd => (nrrd::header::<T>(&shape, spacing), &b""[..]),
        Format::Vti => (vti::header::<T>(&shape, spacing, bytes), vti::FOOTER),
        Format::Tiff => (Vec::new(), &b""[..]),
    };
    refuse_without_room(path, bytes.saturating_add((header.len() + footer.len()) as u64))?;

    let mut slab = Vec::new();
    let samples =
        usize::try_from(slab_bytes).map_err(|_| GridError::SlabTooLarge { bytes: slab_bytes })? / size_of::<T>();
    slab.try_reserve_exact(samples)
        .map_err(|_| GridError::SlabTooLarge { bytes: slab_bytes })?;
    slab.resize(samples, T::default());

    let mut file = PartialFile::create(path)?;
    let mut slab_to = |z: usize, write: &mut dyn FnMut(&[T]) -> io::Result<()>| match fill(z, view(&mut slab, &shape)) {
        ControlFlow::Break(()) => Err(GridError::Cancelled),
        ControlFlow::Continue(()) => write(&slab).map_err(GridError::io(path)),
    };
    let out = file.writer();
    if format == Format::Tiff {
        tiff_stack::write(out, path, &shape, spacing, bytes, slab_to)?;
    } else {
        out.write_all(&header).map_err(GridError::io(path))?;
        for z in 0..nz {
            slab_to(z, &mut |samples| T::write(samples, out))?;
        }
        out.write_all(footer).map_err(GridError::io(path))?;
    }
    file.publish()
}

fn view<'a, T>(slab: &'a mut [T], shape: &VolumeShape) -> ArrayViewMut3<'a, T> {
    ArrayViewMut3::from_shape((shape.ny, shape.nx, shape.channels), slab).expect("the slab was made for this shape")
}

/// Refuses a file that its file system cannot hold.
fn refuse_without_room(path: &Path, needed: u64) -> Result<(), GridError> {
    // Where the system does not say how much is free, files end at 2^63 bytes.
    let free = free_bytes(path).unwrap_or(i64::MAX.unsigned_abs());
    if needed > free {
        Err(GridError::NoRoom {
            path: path.to_owned(),
            needed,
            free,
        })
    } else {
        Ok(())
    }
}

#[cfg(unix)]
fn free_bytes(path: &Path) -> Option<u64> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let system = rustix::fs::statvfs(folder).ok().filter(|system| system.f_blocks > 0)?;
    Some(system.f_bavail.saturating_mul(system.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}
