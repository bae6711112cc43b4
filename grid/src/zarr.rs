//! OME-Zarr 0.5: a folder with one array per resolution, each half as fine as the one before, stored in shards of
//! chunks.
//!
//! A shard is 32 slabs thick. It is written as a file of its own as soon as 32 slabs are computed, complete or not at
//! all; an interrupted call resumes after the last 32 slabs whose shards are all complete. The axes are (c, z, y, x),
//! as OME-Zarr places channels before space. Sources: Zarr core specification 3, sharding codec 1.0, OME-Zarr 0.5.

mod levels;
mod metadata;
mod shard;

use crate::atomic::{lock, named, write_atomically};
use crate::element::Element;
use crate::error::GridError;
use crate::names::{destination, exchange, is_temporary, partial_name};
use crate::slabs::Slabs;
use crate::staging::Staging;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;
use levels::Level;
use ndarray::ArrayViewMut3;
use shard::CHUNK;
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Writes all resolutions; with `resume` the complete shards of `NAME.partial` are kept.
pub(crate) fn write<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    shape: &VolumeShape,
    size: &VoxelSize,
    resume: bool,
    mut slabs: Slabs<T, F>,
) -> Result<(), GridError> {
    let folder = PartialFolder::open(path, resume)?;
    let mut levels = Level::<T>::all(folder.path(), shape);
    let shapes: Vec<VolumeShape> = levels.iter().map(|level| level.shape).collect();
    let root = metadata::group(&shapes, shape, size);
    let done = if resume {
        whole_slabs(folder.path(), &root, &levels[0], &mut slabs)?
    } else {
        0
    };
    write_text(&folder.path().join("zarr.json"), &root)?;
    for level in &levels {
        fs::create_dir_all(&level.folder).map_err(GridError::io(path))?;
        write_text(
            &level.folder.join("zarr.json"),
            &metadata::array::<T>(&level.shape, &level.shards()),
        )?;
    }
    for z in (0..done).step_by(CHUNK) {
        // Already written, but the coarser resolutions are computed from them again.
        for slab in levels[0].read_slabs(z)? {
            levels::push(&mut levels, &slab, false)?;
        }
    }
    slabs.each(path, done, |slab| levels::push(&mut levels, slab, true))?;
    folder.publish(path)
}

