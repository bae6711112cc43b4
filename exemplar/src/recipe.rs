//! Parameters in which the methods differ.

use crate::options::{Method, SolidOptions, Solver};

/// How a voxel's value is computed from its votes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Combine {
    /// Their plain mean.
    Mean,
    /// Their weighted mean.
    Weighted,
    /// The vote nearest to their weighted mean.
    Discrete,
}

/// Parameters of a method.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    pub(crate) combine: Combine,
    /// Exponent c: votes for a colour are multiplied by (expected / found)^c; 0 without a colour histogram.
    pub(crate) colour: f32,
    /// Factor c: votes for a pixel used k times too often are divided by 1 + c k; 0 without a position histogram.
    pub(crate) position: f32,
    /// Factor c: the price of a neighbourhood used k times too often is c k times the variance of a window; 0 without
    /// an index histogram.
    pub(crate) index: f32,
    /// Similar pixels per pixel.
    pub(crate) similar: usize,
    /// Distance of the neighbourhoods that vote, in the first and in the last iteration.
    pub(crate) radii: [usize; 2],
    /// Weight of a vote from a neighbouring voxel when the radius is 1; that of the voxel itself is 1.
    pub(crate) edge: f32,
    /// Whether exemplars are subsampled with the solid.
    pub(crate) thinned: bool,
}

impl Recipe {
    /// The method's parameters; for `phases` the last votes come from the voxel itself.
    pub(crate) fn new(options: &SolidOptions, phases: bool) -> Self {
        let half = options.neighbourhood / 2;
        // In Kopf's solver every neighbourhood that contains a voxel votes; in that of urs-2012 only the voxel's own.
        let radius = match options.solver() {
            Solver::Batch => half,
            Solver::Sequential => 0,
        };
        let paper = Self {
            combine: Combine::Discrete,
            colour: 0.0,
            position: 0.0,
            index: 0.0,
            similar: options.similar.unwrap_or(4),
            radii: [radius; 2],
            edge: 1.0,
            thinned: true,
        };
        match options.method {
            Method::Best => Self {
                colour: 8.0,
                position: 10.0,
                index: 0.02,
                radii: [radius.min(2), radius.min(usize::from(!phases))],
                edge: 0.25,
                similar: options.similar.unwrap_or(12),
                thinned: false,
                ..paper
            },
            Method::WeiLevoy => Self {
                combine: Combine::Mean,
                ..paper
            },
            Method::Kopf => Self {
                combine: Combine::Weighted,
                colour: 8.0,
                ..paper
            },
            Method::ChenWang => Self {
                position: 10.0,
                index: 0.02,
                similar: options.similar.unwrap_or(15),
                ..paper
            },
        }
    }

    /// Distance of the neighbourhoods that vote in an iteration; it decreases evenly in the last half.
    pub(crate) fn radius(&self, iteration: usize, iterations: usize) -> usize {
        let [first, last] = self.radii;
        let left = iterations - iteration - 1;
        let late = iterations / 2;
        if left >= late {
            first
        } else {
            last + (left * (first - last)).div_ceil(late)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Recipe;
    use crate::options::SolidOptions;

    #[test]
    fn the_radius_of_votes_decreases() {
        let recipe = Recipe::new(&SolidOptions::default(), true);
        let radii: Vec<usize> = (0..10).map(|i| recipe.radius(i, 10)).collect();
        assert_eq!(radii, [2, 2, 2, 2, 2, 2, 2, 1, 1, 0]);
        assert_eq!(recipe.radius(0, 1), 2);
        let grey = Recipe::new(&SolidOptions::default(), false);
        assert_eq!((grey.radius(0, 10), grey.radius(9, 10)), (2, 1));
    }
}
