//! The radial distribution function.

use crate::conversions::truncated;
use crate::neighbours::Neighbours;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::PI;
use stereology_shape::{Particle, PeriodicBox};

/// Unit of distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Distance {
    /// Distance of centres divided by the mean of the two sizes: spheres touch at 1, whatever their sizes.
    #[default]
    Contacts,
    /// Distance of centres divided by the mean size of all particles.
    Centres,
}

/// A radial distribution function.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RadialDistribution {
    /// Upper edges of bins of equal width; the first bin starts at 0. No unit.
    pub edges: Vec<f64>,
    /// Number of pairs in each bin divided by that of independent particles.
    pub g: Vec<f64>,
    /// Number of pairs in each bin.
    pub pairs: Vec<u64>,
}

/// The radial distribution function of the centres of particles, in `bins` equal bins from 0 to `reach`.
///
/// # Formula
///
/// ```text
/// g(x) = pairs in the bin / Σ over pairs (4π/3) (x₂³ − x₁³) s³ / V        s: unit of distances
/// ```
///
/// Independent particles have g = 1. All periodic images are counted, so distances may exceed half the box. The result
/// is empty for fewer than two particles or a reach that is not positive and finite. Cost: proportional to the pairs
/// within reach.
///
/// # References
///
/// Torquato 2002, *Random Heterogeneous Materials*, 2.2.
///
/// # Examples
///
/// ```
/// use stereology_anneal::{Distance, Grain, populate, radial_distribution};
/// use stereology_shape::PeriodicBox;
///
/// // Particles at random positions are independent.
/// let period = PeriodicBox::new(nalgebra::Vector3::repeat(20.0))?;
/// let particles = populate(&[Grain { shape: 0, size: 1.0, category: 0 }; 2000], &period, 0);
/// let radial = radial_distribution(&particles, &period, Distance::Contacts, 4.0, 4);
/// assert!(radial.g[1..].iter().all(|g| (g - 1.0).abs() < 0.1));
/// # Ok::<(), stereology_shape::BoxError>(())
/// ```
#[must_use]
pub fn radial_distribution(
    particles: &[Particle],
    period: &PeriodicBox,
    distance: Distance,
    reach: f64,
    bins: usize,
) -> RadialDistribution {
    let edges: Vec<f64> = (1..=bins).map(|k| reach * k as f64 / bins as f64).collect();
    let count = particles.len();
    if count < 2 || bins == 0 || !(reach > 0.0 && reach.is_finite()) {
        return RadialDistribution {
            edges: Vec::new(),
            g: Vec::new(),
            pairs: Vec::new(),
        };
    }
    let sizes: Vec<f64> = particles.iter().map(|p| p.size).collect();
    let mean = sizes.iter().sum::<f64>() / count as f64;
    let half: Vec<f64> = match distance {
        Distance::Contacts => sizes.iter().map(|s| 0.5 * s).collect(),
        Distance::Centres => vec![0.5 * mean; count],
    };
    let centres: Vec<Vector3<f64>> = particles.iter().map(|p| period.wrap(&p.position).coords).collect();
    let reaches: Vec<f64> = half.iter().map(|h| h * reach).collect();
    let neighbours = Neighbours::find(&centres, &reaches, period.sides(), 0.0);
    let blocks: Vec<Vec<u64>> = (0..count.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let mut found = vec![0_u64; bins];
            for i in block * BLOCK..count.min((block + 1) * BLOCK) {
                for neighbour in neighbours.of(i).1 {
                    let j = neighbour.other as usize;
                    let offset = centres[j] + neighbours.images.shift(neighbour.image) - centres[i];
                    let bin = truncated(offset.norm() / (half[i] + half[j]) / reach * bins as f64);
                    // A particle and its own image are not a pair.
                    if i != j && bin < bins {
                        found[bin] += 1;
                    }
                }
            }
            found
        })
        .collect();
    let mut pairs = vec![0_u64; bins];
    for block in &blocks {
        for (sum, found) in pairs.iter_mut().zip(block) {
            *sum += found;
        }
    }
    let cubes = cubes_of_pairs(&half);
    let g = (0..bins)
        .map(|k| {
            let (inner, outer) = (if k == 0 { 0.0 } else { edges[k - 1] }, edges[k]);
            let expected = 4.0 / 3.0 * PI * (outer.powi(3) - inner.powi(3)) * cubes / period.volume();
            pairs[k] as f64 / expected
        })
        .collect();
    RadialDistribution { edges, g, pairs }
}

const BLOCK: usize = 1024;

/// Σ over pairs (hᵢ + hⱼ)³, by powers of sums.
fn cubes_of_pairs(half: &[f64]) -> f64 {
    let power = |k: i32| half.iter().map(|h| h.powi(k)).sum::<f64>();
    let (n, s1, s2, s3) = (half.len() as f64, power(1), power(2), power(3));
    // Half of all ordered pairs, without each particle with itself.
    0.5 * (2.0 * n * s3 + 6.0 * s1 * s2 - 8.0 * s3)
}

impl RadialDistribution {
    /// g at contact: a parabola fitted to the bins from 1 to 1.25, evaluated at 1. `None` with fewer than three such
    /// bins.
    #[must_use]
    pub fn at_contact(&self) -> Option<f64> {
        let width = self.edges.first()?;
        let mut normal = nalgebra::Matrix3::<f64>::zeros();
        let mut right = Vector3::<f64>::zeros();
        let mut used = 0;
        for (edge, g) in self.edges.iter().zip(&self.g) {
            let middle = edge - 0.5 * width - 1.0;
            if edge - width > 1.0 - 1e-9 && *edge < 1.25 + 1e-9 {
                let row = Vector3::new(1.0, middle, middle * middle);
                normal += row * row.transpose();
                right += row * *g;
                used += 1;
            }
        }
        (used >= 3)
            .then(|| normal.lu().solve(&right).map(|fit| fit.x))
            .flatten()
    }
}

/// g at contact of equal hard spheres in equilibrium at volume fraction φ.
///
/// # Formula
///
/// ```text
/// g(1) = (1 − φ/2) / (1 − φ)³
/// ```
///
/// # References
///
/// Carnahan & Starling 1969. Accurate to 1 % up to φ = .49, where spheres in equilibrium begin to crystallise.
///
/// ```
/// assert!((stereology_anneal::carnahan_starling(0.3) - 2.478).abs() < 1e-3);
/// ```
#[must_use]
pub fn carnahan_starling(fraction: f64) -> f64 {
    (1.0 - 0.5 * fraction) / (1.0 - fraction).powi(3)
}
