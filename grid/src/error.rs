//! Errors of reading and writing arrays.

use crate::format::Format;
use std::io;
use std::path::{Path, PathBuf};

/// Why an array could not be written or read. The message names the file, the cause and a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The operating system reported an error.
    #[error("{}: {source}", path.display())]
    Io {
        /// The requested file (not its `.partial`).
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The callback cancelled the work. Nothing is left on disk, except the partial volume of a resumable call.
    #[error("cancelled")]
    Cancelled,
    /// The partial file is not the beginning of this volume.
    #[error("{}: is not the beginning of this volume; move it away, or do not resume", partial.display())]
    OtherPartial {
        /// The partial file.
        partial: PathBuf,
    },
    /// Another process is writing the partial file.
    #[error("{}: another process is writing it; wait until it ends, or give another name", partial.display())]
    InUse {
        /// The partial file.
        partial: PathBuf,
    },
    /// The extension names no known format.
    #[error("{}: unknown format; use .npy, .nrrd, .vti, .tif, .h5 or .zarr", path.display())]
    UnknownFormat {
        /// The path with that extension.
        path: PathBuf,
    },
    /// The extension names no format that can be read.
    #[error("{}: volumes are read from .npy, .nrrd and .tif; convert it", path.display())]
    UnreadableFormat {
        /// The path with that extension.
        path: PathBuf,
    },
    /// The file contains no readable volume.
    #[error("{}: {reason}", path.display())]
    NotVolume {
        /// The file.
        path: PathBuf,
        /// The fault, and a remedy.
        reason: String,
    },
    /// One of the sizes is zero.
    #[error("a volume needs at least one voxel and one channel, not {nx} x {ny} x {nz} voxels of {channels} channels")]
    Empty {
        /// Voxels along x.
        nx: usize,
        /// Voxels along y.
        ny: usize,
        /// Voxels along z.
        nz: usize,
        /// Channels per voxel.
        channels: usize,
    },
    /// The number of bytes exceeds 64 bits.
    #[error("{nx} x {ny} x {nz} voxels of {channels} channels exceed what 64 bits can count; request fewer voxels")]
    Uncountable {
        /// Voxels along x.
        nx: usize,
        /// Voxels along y.
        ny: usize,
        /// Voxels along z.
        nz: usize,
        /// Channels per voxel.
        channels: usize,
    },
    /// The disk has too little free space.
    #[error("{}: needs {needed} bytes of disk but {free} are free there; request fewer voxels", path.display())]
    NoRoom {
        /// The requested file.
        path: PathBuf,
        /// Bytes of the whole file.
        needed: u64,
        /// Free bytes on its file system.
        free: u64,
    },
    /// One slab does not fit in memory.
    #[error("one slab needs {bytes} bytes of memory, more than there is; request fewer voxels in x and y")]
    SlabTooLarge {
        /// Bytes of one slab.
        bytes: u64,
    },
    /// The format cannot store this number of channels.
    #[error("{format} holds 1 or 3 channels, not {channels}; use .npy or .nrrd")]
    Channels {
        /// The requested format.
        format: Format,
        /// The requested number of channels.
        channels: usize,
    },
    /// A spacing is not a positive number.
    #[error("spacing {spacing:?} (x, y, z) must be positive and finite")]
    Spacing {
        /// Spacing along x, y, z.
        spacing: [f64; 3],
    },
    /// The file is not a `.npy` array of the requested type.
    #[error("{}: {reason}", path.display())]
    NotNpy {
        /// The file.
        path: PathBuf,
        /// The fault, and a remedy.
        reason: String,
    },
}

impl GridError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}
