//! The format that a file's extension names.

use crate::error::GridError;
use crate::format::Format;
use std::path::Path;

impl Format {
    /// The format that the extension names; upper and lower case are equal.
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
