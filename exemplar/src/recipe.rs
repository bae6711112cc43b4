//! What tells the methods apart.

use crate::{Method, SolidOptions, Solver};

/// How a voxel's value is made from its votes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Combine {
    /// Their plain mean.
    Mean,
    /// Their weighted mean.
    Weighted,
    /// The vote nearest to their weighted mean.
    Discrete,
}

/// A method's parts.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    pub(crate) combine: Combine,
    /// Strength of the colour histogram, 0 without.
    pub(crate) colour: f32,
    /// Strength of the position histogram, 0 without.
    pub(crate) position: f32,
    /// Strength of the index histogram, 0 without.
    pub(crate) index: f32,
    pub(crate) settling: f32,
    pub(crate) roots: usize,
    pub(crate) edge: f32,
    pub(crate) floor: f32,
    /// Similar pixels a pixel.
    pub(crate) similar: usize,
    /// Random candidates of a search.
    pub(crate) random: usize,
    /// Neighbourhoods this far away vote, at the beginning.
    pub(crate) radius: usize,
    /// Votes come from ever nearer in the last half of the iterations.
    pub(crate) shrinking: bool,
    /// Exemplars are thinned out with the solid.
    pub(crate) thinned: bool,
}

fn env(name: &str, default: f32) -> f32 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

impl Recipe {
    pub(crate) fn new(options: &SolidOptions) -> Self {
        let half = options.neighbourhood / 2;
        let radius = match options.solver() {
            Solver::Batch => half.min(env("RAD", 9.0) as usize),
            Solver::Sequential => 0,
        };
        let recipe = Self {
            combine: Combine::Discrete,
            colour: env("COL", 8.0),
            position: env("POS", 10.0),
            index: env("IDX", 0.022),
            floor: env("FLR", 1.0),
            edge: env("EDGE", 0.25),
            roots: env("ROOTS", 0.0) as usize,
            settling: env("SET", 0.5),
            similar: options.similar.unwrap_or(4),
            random: env("RND", 0.0) as usize,
            radius,
            shrinking: env("SHR", 1.0) > 0.0,
            thinned: env("THIN", 0.0) > 0.0,
        };
        match options.method {
            Method::Best => recipe,
            Method::WeiLevoy => Self {
                combine: Combine::Mean,
                colour: 0.0,
                position: 0.0,
                index: 0.0,
                shrinking: false,
                thinned: true,
                ..recipe
            },
            Method::Kopf => Self {
                combine: Combine::Weighted,
                position: 0.0,
                index: 0.0,
                shrinking: false,
                thinned: true,
                ..recipe
            },
            Method::ChenWang => Self {
                similar: options.similar.unwrap_or(15),
                shrinking: false,
                thinned: true,
                ..recipe
            },
        }
    }

    /// How far away votes come from in an iteration.
    pub(crate) fn radius(&self, iteration: usize, iterations: usize) -> usize {
        let late = 2 * iteration;
        if !self.shrinking || late < iterations {
            return self.radius;
        }
        // The last half of the iterations goes through radius - 1 .. 0 evenly.
        let left = iterations - iteration - 1;
        let half = iterations - iterations.div_ceil(2);
        (left * self.radius).div_ceil(half.max(1)).min(self.radius).max(env("RMIN", 1.0) as usize)
    }
}
