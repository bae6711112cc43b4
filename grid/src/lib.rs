//! Arrays in files: NumPy, NRRD, VTK image data, TIFF stacks, HDF5, OME-Zarr; written slab by slab and renamed when whole.
//!
//! A solid of 2048³ voxels does not fit in memory and takes an hour to compute. [`write_volume`] asks for one z slab at a time, so memory holds one slab whatever the number of slabs, and writes to
//! `FILE.partial`, which becomes `FILE` when the last slab is in: a reader never sees half a volume, and an error or a cancelled call leaves nothing behind. [`write_atomically`] gives the same promise to any
//! other file.
//!
//! Every format holds the same samples in the same order: z slowest, then y, then x, then the channel, little-endian.
//!
//! | format | what a reader sees | read by |
//! |---|---|---|
//! | [`Format::Npy`] | array of shape (nz, ny, nx, channels), or (nz, ny, nx) for one channel | NumPy |
//! | [`Format::Nrrd`] | sizes `channels nx ny nz`, or `nx ny nz`; voxel centres at (i + ½) spacing | 3D Slicer, pynrrd, ITK |
//! | [`Format::Vti`] | one cell array, `rgb` for 3 channels, else `values`; the grid spans nx, ny, nz cells from the origin | ParaView, VTK |
//! | [`Format::Tiff`] | a page a z, with ImageJ's spacing; BigTIFF where 4 GB do not suffice | ImageJ, Fiji, tifffile |
//! | [`Format::Hdf5`] | DREAM.3D's image geometry with one cell array (nz, ny, nx, channels): `rgb`, `FeatureIds` of `u32` (as i32: below 2³¹), else `values` | DREAM.3D, h5py |
//! | [`Format::Zarr`] | OME-Zarr 0.5, arrays (channel, z, y, x) of halved resolutions, 32³ chunks in shards; colours and distances are means, ids and categories are thinned out | napari, zarr-python |
//!
//! Voxels are cells, not points: voxel (i, j, k) covers [i, i+1] × [j, j+1] × [k, k+1] times the spacing. In VTK that is cell data, so ids are never interpolated between particles.
//!
//! [`read_volume`] reads `.npy`, `.nrrd` and `.tif` of any sample type, whichever program wrote them (feature `read`, on by default).
//!
//! # A ramp, slab by slab
//!
//! ```
//! use std::ops::ControlFlow;
//! use stereology_grid::{Format, VolumeShape, read_npy, write_volume};
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! let file = folder.join("ramp.npy");
//! let shape = VolumeShape { nz: 4, ny: 3, nx: 2, channels: 1 };
//! write_volume::<f32>(&file, Format::Npy, shape, [1.0; 3], |z, mut slab| {
//!     slab.fill(z as f32);
//!     ControlFlow::Continue(())
//! })?;
//! let ramp = read_npy::<f32>(&file)?;
//! assert_eq!(ramp.shape(), [4, 3, 2]);
//! assert_eq!(ramp[[3, 0, 0]], 3.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A text file, whole or not at all
//!
//! ```
//! use std::io::Write;
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! let file = folder.join("profiles.csv");
//! stereology_grid::write_atomically(&file, |out| writeln!(out, "size"))?;
//! assert_eq!(std::fs::read_to_string(file)?, "size\n");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What was rejected
//!
//! `vtkio` keeps the spacing as f32; `ndarray-npy` needs the whole array in memory to write it, and asks for the memory a header promises before it looks whether the file holds the data: 60 bytes of a damaged file
//! abort the program. The HDF5 and Zarr libraries want the whole
//! array in memory, or a C compiler. So every format is written here, as what stands before the samples and what behind them, which also lets a volume that was broken off be gone on with ([`resume_volume`]); all are checked
//! with the real readers.

mod atomic;
mod dream3d;
mod element;
mod error;
mod format;
mod frame;
mod hdf5;
mod npy;
mod nrrd;
#[cfg(feature = "read")]
mod nrrd_reader;
#[cfg(feature = "read")]
mod read_volume;
#[cfg(feature = "read")]
mod sample_type;
mod slabs;
#[cfg(feature = "read")]
mod tiff_reader;
mod tiff_stack;
mod vti;
mod zarr;

pub use atomic::write_atomically;
pub use element::Element;
pub use error::GridError;
pub use format::Format;
pub use npy::read_npy;
#[cfg(feature = "read")]
pub use read_volume::{StoredVolume, read_volume};
#[cfg(feature = "read")]
pub use sample_type::SampleType;
pub use slabs::{VolumeShape, resume_volume, write_volume};
