//! The block test: features of blocks of both sides, and a classifier between them.

use ndarray::{Array2, Axis};
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::classifier::classifier_test;
use super::features::{NAMES, RESOLUTION, features};
use super::source::BlockSource;
use crate::level::Level;

/// Whether blocks of a solid's slices can be distinguished from blocks of its exemplar.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockTest {
    /// Fraction of the blocks whose side a linear classifier finds without having seen them: about .5 if it cannot
    /// distinguish them, 1 if it always can.
    pub accuracy: f64,
    /// Probability of at least this accuracy if blocks of both sides are exchangeable.
    pub p_value: f64,
    /// Blocks of each side.
    pub blocks: usize,
    /// Side of a block, pixels.
    pub side: usize,
    /// The features of both sides, the largest difference first.
    pub features: Vec<FeatureMeans>,
}

/// Means of one feature over the blocks of each side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureMeans {
    /// Its name.
    pub name: &'static str,
    /// Mean over the blocks of the exemplar.
    pub exemplar: f64,
    /// Mean over the blocks of the solid.
    pub solid: f64,
    /// Difference of the means, in standard deviations of all blocks.
    pub difference: f64,
}

/// Sides of blocks in pixels: features of smaller blocks vary too much; larger ones are rarely numerous enough.
const SIDES: std::ops::RangeInclusive<usize> = 16..=64;
/// Blocks of each side that are worth smaller blocks.
const ENOUGH: usize = 48;
/// Blocks of each side that are used at most.
const MOST: usize = 128;
/// Level of the test: one false alarm in a hundred solids of exchangeable blocks.
const ALPHA: f64 = 0.01;
/// Accuracy above which the difference is large: four of five blocks. Two normal distributions of equal width are
/// separated so well at a distance of 1.7 standard deviations.
const DISTINCT: f64 = 0.8;
/// Blocks of each side below which all must be recognised: the accuracy of 24 + 24 blocks has a standard error of .06.
const MANY: usize = 24;

impl BlockTest {
    /// [`Level::Good`] with a p-value above .01; else [`Level::Bad`] with an accuracy of at least .8, or of 1 with
    /// fewer than 24 blocks of each side; else [`Level::Care`].
    #[must_use]
    pub fn level(&self) -> Level {
        let distinct = if self.blocks < MANY { 1.0 } else { DISTINCT };
        match (self.p_value <= ALPHA, self.accuracy >= distinct) {
            (false, _) => Level::Good,
            (true, false) => Level::Care,
            (true, true) => Level::Bad,
        }
    }

    /// Means of the feature of this name.
    #[must_use]
    pub fn feature(&self, name: &str) -> Option<&FeatureMeans> {
        self.features.iter().find(|feature| feature.name == name)
    }
}

/// Tests whether blocks of a solid's slices can be distinguished from blocks of its exemplar: a linear classifier of 17
/// features (contrast and shape of the grey levels; power and tails of three octave bands, and the coupling of their
/// amplitudes; coherence and direction of the gradients), cross-validated, with a p-value by permutation
/// ([`classifier_test`]).
///
/// Pixels of one block, and neighbouring slices, depend on each other, so blocks are the units. Their side is the
/// largest of 16 to 64 pixels that leaves 48 blocks on each side. The p-value is that of exchangeable blocks: for
/// structures up to a tenth of a block the rate of false alarms is as stated; coarser ones raise it, since neighbouring
/// blocks then depend on each other. The mean grey level is no feature, because it varies over the longest distances.
/// `None` if a side has fewer than 8 blocks of 16 pixels. Cost: about 5 ms per block and core.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_metrics::{BlockSource, block_test};
///
/// // Waves along columns and along rows.
/// let wave = |v: usize| 0.5 + 0.3 * (v as f32 * 0.7).sin();
/// let noise = |y: usize, x: usize| ((y * 7919 + x * 104_729) % 101) as f32 / 1000.0;
/// let across = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| wave(x) + noise(y, x));
/// let along = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| wave(y) + noise(x, y));
/// let test = block_test(&BlockSource::Images(&[across.view()]), &BlockSource::Images(&[along.view()]), 0).unwrap();
/// assert!(test.accuracy > 0.95 && test.p_value < 0.01);
/// ```
#[must_use]
pub fn block_test(exemplar: &BlockSource<'_>, solid: &BlockSource<'_>, seed: u64) -> Option<BlockTest> {
    let side = SIDES
        .rev()
        .find(|&side| exemplar.count(side).min(solid.count(side)) >= ENOUGH)
        .unwrap_or(*SIDES.start());
    let (of_exemplar, of_solid) = (exemplar.places(side), solid.places(side));
    let blocks = of_exemplar.len().min(of_solid.len()).min(MOST);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut chosen = |from: Vec<super::source::Place<'_>>| {
        let mut taken = sample(&mut rng, from.len(), blocks).into_vec();
        taken.sort_unstable();
        let rows: Vec<[f64; NAMES.len()]> = taken
            .into_par_iter()
            .map(|i| features(from[i].image, from[i].corner, side))
            .collect();
        Array2::from(rows)
    };
    let (a, b) = (chosen(of_exemplar), chosen(of_solid));
    let test = classifier_test(a.view(), b.view(), RESOLUTION, seed)?;
    let mut means: Vec<FeatureMeans> = NAMES
        .into_iter()
        .enumerate()
        .map(|(k, name)| feature_means(name, a.index_axis(Axis(1), k).iter(), b.index_axis(Axis(1), k).iter()))
        .collect();
    means.sort_by(|p, q| q.difference.abs().total_cmp(&p.difference.abs()));
    Some(BlockTest {
        accuracy: test.accuracy,
        p_value: test.p_value,
        blocks,
        side,
        features: means,
    })
}

fn feature_means<'a>(
    name: &'static str,
    exemplar: impl Iterator<Item = &'a f64> + Clone,
    solid: impl Iterator<Item = &'a f64> + Clone,
) -> FeatureMeans {
    let mean = |values: &mut dyn Iterator<Item = &'a f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let all = exemplar.clone().chain(solid.clone());
    let centre = mean(&mut all.clone());
    let count = all.clone().count().max(1) as f64;
    let variance = all.map(|v| (v - centre).powi(2)).sum::<f64>() / count;
    let (exemplar, solid) = (mean(&mut exemplar.clone()), mean(&mut solid.clone()));
    FeatureMeans {
        name,
        exemplar,
        solid,
        difference: (exemplar - solid) / (variance + RESOLUTION * RESOLUTION).sqrt(),
    }
}
