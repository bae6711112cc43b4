//! Reconstruction exactly as in section 4.4 of the paper.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::bounds::{Limit, Region};
use crate::budget::Levels;
use crate::conversions::index;
use crate::dual::DualGraph;
use crate::error::MicrogeometryError;
use crate::labelling::{Labelling, signed};
use crate::leftovers::average;
use stereology_metrics::Progress;

pub(crate) struct Paper<'a> {
    pub(crate) graph: &'a DualGraph,
    pub(crate) weights: &'a [i64],
    /// Mean weight of a triangle.
    pub(crate) unit: i64,
    pub(crate) bin: f64,
    pub(crate) seed: u64,
    pub(crate) progress: Progress<'a>,
}

impl Paper<'_> {
    /// From the bins farthest from the interface inwards, both regions in turn: first the triangles whose range forces
    /// them into the bin, most extreme first, while it holds labels; then random triangles whose range holds the bin's
    /// inner edge.
    pub(crate) fn run(&self, mut room: [Levels; 2]) -> Result<Labelling, MicrogeometryError> {
        let count = self.graph.len();
        let levels = room[0].len().max(room[1].len());
        room.iter_mut().for_each(|side| side.resize(levels, 0));
        // No looking ahead: any weight may be forced into a level.
        let endless = vec![i64::MAX / 2; levels];
        let limit = Limit {
            room: &endless,
            below: 0,
            spare: 0,
        };
        let region = || Region::new(self.graph, self.weights, self.bin, levels, 0);
        let mut regions = [region(), region()];
        let mut labelled = vec![false; count];
        let mut labels = vec![0.0; count];
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut open: Vec<u32> = (0..index(count)).collect();
        for level in (0..levels).rev() {
            if (self.progress)(1.0 - (level + 1) as f64 / levels as f64).is_break() {
                return Err(MicrogeometryError::Cancelled);
            }
            let value = level as f64 * self.bin;
            for side in [1, 0] {
                for t in regions[side].forced_into(level, &labelled) {
                    let i = t as usize;
                    if room[side][level] <= 0 {
                        break;
                    }
                    room[side][level] -= self.weights[i];
                    labels[i] = signed(side, regions[side].bound[i]);
                    labelled[i] = true;
                }
                open.retain(|&t| !labelled[t as usize]);
                let may = |t: &u32| {
                    let i = *t as usize;
                    regions[side].bound[i] <= value && -regions[1 - side].bound[i] >= value
                };
                let mut eligible: Vec<u32> = open.iter().copied().filter(may).collect();
                let wanted = usize::try_from(room[side][level].max(0) / self.unit)
                    .unwrap_or(0)
                    .min(eligible.len());
                let (seeds, _) = eligible.partial_shuffle(&mut random, wanted);
                // Labels of one bin and sign do not bound each other, so they are assigned at once.
                let _ = regions[side].spread(seeds, value, -value - self.bin, &mut labelled, &limit);
                for &t in seeds.iter() {
                    labels[t as usize] = signed(side, value);
                }
                room[side][level] -= seeds.iter().map(|&t| self.weights[t as usize]).sum::<i64>();
                open.retain(|&t| !labelled[t as usize]);
            }
        }
        average(self.graph, &labelled, &mut labels);
        let left_over = open.len() as f64 / count as f64;
        Ok(Labelling { labels, left_over })
    }
}
