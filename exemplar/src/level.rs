//! Exemplars at one scale, arranged so that a step of one pixel is a step of one voxel of the solid at that scale.
//!
//! At level l a voxel stands for 2^l fine ones. The exemplars are smoothed but need not be subsampled: the pixels whose
//! row and column have the same remainders modulo 2^l form an image of that scale, and all 4^l of these images are
//! placed side by side. A thinned pyramid keeps only the first: five levels of 128 x 128 pixels then leave 8 x 8 with
//! four windows of 7 x 7, while the full set has 6,400.

use crate::exemplar::Exemplar;
use crate::numbers::{number, small};

/// No pixel.
pub(crate) const NONE: u32 = u32::MAX;
/// Samples read at once; rows of windows are padded to a multiple.
pub(crate) const LANES: usize = 8;

/// All exemplars at one scale.
pub(crate) struct Level {
    /// Fine pixels of a step: 2^level.
    pub(crate) step: usize,
    /// Samples of a row of the layout.
    pub(crate) width: usize,
    /// Values, one channel after the other.
    pub(crate) values: Vec<f32>,
    /// Samples of one channel, padding included.
    pub(crate) stride: usize,
    /// Fine pixel (of all exemplars, one after the other) of each place of the layout, or [`NONE`].
    pub(crate) pixel: Vec<u32>,
    /// Place in the layout of each fine pixel, or [`NONE`].
    pub(crate) place: Vec<u32>,
    /// 1 + number of the exemplar whose window about this place is complete, or 0.
    pub(crate) owner: Vec<u8>,
    /// Places of complete windows, by exemplar.
    pub(crate) windows: Vec<Vec<u32>>,
    /// Places with a pixel, by exemplar.
    pub(crate) places: Vec<Vec<u32>>,
}

/// Positions of the pixels of several exemplars in one list.
#[derive(Clone, Debug)]
pub(crate) struct Atlas {
    /// (first pixel, height, width) of each exemplar.
    sheets: Vec<(usize, usize, usize)>,
}

impl Atlas {
    pub(crate) fn new(exemplars: &[Exemplar]) -> Self {
        let mut first = 0;
        let sheets = exemplars
            .iter()
            .map(|exemplar| {
                let (height, width) = exemplar.shape();
                first += height * width;
                (first - height * width, height, width)
            })
            .collect();
        Self { sheets }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.sheets.iter().map(|&(_, height, width)| height * width).sum()
    }

    /// Exemplar, row and column of a pixel.
    pub(crate) fn locate(&self, pixel: usize) -> (usize, usize, usize) {
        let sheet = self
            .sheets
            .partition_point(|&(first, ..)| first <= pixel)
            .saturating_sub(1);
        let (first, _, width) = self.sheets[sheet];
        (sheet, (pixel - first) / width, (pixel - first) % width)
    }

    /// Pixel of an exemplar at a row and column; beyond the last row or column, the last one a multiple of `step`
    /// pixels before.
    pub(crate) fn at(&self, sheet: usize, row: usize, column: usize, step: usize) -> usize {
        let (first, height, width) = self.sheets[sheet];
        let back = |i: usize, n: usize| {
            if i < n { i } else { i - (i - n + step) / step * step }
        };
        first + back(row, height) * width + back(column, width)
    }
}

/// Exemplars smoothed for every level, the finest first: channels one after the other, each as large as the exemplar.
pub(crate) fn smoothed(exemplar: &Exemplar, levels: usize) -> Vec<Vec<f32>> {
    let (height, width) = exemplar.shape();
    let mut stack = vec![exemplar.planes()];
    for level in 1..levels {
        let step = 1 << (level - 1);
        let finer = &stack[level - 1];
        let coarser = finer
            .chunks_exact(height * width)
            .flat_map(|plane| halved(plane, height, width, step))
            .collect();
        stack.push(coarser);
    }
    stack
}

