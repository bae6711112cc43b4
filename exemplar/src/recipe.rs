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
    /// Votes for a colour are multiplied by (expected / found)^this; 0 without a colour histogram.
    pub(crate) colour: f32,
    /// Votes for a pixel used k times too often are divided by 1 + this k; 0 without a position histogram.
    pub(crate) position: f32,
    /// A neighbourhood used k times too often costs this k spreads more; 0 without an index histogram.
    pub(crate) index: f32,
    /// Similar pixels a pixel.
    pub(crate) similar: usize,
    /// Neighbourhoods this far away vote, at first and at last.
    pub(crate) radii: [usize; 2],
    /// Weight of a vote from the next voxel, when those within 1 vote; 1 from the voxel itself.
    pub(crate) edge: f32,
    /// Exemplars are thinned out with the solid.
    pub(crate) thinned: bool,
}

impl Recipe {
    /// The method's recipe; `phases` are kept sharp to the end.
    pub(crate) fn new(options: &SolidOptions, phases: bool) -> Self {
        let half = options.neighbourhood / 2;
        // Kopf's solver lets every neighbourhood that covers a voxel vote; urs-2012's the voxel's own.
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

    /// How far away votes come from in an iteration: shrinking evenly in the last half.
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
    use crate::SolidOptions;

    #[test]
    fn votes_come_from_ever_nearer() {
        let recipe = Recipe::new(&SolidOptions::default(), true);
        let radii: Vec<usize> = (0..10).map(|i| recipe.radius(i, 10)).collect();
        assert_eq!(radii, [2, 2, 2, 2, 2, 2, 2, 1, 1, 0]);
        assert_eq!(recipe.radius(0, 1), 2);
        let grey = Recipe::new(&SolidOptions::default(), false);
        assert_eq!((grey.radius(0, 10), grey.radius(9, 10)), (2, 1));
    }
}
