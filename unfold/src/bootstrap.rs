//! Counts drawn again from a fit, or slices drawn again from those there are, fitted again side by side, each from its own stream of random numbers.

use crate::estimate::Interval;
use crate::options::{Bootstrap, Resampling};
use crate::quantiles::{normal_quantile, student_quantile};
use crate::unfold_error::UnfoldError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_metrics::Progress;

/// Densities of every replicate, in order, and of the fit they are replicates of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Replicates {
    pub(crate) base: Vec<f64>,
    pub(crate) densities: Vec<Vec<f64>>,
    pub(crate) bootstrap: Bootstrap,
    /// Slices that were drawn, if slices were.
    pub(crate) slices: Option<usize>,
}

/// What the error of an estimate is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Deviation {
    /// The spread of the replicates, about the estimate less their bias: for sums over many bins.
    Spread,
    /// The root of spread² + bias²: for a single bin, whose bias is not known well.
    SpreadAndBias,
}

impl Replicates {
    /// The interval of a quantity of the densities.
    ///
    /// # Formula
    ///
    /// ```text
    /// g − b ± z σ      g: of the rough fit; b, σ: mean of the replicates less g, and their standard deviation; z: normal quantile
    /// ```
    ///
    /// For slices σ is √(S / (S − 1)) times that, and z Student's with S − 1 degrees of freedom. Widened to hold `value`, the estimate reported; from zero to
    /// `most` at most.
    pub(crate) fn interval(
        &self,
        value: f64,
        most: f64,
        deviation: Deviation,
        quantity: &dyn Fn(&[f64]) -> f64,
    ) -> Interval {
        let values: Vec<f64> = self.densities.iter().map(|densities| quantity(densities)).collect();
        let base = quantity(&self.base);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let bias = mean - base;
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
            lower: (base - bias - reach).max(0.0).min(value),
            upper: (base - bias + reach).min(most).max(value),
        }
    }
}

/// What counts are drawn from.
pub(crate) enum Source<'a> {
    /// Poisson counts with these means.
    Expected(&'a [f64]),
    /// As many slices as there are, with repetition: the counts of each.
    Slices(&'a [Vec<f64>]),
}

impl Source<'_> {
    fn draw(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        match self {
            Self::Expected(means) => means.iter().map(|&mean| poisson(mean, rng)).collect(),
            Self::Slices(slices) => {
                let mut sum = vec![0.0; slices.first().map_or(0, Vec::len)];
                for _ in 0..slices.len() {
                    let slice = &slices[rng.random_range(0..slices.len())];
                    sum.iter_mut().zip(slice).for_each(|(sum, count)| *sum += count);
                }
                sum
            }
        }
    }
}

/// Draws counts and fits them, `bootstrap.replicates` times; `fit` is given room of its own.
pub(crate) fn replicate<R>(
    bootstrap: &Bootstrap,
    stream: u64,
    source: &Source<'_>,
    bins: usize,
    progress: Progress<'_>,
    room: impl Fn() -> R + Sync + Send,
    fit: impl Fn(&[f64], &mut R) -> Result<Vec<f64>, UnfoldError> + Sync,
) -> Result<Vec<Vec<f64>>, UnfoldError> {
    let done = AtomicUsize::new(0);
    (0..bootstrap.replicates)
        .into_par_iter()
        .map_init(room, |room, task| {
            let mut rng = ChaCha8Rng::seed_from_u64(bootstrap.seed);
            rng.set_stream(stream + task as u64);
            let drawn = source.draw(&mut rng);
            // A draw without a single profile unfolds to nothing.
            let densities = if drawn.iter().sum::<f64>() > 0.0 {
                fit(&drawn, room)?
            } else {
                vec![0.0; bins]
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

/// How counts are to be drawn.
pub(crate) fn slices_drawn(bootstrap: &Bootstrap, slices: Option<usize>) -> Result<Option<usize>, UnfoldError> {
    match (bootstrap.resampling, slices) {
        (Resampling::Counts, _) => Ok(None),
        (Resampling::Slices, Some(slices)) if slices >= 2 => Ok(Some(slices)),
        (Resampling::Slices, slices) => Err(UnfoldError::TooFewSlices(slices.unwrap_or(0))),
    }
}

/// A Poisson number; zero for a mean that is zero.
fn poisson(mean: f64, rng: &mut ChaCha8Rng) -> f64 {
    Poisson::new(mean).map_or(0.0, |distribution| distribution.sample(rng))
}
