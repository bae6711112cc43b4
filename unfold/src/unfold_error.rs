//! Why counts cannot be unfolded.

use crate::kernel::KernelError;
use crate::size_bins::ReportedEdgesError;
use stereology_metrics::EdgesError;

/// Why counts cannot be unfolded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnfoldError {
    /// The kernel is for other profile bins.
    #[error("{counts} profile bins for a kernel of {rows} rows: build the kernel for the edges of the counts")]
    Rows {
        /// Bins of the counts.
        counts: usize,
        /// Rows of the kernel.
        rows: usize,
    },
    /// The inverse of a kernel that has none.
    #[error(
        "the paper's method needs as many profile bins as size bins, {rows} and {columns} are left: use equal edges, or nnls or em"
    )]
    NotSquare {
        /// Profile bins above the threshold.
        rows: usize,
        /// Size bins that show profiles above the threshold.
        columns: usize,
    },
    /// The kernel's inverse does not exist.
    #[error("the kernel is singular: merge size bins, or use nnls or em")]
    Singular,
    /// Profiles of a size that no particle can show.
    #[error("profile bin {} contains profiles, but no particle of the kernel gives profiles there: check the edges and the largest size", .bin + 1)]
    Unexplained {
        /// Profile bin, from 0.
        bin: usize,
    },
    /// The threshold is not a length, or leaves nothing.
    #[error("the threshold {0} leaves no profiles: it must be finite, not negative and below the largest profile")]
    Threshold(f64),
    /// A bootstrap that cannot be.
    #[error("a bootstrap needs 2 or more replicates and a level between 0 and 1, not {replicates} and {level}")]
    Bootstrap {
        /// Requested replicates.
        replicates: usize,
        /// Requested level.
        level: f64,
    },
    /// A tolerance that is not positive.
    #[error("the tolerance {0} must be positive")]
    Tolerance(f64),
    /// A smoothing outside its range.
    #[error("the smoothing {0} must lie between 0 and 0.25")]
    Smoothing(f64),
    /// Slices to draw again that are not there.
    #[error("resampling slices needs two or more, there are {0}: give the slice of every profile, or resample counts")]
    TooFewSlices(usize),
    /// Tiles of a photograph whose profiles have no positions.
    #[error(
        "resampling blocks needs the position of every profile on one photograph: give the positions, or resample counts"
    )]
    NoPositions,
    /// Several types on different bins, or no type.
    #[error(
        "the bins of type {index} differ from those of the first, or there is no type: several types need common edges"
    )]
    Bins {
        /// Which, from 0.
        index: usize,
    },
    /// An invalid range of a parameter, or one that contains no value that can explain the profiles.
    #[error(
        "the range {from} to {to} holds no value with which all profiles can be explained: it must be finite, rising, and reach high enough"
    )]
    Range {
        /// Lower end.
        from: f64,
        /// Upper end.
        to: f64,
    },
    /// Fractions of types that the counts do not determine.
    #[error(
        "the counts do not determine the fractions of the types: type {index} could be {:.0} to {:.0} % (condition number {condition_number:.0}); give the fractions, or label the profiles",
        100.0 * .lower, 100.0 * .upper
    )]
    FractionsUnknowable {
        /// The type, from 0.
        index: usize,
        /// Lower end of its interval.
        lower: f64,
        /// Upper end of its interval.
        upper: f64,
        /// How alike the profiles of the types are.
        condition_number: f64,
    },
    /// An invalid kernel.
    #[error(transparent)]
    Kernel(#[from] KernelError),
    /// Edges that bound no bins.
    #[error(transparent)]
    Edges(#[from] EdgesError),
    /// Reported bins that are not made of whole bins.
    #[error(transparent)]
    Reported(#[from] ReportedEdgesError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}
