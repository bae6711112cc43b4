//! Growing a solid: seeds, order, and one voxel after the other.
#![allow(
    clippy::cast_possible_truncation,
    reason = "texels, voxels and cells are fewer than 2^32: `grow` refuses more"
)]

use super::flood_fill::flood_fill;
use super::patch_tree::{Known, PatchTree};
use super::planes::{Layout, layouts};
use super::schedule::{Draw, Schedule, schedule};
use super::voxels::{connected_areas, is_inside, moved};
use super::{GrowError, Planes, Search};
use ndarray::{Array3, Array4, ArrayView3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// How to grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowOptions {
    /// Side of the window that is compared, pixels: 0 (the exemplar's histogram alone), or odd, 3 to 15.
    pub window: usize,
    /// Random seeds besides the measurements.
    pub seeds: usize,
    /// Planes in which windows lie.
    pub planes: Planes,
    /// How windows are looked for.
    pub search: Search,
    /// A window is taken at random among those whose distance is at most 1 + this times the least.
    pub tolerance: f32,
    /// Everything random.
    pub seed: u64,
}

impl Default for GrowOptions {
    /// Windows of 5 × 5 in the planes of the axes, tolerance .1, no random seeds.
    fn default() -> Self {
        Self {
            window: 5,
            seeds: 0,
            planes: Planes::Axis,
            search: Search::default(),
            tolerance: 0.1,
            seed: 0,
        }
    }
}

impl GrowOptions {
    /// With another window.
    #[must_use]
    pub fn with_window(self, window: usize) -> Self {
        Self { window, ..self }
    }

    /// With random seeds.
    #[must_use]
    pub fn with_seeds(self, seeds: usize) -> Self {
        Self { seeds, ..self }
    }

    /// With other planes.
    #[must_use]
    pub fn with_planes(self, planes: Planes) -> Self {
        Self { planes, ..self }
    }

    /// With another search.
    #[must_use]
    pub fn with_search(self, search: Search) -> Self {
        Self { search, ..self }
    }

    /// With another seed of everything random.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }
}

/// What was grown.
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    /// Values (z, y, x, channel); 0 outside the mask.
    pub values: Array4<f32>,
    /// Cell of each voxel, from 1: measured areas first, then random seeds; 0 outside the mask.
    pub labels: Array3<u32>,
    /// Texel of the exemplar each voxel was copied from, row × width + column; `u32::MAX` for measured voxels and outside.
    pub sources: Array3<u32>,
    /// Voxels inside the mask.
    pub inside: usize,
    /// Voxels that have a value.
    pub filled: usize,
    /// Measured voxels, counted once.
    pub measured: usize,
    /// Measured voxels whose value is not the measured one, found by looking at each again.
    pub fixed_changed: usize,
    /// Cells.
    pub cells: usize,
    /// Seeds that were added because a part of the mask had none.
    pub added_seeds: usize,
    /// Voxels taken from the histogram because no plane showed anything known.
    pub by_histogram: usize,
    /// Mean distance of the best windows, squared units of the exemplar; 0 with window 0.
    pub mean_distance: f64,
}

/// Texel of a voxel that was copied from none.
const NO_TEXEL: u32 = u32::MAX;

/// Fills a mask (z, y, x) outwards from measured voxels and random seeds with the texture of an exemplar (row, column, channel).
///
/// Each voxel looks at the window about it in a random plane, turned or mirrored at random, and is given the middle of a window of the exemplar that looks like what is known of it: the sum of
/// squared differences, weighted by a normal distribution of width window / 6.4; one at random among those within the tolerance of the best. Measured voxels keep their values exactly. Connected measured
/// voxels are one seed; parts of the mask without a seed get one each.
///
/// Voxels whose windows do not show each other are filled at once, by a schedule that gives the same solid as one by one, at any number of threads. Cost: about 20 µs a voxel and core
/// with windows of 5 × 5, besides 50 ms for the tree of the exemplar's patches.
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
/// use stereology_exemplar::grow::{GrowOptions, grow};
///
/// let stone = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((x / 3 + y / 5) % 4) as f32);
/// let block = Array3::from_elem((8, 8, 8), true);
/// let measured = [([4, 4, 4], vec![7.0])];
/// let grown = grow(block.view(), stone.view(), &measured, &GrowOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert_eq!((grown.inside, grown.filled, grown.fixed_changed, grown.cells), (512, 512, 0, 1));
/// assert_eq!(grown.values[[4, 4, 4, 0]], 7.0);
/// # Ok::<(), stereology_exemplar::grow::GrowError>(())
/// ```
pub fn grow(
    mask: ArrayView3<'_, bool>,
    exemplar: ArrayView3<'_, f32>,
    measured: &[([usize; 3], Vec<f32>)],
    options: &GrowOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Grown, GrowError> {
    let reach = check_exemplar(exemplar, options.window)?;
    let inside = mask.iter().filter(|here| **here).count();
    if inside == 0 {
        return Err(GrowError::EmptyMask);
    }
    if u32::try_from(mask.len()).is_err() || u32::try_from(exemplar.len()).is_err() {
        return Err(GrowError::TooLarge);
    }
    let fixed = checked(mask, exemplar.dim().2, measured)?;
    if fixed.is_empty() && options.seeds == 0 {
        return Err(GrowError::NoSeeds);
    }
    let places: Vec<[usize; 3]> = fixed.keys().copied().collect();
    let areas = connected_areas(&places);
    let mut cells = areas.iter().map(|area| area + 1).max().unwrap_or(0);
    let mut seeds: Vec<([usize; 3], u32)> = places
        .iter()
        .zip(&areas)
        .map(|(at, area)| (*at, *area as u32 + 1))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(1);
    for voxel in random_voxels(mask, &places, options.seeds, &mut rng) {
        cells += 1;
        seeds.push((voxel, cells as u32));
    }
    let mut fill = flood_fill(mask, &seeds);
    let mut added_seeds = 0;
    while fill.order.len() < inside {
        // A part of the mask that no front reached: its first voxel.
        let free = mask.indexed_iter().find(|(at, here)| **here && fill.labels[*at] == 0);
        let Some(((z, y, x), _)) = free else { break };
        cells += 1;
        added_seeds += 1;
        seeds.push(([z, y, x], cells as u32));
        fill = flood_fill(mask, &seeds);
    }
    let work = Work {
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
    let filled = work.fill(&fill.order, &given, mask.dim())?;
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
        cells,
        added_seeds,
        by_histogram: filled.by_histogram,
        mean_distance: filled.mean_distance,
    })
}

