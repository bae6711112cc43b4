//! Counts drawn again from the fit and unfolded again, side by side, each from its own stream of random numbers.

use crate::{Bootstrap, Interval, Progress, UnfoldError};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Densities of every replicate, in order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Replicates {
    pub(crate) densities: Vec<Vec<f64>>,
    pub(crate) level: f64,
}

impl Replicates {
    /// The percentile interval of a quantity of the densities.
    pub(crate) fn interval(&self, quantity: impl Fn(&[f64]) -> f64) -> Interval {
        let mut values: Vec<f64> = self.densities.iter().map(|densities| quantity(densities)).collect();
        values.sort_by(f64::total_cmp);
        let tail = 0.5 * (1.0 - self.level);
        Interval {
            lower: quantile(&values, tail),
            upper: quantile(&values, 1.0 - tail),
        }
    }

    /// The same with the densities at their places among `bins` bins, zero elsewhere.
    pub(crate) fn widened(&self, columns: &[usize], bins: usize) -> Self {
        let widen = |densities: &Vec<f64>| {
            let mut wide = vec![0.0; bins];
            for (&j, &density) in columns.iter().zip(densities) {
                wide[j] = density;
            }
            wide
        };
        Self {
            densities: self.densities.iter().map(widen).collect(),
            level: self.level,
        }
    }
}

/// Draws `expected` counts again and fits them, `bootstrap.replicates` times.
pub(crate) fn replicate(
    bootstrap: &Bootstrap,
    stream: u64,
    expected: &[f64],
    dispersion: f64,
    progress: Progress<'_>,
    fit: impl Fn(&[f64]) -> Result<Vec<f64>, UnfoldError> + Sync,
) -> Result<Vec<Vec<f64>>, UnfoldError> {
    let done = AtomicUsize::new(0);
    (0..bootstrap.replicates)
        .into_par_iter()
        .map(|task| {
            let mut rng = ChaCha8Rng::seed_from_u64(bootstrap.seed);
            rng.set_stream(stream + task as u64);
            let drawn: Vec<f64> = expected
                .iter()
                .map(|mu| dispersion * poisson(mu / dispersion, &mut rng))
                .collect();
            let densities = if drawn.iter().sum::<f64>() > 0.0 {
                fit(&drawn)?
            } else {
                Vec::new()
            };
            let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / bootstrap.replicates as f64;
            if progress(share).is_break() {
                Err(UnfoldError::Cancelled)
            } else {
                Ok(densities)
            }
        })
        .collect::<Result<Vec<_>, _>>()
        .map(|mut all| {
            // A draw without a single profile unfolds to nothing.
            let columns = all.iter().map(Vec::len).max().unwrap_or(0);
            for densities in &mut all {
                densities.resize(columns, 0.0);
            }
            all
        })
}

/// A Poisson number; zero for a mean that is zero.
fn poisson(mean: f64, rng: &mut ChaCha8Rng) -> f64 {
    Poisson::new(mean).map_or(0.0, |distribution| distribution.sample(rng))
}

/// The value below which a share of the sorted values lies, linear between them.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A position inside the slice.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (position - below as f64) * (sorted[above] - sorted[below])
}
