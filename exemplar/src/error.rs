//! Reasons why a solid cannot be made.

/// A solid cannot be made from these exemplars in this domain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// The exemplar is smaller than the neighbourhood.
    #[error(
        "an exemplar of {height} x {width} pixels has fewer than four neighbourhoods of {side} x {side}: use a larger image or a smaller neighbourhood"
    )]
    ExemplarTooSmall {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
        /// Side of the neighbourhood.
        side: usize,
    },
    /// The exemplar is too large.
    #[error("an exemplar of {height} x {width} pixels: each side may have at most 16,384 pixels")]
    ExemplarTooLarge {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
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
    /// Exemplars, or the parts of one, do not match.
    #[error("{what}")]
    Mismatch {
        /// Description of the mismatch.
        what: String,
    },
    /// The number of exemplars is not one, two or three.
    #[error("a solid is made from one, two or three exemplars, not {found}")]
    Exemplars {
        /// Exemplars given.
        found: usize,
    },
    /// The neighbourhood's side is even or out of range.
    #[error("the neighbourhood's side is an odd number of pixels from 3 to 15, not {side}")]
    Neighbourhood {
        /// Side requested.
        side: usize,
    },
    /// The number of levels is out of range.
    #[error(
        "with this exemplar, size and neighbourhood of {side} x {side} there are 1 to {most} levels, not {asked}: at the coarsest level the exemplar must have four neighbourhoods and the solid two voxels along each side"
    )]
    Levels {
        /// Levels requested.
        asked: usize,
        /// Most levels possible.
        most: usize,
        /// Side of the neighbourhood.
        side: usize,
    },
    /// Another option is out of range.
    #[error("{option} must be {range}, not {asked}")]
    Option {
        /// The option.
        option: &'static str,
        /// Its allowed range.
        range: &'static str,
        /// Value requested.
        asked: usize,
    },
    /// The solid is too small or too large.
    #[error(
        "a solid of (x, y, z) = {} x {} x {} voxels: every side must have 2 to 4,096 voxels, and the whole solid fewer than 2^31",
        .size[2], .size[1], .size[0]
    )]
    Size {
        /// Voxels along z, y, x.
        size: [usize; 3],
    },
    /// The solid needs too much memory.
    #[error(
        "a solid of (x, y, z) = {} x {} x {} voxels needs about {bytes} bytes of memory, the limit is {limit}: use fewer voxels or raise the limit",
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
    /// No voxel lies inside the mask.
    #[error("the mask contains no voxel: nothing can be made inside it")]
    EmptyMask,
    /// The mask has another shape than the solid.
    #[error(
        "the mask has (x, y, z) = {} x {} x {} voxels, the solid {} x {} x {}",
        .found[2], .found[1], .found[0], .size[2], .size[1], .size[0]
    )]
    MaskShape {
        /// Voxels of the mask along z, y, x.
        found: [usize; 3],
        /// Voxels of the solid along z, y, x.
        size: [usize; 3],
    },
    /// A fixed voxel lies outside the solid.
    #[error(
        "the fixed voxel (x, y, z) = ({}, {}, {}) lies outside the solid of {} x {} x {} voxels",
        .at[2], .at[1], .at[0], .size[2], .size[1], .size[0]
    )]
    FixedOutside {
        /// Voxel z, y, x.
        at: [usize; 3],
        /// Voxels of the solid along z, y, x.
        size: [usize; 3],
    },
    /// A fixed voxel lies outside the mask.
    #[error(
        "the fixed voxel (x, y, z) = ({}, {}, {}) lies outside the mask: remove it, or enlarge the mask",
        .at[2], .at[1], .at[0]
    )]
    FixedOutsideMask {
        /// Voxel z, y, x.
        at: [usize; 3],
    },
    /// A voxel is given two values.
    #[error(
        "the fixed voxel (x, y, z) = ({}, {}, {}) is given twice, with different values: {first:?} and {second:?}",
        .at[2], .at[1], .at[0]
    )]
    FixedTwice {
        /// Voxel z, y, x.
        at: [usize; 3],
        /// Its first value.
        first: Vec<f32>,
        /// Its second value.
        second: Vec<f32>,
    },
    /// A fixed voxel has the wrong number of channels, or a value that is not finite.
    #[error(
        "the fixed voxel (x, y, z) = ({}, {}, {}) needs {channels} finite value(s), not {found:?}",
        .at[2], .at[1], .at[0]
    )]
    FixedValue {
        /// Voxel z, y, x.
        at: [usize; 3],
        /// Channels of the exemplars.
        channels: usize,
        /// The values given.
        found: Vec<f32>,
    },
    /// The progress callback cancelled the work.
    #[error("cancelled")]
    Cancelled,
}
