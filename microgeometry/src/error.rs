//! What cannot be done, and what to do about it.

/// Why a contact distribution, a reconstruction or a displacement cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MicrogeometryError {
    /// A frequency is negative or no number.
    #[error("the {side} histogram's bin {bin} holds {value}; frequencies are finite and not negative")]
    Frequency {
        /// `negative` or `positive`.
        side: &'static str,
        /// Index of the bin, from the interface outwards.
        bin: usize,
        /// What it holds.
        value: f64,
    },
    /// Nothing to rebuild.
    #[error("the contact distribution is empty: at least one bin must hold something")]
    EmptyDistribution,
    /// A bin's width is no length.
    #[error("bins have a positive finite width, not {0}")]
    BinWidth(f64),
    /// More bins than anybody can mean.
    #[error("a region has at most {most} bins, not {bins}: take a larger bin width")]
    TooManyBins {
        /// How many there are.
        bins: usize,
        /// How many are allowed.
        most: usize,
    },
    /// A file that is no contact distribution or no design.
    #[error("{0}")]
    File(String),
    /// One region alone has no interface to measure distances to.
    #[error("{0} has one region only: every pixel is on the same side; give another threshold")]
    OneRegion(&'static str),
    /// A dual needs neighbours.
    #[error("the mesh has {triangles} triangles; a reconstruction needs at least 2: subdivide it (--edge-length)")]
    TooFewTriangles {
        /// How many there are.
        triangles: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names a vertex beyond the {vertices} there are")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate that is no finite number.
    #[error("vertex {vertex} is not finite (or beyond 1e60)")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// All triangles are points or lines.
    #[error("the mesh has no area: all its triangles are points or lines")]
    NoArea,
    /// Vertices with very many triangles.
    #[error(
        "a vertex has {most} triangles: their distances to each other do not fit into memory; remesh the mesh there"
    )]
    Crowded {
        /// Triangles about the vertex with most.
        most: usize,
    },
    /// No metric.
    #[error(
        "the metric must be symmetric and positive definite: an axis that is a direction, and a stretch above zero"
    )]
    Metric,
    /// A parameter outside its range.
    #[error("{0}")]
    Parameter(String),
    /// The callback broke off.
    #[error("cancelled")]
    Cancelled,
}
