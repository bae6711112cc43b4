//! Growing a solid from seeds, one voxel after the other.

use std::collections::BTreeMap;

use ndarray::{Array3, Array4, ArrayView3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use stereology_metrics::Progress;

use crate::error::GrowError;
use crate::exemplar::check_exemplar;
use crate::filling::{Filling, NO_TEXEL};
use crate::flood_fill::flood_fill;
use crate::neighbours::is_inside;
use crate::numbers::MOST;
use crate::options::GrowOptions;
use crate::planes::layouts;
use crate::seeds::Seeds;

/// A grown solid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    /// Values (z, y, x, channel); 0 outside the mask.
    pub values: Array4<f32>,
    /// Cell of each voxel, from 1: measured areas first, then random seeds; 0 outside the mask.
    pub labels: Array3<u32>,
    /// Texel of the exemplar each voxel was copied from, row × width + column; `u32::MAX` for measured voxels and
    /// outside.
    pub sources: Array3<u32>,
    /// Voxels inside the mask.
    pub inside: usize,
    /// Voxels that have a value.
    pub filled: usize,
    /// Measured voxels, counted once.
    pub measured: usize,
    /// Measured voxels whose value differs from the measurement, found by comparing each.
    pub fixed_changed: usize,
    /// Cells.
    pub cells: usize,
    /// Seeds that were added because a connected component of the mask had none.
    pub added_seeds: usize,
    /// Voxels taken from the histogram because no plane contained a known voxel.
    pub by_histogram: usize,
    /// Mean distance of the best windows, squared units of the exemplar; 0 with window 0.
    pub mean_distance: f64,
}

/// Fills a mask (z, y, x) outwards from measured voxels and random seeds with the texture of an exemplar (row, column,
/// channel).
///
/// The window about each voxel lies in a random plane, turned or mirrored at random. The voxel gets the centre of a
/// window of the exemplar whose known voxels are similar: the distance is the sum of squared differences with normal
/// weights of standard deviation window / 6.4, and one of the windows within the tolerance of the least distance is
/// chosen at random. Measured voxels keep their values exactly. Connected measured voxels are one seed. Each connected
/// component of the mask (26 neighbours) that has no seed gets one.
///
/// Voxels whose windows do not contain each other are filled at the same time, by a schedule that gives the same solid
/// as filling one by one, with any number of threads. Cost: about 20 µs per voxel and core for windows of 5 × 5, and 50
/// ms for the tree of the exemplar's patches.
///
/// # Errors
///
/// [`GrowError`].
///
/// # References
///
/// Stone et al. 2014, section 4; Efros & Leung 1999.
///
/// # Examples
///
/// ```
/// use ndarray::{Array3, array};
/// use std::ops::ControlFlow;
/// use stereology_grow::{GrowOptions, grow};
///
/// let stone = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((x / 3 + y / 5) % 4) as f32);
/// let block = Array3::from_elem((8, 8, 8), true);
/// let measured = [([4, 4, 4], vec![7.0])];
/// let grown = grow(block.view(), stone.view(), &measured, &GrowOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert_eq!((grown.inside, grown.filled, grown.fixed_changed, grown.cells), (512, 512, 0, 1));
/// assert_eq!(grown.values[[4, 4, 4, 0]], 7.0);
/// # Ok::<(), stereology_grow::GrowError>(())
/// ```
pub fn grow(
    mask: ArrayView3<'_, bool>,
    exemplar: ArrayView3<'_, f32>,
    measured: &[([usize; 3], Vec<f32>)],
    options: &GrowOptions,
    progress: Progress<'_>,
) -> Result<Grown, GrowError> {
    let reach = check_exemplar(exemplar, options.window)?;
    let inside = mask.iter().filter(|here| **here).count();
    if inside == 0 {
        return Err(GrowError::EmptyMask);
    }
    if mask.len() >= MOST {
        return Err(GrowError::TooLarge);
    }
    let (nz, ny, nx) = mask.dim();
    options.check_memory([nz, ny, nx], inside, exemplar.dim().2)?;
    let fixed = checked(mask, exemplar.dim().2, measured)?;
    if fixed.is_empty() && options.seeds == 0 {
        return Err(GrowError::NoSeeds);
    }
    let places: Vec<[usize; 3]> = fixed.keys().copied().collect();
    let mut seeds = Seeds::measured(mask.dim(), &places);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(1);
    seeds.add_random(mask, options.seeds, &mut rng);
    seeds.complete(mask);
    let fill = flood_fill(mask, &seeds.voxels);
    let filling = Filling {
        exemplar,
        reach,
        layouts: if options.window == 0 {
            Vec::new()
        } else {
            layouts(options.planes, reach)
        },
        options,
        progress,
    };
    let given: Vec<(&[f32], u32)> = fixed.values().map(|value| (value.as_slice(), NO_TEXEL)).collect();
    let filled = filling.fill(&fill.order, &given, mask.dim())?;
    #[allow(clippy::float_cmp, reason = "what is given stays to the bit")]
    let fixed_changed = fixed
        .iter()
        .filter(|([z, y, x], value)| {
            value
                .iter()
                .enumerate()
                .any(|(c, v)| filled.values[[*z, *y, *x, c]] != *v)
        })
        .count();
    Ok(Grown {
        values: filled.values,
        labels: fill.labels,
        sources: filled.sources,
        inside,
        filled: fill.order.len(),
        measured: fixed.len(),
        fixed_changed,
        cells: seeds.cells,
        added_seeds: seeds.added,
        by_histogram: filled.by_histogram,
        mean_distance: filled.mean_distance,
    })
}

/// Measurements by voxel, each voxel once.
fn checked(
    mask: ArrayView3<'_, bool>,
    channels: usize,
    measured: &[([usize; 3], Vec<f32>)],
) -> Result<BTreeMap<[usize; 3], Vec<f32>>, GrowError> {
    let mut first: BTreeMap<[usize; 3], usize> = BTreeMap::new();
    let (nz, ny, nx) = mask.dim();
    for (number, (voxel, value)) in measured.iter().enumerate() {
        let [z, y, x] = *voxel;
        if !is_inside(&mask, *voxel) {
            return Err(GrowError::OutsideMask {
                number: number + 1,
                at: [x, y, z],
                size: [nx, ny, nz],
            });
        }
        if value.len() != channels || value.iter().any(|v| !v.is_finite()) {
            return Err(GrowError::Value {
                number: number + 1,
                found: value.clone(),
                channels,
            });
        }
        let earlier = *first.entry(*voxel).or_insert(number);
        if measured[earlier].1 != *value {
            return Err(GrowError::Contradicting {
                first: earlier + 1,
                second: number + 1,
                at: [x, y, z],
                a: measured[earlier].1.clone(),
                b: value.clone(),
            });
        }
    }
    Ok(first
        .into_iter()
        .map(|(voxel, number)| (voxel, measured[number].1.clone()))
        .collect())
}
