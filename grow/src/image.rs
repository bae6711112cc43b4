//! Efros and Leung's synthesis of images: grown outwards from a piece of the exemplar.

use ndarray::{Array3, ArrayView3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_metrics::Progress;

use crate::error::GrowError;
use crate::exemplar::check_exemplar;
use crate::filling::Filling;
use crate::flood_fill::flood_fill;
use crate::numbers::{MOST, number};
use crate::options::GrowOptions;
use crate::planes::image_layout;

/// An image of `height` × `width` pixels grown outwards from a random 3 × 3 piece of the exemplar (row, column,
/// channel) in its centre; windows are neither rotated nor reflected.
///
/// # Errors
///
/// [`GrowError`]; [`GrowError::EmptyMask`] for an image without pixels.
///
/// # References
///
/// Efros & Leung 1999; Stone et al. 2014, section 3 and figure 2.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_grow::{GrowOptions, grow_image};
///
/// let stripes = Array3::from_shape_fn((20, 20, 1), |(y, _, _)| (y / 2 % 2) as f32);
/// let options = GrowOptions::default().with_window(7);
/// let grown = grow_image(stripes.view(), [30, 40], &options, &|_| ControlFlow::Continue(()))?;
/// assert!((0..30).all(|y| (1..40).all(|x| grown[[y, x, 0]] == grown[[y, 0, 0]])));
/// # Ok::<(), stereology_grow::GrowError>(())
/// ```
pub fn grow_image(
    exemplar: ArrayView3<'_, f32>,
    [height, width]: [usize; 2],
    options: &GrowOptions,
    progress: Progress<'_>,
) -> Result<Array3<f32>, GrowError> {
    let reach = check_exemplar(exemplar, options.window)?;
    if height == 0 || width == 0 {
        return Err(GrowError::EmptyMask);
    }
    if height.checked_mul(width).is_none_or(|pixels| pixels >= MOST) {
        return Err(GrowError::TooLarge);
    }
    let (rows, columns, _) = exemplar.dim();
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(1);
    // A whole piece of the exemplar, at most 3 x 3 pixels, as large as fits.
    let piece = [height.min(rows).min(3), width.min(columns).min(3)];
    let from = [
        rng.random_range(0..=rows - piece[0]),
        rng.random_range(0..=columns - piece[1]),
    ];
    let to = [(height - piece[0]) / 2, (width - piece[1]) / 2];
    let cells = || (0..piece[0]).flat_map(|y| (0..piece[1]).map(move |x| (y, x)));
    let seeds: Vec<([usize; 3], u32)> = cells().map(|(y, x)| ([0, to[0] + y, to[1] + x], 1)).collect();
    let pixels: Vec<(Vec<f32>, u32)> = cells()
        .map(|(y, x)| {
            let (y, x) = (from[0] + y, from[1] + x);
            let value = exemplar.index_axis(Axis(0), y).index_axis(Axis(0), x).to_vec();
            (value, number(y * columns + x))
        })
        .collect();
    let given: Vec<(&[f32], u32)> = pixels.iter().map(|(value, texel)| (value.as_slice(), *texel)).collect();
    let mask = Array3::from_elem((1, height, width), true);
    let fill = flood_fill(mask.view(), &seeds);
    let filling = Filling {
        exemplar,
        reach,
        layouts: if options.window == 0 {
            Vec::new()
        } else {
            image_layout(reach)
        },
        options,
        progress,
    };
    let filled = filling.fill(&fill.order, &given, mask.dim())?;
    Ok(filled.values.index_axis_move(Axis(0), 0))
}
