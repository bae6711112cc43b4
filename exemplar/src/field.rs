//! The state of the solid at one level.

use ndarray::ArrayView3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::level::{Atlas, LANES, Level, NONE};
use crate::window::Window;

/// Axes (0 z, 1 y, 2 x) of the slices of a view: constant along the first, rows along the second, columns along the
/// third.
pub(crate) const VIEWS: [[usize; 3]; 3] = [[1, 0, 2], [2, 0, 1], [0, 1, 2]];

/// Voxels at one level.
pub(crate) struct Field {
    pub(crate) size: [usize; 3],
    pub(crate) periodic: bool,
    /// Values (z, y, x), one channel after the other.
    pub(crate) values: Vec<Vec<f32>>,
    /// Place in the level of the exemplar's pixel from which each voxel (z, y, x) is copied.
    pub(crate) sources: Vec<u32>,
    /// By view, (slice, row, column): place of the exemplar's window that is most similar to that about the voxel.
    pub(crate) matches: Vec<Vec<u32>>,
    /// By view, in the same order: squared distance of the two windows.
    pub(crate) gaps: Vec<Vec<f32>>,
    /// Voxels (z, y, x) inside the mask; all if `None`.
    pub(crate) inside: Option<Vec<bool>>,
    /// Fixed voxels, sorted, and their values.
    pub(crate) fixed: Vec<(u32, Vec<f32>)>,
    /// Whether a voxel (z, y, x) is fixed; empty if none is.
    pub(crate) is_fixed: Vec<bool>,
}

/// The exemplar of each view.
pub(crate) fn sheet_of(view: usize, exemplars: usize) -> usize {
    view.min(exemplars - 1)
}

impl Field {
    /// Number of voxels inside the mask.
    pub(crate) fn voxels(&self) -> usize {
        self.inside
            .as_ref()
            .map_or(self.sources.len(), |inside| inside.iter().filter(|i| **i).count())
    }

    /// Whether this voxel (z, y, x) is inside the mask.
    #[inline]
    pub(crate) fn holds(&self, voxel: usize) -> bool {
        self.inside.as_ref().is_none_or(|inside| inside[voxel])
    }

    /// Number of a voxel in the order of a view.
    #[inline]
    pub(crate) fn in_view(&self, view: usize, at: [usize; 3]) -> usize {
        let [slice, row, column] = VIEWS[view];
        (at[slice] * self.size[row] + at[row]) * self.size[column] + at[column]
    }

    /// Calls `with` with the number, in the order of a view, of every voxel inside the mask.
    pub(crate) fn each_held_in_view(&self, view: usize, mut with: impl FnMut(usize)) {
        let [_, ny, nx] = self.size;
        for voxel in (0..self.sources.len()).filter(|&voxel| self.holds(voxel)) {
            with(self.in_view(view, [voxel / (ny * nx), voxel / nx % ny, voxel % nx]));
        }
    }

    /// Number of a voxel in (z, y, x) order.
    #[inline]
    pub(crate) fn index(&self, at: [usize; 3]) -> usize {
        (at[0] * self.size[1] + at[1]) * self.size[2] + at[2]
    }

    /// Slices, rows, columns of a view.
    pub(crate) fn view_shape(&self, view: usize) -> [usize; 3] {
        VIEWS[view].map(|axis| self.size[axis])
    }

    /// Initialises the voxels with random pixels of the exemplars and random matches.
    pub(crate) fn begin(&mut self, level: &Level, views: usize, seed: u64) {
        let n = self.sources.len();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let exemplars = level.windows.len();
        self.matches = (0..views)
            .map(|view| {
                let windows = &level.windows[sheet_of(view, exemplars)];
                (0..n).map(|_| windows[rng.random_range(0..windows.len())]).collect()
            })
            .collect();
        self.gaps = vec![vec![1.0; n]; views];
        for voxel in 0..n {
            let sheet = sheet_of(rng.random_range(0..views), exemplars);
            let windows = &level.windows[sheet];
            let source = windows[rng.random_range(0..windows.len())];
            if self.is_fixed.is_empty() || !self.is_fixed[voxel] {
                self.sources[voxel] = source;
            }
        }
        self.show(level);
    }

