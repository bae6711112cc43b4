//! Bootstrap: counts resampled from a fit, or slices or tiles resampled with replacement, fitted again in parallel,
//! each from its own stream of random numbers.

use crate::estimate::Interval;
use crate::options::{Bootstrap, Resampling};
use crate::population::Population;
use crate::profile_counts::ProfileCounts;
use crate::quantiles::{normal_quantile, student_quantile};
use crate::unfold_error::UnfoldError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Gamma, Poisson};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_metrics::Progress;

/// Densities of every replicate, in order, and of the fit each is a replicate of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Replicates {
    /// Densities of the fits that counts were drawn from.
    pub(crate) bases: Vec<Population>,
    /// Index of the base of each replicate.
    pub(crate) base_of: Vec<usize>,
    pub(crate) densities: Vec<Population>,
    pub(crate) bootstrap: Bootstrap,
    /// Number of slices or tiles in a resample, if they were resampled.
    pub(crate) slices: Option<usize>,
}

/// What the error of an estimate is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Deviation {
    /// The spread of the replicates, about the estimate less their bias: for sums over many bins.
    Spread,
    /// The root of spread² + bias²: for a single bin, whose bias is not known well.
    SpreadAndBias,
    /// As [`Spread`](Self::Spread), of the logarithms: for sums whose error is in proportion to them.
    Ratio,
}

impl Replicates {
    /// The interval of a quantity of the densities.
    ///
    /// # Formula
    ///
    /// ```text
    /// m ± z σ      m, σ: mean and standard deviation over the replicates r of g_r − (q_r − g_r)
    /// ```
    ///
    /// with q_r the quantity of replicate r, g_r that of the fit it was drawn from, and z the normal quantile. The fits
    /// differ where the counts allow several grids, so σ contains that uncertainty too.
    ///
    /// For S slices or tiles σ is √(S / (S − 1)) times that, and z Student's with S − 1 degrees of freedom. The
    /// interval is widened to contain `value`, the reported estimate, and lies between zero and `most`.
    pub(crate) fn interval(
        &self,
        value: f64,
        most: f64,
        deviation: Deviation,
        quantity: &dyn Fn(&Population) -> f64,
    ) -> Interval {
        let bases: Vec<f64> = self.bases.iter().map(quantity).collect();
        let replicates = self.densities.iter().zip(&self.base_of);
        let values: Vec<(f64, f64)> = replicates
            .map(|(densities, &base)| (bases[base], quantity(densities) - bases[base]))
            .collect();
        // Resampled slices and tiles scatter too much for the mean of a logarithm to be the logarithm of the mean.
        if deviation == Deviation::Ratio
            && self.slices.is_none()
            && value > 0.0
            && values.iter().all(|(base, error)| *base > 0.0 && base + error > 0.0)
        {
            let logarithms: Vec<(f64, f64)> = values
                .iter()
                .map(|(base, error)| (base.ln(), ((base + error) / base).ln()))
                .collect();
            let within = self.about(&logarithms, Deviation::Spread);
            return Interval {
                lower: within.lower.exp().min(value),
                upper: within.upper.exp().min(most).max(value),
            };
        }
        let within = self.about(&values, deviation);
        Interval {
            lower: within.lower.max(0.0).min(value),
            upper: within.upper.min(most).max(value),
        }
    }

    /// The interval of values and errors of the fits.
    fn about(&self, values: &[(f64, f64)], deviation: Deviation) -> Interval {
        let n = values.len() as f64;
        let bias = values.iter().map(|(_, error)| error).sum::<f64>() / n;
        let centre = values.iter().map(|(base, error)| base - error).sum::<f64>() / n;
        let variance = values
            .iter()
            .map(|(base, error)| (base - error - centre).powi(2))
            .sum::<f64>()
            / (n - 1.0);
        let inflation = self.slices.map_or(1.0, |slices| slices as f64 / (slices as f64 - 1.0));
        let squared = variance * inflation
            + if deviation == Deviation::SpreadAndBias {
                bias * bias
            } else {
                0.0
            };
        let upper_tail = 0.5 * (1.0 + self.bootstrap.level);
        let quantile = match self.slices {
            Some(slices) => student_quantile(upper_tail, slices as f64 - 1.0),
            None => normal_quantile(upper_tail),
        };
        let reach = quantile * squared.sqrt();
        Interval {
            lower: centre - reach,
            upper: centre + reach,
        }
    }
}

