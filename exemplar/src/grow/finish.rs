//! Grown stone without the seams of its cells.

use std::ops::ControlFlow;

use ndarray::{Array4, ArrayView3, Axis, Zip};

use super::{GrowError, Grown};
use crate::{Domain, Exemplar, FixedVoxel, SolidError, SolidOptions, finish_solid};

/// Removes the seams between the cells of grown stone: `iterations` of [`Method::Best`](crate::Method::Best) at each of its levels, the coarsest beginning with what was grown, measured voxels fixed.
///
/// `mask`, `exemplar` and `measured` are those of [`grow`](super::grow). Every voxel but the measured ones is again a texel of the exemplar. Slices of constant y, x and z look like the exemplar as it stands: it is for stone without a
/// direction. Cost: about 3 µs a voxel, iteration and core.
///
/// # Errors
///
/// [`GrowError::ExemplarTooSmall`] for an exemplar under 8 × 8 texels, [`GrowError::Finish`], [`GrowError::Cancelled`].
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_exemplar::grow::{GrowOptions, finish, grow};
///
/// let go = |_: f64| ControlFlow::Continue(());
/// let stone = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((x / 3 + y / 5) % 4) as f32);
/// let block = Array3::from_elem((10, 10, 10), true);
/// let measured = [([4, 4, 4], vec![7.0])];
/// let grown = grow(block.view(), stone.view(), &measured, &GrowOptions::default().with_seeds(3), &go)?;
/// let finished = finish(&grown, block.view(), stone.view(), &measured, 3, 0, &go)?;
/// assert_eq!((finished.values[[4, 4, 4, 0]], finished.fixed_changed), (7.0, 0));
/// # Ok::<(), stereology_exemplar::grow::GrowError>(())
/// ```
pub fn finish(
    grown: &Grown,
    mask: ArrayView3<'_, bool>,
    exemplar: ArrayView3<'_, f32>,
    measured: &[([usize; 3], Vec<f32>)],
    iterations: usize,
    seed: u64,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Grown, GrowError> {
    let (height, width, channels) = exemplar.dim();
    // Each channel from 0 to 1, so that chemistry counts as much as grey.
    let ranges: Vec<(f32, f32)> = exemplar
        .axis_iter(Axis(2))
        .map(|channel| {
            let (low, high) = channel
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
            (low, (high - low).max(f32::MIN_POSITIVE))
        })
        .collect();
    let brought = |value: f32, channel: usize| (value - ranges[channel].0) / ranges[channel].1;
    let mut picture = exemplar.to_owned();
    picture
        .indexed_iter_mut()
        .for_each(|((_, _, channel), v)| *v = brought(*v, channel));
    let fixed: Vec<FixedVoxel> = measured
        .iter()
        .map(|(at, value)| {
            (
                *at,
                value
                    .iter()
                    .enumerate()
                    .map(|(channel, &v)| brought(v, channel))
                    .collect(),
            )
        })
        .collect();
    let failed = |error: SolidError| match error {
        SolidError::Cancelled => GrowError::Cancelled,
        SolidError::ExemplarTooSmall { side, .. } => GrowError::ExemplarTooSmall {
            width,
            height,
            window: side,
        },
        other => GrowError::Finish(other),
    };
    let (nz, ny, nx) = mask.dim();
    let domain = Domain::new([nz, ny, nx])
        .and_then(|domain| domain.open().with_mask(mask))
        .and_then(|domain| domain.with_fixed(fixed))
        .map_err(failed)?;
    let options = SolidOptions::default().with_iterations(iterations).with_seed(seed);
    let picture = [Exemplar::colour(picture.view()).map_err(failed)?];
    let solid = finish_solid(&picture, &domain, grown.sources.view(), &options, progress).map_err(failed)?;
    let mut made = grown.clone();
    let mut values = Array4::zeros((nz, ny, nx, channels));
    Zip::from(values.lanes_mut(Axis(3)))
        .and(&mut made.sources)
        .and(&solid.sources)
        .and(grown.values.lanes(Axis(3)))
        .and(&mask)
        .for_each(|mut value, source, &pixel, before, &inside| {
            // Measured voxels are copied from no texel and stay as they are.
            if inside && *source != u32::MAX {
                *source = pixel;
                let (y, x) = (pixel as usize / width, pixel as usize % width);
                (0..channels).for_each(|c| value[c] = exemplar[[y, x, c]]);
            } else {
                value.assign(&before);
            }
        });
    made.values = values;
    #[allow(clippy::float_cmp, reason = "what is given stays to the bit")]
    let changed = |(at, value): &&([usize; 3], Vec<f32>)| {
        let [z, y, x] = *at;
        value.iter().enumerate().any(|(c, v)| made.values[[z, y, x, c]] != *v)
    };
    made.fixed_changed = measured.iter().filter(changed).count();
    Ok(made)
}
