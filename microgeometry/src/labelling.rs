//! What a method of reconstruction gives.

/// A label for every triangle.
pub(crate) struct Labelling {
    /// Signed distances to the interface.
    pub(crate) labels: Vec<f64>,
    /// Fraction of the triangles for which the histogram had no label left.
    pub(crate) left_over: f64,
}

/// Distance in a region, 0 the negative and 1 the positive one, as a label.
pub(crate) fn signed(side: usize, distance: f64) -> f64 {
    if side == 1 { distance } else { -distance }
}
