//! The size distribution: means and percentiles by number and by volume, and the sieve curve.

use crate::estimate::Estimate;
use crate::population::Population;
use crate::size_bins::SizeBins;

/// Shares of particles at which [`Percentiles`] are given.
pub const SHARES: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];

/// Mean size and percentiles, by number or by volume.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Percentiles {
    /// Mean size.
    pub mean: Estimate,
    /// Sizes below which the [`SHARES`] of the particles are.
    pub percentiles: [Estimate; 5],
}

/// The distribution of sizes of the particles that have a density.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SizeDistribution {
    /// Every particle counts once.
    pub by_number: Percentiles,
    /// Every particle counts with its volume.
    pub by_volume: Percentiles,
    /// The sieve curve: the fraction of the particles' volume below each edge of the bins, from the first to the last.
    /// A sieve lets a particle pass by its middle axis; here the size is the diameter of the circle with the area of
    /// its largest section.
    pub passing: Vec<Estimate>,
}

/// How particles are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weighing {
    Number,
    Volume,
}

/// Integral of D^power over the sizes of each bin, at densities of one a bin: 0 a number, 3 a volume.
fn moments(sizes: &SizeBins, power: i32) -> Vec<f64> {
    let spread = sizes.is_spread();
    let moment = |bin: &[f64]| {
        let (a, b) = (bin[0], bin[1]);
        if !spread {
            return b.powi(power);
        }
        // (b^(p+1) − a^(p+1)) / ((p + 1)(b − a)), without the cancellation.
        (0..=power).map(|k| b.powi(k) * a.powi(power - k)).sum::<f64>() / f64::from(power + 1)
    };
    sizes.edges().windows(2).map(moment).collect()
}

impl Weighing {
    fn power(self) -> i32 {
        match self {
            Self::Number => 0,
            Self::Volume => 3,
        }
    }
}

/// Moments of a set of bins, for asking many densities.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    edges: Vec<f64>,
    spread: bool,
    powers: [Vec<f64>; 5],
}

impl Moments {
    pub(crate) fn new(sizes: &SizeBins) -> Self {
        Self {
            edges: sizes.edges().to_vec(),
            spread: sizes.is_spread(),
            powers: [0, 1, 2, 3, 4].map(|power| moments(sizes, power)),
        }
    }

    /// The largest size.
    pub(crate) fn largest(&self) -> f64 {
        self.edges.last().copied().unwrap_or(0.0)
    }

    /// Σ N ⟨D^power⟩.
    pub(crate) fn sum(&self, population: &Population, power: usize) -> f64 {
        let spread: f64 = population
            .spread
            .iter()
            .zip(&self.powers[power])
            .map(|(n, m)| n * m)
            .sum();
        let spikes = population.spikes.iter();
        spread + spikes.map(|of| of.density * power_of(of.size, power)).sum::<f64>()
    }

    /// Mean size; zero without particles.
    pub(crate) fn mean(&self, densities: &Population, weighing: Weighing) -> f64 {
        let power = usize::from(weighing == Weighing::Volume) * 3;
        let whole = self.sum(densities, power);
        if whole > 0.0 {
            self.sum(densities, power + 1) / whole
        } else {
            0.0
        }
    }

    /// The size below which a fraction of the particles lies.
    ///
    /// An estimate has particles spread over bins or of single sizes, not both.
    pub(crate) fn percentile(&self, population: &Population, weighing: Weighing, share: f64) -> f64 {
        if !population.spikes.is_empty() {
            return percentile_of_spikes(population, weighing, share);
        }
        let densities = &population.spread;
        let moments = &self.powers[usize::from(weighing == Weighing::Volume) * 3];
        let power = weighing.power() + 1;
        let wanted = share * densities.iter().zip(moments).map(|(n, m)| n * m).sum::<f64>();
        let mut below = 0.0;
        for ((bin, &density), moment) in self.edges.windows(2).zip(densities).zip(moments) {
            let here = density * moment;
            if here > 0.0 && below + here >= wanted {
                if !self.spread {
                    return bin[1];
                }
                let part = ((wanted - below) / here).clamp(0.0, 1.0);
                let (a, b) = (bin[0].powi(power), bin[1].powi(power));
                return (a + part * (b - a)).powf(1.0 / f64::from(power));
            }
            below += here;
        }
        0.0
    }

