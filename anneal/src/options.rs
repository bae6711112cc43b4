//! What packing may do.

use crate::proxies::Proxy;

/// How particles are moved apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Mode {
    /// Descent with momentum on the energy of overlaps; bodies turn as well as move.
    #[default]
    Fast,
    /// Jagnow, Dorsey & Rushmeier 2004, section 4.1: find all collisions, push positions apart, repeat. Orientations stay; about ten times the iterations.
    Paper,
    /// Simulated annealing proper: single shifts, turns, swaps and re-insertions by Metropolis' rule while it cools, then a quench. On one core.
    Anneal,
    /// Jagnow, Dorsey & Rushmeier 2004, section 4.1, the naive way: one particle at a time, the largest first, at random places until one is vacant. Jams at
    /// fractions of about .35 ([`PackError::Jammed`](crate::PackError::Jammed)). On one core.
    Sequential,
}

/// What [`pack`](crate::pack()) may do.
///
/// # Examples
///
/// ```
/// use stereology_anneal::{Mode, PackOptions};
///
/// let options = PackOptions::default().with_mode(Mode::Paper).with_iterations(500);
/// assert_eq!(options.iterations, 500);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackOptions {
    /// How particles are moved apart.
    pub mode: Mode,
    /// Give up after so many iterations; sequentially, give a particle so many tries.
    pub iterations: usize,
    /// Sizes are multiplied by this while packing, from 1.0001 to 1.05; `None`: by 1.02 where there is room, down to 1.002 where there is little. True sizes
    /// are certified.
    pub swelling: Option<f64>,
    /// What stands for meshes while they are packed.
    pub proxy: Proxy,
    /// How much the volume of the convex parts of a body that is not convex may exceed its own, relative to it: .005 to 1. Particles keep that much room to
    /// themselves, and cost as their number of parts.
    pub tolerance: f64,
    /// For random moves: annealing, sequential placing, the shaking of particles that jam.
    pub seed: u64,
}

impl Default for PackOptions {
    fn default() -> Self {
        Self {
            mode: Mode::Fast,
            iterations: 20_000,
            swelling: None,
            proxy: Proxy::Parts,
            tolerance: 0.1,
            seed: 0,
        }
    }
}

impl PackOptions {
    /// How particles are moved apart.
    #[must_use]
    pub const fn with_mode(mut self, mode: Mode) -> Self {
        self.mode = mode;
        self
    }

    /// Give up after so many iterations.
    #[must_use]
    pub const fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// Factor of sizes while packing.
    #[must_use]
    pub const fn with_swelling(mut self, swelling: f64) -> Self {
        self.swelling = Some(swelling);
        self
    }

    /// What stands for meshes.
    #[must_use]
    pub const fn with_proxy(mut self, proxy: Proxy) -> Self {
        self.proxy = proxy;
        self
    }

    /// Volume tolerance of convex parts.
    #[must_use]
    pub const fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Seed of random moves.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }
}