/// Number of slabs of the finest resolution in complete shards. The metadata and the first and last of these slabs must
/// equal ours.
fn whole_slabs<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    partial: &Path,
    root: &str,
    finest: &Level<T>,
    slabs: &mut Slabs<T, F>,
) -> Result<usize, GridError> {
    let other = || GridError::OtherPartial {
        partial: partial.to_owned(),
    };
    if foreign_file(partial).map_err(GridError::io(partial))?.is_some() {
        return Err(other());
    }
    match fs::read_to_string(partial.join("zarr.json")) {
        Ok(found) if found == root => {}
        Ok(_) => return Err(other()),
        // `zarr.json` is the first file of a volume.
        Err(error)
            if error.kind() == io::ErrorKind::NotFound
                && fs::read_dir(partial).is_ok_and(|mut files| files.next().is_none()) =>
        {
            return Ok(0);
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(other()),
        Err(error) => return Err(GridError::io(partial)(error)),
    }
    let done = finest.whole_slabs();
    if done == 0 {
        return Ok(0);
    }
    for z in [0, done - 1] {
        let theirs = finest.read_slabs(z / CHUNK * CHUNK)?;
        if theirs.get(z % CHUNK).map(Vec::as_slice) != Some(slabs.at(z)?) {
            return Err(other());
        }
    }
    Ok(done)
}

fn write_text(path: &Path, text: &str) -> Result<(), GridError> {
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}

/// The folder that is being filled.
#[derive(Debug)]
enum PartialFolder {
    /// Under a temporary name; removed if dropped before it is published.
    Temporary { staged: Staging, replaces: bool },
    /// `NAME.partial`, locked; kept when dropped.
    Resumable {
        path: PathBuf,
        partial: PathBuf,
        replaces: bool,
        _lock: File,
    },
}

impl PartialFolder {
    fn open(path: &Path, resume: bool) -> Result<Self, GridError> {
        let failed = || GridError::io(path);
        let target = destination(path).map_err(failed())?;
        let replaces = target.exists();
        if replaces {
            refuse_other_folder(path, &target)?;
        }
        if !resume {
            let staged = Staging::beside(path).map_err(failed())?;
            fs::create_dir(staged.path()).map_err(failed())?;
            return Ok(Self::Temporary { staged, replaces });
        }
        let partial = partial_name(&target);
        fs::create_dir_all(&partial).map_err(failed())?;
        let open = File::open(&partial).map_err(failed())?;
        lock(&open, &partial)?;
        remove_temporaries(&partial).map_err(failed())?;
        Ok(Self::Resumable {
            path: target,
            partial,
            replaces,
            _lock: open,
        })
    }

    fn path(&self) -> &Path {
        match self {
            Self::Temporary { staged, .. } => staged.path(),
            Self::Resumable { partial, .. } => partial,
        }
    }

    fn publish(self, path: &Path) -> Result<(), GridError> {
        match self {
            Self::Temporary { mut staged, replaces } => staged.publish(replaces),
            Self::Resumable {
                path,
                partial,
                replaces: false,
                ..
            } => named(&partial, &path, false),
            Self::Resumable { path, partial, .. } => {
                exchange(&partial, &path).and_then(|()| fs::remove_dir_all(&partial))
            }
        }
        .map_err(GridError::io(path))
    }
}

/// Refuses to replace a file, or a folder with anything in it that is not of a Zarr volume of ours.
fn refuse_other_folder(path: &Path, target: &Path) -> Result<(), GridError> {
    let refused = |message: String| {
        Err(GridError::io(path)(io::Error::new(
            io::ErrorKind::AlreadyExists,
            message,
        )))
    };
    if !target.is_dir() {
        return refused("is a file, and no Zarr folder; choose another name".to_owned());
    }
    match foreign_file(target).map_err(GridError::io(path))? {
        None => Ok(()),
        Some(file) => refused(format!(
            "contains {}, which is not of a Zarr volume of this program; move it away, or choose another name",
            file.display()
        )),
    }
}

/// A file or folder inside `folder` that no OME-Zarr folder of ours contains, relative to it.
///
/// # Errors
///
/// If the folder cannot be read.
pub fn foreign_file(folder: &Path) -> io::Result<Option<PathBuf>> {
    foreign_below(folder, Path::new(""))
}

fn foreign_below(folder: &Path, below: &Path) -> io::Result<Option<PathBuf>> {
    let mut entries = fs::read_dir(folder.join(below))?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let inside = below.join(entry.file_name());
        let is_folder = entry.file_type()?.is_dir();
        if !is_of_zarr(&inside, is_folder) {
            return Ok(Some(inside));
        }
        if is_folder && let Some(file) = foreign_below(folder, &inside)? {
            return Ok(Some(file));
        }
    }
    Ok(None)
}

/// Whether [`write`] makes such a file or folder: `zarr.json`, `LEVEL/zarr.json`, `LEVEL/c/0/Z/Y/X`.
fn is_of_zarr(inside: &Path, is_folder: bool) -> bool {
    let is_number = |name: &str| !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_digit());
    let parts: Option<Vec<&str>> = inside.iter().map(std::ffi::OsStr::to_str).collect();
    match parts.as_deref() {
        Some(["zarr.json"]) => !is_folder,
        Some([level]) => is_folder && is_number(level),
        Some([_, "zarr.json"]) => !is_folder,
        Some([_, "c"]) => is_folder,
        Some([_, "c", rest @ ..]) => is_folder == (rest.len() < 4) && rest.iter().all(|part| is_number(part)),
        _ => false,
    }
}

/// Removes temporary files that a killed process left beside files of ours in `NAME.partial`.
fn remove_temporaries(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let of = name.split('.').next().unwrap_or_default();
        if entry.file_type()?.is_dir() {
            remove_temporaries(&entry.path())?;
        } else if is_temporary(&name, "zarr.json") || (of.parse::<u64>().is_ok() && is_temporary(&name, of)) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
