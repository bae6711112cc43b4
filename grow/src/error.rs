//! Reasons why nothing can be grown.

/// Stone cannot be grown from this exemplar in this mask around these measurements.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GrowError {
    /// The exemplar contains no whole window.
    #[error(
        "an exemplar of {width} x {height} pixels contains no window of {window} x {window}; use a larger image or a smaller window"
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
    #[error("every pixel of the exemplar has the same colour: it has no texture")]
    ConstantExemplar,
    /// The exemplar contains NaN or infinity.
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
        /// Side requested.
        window: usize,
    },
    /// The number of voxels is out of range.
    #[error("the mesh's longest side can have 1 to 2,048 voxels, not {resolution}")]
    Resolution {
        /// Voxels requested.
        resolution: usize,
    },
    /// No voxel centre lies inside.
    #[error("no voxel has its centre inside the mesh: it is thinner than a voxel; use a higher resolution")]
    EmptyMask,
    /// A measured voxel lies outside.
    #[error(
        "measurement {number} at voxel (x, y, z) = ({}, {}, {}) lies outside the mask of {} x {} x {} voxels; remove it, or correct its place",
        .at[0], .at[1], .at[2], .size[0], .size[1], .size[2]
    )]
    OutsideMask {
        /// Number of the measurement, from 1.
        number: usize,
        /// Voxel x, y, z.
        at: [usize; 3],
        /// Voxels along x, y, z.
        size: [usize; 3],
    },
    /// Two measurements of one voxel differ.
    #[error(
        "measurements {first} and {second} lie in one voxel, (x, y, z) = ({}, {}, {}), with different values, {a:?} and {b:?}; remove one, average them, or use a higher resolution",
        .at[0], .at[1], .at[2]
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
    /// A measurement has another number of channels than the exemplar, or a value that is not finite.
    #[error(
        "measurement {number} has the values {found:?}; the exemplar has {channels} channel(s), so as many finite numbers are needed"
    )]
    Value {
        /// Number of the measurement, from 1.
        number: usize,
        /// The values given.
        found: Vec<f32>,
        /// Channels of the exemplar.
        channels: usize,
    },
    /// More voxels or samples than 32 bits can number.
    #[error("the box has 4,294,967,295 voxels or more, or the exemplar that many samples; use a lower resolution")]
    TooLarge,
    /// The box needs too much memory.
    #[error(
        "a box of (x, y, z) = {} x {} x {} voxels needs about {bytes} bytes of memory, the limit is {limit}: use a lower resolution or raise the limit",
        .size[2], .size[1], .size[0]
    )]
    Memory {
        /// Voxels along z, y, x.
        size: [usize; 3],
        /// Bytes needed.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// Neither seeds nor measurements.
    #[error("there is no seed: give measurements, or at least one seed")]
    NoSeeds,
    /// The exemplar cannot be halved that often.
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
        /// Levels requested.
        levels: usize,
        /// Most levels possible.
        most: usize,
    },
    /// The progress callback cancelled the work.
    #[error("cancelled")]
    Cancelled,
}
