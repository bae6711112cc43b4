//! What can go wrong with an array in a file.

use crate::Format;
use std::io;
use std::path::{Path, PathBuf};

/// Why an array could not be written or read; the message says what, where and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file that was asked for (not its `.partial`).
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The callback broke off; nothing was left on disk, but the partial volume where it is to be gone on with.
    #[error("cancelled")]
    Cancelled,
    /// What lies half-written is the beginning of another volume.
    #[error("{}: begins another volume than the one asked for; remove it, or do not resume", partial.display())]
    OtherPartial {
        /// The half-written file.
        partial: PathBuf,
    },
    /// The extension names no format of ours.
    #[error("{}: unknown format; use .npy, .nrrd, .vti, .tif, .h5 or .zarr", path.display())]
    UnknownFormat {
        /// The path whose extension it was.
        path: PathBuf,
    },
    /// The extension names no format that is read.
    #[error("{}: volumes are read from .npy, .nrrd and .tif; convert it", path.display())]
    UnreadableFormat {
        /// The path whose extension it was.
        path: PathBuf,
    },
    /// The file holds no volume that can be understood.
    #[error("{}: {reason}", path.display())]
    NotVolume {
        /// The file.
        path: PathBuf,
        /// What is wrong with it and what to do.
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
        /// Channels of a voxel.
        channels: usize,
    },
    /// The number of bytes does not fit in 64 bits.
    #[error("{nx} x {ny} x {nz} voxels of {channels} channels cannot be counted in 64 bits; ask for fewer voxels")]
    Uncountable {
        /// Voxels along x.
        nx: usize,
        /// Voxels along y.
        ny: usize,
        /// Voxels along z.
        nz: usize,
        /// Channels of a voxel.
        channels: usize,
    },
    /// The disk has no room for the file.
    #[error("{}: needs {needed} bytes of disk but {free} are free there; ask for fewer voxels", path.display())]
    NoRoom {
        /// The file that was asked for.
        path: PathBuf,
        /// Bytes of the whole file.
        needed: u64,
        /// Bytes free on its file system.
        free: u64,
    },
    /// One slab does not fit in memory.
    #[error("one slab needs {bytes} bytes of memory, more than there is; ask for fewer voxels in x and y")]
    SlabTooLarge {
        /// Bytes of one slab.
        bytes: u64,
    },
    /// The format cannot hold so many channels.
    #[error("{format} holds 1 or 3 channels, not {channels}; use .npy or .nrrd")]
    Channels {
        /// The format asked for.
        format: Format,
        /// The channels asked for.
        channels: usize,
    },
    /// A spacing is not a positive number.
    #[error("spacing {spacing:?} (x, y, z) must be positive and finite")]
    Spacing {
        /// Spacing along x, y, z.
        spacing: [f64; 3],
    },
    /// The file is not the array that was asked for.
    #[error("{}: {reason}", path.display())]
    NotNpy {
        /// The file.
        path: PathBuf,
        /// What is wrong with it and what to do.
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