/// Each pixel becomes the mean of itself and the pixel `step` further, with weights 1 3 3 1 along rows and columns: a
/// voxel at one level is the mean of its two children along each axis, slightly smoothed. Mirrored at the edges.
fn halved(plane: &[f32], height: usize, width: usize, step: usize) -> Vec<f32> {
    let mirror = |i: isize, n: usize| -> usize {
        let period = 2 * n as isize;
        let i = i.rem_euclid(period);
        (if i < n as isize { i } else { period - 1 - i }) as usize
    };
    const TAPS: [(isize, f32); 4] = [(-1, 0.125), (0, 0.375), (1, 0.375), (2, 0.125)];
    let step = step as isize;
    let mut rows = vec![0.0; plane.len()];
    for y in 0..height {
        for (tap, weight) in TAPS {
            let from = mirror(y as isize + tap * step, height) * width;
            for x in 0..width {
                rows[y * width + x] += weight * plane[from + x];
            }
        }
    }
    let mut made = vec![0.0; plane.len()];
    for y in 0..height {
        for x in 0..width {
            made[y * width + x] = TAPS
                .iter()
                .map(|&(tap, weight)| weight * rows[y * width + mirror(x as isize + tap * step, width)])
                .sum();
        }
    }
    made
}

impl Level {
    /// Level `level` of exemplars `smoothed` for it; `thinned` keeps every 2^level-th pixel only.
    pub(crate) fn new(
        exemplars: &[Exemplar],
        stacks: &[Vec<Vec<f32>>],
        atlas: &Atlas,
        level: usize,
        half: usize,
        thinned: bool,
    ) -> Self {
        let step = 1_usize << level;
        let phases = if thinned { 1 } else { step };
        let channels = exemplars[0].channels();
        let tile = |n: usize| n.div_ceil(step);
        let width = exemplars.iter().map(|e| tile(e.shape().1) * phases).max().unwrap_or(0);
        let height: usize = exemplars.iter().map(|e| tile(e.shape().0) * phases).sum();
        // Windows read whole lanes, which extend beyond the last row.
        let stride = width * height + width * half + 4 * LANES;
        let mut made = Self {
            step,
            width,
            values: vec![0.0; stride * channels],
            stride,
            pixel: vec![NONE; width * height],
            place: vec![NONE; atlas.pixels()],
            owner: vec![0; width * height],
            windows: vec![Vec::new(); exemplars.len()],
            places: vec![Vec::new(); exemplars.len()],
        };
        let mut first_row = 0;
        for (sheet, exemplar) in exemplars.iter().enumerate() {
            let (rows, columns) = exemplar.shape();
            let (tile_rows, tile_columns) = (tile(rows), tile(columns));
            for y in 0..tile_rows * phases {
                for x in 0..tile_columns * phases {
                    let (row, column) = (
                        y % tile_rows * step + y / tile_rows,
                        x % tile_columns * step + x / tile_columns,
                    );
                    if row >= rows || column >= columns {
                        continue;
                    }
                    let place = (first_row + y) * width + x;
                    let pixel = atlas.at(sheet, row, column, 1);
                    made.pixel[place] = number(pixel);
                    made.place[pixel] = number(place);
                    made.places[sheet].push(number(place));
                    for channel in 0..channels {
                        made.values[channel * stride + place] =
                            stacks[sheet][level][channel * rows * columns + row * columns + column];
                    }
                    let fits = |i: usize, n: usize| i >= half * step && i + half * step < n;
                    if fits(row, rows) && fits(column, columns) {
                        made.owner[place] = small(sheet) + 1;
                        made.windows[sheet].push(number(place));
                    }
                }
            }
            first_row += tile_rows * phases;
        }
        made
    }

    /// Value of a channel at a place.
    #[inline]
    pub(crate) fn value(&self, channel: usize, place: u32) -> f32 {
        self.values[channel * self.stride + place as usize]
    }

    /// Whether the window about this place is complete and of this exemplar.
    #[inline]
    pub(crate) fn fits(&self, place: usize, sheet: usize) -> bool {
        self.owner
            .get(place)
            .is_some_and(|&owner| usize::from(owner) == sheet + 1)
    }
}