/// Half the window, if the exemplar is one that windows can be taken from.
pub(super) fn check_exemplar(exemplar: ArrayView3<'_, f32>, window: usize) -> Result<usize, GrowError> {
    if window != 0 && !(window % 2 == 1 && (3..=15).contains(&window)) {
        return Err(GrowError::Window { window });
    }
    let (height, width, _) = exemplar.dim();
    let least = window.max(1);
    if height < least || width < least || exemplar.is_empty() {
        return Err(GrowError::ExemplarTooSmall { width, height, window });
    }
    if let Some(((row, column, _), _)) = exemplar.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(GrowError::NotFinite { row, column });
    }
    let first = exemplar.index_axis(ndarray::Axis(0), 0);
    let first = first.index_axis(ndarray::Axis(0), 0);
    if exemplar.lanes(ndarray::Axis(2)).into_iter().all(|pixel| pixel == first) {
        return Err(GrowError::ConstantExemplar);
    }
    Ok(window / 2)
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

/// Voxels of the mask drawn without repetition, none of them `taken`; fewer if there are no more.
fn random_voxels(
    mask: ArrayView3<'_, bool>,
    taken: &[[usize; 3]],
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<[usize; 3]> {
    if count == 0 {
        return Vec::new();
    }
    let mut free: Vec<[usize; 3]> = mask
        .indexed_iter()
        .filter(|(_, here)| **here)
        .map(|((z, y, x), _)| [z, y, x])
        .filter(|voxel| taken.binary_search(voxel).is_err())
        .collect();
    let count = count.min(free.len());
    for i in 0..count {
        let j = rng.random_range(i..free.len());
        free.swap(i, j);
    }
    free.truncate(count);
    free
}

/// What is needed to fill voxels in an order.
pub(super) struct Work<'a> {
    pub exemplar: ArrayView3<'a, f32>,
    pub reach: usize,
    /// By plane and turn; none for the histogram alone.
    pub layouts: Vec<Vec<Layout>>,
    pub options: &'a GrowOptions,
    pub progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

pub(super) struct Filled {
    pub values: Array4<f32>,
    pub sources: Array3<u32>,
    pub by_histogram: usize,
    pub mean_distance: f64,
}

impl Work<'_> {
    /// Fills the voxels of an order, the first of which are given: values and texels.
    pub(super) fn fill(
        &self,
        order: &[[usize; 3]],
        given: &[(&[f32], u32)],
        size: (usize, usize, usize),
    ) -> Result<Filled, GrowError> {
        let (height, width, channels) = self.exemplar.dim();
        let told = |done: f64| match (self.progress)(done) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(GrowError::Cancelled),
        };
        told(0.0)?;
        let plan = schedule(order, given.len(), size, &self.layouts, self.options.seed);
        let tree = (!self.layouts.is_empty()).then(|| PatchTree::new(self.exemplar, self.reach));
        let weights = self.weights();
        let mut filled = Filled {
            values: Array4::zeros((size.0, size.1, size.2, channels)),
            sources: Array3::from_elem(size, NO_TEXEL),
            by_histogram: 0,
            mean_distance: 0.0,
        };
        let write = |filled: &mut Filled, at: usize, value: &[f32], texel: u32| {
            let [z, y, x] = order[at];
            filled.sources[order[at]] = texel;
            value
                .iter()
                .enumerate()
                .for_each(|(c, v)| filled.values[[z, y, x, c]] = *v);
        };
        for (at, (value, texel)) in given.iter().enumerate() {
            write(&mut filled, at, value, *texel);
        }
        let (mut done, mut told_at, mut compared) = (0_usize, 0_usize, 0_usize);
        let mut texel_values = vec![0.0; channels];
        for round in &plan.rounds {
            let chosen: Vec<(u32, f32)> = {
                let filled = &filled;
                let choose = |scratch: &mut Scratch, at: u32| match (plan.draws[at as usize], &tree) {
                    (
                        Draw {
                            window: Some(window),
                            choice,
                        },
                        Some(tree),
                    ) => self.choose(
                        tree,
                        &plan,
                        &weights,
                        filled,
                        order[at as usize],
                        window,
                        choice,
                        scratch,
                    ),
                    (Draw { choice, .. }, _) => (pick(choice, height * width) as u32, f32::NAN),
                };
                // A handful is filled before another thread has begun.
                round
                    .par_iter()
                    .with_min_len(16)
                    .map_init(Scratch::default, |scratch, at| choose(scratch, *at))
                    .collect()
            };
            for (&at, &(texel, distance)) in round.iter().zip(&chosen) {
                if distance.is_nan() {
                    filled.by_histogram += 1;
                } else {
                    filled.mean_distance += f64::from(distance);
                    compared += 1;
                }
                let (y, x) = (texel as usize / width, texel as usize % width);
                texel_values
                    .iter_mut()
                    .enumerate()
                    .for_each(|(c, v)| *v = self.exemplar[[y, x, c]]);
                write(&mut filled, at as usize, &texel_values, texel);
            }
            done += round.len();
            if done - told_at > 2000 {
                told_at = done;
                told(done as f64 / order.len() as f64)?;
            }
        }
        if self.layouts.is_empty() {
            filled.by_histogram = 0;
        }
        filled.mean_distance /= compared.max(1) as f64;
        Ok(filled)
    }

    /// Normal weights of the window's pixels (Efros & Leung: width side / 6.4).
    fn weights(&self) -> Vec<f32> {
        let side = 2 * self.reach + 1;
        let width = side as f64 / 6.4;
        let reach = self.reach as f64;
        (0..side * side)
            .map(|pixel| {
                let (u, v) = ((pixel / side) as f64 - reach, (pixel % side) as f64 - reach);
                (-(u * u + v * v) / (2.0 * width * width)).exp() as f32
            })
            .collect()
    }

    /// The texel a voxel is copied from, and the least distance.
    #[expect(clippy::too_many_arguments, reason = "one voxel's whole view of the work")]
    fn choose(
        &self,
        tree: &PatchTree<'_>,
        plan: &Schedule,
        weights: &[f32],
        filled: &Filled,
        voxel: [usize; 3],
        (plane, turn): (u8, u8),
        choice: f32,
        scratch: &mut Scratch,
    ) -> (u32, f32) {
        let channels = self.exemplar.dim().2;
        let side = 2 * self.reach + 1;
        let reach = self.reach as isize;
        let own = plan.place[voxel];
        scratch.known.clear();
        scratch.beside.clear();
        let mut total = 0.0;
        for (pixel, step) in self.layouts[plane as usize][turn as usize].iter().enumerate() {
            let near = step.and_then(|step| moved(voxel, step));
            let Some(near) = near.filter(|near| plan.place.get(*near).is_some_and(|&place| place < own)) else {
                continue;
            };
            let [z, y, x] = near;
            for c in 0..channels {
                scratch.known.push(Known {
                    sample: pixel * channels + c,
                    value: filled.values[[z, y, x, c]],
                    weight: weights[pixel],
                });
            }
            total += weights[pixel] * channels as f32;
            let texel = filled.sources[near];
            if texel != NO_TEXEL {
                // The neighbour's texel less its place in the window: the middle that would continue it.
                let (row, column) = ((pixel / side) as isize - reach, (pixel % side) as isize - reach);
                scratch.beside.extend(tree.beside(texel, -row, -column));
            }
        }
        scratch.known.iter_mut().for_each(|k| k.weight /= total);
        scratch.beside.sort_unstable();
        scratch.beside.dedup();
        let least = tree.like(
            &scratch.known,
            &scratch.beside,
            self.options.search,
            self.options.tolerance,
            choice.to_bits(),
            &mut scratch.found,
        );
        (scratch.found[pick(choice, scratch.found.len())].1, least)
    }
}

/// Lists that are used again for every voxel.
#[derive(Debug, Default)]
struct Scratch {
    known: Vec<Known>,
    beside: Vec<u32>,
    found: Vec<(f32, u32)>,
}

/// One of `n` by a number from 0 to 1.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and n")]
pub(super) fn pick(choice: f32, n: usize) -> usize {
    ((f64::from(choice) * n as f64) as usize).min(n.saturating_sub(1))
}
