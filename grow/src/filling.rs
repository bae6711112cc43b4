//! Filling voxels with texels in a given order.

use std::ops::ControlFlow;

use ndarray::{Array3, Array4, ArrayView3};
use rayon::prelude::*;
use stereology_metrics::Progress;

use crate::error::GrowError;
use crate::neighbours::moved;
use crate::numbers::{chosen, number, single};
use crate::options::GrowOptions;
use crate::patch_tree::{Known, PatchTree};
use crate::planes::Layout;
use crate::schedule::{Draw, Schedule, schedule};

/// Texel of a voxel that was not copied.
pub(crate) const NO_TEXEL: u32 = u32::MAX;

/// Everything that filling voxels in a given order needs.
pub(crate) struct Filling<'a> {
    pub(crate) exemplar: ArrayView3<'a, f32>,
    pub(crate) reach: usize,
    /// Layouts by plane and turn; empty for the histogram alone.
    pub(crate) layouts: Vec<Vec<Layout>>,
    pub(crate) options: &'a GrowOptions,
    pub(crate) progress: Progress<'a>,
}

pub(crate) struct Filled {
    pub(crate) values: Array4<f32>,
    pub(crate) sources: Array3<u32>,
    pub(crate) by_histogram: usize,
    pub(crate) mean_distance: f64,
}

impl Filling<'_> {
    /// Fills the voxels of an order; the first ones are given, with values and texels.
    pub(crate) fn fill(
        &self,
        order: &[[usize; 3]],
        given: &[(&[f32], u32)],
        size: (usize, usize, usize),
    ) -> Result<Filled, GrowError> {
        let (height, width, channels) = self.exemplar.dim();
        let report = |done: f64| match (self.progress)(done) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(GrowError::Cancelled),
        };
        report(0.0)?;
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
        let (mut done, mut reported, mut compared) = (0_usize, 0_usize, 0_usize);
        let mut texel_values = vec![0.0; channels];
        for round in &plan.rounds {
            let texels: Vec<(u32, f32)> = {
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
                    (Draw { choice, .. }, _) => (number(chosen(choice, height * width)), f32::NAN),
                };
                // A few voxels are filled faster than another thread starts.
                round
                    .par_iter()
                    .with_min_len(16)
                    .map_init(Scratch::default, |scratch, at| choose(scratch, *at))
                    .collect()
            };
            for (&at, &(texel, distance)) in round.iter().zip(&texels) {
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
            if done - reported > 2000 {
                reported = done;
                report(done as f64 / order.len() as f64)?;
            }
        }
        if self.layouts.is_empty() {
            filled.by_histogram = 0;
        }
        filled.mean_distance /= compared.max(1) as f64;
        Ok(filled)
    }

    /// Normal weights of the window's pixels (Efros & Leung: standard deviation side / 6.4).
    fn weights(&self) -> Vec<f32> {
        let side = 2 * self.reach + 1;
        let width = side as f64 / 6.4;
        let reach = self.reach as f64;
        (0..side * side)
            .map(|pixel| {
                let (u, v) = ((pixel / side) as f64 - reach, (pixel % side) as f64 - reach);
                single((-(u * u + v * v) / (2.0 * width * width)).exp())
            })
            .collect()
    }

    /// The texel that a voxel is copied from, and the least distance.
    #[expect(clippy::too_many_arguments, reason = "everything that one voxel depends on")]
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
                // The neighbour's texel minus its position in the window: the centre of the window that continues it.
                let (row, column) = ((pixel / side) as isize - reach, (pixel % side) as isize - reach);
                scratch.beside.extend(tree.beside(texel, -row, -column));
            }
        }
        scratch.known.iter_mut().for_each(|k| k.weight /= total);
        scratch.beside.sort_unstable();
        scratch.beside.dedup();
        let least = tree.similar(
            &scratch.known,
            &scratch.beside,
            self.options.search,
            self.options.tolerance,
            choice.to_bits(),
            &mut scratch.found,
        );
        (scratch.found[chosen(choice, scratch.found.len())].1, least)
    }
}

/// Lists that are reused for every voxel.
#[derive(Debug, Default)]
struct Scratch {
    known: Vec<Known>,
    beside: Vec<u32>,
    found: Vec<(f32, u32)>,
}