    /// After [`Field::begin`]: initialises the voxels with these pixels (z, y, x at the finest level) and the windows
    /// about them; numbers that are no pixel leave a voxel as it is.
    pub(crate) fn begin_with(&mut self, level: &Level, pixels: ArrayView3<'_, u32>) {
        let exemplars = level.windows.len();
        let [_, ny, nx] = self.size;
        for voxel in 0..self.sources.len() {
            let [z, y, x] = [voxel / (ny * nx), voxel / nx % ny, voxel % nx];
            let place = pixels
                .get([z, y, x].map(|i| i * level.step))
                .and_then(|&pixel| level.place.get(pixel as usize))
                .filter(|place| **place != NONE);
            let Some(&place) = place else { continue };
            if self.is_fixed.is_empty() || !self.is_fixed[voxel] {
                self.sources[voxel] = place;
            }
            for view in 0..self.matches.len() {
                if level.fits(place as usize, sheet_of(view, exemplars)) {
                    let at = self.in_view(view, [z, y, x]);
                    self.matches[view][at] = place;
                }
            }
        }
        self.show(level);
    }

    /// Copies values from the sources; fixed voxels keep their values, and voxels outside the mask are 0.
    pub(crate) fn show(&mut self, level: &Level) {
        for (channel, values) in self.values.iter_mut().enumerate() {
            let theirs = &level.values[channel * level.stride..(channel + 1) * level.stride];
            for (value, &source) in values.iter_mut().zip(&self.sources) {
                *value = theirs[source as usize];
            }
        }
        self.restore_fixed();
    }

    fn restore_fixed(&mut self) {
        for (voxel, fixed) in &self.fixed {
            for (values, &v) in self.values.iter_mut().zip(fixed) {
                values[*voxel as usize] = v;
            }
        }
    }

    /// Takes sources, matches and values of the next coarser level: each of eight children the pixel beside its
    /// parent's that lies where the child lies. `continuous` takes values from the parent instead of from the source.
    pub(crate) fn refine(&mut self, coarse: &Self, from: &Level, to: &Level, atlas: &Atlas, continuous: bool) {
        let child = |place: u32, row: usize, column: usize| {
            let (sheet, y, x) = atlas.locate(from.pixel[place as usize] as usize);
            let pixel = atlas.at(sheet, y + row * to.step, x + column * to.step, to.step);
            to.place[pixel]
        };
        let views = coarse.matches.len();
        self.matches = (0..views)
            .map(|view| {
                let [slices, rows, columns] = self.view_shape(view);
                let shape = coarse.view_shape(view);
                let mut matches = Vec::with_capacity(slices * rows * columns);
                for s in 0..slices {
                    for r in 0..rows {
                        for c in 0..columns {
                            let parent = (s / 2 * shape[1] + r / 2) * shape[2] + c / 2;
                            matches.push(child(coarse.matches[view][parent], r % 2, c % 2));
                        }
                    }
                }
                matches
            })
            .collect();
        self.gaps = vec![vec![1.0; self.sources.len()]; views];
        let exemplars = from.windows.len();
        let [nz, ny, nx] = self.size;
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let voxel = self.index([z, y, x]);
                    let parent = coarse.index([z / 2, y / 2, x / 2]);
                    let source = coarse.sources[parent];
                    // The view whose match is the source determines its orientation.
                    let place = [z, y, x].map(|i| i / 2);
                    let (sheet, ..) = atlas.locate(from.pixel[source as usize] as usize);
                    let view = (0..views)
                        .filter(|&view| sheet_of(view, exemplars) == sheet)
                        .min_by_key(|&view| {
                            let other = coarse.matches[view][coarse.in_view(view, place)];
                            (other != source, view)
                        })
                        .unwrap_or(0);
                    let [_, row, column] = VIEWS[view];
                    let at = [z, y, x];
                    if self.is_fixed.is_empty() || !self.is_fixed[voxel] {
                        self.sources[voxel] = child(source, at[row] % 2, at[column] % 2);
                    }
                    debug_assert_ne!(self.sources[voxel], NONE);
                    if continuous {
                        for (values, coarse) in self.values.iter_mut().zip(&coarse.values) {
                            values[voxel] = coarse[parent];
                        }
                    }
                }
            }
        }
        if continuous {
            self.restore_fixed();
        } else {
            self.show(to);
        }
    }
}

