//! Errors of carving and baking.

use stereology_shape::TriangleMesh;

/// The largest texture side that most readers accept.
pub(crate) const MOST_PIXELS: u32 = 16_384;

/// Why a mesh cannot be carved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CarveError {
    /// The mesh has no triangles.
    #[error("the mesh has no triangles, so it cannot be carved")]
    Empty,
    /// A triangle refers to a missing vertex.
    #[error("triangle {triangle} refers to a vertex that is not among the {vertices} vertices")]
    Index {
        /// Which triangle.
        triangle: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A coordinate is not a finite number, or all are the same.
    #[error("the mesh has no size: its coordinates must be finite, and not all the same")]
    NoSize,
    /// An option out of range.
    #[error("detail {detail} and contrast {contrast} must be positive and finite")]
    Options {
        /// Shortest edge.
        detail: f64,
        /// Difference of colours.
        contrast: f32,
    },
    /// A side of an atlas out of range.
    #[error("an atlas cannot have a side of {pixels} pixels; 1 to 16384 are possible")]
    Pixels {
        /// The requested side.
        pixels: u32,
    },
    /// The atlas is too small for so many triangles.
    #[error("{triangles} triangles do not fit into an atlas of {pixels} x {pixels} pixels, {}", enough_or_not(*enough))]
    Crowded {
        /// Triangles of the mesh.
        triangles: usize,
        /// The requested side.
        pixels: u32,
        /// The smallest sufficient side: each chart has 3 × 3 pixels.
        enough: u64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

fn enough_or_not(enough: u64) -> String {
    if enough > u64::from(MOST_PIXELS) {
        "nor into any other; use vertex colours, or fewer triangles".to_owned()
    } else {
        format!("at least {enough} are needed, several times as many for detail")
    }
}

/// Checks that a mesh can be carved or baked.
pub(crate) fn check(mesh: &TriangleMesh) -> Result<(), CarveError> {
    let vertices = mesh.vertices.len();
    if mesh.triangles.is_empty() {
        return Err(CarveError::Empty);
    }
    let outside = |triangle: &[u32; 3]| triangle.iter().any(|&i| i as usize >= vertices);
    if let Some(triangle) = mesh.triangles.iter().position(outside) {
        return Err(CarveError::Index { triangle, vertices });
    }
    let first = mesh.vertices[mesh.triangles[0][0] as usize];
    let used = || mesh.triangles.iter().flatten().map(|&i| mesh.vertices[i as usize]);
    if used().any(|v| !v.iter().all(|x| x.is_finite())) || used().all(|v| v == first) {
        return Err(CarveError::NoSize);
    }
    Ok(())
}
