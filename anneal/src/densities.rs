//! Particles from unfolded number densities.

use crate::conversions::truncated;
use crate::population::{BINS, Grain, MOST, PopulationError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number densities of one type of particle, the result of unfolding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeDensities<'a> {
    /// Index of the body.
    pub shape: usize,
    /// Colour category.
    pub category: u8,
    /// Edges of the bins (a, b], one more than bins; lengths.
    pub edges: &'a [f64],
    /// Particles per unit volume in each bin; 0 in bins without an estimate.
    pub number_density: &'a [f64],
}

/// Position of a particle's size in its bin, as assumed by the kernel that unfolded the densities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SizeInBin {
    /// Spread over the bin: one of `n` particles is drawn from each n-th part.
    #[default]
    Spread,
    /// At the upper edge, as in the paper.
    UpperEdge,
}

/// Whole numbers of particles in a volume with these number densities: cumulative numbers from the largest bin down are
/// rounded.
///
/// The number in any bin and above any size is within one of its expectation, and the total within a half. Rounding
/// each bin alone would lose the rare large particles, which contain most of the volume.
///
/// # Errors
///
/// [`PopulationError::Volume`]; [`PopulationError::TooMany`] above 10⁶; [`PopulationError::Histogram`] for densities
/// that are negative or not finite.
///
/// ```
/// // Five bins with 0.4 expected particles each contain two particles together, not none.
/// let counts = stereology_anneal::counts_from_densities(&[0.4; 5], 1.0)?;
/// assert_eq!(counts.iter().sum::<usize>(), 2);
/// # Ok::<(), stereology_anneal::PopulationError>(())
/// ```
pub fn counts_from_densities(number_density: &[f64], volume: f64) -> Result<Vec<usize>, PopulationError> {
    if !(volume.is_finite() && volume > 0.0) {
        return Err(PopulationError::Volume(volume));
    }
    if number_density.iter().any(|n| !(n.is_finite() && *n >= 0.0)) {
        let densities = number_density.len();
        return Err(PopulationError::Histogram {
            histogram: 0,
            edges: densities + 1,
            densities,
        });
    }
    let total = number_density.iter().sum::<f64>() * volume;
    if total > MOST {
        return Err(PopulationError::TooMany(total));
    }
    let mut counts = vec![0; number_density.len()];
    let (mut expected, mut given) = (0.0, 0);
    for (bin, density) in number_density.iter().enumerate().rev() {
        expected += density * volume;
        counts[bin] = truncated(expected + 0.5) - given;
        given += counts[bin];
    }
    Ok(counts)
}

/// The particles of a volume with these number densities, by type, largest last.
///
/// Counts are those of [`counts_from_densities`]. To reach a volume fraction exactly, adjust the box
/// ([`box_for_fraction`](crate::box_for_fraction): sizes and histogram are kept, densities change by the rounding) or
/// the sizes ([`scale_to_fraction`](crate::scale_to_fraction)).
///
/// # Errors
///
/// [`PopulationError::Histogram`] unless the edges increase and there is one more than densities; the errors of
/// [`counts_from_densities`].
///
/// ```
/// use stereology_anneal::{SizeDensities, SizeInBin, grains_from_densities};
///
/// let densities = SizeDensities { shape: 0, category: 2, edges: &[0.0, 1.0, 2.0], number_density: &[3.0, 1.0] };
/// let grains = grains_from_densities(&[densities], 10.0, SizeInBin::UpperEdge, 0)?;
/// assert_eq!(grains.len(), 40);
/// assert_eq!(grains.iter().filter(|g| g.size == 2.0).count(), 10);
/// # Ok::<(), stereology_anneal::PopulationError>(())
/// ```
pub fn grains_from_densities(
    densities: &[SizeDensities<'_>],
    volume: f64,
    size_in_bin: SizeInBin,
    seed: u64,
) -> Result<Vec<Grain>, PopulationError> {
    let total = volume * densities.iter().flat_map(|of| of.number_density).sum::<f64>();
    if total > MOST {
        return Err(PopulationError::TooMany(total));
    }
    let mut grains = Vec::new();
    for (histogram, of) in densities.iter().enumerate() {
        let wrong = PopulationError::Histogram {
            histogram,
            edges: of.edges.len(),
            densities: of.number_density.len(),
        };
        let increasing = of.edges.windows(2).all(|pair| pair[0] < pair[1] && pair[1].is_finite());
        if of.edges.len() != of.number_density.len() + 1 || !increasing || of.edges[0] < 0.0 {
            return Err(wrong);
        }
        let counts = counts_from_densities(of.number_density, volume).map_err(|error| match error {
            PopulationError::Histogram { .. } => wrong,
            other => other,
        })?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream((BINS << 32) + histogram as u64);
        for (bin, count) in counts.into_iter().enumerate() {
            let (lower, upper) = (of.edges[bin], of.edges[bin + 1]);
            for k in 0..count {
                let size = match size_in_bin {
                    SizeInBin::UpperEdge => upper,
                    // In (lower, upper], so that no size is zero.
                    SizeInBin::Spread => upper - (upper - lower) * ((k as f64 + rng.random::<f64>()) / count as f64),
                };
                grains.push(Grain {
                    shape: of.shape,
                    size,
                    category: of.category,
                });
            }
        }
    }
    Ok(grains)
}
