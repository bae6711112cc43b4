//! Removal of the seams between the cells of grown stone.

use ndarray::{Array4, ArrayView3, Axis, Zip};
use stereology_exemplar::{Domain, Exemplar, FixedVoxel, SolidError, SolidOptions, finish_solid};
use stereology_grow::{Grown, Progress};

/// Removes the seams between the cells of grown stone: `iterations` of
/// [`Method::Best`](stereology_exemplar::Method::Best) at each of its levels. The coarsest level starts with the grown
/// stone, and measured voxels are fixed.
///
/// `mask`, `exemplar` and `measured` are those of [`grow`](stereology_grow::grow). Every voxel except the measured ones
/// is a texel of the exemplar again. Slices of constant y, x and z look like the exemplar in its given orientation, so
/// the pass is for stone without a preferred direction. Cost: about 3 µs per voxel, iteration and core.
///
/// # Errors
///
/// [`SolidError`], such as [`SolidError::ExemplarTooSmall`] for an exemplar of fewer than 8 × 8 texels.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology::grow::{GrowOptions, grow};
/// use stereology::pipeline::finish_grown;
///
/// let go = |_: f64| ControlFlow::Continue(());
/// let stone = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((x / 3 + y / 5) % 4) as f32);
/// let block = Array3::from_elem((10, 10, 10), true);
/// let measured = [([4, 4, 4], vec![7.0])];
/// let grown = grow(block.view(), stone.view(), &measured, &GrowOptions::default().with_seeds(3), &go)?;
/// let finished = finish_grown(&grown, block.view(), stone.view(), &measured, 3, 0, &go)?;
/// assert_eq!((finished.values[[4, 4, 4, 0]], finished.fixed_changed), (7.0, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn finish_grown(
    grown: &Grown,
    mask: ArrayView3<'_, bool>,
    exemplar: ArrayView3<'_, f32>,
    measured: &[([usize; 3], Vec<f32>)],
    iterations: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Grown, SolidError> {
    let (_, width, channels) = exemplar.dim();
    // Each channel is scaled to 0 to 1, so that chemistry counts as much as grey levels.
    let ranges: Vec<(f32, f32)> = exemplar
        .axis_iter(Axis(2))
        .map(|channel| {
            let (low, high) = channel
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
            (low, (high - low).max(f32::MIN_POSITIVE))
        })
        .collect();
    let scaled = |value: f32, channel: usize| (value - ranges[channel].0) / ranges[channel].1;
    let mut image = exemplar.to_owned();
    image
        .indexed_iter_mut()
        .for_each(|((_, _, channel), v)| *v = scaled(*v, channel));
    let fixed: Vec<FixedVoxel> = measured
        .iter()
        .map(|(at, value)| {
            (
                *at,
                value
                    .iter()
                    .enumerate()
                    .map(|(channel, &v)| scaled(v, channel))
                    .collect(),
            )
        })
        .collect();
    let (nz, ny, nx) = mask.dim();
    let domain = Domain::new([nz, ny, nx])
        .and_then(|domain| domain.open().with_mask(mask))
        .and_then(|domain| domain.with_fixed(fixed))?;
    let options = SolidOptions::default().with_iterations(iterations).with_seed(seed);
    let image = [Exemplar::colour(image.view())?];
    let solid = finish_solid(&image, &domain, grown.sources.view(), &options, progress)?;
    let mut finished = grown.clone();
    let mut values = Array4::zeros((nz, ny, nx, channels));
    Zip::from(values.lanes_mut(Axis(3)))
        .and(&mut finished.sources)
        .and(&solid.sources)
        .and(grown.values.lanes(Axis(3)))
        .and(&mask)
        .for_each(|mut value, source, &pixel, before, &inside| {
            // Measured voxels have no texel and keep their values.
            if inside && *source != u32::MAX {
                *source = pixel;
                let (y, x) = (pixel as usize / width, pixel as usize % width);
                (0..channels).for_each(|c| value[c] = exemplar[[y, x, c]]);
            } else {
                value.assign(&before);
            }
        });
    finished.values = values;
    #[allow(clippy::float_cmp, reason = "measured values are kept to the bit")]
    let changed = |(at, value): &&([usize; 3], Vec<f32>)| {
        let [z, y, x] = *at;
        value
            .iter()
            .enumerate()
            .any(|(c, v)| finished.values[[z, y, x, c]] != *v)
    };
    finished.fixed_changed = measured.iter().filter(changed).count();
    Ok(finished)
}
