//! Arrays in files: NumPy, NRRD, VTK image data, TIFF stacks, HDF5, OME-Zarr; written slab by slab and renamed when
//! complete.
//!
//! A solid of 2048³ voxels does not fit in memory and takes an hour to compute. [`write_volume`] computes and writes
//! one z slab at a time, so the memory does not depend on the number of slabs. It writes under a temporary name that no
//! other file has, and renames after the last slab: a reader never sees half a volume, and an error or a cancelled call
//! leaves nothing behind. [`write_atomically`] does the same for any other file, and [`Staging`] for a folder.
//!
//! Every format holds the same samples in the same order: z slowest, then y, then x, then the channel, little-endian.
//!
//! | format | what a reader sees | read by |
//! |---|---|---|
//! | [`Format::Npy`] | array of shape (nz, ny, nx, channels), or (nz, ny, nx) for one channel | NumPy |
//! | [`Format::Nrrd`] | sizes `channels nx ny nz`, or `nx ny nz`; voxel centres at (i + ½) spacing | 3D Slicer, pynrrd, ITK |
//! | [`Format::Vti`] | one cell array, `rgb` for 3 channels, else `values`; the grid spans nx, ny, nz cells from the origin | ParaView, VTK |
//! | [`Format::Tiff`] | one page per z slice, with ImageJ's spacing; BigTIFF above 4 GB | ImageJ, Fiji, tifffile |
//! | [`Format::Hdf5`] | DREAM.3D's image geometry with one cell array (nz, ny, nx, channels): `rgb`, `FeatureIds` of `u32` (as i32: below 2³¹), else `values` | DREAM.3D, h5py |
//! | [`Format::Zarr`] | OME-Zarr 0.5, arrays (channel, z, y, x) of halved resolutions, 32³ chunks in shards; colours and distances are averaged, ids and categories subsampled | napari, zarr-python |
//!
//! The unit of length ([`LengthUnit`]) is stored as `space units` in NRRD, as a field `unit` in VTK, as the resolution
//! unit in TIFF (inch or centimetre, to which lengths are converted) and as the unit of the axes in OME-Zarr.
//!
//! Voxels are cells, not points: voxel (i, j, k) covers [i, i+1] × [j, j+1] × [k, k+1] times the spacing. In VTK they
//! are cell data, so ids are never interpolated between particles.
//!
//! [`read_volume`] reads `.npy`, `.nrrd` and `.tif` of any sample type from any program (feature `read`, on by
//! default).
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
//! # A text file, complete or absent
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
//! `vtkio` stores the spacing as f32. `ndarray-npy` needs the whole array in memory to write it, and allocates the
//! memory that a header claims before it checks the length of the file: a damaged file of 60 bytes aborts the program.
//! The HDF5 and Zarr libraries need the whole array in memory, or a C compiler. So every format is written here as raw
//! samples between a head and a tail, which also lets an interrupted write be resumed ([`resume_volume`]). The tests
//! read HDF5, TIFF and .npy back with other crates; all formats were checked with the programs in the table.

mod atomic;
mod disk_room;
mod dream3d;
mod element;
mod error;
mod extension;
mod format;
mod frame;
mod framed;
mod hdf5;
mod length_unit;
mod names;
mod npy;
mod nrrd;
#[cfg(feature = "read")]
mod nrrd_reader;
#[cfg(feature = "read")]
mod read_volume;
#[cfg(feature = "read")]
mod sample_type;
mod slabs;
mod staging;
#[cfg(feature = "read")]
mod tiff_reader;
mod tiff_stack;
mod volume_shape;
mod voxel_size;
mod vti;
mod write_volume;
mod zarr;

pub use atomic::write_atomically;
pub use element::Element;
pub use error::GridError;
pub use format::Format;
pub use length_unit::{LengthUnit, LengthUnitError};
pub use names::{destination, exchange, give_name};
pub use npy::read_npy;
#[cfg(feature = "read")]
pub use read_volume::{StoredVolume, read_volume};
#[cfg(feature = "read")]
pub use sample_type::SampleType;
pub use staging::Staging;
pub use volume_shape::VolumeShape;
pub use voxel_size::VoxelSize;
pub use write_volume::{resume_volume, write_volume};
pub use zarr::foreign_file as foreign_file_in_zarr;
