//! Why a solid cannot be made.

/// A solid cannot be made from these exemplars in this domain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// The exemplar is smaller than the neighbourhood.
    #[error(
        "an exemplar of {height} x {width} pixels has fewer than four neighbourhoods of {side} x {side}: use a larger picture or a smaller neighbourhood"
    )]
    ExemplarTooSmall {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
        /// Side of the neighbourhood.
        side: usize,
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
    /// Exemplars, or what belongs to one, do not fit together.
    #[error("{what}")]
    Mismatch {
        /// What does not fit what.
        what: String,
    },
    /// Neither one, two nor three exemplars.
    #[error("a solid is made from one, two or three exemplars, not {found}")]
    Exemplars {
        /// Exemplars given.
        found: usize,
    },
    /// The neighbourhood's side is even or out of range.
    #[error("the neighbourhood's side is an odd number of pixels from 3 to 15, not {side}")]
    Neighbourhood {
        /// Side asked for.
        side: usize,
    },
    /// The number of levels is out of range.
    #[error(
        "with this exemplar, size and neighbourhood of {side} x {side} there are 1 to {most} levels, not {asked}: at the coarsest, the exemplar must keep four neighbourhoods and the solid two voxels a side"
    )]
    Levels {
        /// Levels asked for.
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
        /// What it may be.
        range: &'static str,
        /// What was asked for.
        asked: usize,
    },
    /// The solid is too small or too large.
    #[error(
        "a solid of {size:?} voxels (z, y, x): every side must have 2 to 4,096 voxels, and all together fewer than 2^31"
    )]
    Size {
        /// Voxels along z, y, x.
        size: [usize; 3],
    },
    /// No voxel lies inside the mask.
    #[error("the mask holds no voxel: nothing can be made inside it")]
    EmptyMask,
    /// The mask has another shape than the solid.
    #[error("the mask has {found:?} voxels (z, y, x), the solid {size:?}")]
    MaskShape {
        /// Voxels of the mask.
        found: [usize; 3],
        /// Voxels of the solid.
        size: [usize; 3],
    },
    /// A given voxel lies outside the solid.
    #[error("the voxel given at {at:?} (z, y, x) lies outside the solid of {size:?}")]
    FixedOutside {
        /// Voxel.
        at: [usize; 3],
        /// Voxels of the solid.
        size: [usize; 3],
    },
    /// A given voxel lies outside the mask.
    #[error("the voxel given at {at:?} (z, y, x) lies outside the mask: remove it, or widen the mask")]
    FixedOutsideMask {
        /// Voxel.
        at: [usize; 3],
    },
    /// A voxel is given two values.
    #[error("the voxel at {at:?} (z, y, x) is given twice, with different values: {first:?} and {second:?}")]
    FixedTwice {
        /// Voxel.
        at: [usize; 3],
        /// Its first value.
        first: Vec<f32>,
        /// Its second value.
        second: Vec<f32>,
    },
    /// A given voxel has the wrong number of channels, or a value that is none.
    #[error("the voxel given at {at:?} (z, y, x) needs {channels} finite value(s): {found:?}")]
    FixedValue {
        /// Voxel.
        at: [usize; 3],
        /// Channels of the exemplars.
        channels: usize,
        /// What was given.
        found: Vec<f32>,
    },
    /// The progress function said break.
    #[error("cancelled")]
    Cancelled,
}
