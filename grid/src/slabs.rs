//! A volume written one z slab at a time, and gone on with where it was broken off.

use crate::atomic::{PartialFile, partial_name};
use crate::element::Element;
use crate::frame::Frame;
use crate::{Format, GridError, zarr};
use ndarray::ArrayViewMut3;
use std::fs;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc;
use std::thread;

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
/// `spacing` is the size of a voxel along x, y, z in the unit of length of your choice; .npy has no place for it. One slab is written while the next is computed. Memory: two slabs; for Zarr 32 more, and as many of each coarser resolution. The file appears under its name
/// when it is whole.
///
/// # Errors
///
/// Before anything is written: [`GridError::Empty`], [`GridError::Uncountable`], [`GridError::Channels`] (VTI, TIFF and Zarr show 1 or 3), [`GridError::Spacing`], [`GridError::NoRoom`] (the file system has fewer bytes free than the file
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
/// assert!(matches!(refused, Err(GridError::NoRoom { needed: 3_000_000_000_000_000_000, .. })));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_volume<T: Element>(
    path: impl AsRef<Path>,
    format: Format,
    shape: VolumeShape,
    spacing: [f64; 3],
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    write(path.as_ref(), format, shape, spacing, false, fill)
}

/// Writes a volume as [`write_volume`] does, goes on from `FILE.partial` if there is one, and leaves it there if the call is broken off or fails.
///
/// What is there must be the beginning of the same volume: its head is compared, and its first and its last whole slab with what `fill` gives for them. So `fill` is called for those two, and then for every slab that is missing.
/// The file is the same as one written at a stretch.
///
/// # Errors
///
/// As [`write_volume`], and [`GridError::OtherPartial`] if `FILE.partial` is the beginning of another volume.
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
    spacing: [f64; 3],
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    write(path.as_ref(), format, shape, spacing, true, fill)
}

fn write<T: Element>(
    path: &Path,
    format: Format,
    shape: VolumeShape,
    spacing: [f64; 3],
    resume: bool,
    fill: impl FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>,
) -> Result<(), GridError> {
    let [bytes, slab_bytes] = shape.bytes::<T>()?;
    let channels = shape.channels;
    if !matches!(format, Format::Npy | Format::Nrrd | Format::Hdf5) && channels != 1 && channels != 3 {
        return Err(GridError::Channels { format, channels });
    }
    if !spacing.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(GridError::Spacing { spacing });
    }
    let held = if resume { bytes_in(&partial_name(path)) } else { 0 };
    // Directories of a TIFF's pages are not made for a volume that cannot be: there may be 2^64 of them.
    refuse_without_room(path, bytes.saturating_sub(held))?;
    let frame = Frame::of::<T>(format, &shape, spacing, bytes);
    let around = frame.as_ref().map_or(0, Frame::length);
    refuse_without_room(path, bytes.saturating_add(around).saturating_sub(held))?;
    let slabs = Slabs::new(shape, slab_bytes, fill)?;
    match frame {
        None => zarr::write(path, &shape, spacing, resume, slabs),
        Some(frame) => write_framed(path, &frame, slab_bytes, resume, slabs),
    }
}

/// Where slabs come from.
pub(crate) struct Slabs<T, F> {
    shape: VolumeShape,
    slab: Vec<T>,
    /// Filled while the other is written.
    next: Vec<T>,
    fill: F,
}

impl<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>> Slabs<T, F> {
    fn new(shape: VolumeShape, bytes: u64, fill: F) -> Result<Self, GridError> {
        let samples = usize::try_from(bytes).map_err(|_| GridError::SlabTooLarge { bytes })? / size_of::<T>();
        let slab = || {
            let mut slab = Vec::new();
            slab.try_reserve_exact(samples)
                .map_err(|_| GridError::SlabTooLarge { bytes })?;
            slab.resize(samples, T::default());
            Ok(slab)
        };
        let (slab, next) = (slab()?, slab()?);
        Ok(Self {
            shape,
            slab,
            next,
            fill,
        })
    }

