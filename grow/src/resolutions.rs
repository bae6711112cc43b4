//! Multiresolution synthesis of images with a fixed neighbourhood (Wei and Levoy), which is faster than growing.

use ndarray::{Array3, ArrayView3, Axis, concatenate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_metrics::Progress;

use crate::error::GrowError;
use crate::exemplar::check_exemplar;
use crate::numbers::{MOST, chosen, number};
use crate::patch_tree::{Known, PatchTree};
use crate::search::Search;

/// How an image is synthesised by levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelOptions {
    /// Number of resolutions, each half of the one before.
    pub levels: usize,
    /// Side of the neighbourhood, odd, 3 to 15; its half above and to the left is known.
    pub window: usize,
    /// How similar neighbourhoods are searched for.
    pub search: Search,
    /// One of the neighbourhoods whose distance is at most 1 + this number times the least distance is chosen at
    /// random.
    pub tolerance: f32,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for LevelOptions {
    /// Three levels, 5 × 5, tolerance .1.
    fn default() -> Self {
        Self {
            levels: 3,
            window: 5,
            search: Search::default(),
            tolerance: 0.1,
            seed: 0,
        }
    }
}

impl LevelOptions {
    /// With `levels` levels.
    #[must_use]
    pub fn with_levels(self, levels: usize) -> Self {
        Self { levels, ..self }
    }

    /// With another window.
    #[must_use]
    pub fn with_window(self, window: usize) -> Self {
        Self { window, ..self }
    }

    /// With another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }
}

/// An image of `height` × `width` pixels that repeats without a seam, made row by row at each of several resolutions.
/// Every pixel is chosen by the half window above and to the left, which is always known, and by the 3 × 3 pixels about
/// its position one level coarser.
///
/// # Errors
///
/// [`GrowError`]; [`GrowError::Levels`] if the coarsest exemplar is smaller than the window.
///
/// # References
///
/// Wei & Levoy 2000, 2001; the multiresolution variant mentioned by Stone et al. 2014, section 3.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_grow::{LevelOptions, synthesize_by_levels};
///
/// let board = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((y / 4 + x / 4) % 2) as f32);
/// let made = synthesize_by_levels(board.view(), [40, 40], &LevelOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert_eq!(made.dim(), (40, 40, 1));
/// assert!(made.iter().all(|v| *v == 0.0 || *v == 1.0)); // only pixels of the exemplar
/// # Ok::<(), stereology_grow::GrowError>(())
/// ```
pub fn synthesize_by_levels(
    exemplar: ArrayView3<'_, f32>,
    [height, width]: [usize; 2],
    options: &LevelOptions,
    progress: Progress<'_>,
) -> Result<Array3<f32>, GrowError> {
    if options.window == 0 {
        return Err(GrowError::Window { window: 0 });
    }
    check_exemplar(exemplar, options.window)?;
    if height == 0 || width == 0 {
        return Err(GrowError::EmptyMask);
    }
    if height.checked_mul(width).is_none_or(|pixels| pixels >= MOST) {
        return Err(GrowError::TooLarge);
    }
    let (rows, columns, _) = exemplar.dim();
    // One level coarser a pixel stands for two along each axis. More than one window must fit, so that there is a
    // choice.
    let most = (1..)
        .take_while(|level| rows.min(columns) >> (level - 1) > options.window)
        .last()
        .unwrap_or(1);
    if !(1..=most).contains(&options.levels) {
        return Err(GrowError::Levels {
            width: columns,
            height: rows,
            window: options.window,
            levels: options.levels,
            most,
        });
    }
    let mut exemplars = vec![exemplar.to_owned()];
    for level in 1..options.levels {
        exemplars.push(halved(&exemplars[level - 1]));
    }
    let mut coarser: Option<(Array3<f32>, Array3<f32>)> = None;
    for level in (0..options.levels).rev() {
        let size = [height, width].map(|n| n.div_ceil(1 << level));
        let own = &exemplars[level];
        // The coarser level is added to the fine one as further channels.
        let (both, parent) = match &coarser {
            None => (own.clone(), None),
            Some((exemplar, made)) => {
                let (rows, columns, _) = own.dim();
                let wide = doubled(exemplar, [rows, columns]);
                let both = concatenate(Axis(2), &[own.view(), wide.view()]).unwrap_or_else(|_| own.clone());
                (both, Some(doubled(made, size)))
            }
        };
        let made = one_level(own, &both, parent.as_ref(), size, level, options, progress)?;
        coarser = Some((own.clone(), made));
    }
    Ok(coarser.map_or_else(|| Array3::zeros((height, width, 1)), |(_, made)| made))
}

/// One resolution, row by row.
fn one_level(
    exemplar: &Array3<f32>,
    both: &Array3<f32>,
    parent: Option<&Array3<f32>>,
    [height, width]: [usize; 2],
    level: usize,
    options: &LevelOptions,
    progress: Progress<'_>,
) -> Result<Array3<f32>, GrowError> {
    let (rows, columns, channels) = exemplar.dim();
    let samples = both.dim().2;
    let reach = options.window / 2;
    let tree = PatchTree::new(both.view(), reach);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(2 + level as u64);
    let mut sources = ndarray::Array2::from_shape_fn((height, width), |_| rng.random_range(0..number(rows * columns)));
    let mut made = Array3::zeros((height, width, channels));
    let copy = |made: &mut Array3<f32>, y: usize, x: usize, texel: u32| {
        let from = exemplar.index_axis(Axis(0), texel as usize / columns);
        made.index_axis_mut(Axis(0), y)
            .index_axis_mut(Axis(0), x)
            .assign(&from.index_axis(Axis(0), texel as usize % columns));
    };
    for ((y, x), &texel) in sources.indexed_iter() {
        copy(&mut made, y, x, texel);
    }
    let side = options.window;
    let (mut known, mut beside, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for y in 0..height {
        // Progress is reported for every row; the finest level takes most of the time.
        let done = (y as f64 / height as f64 + 1.0 / 3.0) / f64::powi(4.0, i32::try_from(level).unwrap_or(30));
        if progress(done.min(1.0)).is_break() {
            return Err(GrowError::Cancelled);
        }
        for x in 0..width {
            known.clear();
            beside.clear();
            for pixel in 0..side * side {
                let (v, u) = (pixel / side, pixel % side);
                // The output repeats; the pixels above its first rows are still the initial noise.
                let at = [
                    (y + height * side + v - reach) % height,
                    (x + width * side + u - reach) % width,
                ];
                if pixel < side * side / 2 {
                    for c in 0..channels {
                        known.push(Known {
                            sample: pixel * samples + c,
                            value: made[[at[0], at[1], c]],
                            weight: 1.0,
                        });
                    }
                    let back = [reach as isize - v as isize, reach as isize - u as isize];
                    beside.extend(tree.beside(sources[at], back[0], back[1]));
                }
                let about = |p: usize| p.abs_diff(reach).is_multiple_of(2) && p.abs_diff(reach) <= 2;
                if let Some(parent) = parent.filter(|_| about(v) && about(u)) {
                    for c in 0..channels {
                        let value = parent[[at[0], at[1], c]];
                        known.push(Known {
                            sample: pixel * samples + channels + c,
                            value,
                            weight: 1.0,
                        });
                    }
                }
            }
            let total = known.len() as f32;
            known.iter_mut().for_each(|k| k.weight /= total);
            beside.sort_unstable();
            beside.dedup();
            let salt = rng.random::<u32>();
            tree.similar(&known, &beside, options.search, options.tolerance, salt, &mut found);
            let texel = found[chosen(rng.random::<f32>(), found.len())].1;
            sources[[y, x]] = texel;
            copy(&mut made, y, x, texel);
        }
    }
    Ok(made)
}

/// Half the resolution: means of 2 × 2 pixels; a last odd row or column is left out.
fn halved(image: &Array3<f32>) -> Array3<f32> {
    let (height, width, channels) = image.dim();
    Array3::from_shape_fn((height / 2, width / 2, channels), |(y, x, c)| {
        let at = |dy: usize, dx: usize| image[[2 * y + dy, 2 * x + dx, c]];
        (at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1)) / 4.0
    })
}

/// Twice the resolution, each pixel four times, cropped or continued to the given size.
fn doubled(image: &Array3<f32>, [height, width]: [usize; 2]) -> Array3<f32> {
    let (rows, columns, channels) = image.dim();
    Array3::from_shape_fn((height, width, channels), |(y, x, c)| {
        image[[(y / 2).min(rows - 1), (x / 2).min(columns - 1), c]]
    })
}