    /// Share of the particles' volume in bins up to an edge of the bins.
    pub(crate) fn passing(&self, population: &Population, edge: f64) -> f64 {
        let volume = self.sum(population, 3);
        let passes = |size: f64| size <= edge * (1.0 + 1e-12);
        let below = self.edges[1..].iter().zip(&population.spread).zip(&self.powers[3]);
        let below: f64 = below
            .filter(|((upper, _), _)| passes(**upper))
            .map(|((_, n), m)| n * m)
            .sum();
        let spikes = population.spikes.iter().filter(|of| passes(of.size));
        let below = below + spikes.map(|of| of.density * power_of(of.size, 3)).sum::<f64>();
        if volume > 0.0 { below / volume } else { 0.0 }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // Powers are at most 4.
fn power_of(size: f64, power: usize) -> f64 {
    size.powi(power as i32)
}

/// The smallest size with at least a fraction of the particles up to it.
fn percentile_of_spikes(population: &Population, weighing: Weighing, share: f64) -> f64 {
    let mut spikes: Vec<(f64, f64)> = population
        .spikes
        .iter()
        .map(|of| (of.size, of.density * of.size.powi(weighing.power())))
        .collect();
    spikes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = share * spikes.iter().map(|of| of.1).sum::<f64>();
    let mut below = 0.0;
    let reached = spikes.iter().find(|of| {
        below += of.1;
        below >= wanted
    });
    reached.or(spikes.last()).map_or(0.0, |of| of.0)
}

/// The distribution, with `estimate` giving a quantity of the densities, up to a limit, its value and interval; where
/// densities count by volume they are weighed as well.
pub(crate) fn describe(
    moments: &Moments,
    reported_edges: &[f64],
    estimate: impl Fn(Weighing, f64, &dyn Fn(&Population) -> f64) -> Estimate,
) -> SizeDistribution {
    let percentiles = |weighing: Weighing| Percentiles {
        mean: estimate(weighing, moments.largest(), &|densities| {
            moments.mean(densities, weighing)
        }),
        percentiles: SHARES.map(|share| {
            estimate(weighing, moments.largest(), &|densities| {
                moments.percentile(densities, weighing, share)
            })
        }),
    };
    SizeDistribution {
        by_number: percentiles(Weighing::Number),
        by_volume: percentiles(Weighing::Volume),
        // The last bin holds larger particles too.
        passing: reported_edges
            .iter()
            .enumerate()
            .map(|(k, &edge)| {
                if k + 1 == reported_edges.len() {
                    f64::INFINITY
                } else {
                    edge
                }
            })
            .map(|edge| estimate(Weighing::Volume, 1.0, &|densities| moments.passing(densities, edge)))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Moments, Weighing};
    use crate::population::Population;
    use crate::{SizeBins, equal_edges};
    use proptest::prelude::*;

    /// Sizes spread evenly over (0, 1]: mean 1/2, median 1/2; by volume, density 4 D³: mean 4/5, median 2^(-1/4), half
    /// way down 1/16 passes.
    #[test]
    fn a_flat_distribution_has_its_known_percentiles() {
        let edges = equal_edges(1.0, 8);
        let moments = Moments::new(&SizeBins::integrated(&edges).unwrap());
        let flat = Population::of_bins(vec![1.0; 8]);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(moments.mean(&flat, Weighing::Number), 0.5);
        close(moments.percentile(&flat, Weighing::Number, 0.5), 0.5);
        close(moments.mean(&flat, Weighing::Volume), 0.8);
        close(moments.percentile(&flat, Weighing::Volume, 0.5), 0.5_f64.powf(0.25));
        close(moments.passing(&flat, 0.5), 1.0 / 16.0);
        close(moments.passing(&flat, 1.0), 1.0);
        close(
            moments.percentile(&Population::of_bins(vec![0.0; 8]), Weighing::Volume, 0.5),
            0.0,
        );
    }

    proptest! {
        /// Percentiles increase with their fraction and lie between the edges; volume's are never below number's.
        #[test]
        fn percentiles_are_ordered(densities in prop::collection::vec(0.0..1.0_f64, 6)) {
            prop_assume!(densities.iter().sum::<f64>() > 0.1);
            let densities = Population::of_bins(densities);
            for bins in [SizeBins::integrated(&equal_edges(3.0, 6)).unwrap(), SizeBins::upper_edge(&equal_edges(3.0, 6)).unwrap()] {
                let moments = Moments::new(&bins);
                let mut last = 0.0;
                for share in [0.0, 0.1, 0.5, 0.9, 1.0] {
                    let number = moments.percentile(&densities, Weighing::Number, share);
                    let volume = moments.percentile(&densities, Weighing::Volume, share);
                    prop_assert!(number >= last && number <= 3.0 + 1e-12);
                    prop_assert!(volume >= number - 1e-9);
                    last = number;
                }
            }
        }
    }
}
