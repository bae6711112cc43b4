//! Why triangles do not enclose a solid, and which repairs were made.

/// A repair made when a mesh was checked. Indices and counts refer to the mesh as given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Repair {
    /// Coordinates that are far below the rounding of the largest were set to zero.
    FlushedCoordinates {
        /// How many.
        count: usize,
    },
    /// Vertices at exactly the position of another were joined with it.
    WeldedVertices {
        /// How many.
        count: usize,
    },
    /// Vertices within the requested tolerance of another were joined with it.
    WeldedWithinTolerance {
        /// How many.
        count: usize,
    },
    /// Triangles that used one vertex twice were dropped.
    DroppedDegenerate {
        /// How many.
        count: usize,
    },
    /// Repeated triangles were dropped.
    DroppedDuplicates {
        /// How many.
        count: usize,
    },
    /// Vertices that no triangle uses were dropped.
    DroppedUnusedVertices {
        /// How many.
        count: usize,
    },
    /// Triangles were reversed to match the orientation of their neighbours.
    TurnedTriangles {
        /// How many.
        count: usize,
    },
    /// Whole bodies were inside out (or a cavity was oriented outwards) and were reversed.
    TurnedInsideOut {
        /// How many bodies.
        bodies: usize,
    },
}

impl std::fmt::Display for Repair {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::FlushedCoordinates { count } => {
                write!(f, "{count} coordinates below 1e-20 of the largest were set to 0")
            }
            Self::WeldedVertices { count } => {
                write!(f, "{count} vertices were joined with others at the same position")
            }
            Self::WeldedWithinTolerance { count } => {
                write!(f, "{count} vertices were joined with others within the tolerance")
            }
            Self::DroppedDegenerate { count } => write!(f, "{count} triangles that used a vertex twice were dropped"),
            Self::DroppedDuplicates { count } => write!(f, "{count} duplicate triangles were dropped"),
            Self::DroppedUnusedVertices { count } => write!(f, "{count} unused vertices were dropped"),
            Self::TurnedTriangles { count } => {
                write!(f, "{count} triangles were reversed to match their neighbours")
            }
            Self::TurnedInsideOut { bodies } => write!(f, "{bodies} bodies were inside out and were reversed"),
        }
    }
}

/// Why triangles do not enclose a solid, and where. Indices are of the mesh as given, positions in its own unit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// No triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} (counted from 0) has a coordinate that is not finite")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle refers to a missing vertex.
    #[error("triangle {triangle} (counted from 0) refers to vertex {index}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it refers to.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More triangles or vertices than 32-bit indices can number.
    #[error("the mesh has {triangles} triangles; at most {limit} are supported; simplify it first")]
    TooLarge {
        /// How many triangles.
        triangles: usize,
        /// The most.
        limit: usize,
    },
    /// Coordinates too large or too small for volumes in double precision.
    #[error("the mesh is {extent:e} long; lengths from 1e-60 to 1e60 are supported; choose another unit")]
    Extent {
        /// Largest side of the bounding box.
        extent: f64,
    },
    /// An edge with a triangle on one side only: the surface has a hole.
    #[error(
        "the mesh is open: {count} edges belong to one triangle only, the first from {from:?} to {to:?} of triangle {triangle}; \
         close the holes in a mesh editor"
    )]
    OpenEdge {
        /// The triangle at the first open edge, counted after degenerate and duplicate triangles were dropped.
        triangle: usize,
        /// One end of the first open edge.
        from: [f64; 3],
        /// Its other end.
        to: [f64; 3],
        /// How many open edges there are.
        count: usize,
    },
    /// An edge with more than two triangles.
    #[error(
        "the mesh is not manifold: {count} edges belong to more than two triangles, the first ({triangles} triangles) from {from:?} to \
         {to:?}; separate the sheets in a mesh editor"
    )]
    NonManifoldEdge {
        /// One end of the first such edge.
        from: [f64; 3],
        /// Its other end.
        to: [f64; 3],
        /// How many triangles meet there.
        triangles: usize,
        /// How many such edges there are.
        count: usize,
    },
    /// The surface has no inside, like a Klein bottle.
    #[error(
        "the mesh has no consistent orientation: neighbouring triangles contradict each other at the edge from {from:?} to {to:?}"
    )]
    NotOrientable {
        /// One end of an edge where the orientations contradict each other.
        from: [f64; 3],
        /// Its other end.
        to: [f64; 3],
    },
    /// The surface intersects itself, so inside and outside are undefined there.
    #[error(
        "the mesh cuts through itself: {count}{} pairs of triangles cross, the first are {} and {} (counted from 0) near {place:?}; unite \
         the overlapping parts (a boolean union in a mesh editor)",
        if *.count >= 1000 { " or more" } else { "" }, .triangles[0], .triangles[1]
    )]
    SelfIntersection {
        /// The first two triangles that cross, counted after degenerate and duplicate triangles were dropped.
        triangles: [usize; 2],
        /// Where they cross.
        place: [f64; 3],
        /// Number of pairs that cross; the search stops at 1000.
        count: usize,
    },
    /// The triangles enclose no volume.
    #[error("the mesh encloses no volume (it is flat)")]
    ZeroVolume,
}
