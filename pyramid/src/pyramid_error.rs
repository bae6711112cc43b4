//! Why an image or a volume cannot be taken apart.

/// An image cannot be taken apart as asked.
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
    /// The image is too small for so many levels, or none were asked for.
    #[error("a pyramid of {height} x {width} pixels has 1 to {most} levels, not {asked}")]
    Levels {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
        /// Levels asked for.
        asked: usize,
        /// Most levels possible.
        most: usize,
    },
    /// The number of orientations is out of range.
    #[error("a pyramid has 1 to 32 orientations, not {asked}")]
    Orientations {
        /// Orientations asked for.
        asked: usize,
    },
    /// A distance between samples is not positive, or one is more than 64 times another.
    #[error("distances between samples must be positive and alike within a factor of 64, not {spacing:?}")]
    Spacing {
        /// Distances given, an axis each.
        spacing: Vec<f64>,
    },
    /// The volume is too small for so many levels, or none were asked for.
    #[error(
        "a pyramid of a volume of {shape:?} samples has 1 to {most} levels, not {asked}; each side needs at least 8"
    )]
    VolumeLevels {
        /// Samples along z, y, x.
        shape: [usize; 3],
        /// Levels asked for.
        asked: usize,
        /// Most levels possible.
        most: usize,
    },
    /// The volume has another shape than the pyramid was made for.
    #[error("this pyramid was made for {expected:?} samples (z, y, x), but the volume has {found:?}")]
    VolumeShape {
        /// Samples the pyramid was made for.
        expected: [usize; 3],
        /// Samples of the volume.
        found: [usize; 3],
    },
    /// The volume holds NaN or infinity.
    #[error("the sample at {at:?} (z, y, x) is NaN or infinite")]
    VolumeNotFinite {
        /// Position of the sample.
        at: [usize; 3],
    },
    /// The image has another shape than the pyramid was made for.
    #[error("this pyramid was made for {expected:?} pixels (rows, columns), but the image has {found:?}")]
    Shape {
        /// Rows and columns the pyramid was made for.
        expected: [usize; 2],
        /// Rows and columns of the image.
        found: [usize; 2],
    },
    /// The image holds NaN or infinity.
    #[error("the pixel at row {row}, column {column} is NaN or infinite")]
    NotFinite {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
    },
}