    /// The samples of the slab at z.
    pub(crate) fn at(&mut self, z: usize) -> Result<&[T], GridError> {
        let VolumeShape { ny, nx, channels, .. } = self.shape;
        let view =
            ArrayViewMut3::from_shape((ny, nx, channels), &mut self.slab).expect("the slab was made for this shape");
        match (self.fill)(z, view) {
            ControlFlow::Break(()) => Err(GridError::Cancelled),
            ControlFlow::Continue(()) => Ok(&self.slab),
        }
    }

    /// Hands over the slabs from z = `first` on. `take` works on each while the next one is computed; it has had all that were computed when this returns.
    pub(crate) fn each(
        mut self,
        path: &Path,
        first: usize,
        mut take: impl FnMut(&[T]) -> Result<(), GridError> + Send,
    ) -> Result<(), GridError> {
        let (full, filled) = mpsc::channel::<Vec<T>>();
        let (empty, emptied) = mpsc::channel();
        let mut next = Some(std::mem::take(&mut self.next));
        let taking = move || {
            for slab in filled {
                take(&slab)?;
                // Nobody waits for the last ones.
                let _ = empty.send(slab);
            }
            Ok(())
        };
        thread::scope(|scope| {
            let taker = thread::Builder::new()
                .spawn_scoped(scope, taking)
                .map_err(GridError::io(path))?;
            let mut computed = Ok(());
            for z in first..self.shape.nz {
                if let Err(stopped) = self.at(z) {
                    computed = Err(stopped);
                    break;
                }
                // A taker that failed is gone, and says why itself.
                let Some(empty) = next.take().or_else(|| emptied.recv().ok()) else {
                    break;
                };
                if full.send(std::mem::replace(&mut self.slab, empty)).is_err() {
                    break;
                }
            }
            drop(full);
            let taken = taker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            taken.and(computed)
        })
    }
}

fn write_framed<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    frame: &Frame,
    slab_bytes: u64,
    resume: bool,
    mut slabs: Slabs<T, F>,
) -> Result<(), GridError> {
    let (mut file, done) = if resume {
        let mut file = PartialFile::reopen(path)?;
        let done = whole_slabs(path, &mut file, frame, slab_bytes, &mut slabs)?;
        (file, done)
    } else {
        (PartialFile::create(path)?, 0)
    };
    let failed = || GridError::io(path);
    if done == 0 {
        file.cut_to(0)?;
        file.writer().write_all(&frame.head).map_err(failed())?;
    } else {
        file.cut_to(frame.head.len() as u64 + done as u64 * slab_bytes)?;
    }
    slabs.each(path, done, |slab| T::write(slab, file.writer()).map_err(failed()))?;
    file.writer().write_all(&frame.tail).map_err(failed())?;
    file.publish()
}

/// How many slabs of `FILE.partial` are there, the same as ours as far as head, first and last slab tell.
fn whole_slabs<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    file: &mut PartialFile,
    frame: &Frame,
    slab_bytes: u64,
    slabs: &mut Slabs<T, F>,
) -> Result<usize, GridError> {
    let head = frame.head.len() as u64;
    let length = file.writer().get_ref().metadata().map_err(GridError::io(path))?.len();
    if length < head + slab_bytes {
        return Ok(0);
    }
    let whole = usize::try_from((length - head) / slab_bytes).unwrap_or(usize::MAX);
    let done = whole.min(slabs.shape.nz);
    let mut is_there = |at: u64, ours: &[u8]| {
        let mut theirs = vec![0; ours.len()];
        let from = file.writer().get_mut();
        from.seek(SeekFrom::Start(at))
            .and_then(|_| from.read_exact(&mut theirs))
            .map_err(GridError::io(path))?;
        if theirs == ours {
            return Ok(());
        }
        let partial = partial_name(path);
        Err(GridError::OtherPartial { partial })
    };
    is_there(0, &frame.head)?;
    for z in [0, done - 1] {
        let mut ours = Vec::new();
        T::write(slabs.at(z)?, &mut ours).map_err(GridError::io(path))?;
        is_there(head + z as u64 * slab_bytes, &ours)?;
    }
    Ok(done)
}

/// Bytes of a file, or of all files in a folder.
fn bytes_in(path: &Path) -> u64 {
    match fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| bytes_in(&entry.path())).sum(),
        Err(_) => fs::metadata(path).map_or(0, |file| file.len()),
    }
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
