//! Local porosity: how a phase's fraction varies from place to place.

use ndarray::{Array2, ArrayView2};

/// Fractions of the phase in all squares of `side` pixels, by the place of their first corner; empty if no square fits.
///
/// Over a large image their mean is the phase's fraction φ, and their variance falls from φ (1 − φ) at side 1 as the
/// side grows; it falls more slowly in a coarser material.
///
/// # References
///
/// Hilfer 1991.
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::local_porosity;
///
/// let board = Array2::from_shape_fn((10, 12), |(y, x)| (x + y) % 2 == 0);
/// assert!(local_porosity(board.view(), 4).iter().all(|fraction| *fraction == 0.5));
/// ```
#[must_use]
pub fn local_porosity(phase: ArrayView2<'_, bool>, side: usize) -> Array2<f64> {
    let (height, width) = phase.dim();
    if side == 0 || side > height || side > width {
        return Array2::zeros((0, 0));
    }
    // Sums over all rectangles from the first corner.
    let mut sums = Array2::<u64>::zeros((height + 1, width + 1));
    for ((y, x), &here) in phase.indexed_iter() {
        sums[[y + 1, x + 1]] = u64::from(here) + sums[[y, x + 1]] + sums[[y + 1, x]] - sums[[y, x]];
    }
    Array2::from_shape_fn((height - side + 1, width - side + 1), |(y, x)| {
        let inside = sums[[y + side, x + side]] + sums[[y, x]] - sums[[y, x + side]] - sums[[y + side, x]];
        inside as f64 / (side * side) as f64
    })
}
