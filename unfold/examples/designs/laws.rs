//! Size distributions of spheres, whose sections are simulated exactly.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Gamma, Poisson, StandardNormal, Weibull};

/// One size of a distribution.
fn size(law: &str, rng: &mut ChaCha8Rng) -> f64 {
    let normal: f64 = StandardNormal.sample(rng);
    let uniform: f64 = rng.random();
    let gamma = |shape: f64, rng: &mut ChaCha8Rng| Gamma::new(shape, 1.0 / shape).map_or(1.0, |law| law.sample(rng));
    match law {
        "lognormal.3" => (0.3 * normal).exp(),
        "lognormal.5" => (0.5 * normal).exp(),
        "lognormal.8" => (0.8 * normal).exp(),
        "lognormal1" => normal.exp(),
        "gamma1.5" => gamma(1.5, rng),
        "gamma2" => gamma(2.0, rng),
        "weibull1.5" => Weibull::new(1.0, 1.5).map_or(1.0, |law| law.sample(rng)),
        // Density as D^-2.5 from 0.1 to 1.
        "power" => (0.1_f64.powf(-1.5) + uniform * (1.0 - 0.1_f64.powf(-1.5))).powf(-1.0 / 1.5),
        "trimodal" => {
            let middle = if uniform < 0.5 {
                0.3
            } else if uniform < 0.8 {
                0.6
            } else {
                1.0
            };
            middle * (1.0 + 0.05 * normal)
        }
        "spike+tail" => {
            if uniform < 0.6 {
                0.5 * (1.0 + 0.02 * normal)
            } else {
                0.5 * (0.4 * normal).exp()
            }
        }
        "fines" => {
            if uniform < 0.7 {
                0.1 * (0.3 * normal).exp()
            } else {
                (0.2 * normal).exp()
            }
        }
        // Those of figure 7, and a narrow band on a broad mode.
        "constant" => uniform,
        "single" => within(0.55 + 0.15 * normal, rng, law),
        "bimodal" => within(if uniform < 0.5 { 0.3 } else { 0.75 } + 0.08 * normal, rng, law),
        "lognormal.45" => within(0.3 * (0.45 * normal).exp(), rng, law),
        "two bands" => 0.1 * (uniform + if rng.random::<f64>() < 0.5 { 3.0 } else { 7.0 }),
        "band+mode" if uniform < 0.3 => 0.7 + 0.05 * rng.random::<f64>(),
        "band+mode" => within(0.5 + 0.15 * normal, rng, law),
        _ => 0.5,
    }
}

/// The size if it lies in (0, 1], else another one.
fn within(drawn: f64, rng: &mut ChaCha8Rng, law: &str) -> f64 {
    if drawn > 0.0 && drawn <= 1.0 {
        drawn
    } else {
        size(law, rng)
    }
}

/// A distribution, its moments, and a table of sizes drawn in proportion to the size.
pub(crate) struct Law {
    pub(crate) mean: f64,
    /// Mean of the cubes of the sizes.
    pub(crate) cube: f64,
    pub(crate) drawn: Vec<f64>,
    /// Running sum of the sizes.
    running: Vec<f64>,
}

impl Law {
    pub(crate) fn new(name: &str) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let drawn: Vec<f64> = (0..2_000_000).map(|_| size(name, &mut rng)).collect();
        let mut sum = 0.0;
        let running: Vec<f64> = drawn
            .iter()
            .map(|d| {
                sum += d;
                sum
            })
            .collect();
        let count = drawn.len() as f64;
        Self {
            mean: sum / count,
            cube: drawn.iter().map(|d| d.powi(3)).sum::<f64>() / count,
            drawn,
            running,
        }
    }

    /// A Poisson number of profiles.
    pub(crate) fn profiles(&self, expected: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let count = Poisson::new(expected).map_or(0.0, |law| law.sample(rng)) as usize;
        let whole = self.running[self.running.len() - 1];
        let profiles = (0..count).map(|_| {
            let share = whole * rng.random::<f64>();
            let at = self.running.partition_point(|&sum| sum < share);
            let depth: f64 = rng.random();
            self.drawn[at] * (1.0 - depth * depth).sqrt()
        });
        profiles.collect()
    }
}
