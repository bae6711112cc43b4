//! Errors.

/// Why a contact distribution, a reconstruction or a displacement cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MicrogeometryError {
    /// A frequency is negative or not a number.
    #[error("bin {bin} of the {side} histogram is {value}: frequencies must be finite and not negative")]
    Frequency {
        /// `negative` or `positive`.
        side: &'static str,
        /// Index of the bin, from the interface outwards.
        bin: usize,
        /// Its value.
        value: f64,
    },
    /// No frequency is positive.
    #[error("the contact distribution is empty: at least one bin must be positive")]
    EmptyDistribution,
    /// A bin's width is not a positive length.
    #[error("bins must have a positive finite width, not {0}")]
    BinWidth(f64),
    /// Too many bins.
    #[error("a region has at most {most} bins, not {bins}: use a larger bin width")]
    TooManyBins {
        /// How many there are.
        bins: usize,
        /// How many are allowed.
        most: usize,
    },
    /// A file that is not a contact distribution or design.
    #[error("{0}")]
    File(String),
    /// There is one region only, hence no interface.
    #[error("{0} has one region only: every pixel is on the same side; give another threshold")]
    OneRegion(&'static str),
    /// Too few triangles for a dual graph.
    #[error("the mesh has {triangles} triangles; a reconstruction needs at least 2: refine the mesh")]
    TooFewTriangles {
        /// How many there are.
        triangles: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to a vertex beyond the {vertices} of the mesh")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate that is not finite.
    #[error("vertex {vertex} is not finite (or beyond 1e60)")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// All triangles are points or lines.
    #[error("the mesh has no area: all its triangles are points or lines")]
    NoArea,
    /// Vertices with very many triangles.
    #[error("a vertex has {most} triangles: the distances between them do not fit into memory; remesh the mesh there")]
    Crowded {
        /// Triangles around the vertex with most.
        most: usize,
    },
    /// The metric is not symmetric and positive definite.
    #[error(
        "the metric must be symmetric and positive definite: an axis that is a direction, and a stretch above zero"
    )]
    Metric,
    /// A parameter outside its range.
    #[error("{0}")]
    Parameter(String),
    /// The progress callback cancelled the work.
    #[error("cancelled")]
    Cancelled,
}
