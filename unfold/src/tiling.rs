//! Tiles of a photograph: the parts that a spatial block bootstrap draws.

use crate::clustering::Rectangle;

/// Tiles over a photograph, some sixteen that are nearly square, and what their resampling lacks.
///
/// A resample consists of as many tiles as cover the photograph, each anywhere on it (a tile that reaches over one edge
/// is continued at the opposite edge). Profiles that lie together stay together. Tiles cut clusters, so their totals
/// vary less than those of photographs; a random factor common to all counts of a resample supplies the rest.
///
/// # References
///
/// Politis & Romano 1994 (circular blocks).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tiling {
    window: Rectangle,
    columns: usize,
    rows: usize,
    /// Variance of the common factor, whose mean is 1.
    common_variance: f64,
}

/// Number of tiles, if they can be square.
const TILES: f64 = 16.0;
/// Tiles along a side, at least and at most.
const ALONG: (usize, usize) = (2, 8);
/// Steps of a tile from place to place, along a side of its own.
const STEPS: usize = 4;

impl Tiling {
    /// Tiles over the smallest rectangle around `points`, for counts whose variance is `dispersion` times Poisson's;
    /// `weights`, one per point, are those of the counts. `None` if that rectangle has no area, or there is no weight.
    ///
    /// ```
    /// use stereology_unfold::Tiling;
    /// let points: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k % 10), f64::from(k / 10)]).collect();
    /// assert_eq!(Tiling::new(&points, None, 2.0).map(|of| of.tiles()), Some(16));
    /// assert_eq!(Tiling::new(&points[..10], None, 2.0), None); // all on a line
    /// ```
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Between 2 and 8.
    pub fn new(points: &[[f64; 2]], weights: Option<&[f64]>, dispersion: f64) -> Option<Self> {
        let window = Rectangle::around(points)?;
        let along = |wanted: f64| (wanted.round() as usize).clamp(ALONG.0, ALONG.1);
        let columns = along((TILES * window.sides[0] / window.sides[1]).sqrt());
        let rows = along(TILES / columns as f64);
        let mut tiling = Self {
            window,
            columns,
            rows,
            common_variance: 0.0,
        };
        let weight = |k: usize| weights.map_or(1.0, |weights| weights.get(k).copied().unwrap_or(0.0));
        let (mut sum, mut squares) = (0.0, 0.0);
        let mut cells = vec![vec![0.0]; tiling.cells()];
        for (k, point) in points.iter().enumerate() {
            cells[tiling.cell(point)][0] += weight(k);
            sum += weight(k);
            squares += weight(k).powi(2);
        }
        if sum <= 0.0 {
            return None;
        }
        let tiles = tiling.tiles() as f64;
        let totals: Vec<f64> = tiling.parts(&cells).into_iter().map(|part| part[0]).collect();
        let variance = totals.iter().map(|total| (total - sum / tiles).powi(2)).sum::<f64>() / totals.len() as f64;
        // The spread of resamples is multiplied by n / (n - 1) for n tiles.
        let wanted = dispersion * squares * (tiles - 1.0) / tiles;
        tiling.common_variance = (wanted - tiles * variance).max(0.0) / (sum * sum);
        Some(tiling)
    }

    /// Number of tiles that cover the photograph.
    #[must_use]
    pub fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    pub(crate) fn common_variance(&self) -> f64 {
        self.common_variance
    }

    /// Number of cells: places of tiles.
    pub(crate) fn cells(&self) -> usize {
        self.tiles() * STEPS * STEPS
    }

    /// The cell of a point.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // The cast saturates, and the result is limited.
    pub(crate) fn cell(&self, point: &[f64; 2]) -> usize {
        let place = |axis: usize, cells: usize| {
            let share = (point[axis] - self.window.corner[axis]) / self.window.sides[axis];
            ((share * cells as f64) as usize).min(cells - 1)
        };
        place(1, self.rows * STEPS) * self.columns * STEPS + place(0, self.columns * STEPS)
    }

    /// Counts of the tile at every place, from those of the cells.
    pub(crate) fn parts(&self, cells: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (columns, rows) = (self.columns * STEPS, self.rows * STEPS);
        let bins = cells.first().map_or(0, Vec::len);
        let tile = |place: usize| {
            let mut sum = vec![0.0; bins];
            for step in 0..STEPS * STEPS {
                let row = (place / columns + step / STEPS) % rows;
                let column = (place % columns + step % STEPS) % columns;
                let cell = &cells[row * columns + column];
                sum.iter_mut().zip(cell).for_each(|(sum, count)| *sum += count);
            }
            sum
        };
        (0..columns * rows).map(tile).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{STEPS, Tiling};
    use proptest::prelude::*;

    proptest! {
        /// Every cell is in as many tiles as a tile has cells, and tiles are nearly square.
        #[test]
        fn tiles_cover_all_cells_equally(width in 0.2..5.0_f64, height in 0.2..5.0_f64) {
            let points = [[0.0, 0.0], [width, height], [0.5 * width, 0.25 * height]];
            let tiling = Tiling::new(&points, None, 1.0).unwrap();
            let cells: Vec<Vec<f64>> = (0..tiling.cells()).map(|cell| (0..tiling.cells()).map(|of| f64::from(u8::from(of == cell))).collect()).collect();
            let parts = tiling.parts(&cells);
            prop_assert_eq!(parts.len(), tiling.cells());
            for cell in 0..tiling.cells() {
                let held: f64 = parts.iter().map(|part| part[cell]).sum();
                prop_assert!((held - (STEPS * STEPS) as f64).abs() < 0.5);
            }
            prop_assert!((4..=32).contains(&tiling.tiles()));
        }
    }

    /// Points that lie evenly need a common factor for a larger dispersion; in one heap they need none.
    #[test]
    fn a_common_factor_supplies_what_tiles_lack() {
        let even: Vec<[f64; 2]> = (0..256).map(|k| [f64::from(k % 16), f64::from(k / 16)]).collect();
        let tiling = Tiling::new(&even, None, 3.0).unwrap();
        let wanted = 3.0 * (15.0 / 16.0) / 256.0;
        assert!(tiling.common_variance() <= wanted && tiling.common_variance() > 0.8 * wanted);
        let heap: Vec<[f64; 2]> = even
            .iter()
            .map(|[x, y]| if *x < 15.0 { [x / 8.0, y / 8.0] } else { [*x, *y] })
            .collect();
        assert!(Tiling::new(&heap, None, 3.0).unwrap().common_variance() <= 0.0);
    }
}
