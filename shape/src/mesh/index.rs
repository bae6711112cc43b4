//! Indices of vertices and triangles in 32 bits.

/// Index of a vertex or triangle in 32 bits; larger meshes are refused where meshes are checked.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
