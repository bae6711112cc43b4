//! A grid of cells in a periodic box, searched across the walls of the box.
//!
//! A search uses unwrapped cell numbers: number `k` of `n` along an axis is cell `k mod n` in the period `floor(k /
//! n)`. Every periodic image is found once and none is missed, whether an axis has one cell or a thousand, and whether
//! a body is smaller or larger than the box.

use crate::conversions::{floor, index};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// The cells of one grid.
pub(crate) struct PeriodicCells {
    sides: Vector3<f64>,
    counts: [i64; 3],
}

impl PeriodicCells {
    /// Cells of at least `width`, about `most` in all at most, and no more than `most_per_axis` along an axis.
    pub(crate) fn new(sides: Vector3<f64>, width: f64, most: usize, most_per_axis: i64) -> Self {
        let width = width.max(f64::MIN_POSITIVE);
        let per_side = (most as f64).cbrt();
        let mean_side = sides.product().cbrt();
        let counts = std::array::from_fn(|axis| {
            let fit = (sides[axis] / width).min(per_side * sides[axis] / mean_side);
            floor(fit).clamp(1, most_per_axis)
        });
        Self { sides, counts }
    }

    /// Number of cells.
    pub(crate) fn len(&self) -> usize {
        index(self.counts.iter().product())
    }

    /// The cell of a point of the box.
    pub(crate) fn of(&self, point: &Vector3<f64>) -> usize {
        let at: [i64; 3] = std::array::from_fn(|axis| {
            let cell = floor(point[axis] * (self.counts[axis] as f64 / self.sides[axis]));
            cell.clamp(0, self.counts[axis] - 1)
        });
        self.index(at)
    }

    /// Visits all cells within `far` of a point along each axis, each with the number of its period along x, y and z.
    pub(crate) fn visit<B>(
        &self,
        point: &Vector3<f64>,
        far: f64,
        mut visitor: impl FnMut(usize, [i64; 3]) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let range = |axis: usize| {
            let scale = self.counts[axis] as f64 / self.sides[axis];
            floor((point[axis] - far) * scale)..=floor((point[axis] + far) * scale)
        };
        let [nx, ny, nz] = self.counts;
        for kx in range(0) {
            let (cx, px) = (kx.rem_euclid(nx), kx.div_euclid(nx));
            for ky in range(1) {
                let (cy, py) = (ky.rem_euclid(ny), ky.div_euclid(ny));
                for kz in range(2) {
                    let (cz, pz) = (kz.rem_euclid(nz), kz.div_euclid(nz));
                    visitor(self.index([cx, cy, cz]), [px, py, pz])?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    fn index(&self, [x, y, z]: [i64; 3]) -> usize {
        index((x * self.counts[1] + y) * self.counts[2] + z)
    }
}
