//! Preparation of a synthesis: levels, memory, and initial noise.

use ndarray::{Array, Dimension, IntoDimension};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use stereology_metrics::Finding;

use crate::bank::{level_shape, most_levels};
use crate::exemplar::Prepared;
use crate::{Exemplar, Matching, Mode, TextureError, TextureOptions, TextureReport};

/// Number of samples along the shortest side of the coarsest oriented bands with the default number of levels.
const COARSEST: usize = 16;

pub(crate) struct Plan {
    pub(crate) levels: usize,
    requested: Option<usize>,
}

impl Plan {
    /// Checks everything that does not depend on the pixels. `shape` is that of the result.
    pub(crate) fn new(
        exemplars: &[Exemplar<'_>],
        shape: &[usize],
        options: &TextureOptions,
    ) -> Result<Self, TextureError> {
        for exemplar in exemplars {
            let (height, width, _) = exemplar.image.dim();
            if height < 8 || width < 8 {
                return Err(TextureError::ExemplarTooSmall { height, width });
            }
        }
        let channels = exemplars[0].image.dim().2;
        if shape.iter().any(|&n| n < 8) {
            return Err(TextureError::ResultTooSmall { shape: shape.to_vec() });
        }
        if options.levels == Some(0) || options.orientations == 0 || options.orientations > 32 {
            let levels = options.levels.unwrap_or(1);
            return Err(TextureError::Options {
                levels,
                orientations: options.orientations,
            });
        }
        let bytes = bytes_needed(shape, channels, options);
        if bytes > u128::from(options.memory_limit) {
            return Err(TextureError::TooLarge {
                shape: shape.to_vec(),
                bytes,
                limit: options.memory_limit,
            });
        }
        let sides = exemplars.iter().flat_map(|exemplar| exemplar.image.shape()[..2].iter());
        let shortest = sides.chain(shape).copied().min().unwrap_or(0);
        let most = most_levels(&[shortest], &[]);
        let usual = (1..=most)
            .take_while(|&l| l == 1 || level_shape(&[shortest], &[], l - 1)[0] >= COARSEST)
            .count();
        Ok(Self {
            levels: options.levels.map_or(usual, |requested| requested.min(most)),
            requested: options.levels,
        })
    }

    pub(crate) fn report(&self, exemplar: &Prepared) -> TextureReport {
        let mut findings = Vec::new();
        if let Some(requested) = self.requested.filter(|&requested| requested > self.levels) {
            let message = format!(
                "{requested} levels are too many for these sizes: {} are used",
                self.levels
            );
            findings.push(Finding::new("levels-reduced", message));
        }
        if !exemplar.varies(0) {
            findings.push(Finding::new(
                "constant-exemplar",
                "the exemplar has a single colour, and so does the texture",
            ));
        }
        TextureReport {
            levels: self.levels,
            band_errors: Vec::new(),
            slice_errors: Vec::new(),
            final_error: 0.0,
            findings,
        }
    }
}

/// Approximate peak memory of a synthesis in bytes: components, channels and the interleaved result; the coefficients
/// of one component (of all, for an image) with their spectra; for a volume, the spectra of the correction of cuts, and
/// in [`Mode::Slices`] those of an oblique band; and two lists of indices for each band that is sorted at the same
/// time.
fn bytes_needed(shape: &[usize], channels: usize, options: &TextureOptions) -> u128 {
    let samples = shape.iter().fold(1_u128, |all, &n| all.saturating_mul(n as u128));
    let colours = 3 * channels as u128;
    let coefficients = 4 + 4 * options.orientations as u128 / 3;
    let sorted = match options.matching {
        Matching::Exact => 5 * rayon::current_num_threads().min(1 + options.orientations) as u128,
        Matching::Table => 0,
    };
    let floats = match (shape.len(), options.mode) {
        (2, _) => channels as u128 * coefficients + sorted,
        (_, Mode::Slices) => coefficients + 13 + sorted,
        _ => coefficients + 4 + sorted,
    };
    samples.saturating_mul(4 * (colours + floats))
}

/// Gaussian noise of unit variance, with one random stream per row of `row` samples, so that rows are independent of
/// threads.
pub(crate) fn white_noise(samples: usize, row: usize, seed: u64, component: usize) -> Vec<f32> {
    let mut noise = vec![0.0_f32; samples];
    noise.par_chunks_mut(row).enumerate().for_each(|(i, row)| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream((component as u64) << 40 | i as u64);
        row.iter_mut().for_each(|v| *v = random.sample(StandardNormal));
    });
    noise
}

/// Root mean square over all bands, from sums of squares and numbers of bands.
pub(crate) fn root_mean_square(errors: &[(f64, usize)]) -> f64 {
    let (sum, n) = errors.iter().fold((0.0, 0), |(sum, n), &(s, m)| (sum + s, n + m));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

/// The values as an array.
pub(crate) fn shaped<I: IntoDimension>(shape: I, values: Vec<f32>) -> Array<f32, I::Dim> {
    let shape = shape.into_dimension();
    debug_assert_eq!(shape.size(), values.len());
    Array::from_shape_vec(shape, values).expect("a value for every sample and channel")
}
