//! OME-Zarr 0.5: a folder of one array a resolution, each halved from the one before, stored in shards of chunks.
//!
//! A shard is 32 slabs thick, so it is written as soon as 32 slabs are there, as a file of its own that appears whole; a call that was broken off goes on behind the last 32 slabs whose shards are all there. The axes are
//! (c, z, y, x), as OME-Zarr has channels before space. Sources: Zarr core specification 3, sharding codec 1.0, OME-Zarr 0.5.

mod levels;
mod metadata;
mod shard;

use crate::atomic::{partial_name, write_atomically};
use crate::element::Element;
use crate::slabs::Slabs;
use crate::{GridError, VolumeShape};
use levels::Level;
use ndarray::ArrayViewMut3;
use std::fs;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Slabs in a shard, and voxels along each side of a chunk.
const CHUNK: usize = 32;
/// Chunks along y and x in a shard, at most.
const CHUNKS: usize = 16;
/// The coarsest resolution has at most so many voxels along its longest side.
const COARSE: usize = 128;

pub(crate) fn write<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    shape: &VolumeShape,
    spacing: [f64; 3],
    resume: bool,
    mut slabs: Slabs<T, F>,
) -> Result<(), GridError> {
    let folder = PartialFolder::open(path, resume)?;
    let mut levels = Level::<T>::all(&folder.partial, shape);
    let shapes: Vec<VolumeShape> = levels.iter().map(|level| level.shape).collect();
    let root = metadata::group(&shapes, shape, spacing);
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
        // Already written; the coarser resolutions need them again.
        for slab in levels[0].read_slabs(z)? {
            levels::push(&mut levels, &slab, false)?;
        }
    }
    slabs.each(path, done, |slab| levels::push(&mut levels, slab, true))?;
    folder.publish()
}

/// How many slabs of the finest resolution are there in whole shards, the same as ours as far as metadata, first and last slab tell.
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
    let told = fs::read_to_string(partial.join("zarr.json")).map_err(GridError::io(partial))?;
    if told != root {
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

/// `NAME.partial` while it is being filled; removed when dropped before it was published, unless it is to be kept.
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
                "is there and no Zarr folder; choose another name",
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
        self.keep = true; // from here on there is nothing to throw away but what was there before
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
            // There is nobody to tell if the removal fails.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

fn is_zarr(folder: &Path) -> bool {
    folder.join("zarr.json").is_file() || fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none())
}