/// One slice of a view with a border, so that every window in it is whole.
pub(crate) struct Plane {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// Samples of a row with border.
    width: usize,
    /// Samples of a channel.
    stride: usize,
    values: Vec<f32>,
    /// 1 inside the mask; empty if the whole plane is inside.
    inside: Vec<f32>,
}

impl Plane {
    /// Slice `slice` of view `view`.
    pub(crate) fn cut(field: &Field, view: usize, slice: usize, window: &Window) -> Self {
        let [slice_axis, row_axis, column_axis] = VIEWS[view];
        let (rows, columns) = (field.size[row_axis], field.size[column_axis]);
        let half = window.half;
        let width = columns + 2 * half + LANES;
        let stride = width * (rows + 2 * half) + window.row;
        let wrapped = |n: usize, side: usize| -> Vec<Option<usize>> {
            (0..n)
                .map(|i| {
                    let i = i as isize - half as isize;
                    let within = i >= 0 && (i as usize) < side;
                    (field.periodic || within).then(|| i.rem_euclid(side as isize) as usize)
                })
                .collect()
        };
        let (row_of, column_of) = (wrapped(rows + 2 * half, rows), wrapped(columns + 2 * half, columns));
        let mut plane = Self {
            rows,
            columns,
            width,
            stride,
            values: vec![0.0; stride * field.values.len()],
            inside: Vec::new(),
        };
        let steps = [field.size[1] * field.size[2], field.size[2], 1];
        let base = slice * steps[slice_axis];
        for (channel, values) in field.values.iter().enumerate() {
            for (r, row) in row_of.iter().enumerate() {
                let Some(row) = row else { continue };
                let from = base + row * steps[row_axis];
                let into = channel * stride + r * width;
                for (slot, column) in plane.values[into..].iter_mut().zip(&column_of) {
                    if let Some(column) = column {
                        *slot = values[from + column * steps[column_axis]];
                    }
                }
            }
        }
        if !field.periodic || field.inside.is_some() {
            plane.inside = vec![0.0; stride];
            for (r, row) in row_of.iter().enumerate() {
                let Some(row) = row else { continue };
                for (c, column) in column_of.iter().enumerate() {
                    let Some(column) = column else { continue };
                    let voxel = base + row * steps[row_axis] + column * steps[column_axis];
                    plane.inside[r * width + c] = f32::from(u8::from(field.holds(voxel)));
                }
            }
        }
        plane
    }

    /// Copies the window about a voxel. In a bounded solid it writes to `weights` which of its pixels count and returns
    /// their number.
    #[inline]
    pub(crate) fn window(
        &self,
        window: &Window,
        row: usize,
        column: usize,
        into: &mut [f32],
        weights: &mut [f32],
    ) -> Option<f32> {
        let from = row * self.width + column;
        let (chunks, _) = into.as_chunks_mut::<LANES>();
        let across = window.row / LANES;
        for (channel, rows) in chunks.chunks_exact_mut(window.side * across).enumerate() {
            let mut at = channel * self.stride + from;
            for row in rows.chunks_exact_mut(across) {
                let (theirs, _) = self.values[at..at + window.row].as_chunks::<LANES>();
                for (slot, theirs) in row.iter_mut().zip(theirs) {
                    *slot = *theirs;
                }
                at += self.width;
            }
        }
        if self.inside.is_empty() {
            return None;
        }
        for (i, line) in weights.chunks_exact_mut(window.row).enumerate() {
            let at = from + i * self.width;
            let shape = &window.weights[i * window.row..(i + 1) * window.row];
            for ((slot, inside), counts) in line.iter_mut().zip(&self.inside[at..at + window.row]).zip(shape) {
                *slot = inside * counts;
            }
        }
        Some(weights.iter().sum())
    }
}
