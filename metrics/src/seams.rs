//! Seams: the steps of a solid between the cells that were grown from different seeds.

use ndarray::{ArrayView3, ArrayView4};

/// Steps between neighbouring voxels, across the borders of cells and inside them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seams {
    /// Mean step across a border, in units of the samples.
    pub across: f64,
    /// Mean step inside a cell.
    pub inside: f64,
    /// Pairs of neighbours across a border.
    pub pairs: u64,
}

impl Seams {
    /// Steps across borders over steps inside: 1 if the borders show no seam. `None` without borders or without
    /// texture.
    #[must_use]
    pub fn visibility(&self) -> Option<f64> {
        (self.pairs > 0 && self.inside > 0.0).then(|| self.across / self.inside)
    }
}

/// Mean steps of a volume (z, y, x, channel) between neighbours along the axes, within cells and across their borders;
/// label 0 is outside and does not count.
///
/// # Examples
///
/// ```
/// use ndarray::{Array3, Array4};
/// use stereology_metrics::seams;
///
/// let labels = Array3::from_shape_fn((4, 4, 8), |(_, _, x)| 1 + u32::from(x >= 4));
/// let volume = Array4::from_shape_fn((4, 4, 8, 1), |(z, _, x, _)| 0.1 * (z % 2) as f32 + 0.5 * (x / 4) as f32);
/// let found = seams(volume.view(), labels.view());
/// assert!((found.across - 0.5).abs() < 1e-6 && found.pairs == 16);
/// ```
#[must_use]
pub fn seams(volume: ArrayView4<'_, f32>, labels: ArrayView3<'_, u32>) -> Seams {
    let (nz, ny, nx, channels) = volume.dim();
    let mut sums = [(0.0, 0_u64); 2];
    if labels.dim() != (nz, ny, nx) {
        return Seams::default();
    }
    for ((z, y, x), &label) in labels.indexed_iter() {
        for (dz, dy, dx) in [(1, 0, 0), (0, 1, 0), (0, 0, 1)] {
            let (bz, by, bx) = (z + dz, y + dy, x + dx);
            let Some(&other) = labels.get((bz, by, bx)) else {
                continue;
            };
            if label == 0 || other == 0 {
                continue;
            }
            let step = |c: usize| f64::from((volume[[z, y, x, c]] - volume[[bz, by, bx, c]]).abs());
            let sum = &mut sums[usize::from(label != other)];
            *sum = (
                sum.0 + (0..channels).map(step).sum::<f64>() / channels as f64,
                sum.1 + 1,
            );
        }
    }
    let mean = |(sum, n): (f64, u64)| sum / n.max(1) as f64;
    Seams {
        across: mean(sums[1]),
        inside: mean(sums[0]),
        pairs: sums[1].1,
    }
}
