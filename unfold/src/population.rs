//! Particles per unit volume by size: spread over the bins of a kernel, and at single sizes.

use crate::size_bins::SizeBins;

/// Particles of one exact size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spike {
    pub(crate) size: f64,
    /// Particles per unit volume.
    pub(crate) density: f64,
}

/// An estimate of the densities of all sizes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Population {
    /// Density of each bin, its sizes spread as the kernel has it.
    pub(crate) spread: Vec<f64>,
    pub(crate) spikes: Vec<Spike>,
}

impl Population {
    pub(crate) fn of_bins(spread: Vec<f64>) -> Self {
        Self {
            spread,
            spikes: Vec::new(),
        }
    }

    pub(crate) fn of_spikes(bins: usize, spikes: Vec<Spike>) -> Self {
        Self {
            spread: vec![0.0; bins],
            spikes,
        }
    }

    pub(crate) fn total(&self) -> f64 {
        self.spread.iter().sum::<f64>() + self.spikes.iter().map(|of| of.density).sum::<f64>()
    }

    /// The same with every spike in the bin of its size.
    pub(crate) fn in_bins(&self, sizes: &SizeBins) -> Vec<f64> {
        let mut bins = self.spread.clone();
        for spike in &self.spikes {
            bins[place(sizes.edges(), spike.size)] += spike.density;
        }
        bins
    }
}

/// The bin between `edges` that a size falls in; the last holds larger sizes too.
fn place(edges: &[f64], size: f64) -> usize {
    let last = edges.len().saturating_sub(2);
    edges.partition_point(|&edge| edge < size).saturating_sub(1).min(last)
}

/// Which reported bin every size belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Grouping {
    of_bin: Vec<usize>,
    reported: Vec<f64>,
}

impl Grouping {
    pub(crate) fn new(sizes: &SizeBins) -> Self {
        Self {
            of_bin: sizes.groups(),
            reported: sizes.reported_edges().to_vec(),
        }
    }

    pub(crate) fn bins(&self) -> usize {
        self.reported.len() - 1
    }

    /// The reported bin of a bin of the kernel.
    pub(crate) fn of_bin(&self, bin: usize) -> usize {
        self.of_bin[bin]
    }

    /// The reported bin of a size.
    pub(crate) fn of_size(&self, size: f64) -> usize {
        place(&self.reported, size)
    }

    /// Density of a reported bin.
    pub(crate) fn sum(&self, population: &Population, bin: usize) -> f64 {
        let spread = population.spread.iter().zip(&self.of_bin);
        let spread: f64 = spread.filter(|(_, of)| **of == bin).map(|(density, _)| density).sum();
        let spikes = population.spikes.iter().filter(|of| self.of_size(of.size) == bin);
        spread + spikes.map(|of| of.density).sum::<f64>()
    }

    /// The population with each density multiplied by the weight of its reported bin.
    pub(crate) fn weighed(&self, population: &Population, weight: impl Fn(usize) -> f64) -> Population {
        let spread = population.spread.iter().zip(&self.of_bin);
        let spikes = population.spikes.iter().map(|of| Spike {
            density: of.density * weight(self.of_size(of.size)),
            ..*of
        });
        Population {
            spread: spread.map(|(density, &bin)| density * weight(bin)).collect(),
            spikes: spikes.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Grouping, Population, Spike};
    use crate::{SizeBins, equal_edges};
    use proptest::prelude::*;

    proptest! {
        /// Every particle is in one reported bin, whatever its size.
        #[test]
        fn bins_sum_to_the_total(spread in prop::collection::vec(0.0..1.0_f64, 12), sizes in prop::collection::vec(0.01..4.0_f64, 0..5)) {
            let bins = SizeBins::integrated(&equal_edges(3.0, 12)).unwrap().reported_in(&equal_edges(2.0, 4)).unwrap();
            let spikes: Vec<Spike> = sizes.iter().map(|&size| Spike { size, density: 0.5 }).collect();
            let population = Population { spread, spikes };
            let grouping = Grouping::new(&bins);
            let sum: f64 = (0..grouping.bins()).map(|bin| grouping.sum(&population, bin)).sum();
            prop_assert!((sum - population.total()).abs() < 1e-9);
            prop_assert!((population.in_bins(&bins).iter().sum::<f64>() - population.total()).abs() < 1e-9);
            let halved = grouping.weighed(&population, |_| 0.5);
            prop_assert!((halved.total() - 0.5 * population.total()).abs() < 1e-9);
        }
    }
}
