//! Fields at a finer resolution.

use ndarray::Array2;

use crate::conversions::whole_part;

/// A field of cells of `cell` pixels' height and width at every pixel, by linear interpolation between the centres of
/// the cells.
///
/// # Complexity
///
/// Linear in pixels.
pub(crate) fn enlarged(field: &Array2<[f32; 3]>, dim: (usize, usize), cell: [f32; 2]) -> Array2<[f32; 3]> {
    let (rows, columns) = field.dim();
    let between = |i: usize, n: usize, side: f32| {
        let at = ((i as f32 + 0.5) / side - 0.5).clamp(0.0, (n - 1) as f32);
        let low = whole_part(f64::from(at)).min(n.saturating_sub(2));
        (low, (low + 1).min(n - 1), at - low as f32)
    };
    Array2::from_shape_fn(dim, |(y, x)| {
        let ((u, d, v), (l, r, h)) = (between(y, rows, cell[0]), between(x, columns, cell[1]));
        std::array::from_fn(|c| {
            let top = field[[u, l]][c] + h * (field[[u, r]][c] - field[[u, l]][c]);
            let bottom = field[[d, l]][c] + h * (field[[d, r]][c] - field[[d, l]][c]);
            top + v * (bottom - top)
        })
    })
}
