//! The file formats and their names.

use crate::GridError;
use std::fmt;
use std::path::Path;

/// A file format of volumes, known by the extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// NumPy array file, version 1.0: `.npy`.
    Npy,
    /// Nearly raw raster data with attached raw data: `.nrrd`.
    Nrrd,
    /// VTK XML image data, appended raw: `.vti`.
    Vti,
    /// Stack of TIFF pages, uncompressed: `.tif`, `.tiff`.
    Tiff,
    /// HDF5 in the layout of DREAM.3D: `.h5`, `.hdf5`, `.dream3d`.
    Hdf5,
    /// Folder of OME-Zarr 0.5, several resolutions in shards: `.zarr`.
    Zarr,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 6] = [Self::Npy, Self::Nrrd, Self::Vti, Self::Tiff, Self::Hdf5, Self::Zarr];

    /// The format that the extension names; capitals do not matter.
    ///
    /// # Errors
    ///
    /// [`GridError::UnknownFormat`] for any other extension or none.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_grid::Format;
    /// assert_eq!(Format::from_path("out/solid.NRRD")?, Format::Nrrd);
    /// assert!(Format::from_path("solid.raw").is_err());
    /// # Ok::<(), stereology_grid::GridError>(())
    /// ```
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, GridError> {
        let path = path.as_ref();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("npy") => Ok(Self::Npy),
            Some("nrrd") => Ok(Self::Nrrd),
            Some("vti") => Ok(Self::Vti),
            Some("tif" | "tiff") => Ok(Self::Tiff),
            Some("h5" | "hdf5" | "dream3d") => Ok(Self::Hdf5),
            Some("zarr") => Ok(Self::Zarr),
            _ => Err(GridError::UnknownFormat { path: path.to_owned() }),
        }
    }
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
