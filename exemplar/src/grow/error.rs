//! Why nothing can be grown.

/// Stone cannot be grown from this exemplar in this mask around these measurements.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GrowError {
    /// The exemplar holds no whole window.
    #[error(
        "an exemplar of {width} x {height} pixels holds no window of {window} x {window}; use a larger picture or a smaller window"
    )]
    ExemplarTooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Side of the window, pixels.
        window: usize,
    },
    /// The exemplar has one colour.
    #[error("every pixel of the exemplar has the same colour: there is nothing to learn from it")]
    ConstantExemplar,
    /// The exemplar holds NaN or infinity.
    #[error("the exemplar's pixel at row {row}, column {column} is NaN or infinite")]
    NotFinite {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
    },
    /// The window's side is even or out of range.
    #[error("the window's side is 0 (the histogram alone) or an odd number of pixels from 3 to 15, not {window}")]
    Window {
        /// Side asked for.
        window: usize,
    },
    /// The number of voxels is out of range.
    #[error("the mesh's longest side can have 1 to 2,048 voxels, not {resolution}")]
    Resolution {
        /// Voxels asked for.
        resolution: usize,
    },
    /// No voxel centre lies inside.
    #[error("no voxel has its centre inside the mesh: it is thinner than a voxel; use a higher resolution")]
    EmptyMask,
    /// A measured voxel lies outside.
    #[error(
        "measurement {number} at voxel {at:?} (x, y, z) lies outside the mask of {size:?} voxels; remove it, or correct its place"
    )]
    OutsideMask {
        /// Which measurement, from 1.
        number: usize,
        /// Voxel x, y, z.
        at: [usize; 3],
        /// Voxels along x, y, z.
        size: [usize; 3],
    },
    /// Two measurements of one voxel differ.
    #[error(
        "measurements {first} and {second} fall into one voxel {at:?} (x, y, z) with different values, {a:?} and {b:?}; remove one, average them, or use a higher resolution"
    )]
    Contradicting {
        /// First measurement, from 1.
        first: usize,
        /// Second measurement.
        second: usize,
        /// Voxel x, y, z.
        at: [usize; 3],
        /// Value of the first.
        a: Vec<f32>,
        /// Value of the second.
        b: Vec<f32>,
    },
    /// A measurement has another number of channels than the exemplar, or a value that is none.
    #[error(
        "measurement {number} has the values {found:?}; the exemplar has {channels} channel(s), so as many finite numbers are needed"
    )]
    Value {
        /// Which measurement, from 1.
        number: usize,
        /// What was given.
        found: Vec<f32>,
        /// Channels of the exemplar.
        channels: usize,
    },
    /// More than 32 bits can number.
    #[error("the box holds more than 4,294,967,295 voxels, or the exemplar so many samples; use a lower resolution")]
    TooLarge,
    /// Neither seeds nor measurements.
    #[error("nothing to grow from: give measurements, or at least one seed")]
    NoSeeds,
    /// The exemplar cannot be halved so often.
    #[error(
        "an exemplar of {width} x {height} pixels can have 1 to {most} levels with windows of {window} x {window}, not {levels}"
    )]
    Levels {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Side of the window, pixels.
        window: usize,
        /// Levels asked for.
        levels: usize,
        /// Most levels possible.
        most: usize,
    },
    /// The finishing pass cannot be made.
    #[error("the stone cannot be finished: {0}")]
    Finish(crate::SolidError),
    /// The callback broke off.
    #[error("cancelled")]
    Cancelled,
}
