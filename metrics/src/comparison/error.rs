//! Reasons why a comparison cannot be made.

/// A comparison cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// Nothing to compare.
    #[error("the {side} has no images")]
    Empty {
        /// Which side: exemplar or volume.
        side: &'static str,
    },
    /// An image is too small.
    #[error("the {side} has an image of {width} x {height} pixels; at least {least} x {least} are needed")]
    TooSmall {
        /// Which side.
        side: &'static str,
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Pixels needed along each axis.
        least: usize,
    },
    /// A sample is not a number.
    #[error("the {side} has samples that are not finite; replace them before measuring")]
    NotFinite {
        /// Which side.
        side: &'static str,
    },
    /// The exemplar has one grey level.
    #[error("the exemplar has the same grey level everywhere: there is nothing to compare with")]
    ConstantExemplar,
    /// The filter of the fringes failed.
    #[error("the fringes cannot be filtered: {0}")]
    Filter(String),
    /// The progress callback cancelled the comparison.
    #[error("cancelled")]
    Cancelled,
}
