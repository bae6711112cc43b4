//! OME-Zarr 0.5: a folder with one array per resolution, each half as fine as the one before, stored in shards of
//! chunks.
//!
//! A shard is 32 slabs thick. It is written as a file of its own as soon as 32 slabs are computed, complete or not at
//! all; an interrupted call resumes after the last 32 slabs whose shards are all complete. The axes are (c, z, y, x),
//! as OME-Zarr places channels before space. Sources: Zarr core specification 3, sharding codec 1.0, OME-Zarr 0.5.

mod levels;
mod metadata;
mod shard;

use crate::atomic::{partial_name, write_atomically};
use crate::element::Element;
use crate::error::GridError;
use crate::slabs::Slabs;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;
use levels::Level;
use ndarray::ArrayViewMut3;
use shard::CHUNK;
use std::fs;
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
    let mut levels = Level::<T>::all(&folder.partial, shape);
    let shapes: Vec<VolumeShape> = levels.iter().map(|level| level.shape).collect();
    let root = metadata::group(&shapes, shape, size);
    let done = if resume {
        whole_slabs(&folder.partial, &root, &levels[0], &mut slabs)?
    } else {
        0
    };
    write_text(&folder.partial.join("zarr.json"), &root)?;
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
    folder.publish()
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
    let done = finest.whole_slabs();
    if done == 0 {
        return Ok(0);
    }
    let found = fs::read_to_string(partial.join("zarr.json")).map_err(GridError::io(partial))?;
    if found != root {
        return Err(other());
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

/// `NAME.partial` while it is being filled; removed if dropped before it is published, unless it is to be kept.
struct PartialFolder {
    path: PathBuf,
    partial: PathBuf,
    keep: bool,
}

impl PartialFolder {
    fn open(path: &Path, resume: bool) -> Result<Self, GridError> {
        if path.is_file() || (path.is_dir() && !is_zarr(path)) {
            return Err(GridError::io(path)(io::Error::new(
                io::ErrorKind::AlreadyExists,
                "exists and is no Zarr folder; choose another name",
            )));
        }
        let partial = partial_name(path);
        if partial.exists() && !resume {
            fs::remove_dir_all(&partial).map_err(GridError::io(path))?;
        }
        fs::create_dir_all(&partial).map_err(GridError::io(path))?;
        Ok(Self {
            path: path.to_owned(),
            partial,
            keep: resume,
        })
    }

    fn publish(mut self) -> Result<(), GridError> {
        self.keep = true; // complete: nothing to remove if a rename below fails
        let failed = || GridError::io(&self.path);
        let mut old = self.path.as_os_str().to_owned();
        old.push(".old");
        let old = PathBuf::from(old);
        let replaces = self.path.exists();
        if replaces {
            fs::rename(&self.path, &old).map_err(failed())?;
        }
        fs::rename(&self.partial, &self.path).map_err(failed())?;
        if replaces {
            fs::remove_dir_all(&old).map_err(failed())?;
        }
        Ok(())
    }
}

impl Drop for PartialFolder {
    fn drop(&mut self) {
        if !self.keep {
            // A failed removal cannot be reported from here.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

fn is_zarr(folder: &Path) -> bool {
    folder.join("zarr.json").is_file() || fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none())
}