/// What counts are drawn from.
pub(crate) enum Source<'a> {
    /// Poisson counts with these means.
    Expected(&'a [f64]),
    /// Slices or tiles, with repetition.
    Parts(&'a Parts),
}

impl Source<'_> {
    fn draw(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        match self {
            Self::Expected(means) => means.iter().map(|&mean| poisson(mean, rng)).collect(),
            Self::Parts(parts) => parts.draw(rng),
        }
    }
}

/// Parts of the counts that are drawn as a whole.
pub(crate) struct Parts {
    /// Counts of each slice, or of a tile at each place.
    pub(crate) counts: Vec<Vec<f64>>,
    /// Number of parts in a resample.
    pub(crate) number: usize,
    /// Variance of a factor of mean 1 that all counts of a resample have in common.
    pub(crate) common_variance: f64,
}

impl Parts {
    fn draw(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let mut sum = vec![0.0; self.counts.first().map_or(0, Vec::len)];
        for _ in 0..self.number {
            let part = &self.counts[rng.random_range(0..self.counts.len())];
            sum.iter_mut().zip(part).for_each(|(sum, count)| *sum += count);
        }
        if self.common_variance > 0.0
            && let Ok(law) = Gamma::new(1.0 / self.common_variance, self.common_variance)
        {
            let factor = law.sample(rng);
            sum.iter_mut().for_each(|count| *count *= factor);
        }
        sum
    }
}

/// Draws counts and fits them, `bootstrap.replicates` times. `source` and `fit` receive the number of the replicate;
/// `fit` also receives working memory and the random numbers of the replicate.
pub(crate) fn replicate<'a, R>(
    bootstrap: &Bootstrap,
    stream: u64,
    source: impl Fn(usize) -> Source<'a> + Sync,
    bins: usize,
    progress: Progress<'_>,
    room: impl Fn() -> R + Sync + Send,
    fit: impl Fn(usize, &[f64], &mut R, &mut ChaCha8Rng) -> Result<Population, UnfoldError> + Sync,
) -> Result<Vec<Population>, UnfoldError> {
    let done = AtomicUsize::new(0);
    (0..bootstrap.replicates)
        .into_par_iter()
        .map_init(room, |room, task| {
            let mut rng = ChaCha8Rng::seed_from_u64(bootstrap.seed);
            rng.set_stream(stream + task as u64);
            let drawn = source(task).draw(&mut rng);
            // A resample with no profiles has zero density in every bin.
            let densities = if drawn.iter().sum::<f64>() > 0.0 {
                fit(task, &drawn, room, &mut rng)?
            } else {
                Population::of_bins(vec![0.0; bins])
            };
            let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / bootstrap.replicates as f64;
            if progress(share).is_break() {
                Err(UnfoldError::Cancelled)
            } else {
                Ok(densities)
            }
        })
        .collect()
}

/// The parts that are to be drawn, with the rows from `first_row` on; `None` for counts.
pub(crate) fn parts(
    bootstrap: &Bootstrap,
    counts: &ProfileCounts,
    first_row: usize,
) -> Result<Option<Parts>, UnfoldError> {
    let above = |parts: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let part = |of: &Vec<f64>| of[first_row..].iter().map(|n| n / counts.dispersion()).collect();
        parts.iter().map(part).collect()
    };
    match (bootstrap.resampling, counts.by_slice(), counts.tiles()) {
        (Resampling::Counts, ..) | (Resampling::Auto, _, None) => Ok(None),
        (Resampling::Slices, Some(slices), _) if slices.len() >= 2 => Ok(Some(Parts {
            counts: above(slices),
            number: slices.len(),
            common_variance: 0.0,
        })),
        (Resampling::Slices, slices, _) => Err(UnfoldError::TooFewSlices(slices.map_or(0, <[_]>::len))),
        (Resampling::Blocks | Resampling::Auto, _, Some(tiles)) => Ok(Some(Parts {
            counts: above(&tiles.parts),
            number: tiles.tiling.tiles(),
            common_variance: tiles.tiling.common_variance(),
        })),
        (Resampling::Blocks, _, None) => Err(UnfoldError::NoPositions),
    }
}

/// A Poisson number; zero for a mean that is zero.
pub(crate) fn poisson(mean: f64, rng: &mut ChaCha8Rng) -> f64 {
    Poisson::new(mean).map_or(0.0, |distribution| distribution.sample(rng))
}
