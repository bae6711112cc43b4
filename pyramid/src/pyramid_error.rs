//! Errors of the pyramids.

/// Why an image or a volume cannot be decomposed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PyramidError {
    /// The image is too small for a single level.
    #[error("an image of {height} x {width} pixels is too small for a pyramid: it needs at least 8 x 8")]
    TooSmall {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
    },
    /// The image is too small for this number of levels, or the number is zero.
    #[error("a pyramid of {height} x {width} pixels has 1 to {most} levels, not {requested}")]
    Levels {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
        /// Requested levels.
        requested: usize,
        /// Largest possible number of levels.
        most: usize,
    },
    /// The number of orientations is out of range.
    #[error("a pyramid has 1 to 32 orientations, not {requested}")]
    Orientations {
        /// Requested orientations.
        requested: usize,
    },
    /// A distance between samples is not positive, or one is more than 64 times another.
    #[error("distances between samples must be positive and differ by at most a factor of 64, not {spacing:?}")]
    Spacing {
        /// Given distances, one per axis.
        spacing: Vec<f64>,
    },
    /// The volume is too small for this number of levels, or the number is zero.
    #[error(
        "a pyramid of a volume of {shape:?} samples has 1 to {most} levels, not {requested}; each side needs at least 8"
    )]
    VolumeLevels {
        /// Samples along z, y, x.
        shape: [usize; 3],
        /// Requested levels.
        requested: usize,
        /// Largest possible number of levels.
        most: usize,
    },
    /// The volume does not have the shape of the pyramid.
    #[error("this pyramid is for {expected:?} samples (z, y, x), but the volume has {found:?}")]
    VolumeShape {
        /// Samples of the pyramid.
        expected: [usize; 3],
        /// Samples of the volume.
        found: [usize; 3],
    },
    /// The volume contains NaN or infinity.
    #[error("the sample at {at:?} (z, y, x) is NaN or infinite")]
    VolumeNotFinite {
        /// Position of the sample.
        at: [usize; 3],
    },
    /// The image does not have the shape of the pyramid.
    #[error("this pyramid is for {expected:?} pixels (rows, columns), but the image has {found:?}")]
    Shape {
        /// Rows and columns of the pyramid.
        expected: [usize; 2],
        /// Rows and columns of the image.
        found: [usize; 2],
    },
    /// The image contains NaN or infinity.
    #[error("the pixel at row {row}, column {column} is NaN or infinite")]
    NotFinite {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
    },
}
