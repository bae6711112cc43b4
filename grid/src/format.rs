//! The file formats and their names.

use std::fmt;

/// A file format of volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// NumPy array file, version 1.0: `.npy`.
    Npy,
    /// Nearly raw raster data with attached raw data: `.nrrd`.
    Nrrd,
    /// VTK XML image data, appended raw: `.vti`.
    Vti,
    /// Uncompressed stack of TIFF pages: `.tif`, `.tiff`.
    Tiff,
    /// HDF5 in the layout of DREAM.3D: `.h5`, `.hdf5`, `.dream3d`.
    Hdf5,
    /// Folder of OME-Zarr 0.5 with several resolutions in shards: `.zarr`.
    Zarr,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 6] = [Self::Npy, Self::Nrrd, Self::Vti, Self::Tiff, Self::Hdf5, Self::Zarr];
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Npy => ".npy",
            Self::Nrrd => ".nrrd",
            Self::Vti => ".vti",
            Self::Tiff => ".tif",
            Self::Hdf5 => ".h5",
            Self::Zarr => ".zarr",
        })
    }
}
