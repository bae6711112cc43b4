//! A test of the profile sizes on planes through a packing.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use stereology_shape::{Particle, PeriodicBox, UnitBody, isotropic_rotation};

use crate::certificate::Packing;
use crate::conversions::{floor, truncated};
use crate::one_by_one::anywhere;

/// Profiles on planes through a packing, compared with random arrangements.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SectionTest {
    /// Profiles per unit area, N_A.
    pub profiles_per_area: f64,
    /// N_A of the same particles at random positions and orientations: Σ H / V for convex particles, eq. (1) of Jagnow
    /// et al. 2004.
    pub expected_per_area: f64,
    /// Number of profiles in each size bin, smallest first.
    pub profiles: Vec<f64>,
    /// Mean number in each bin over the random arrangements.
    pub expected: Vec<f64>,
    /// Σ (profiles − m)² / m, where m is the mean over the packing and all random arrangements.
    pub statistic: f64,
    /// Fraction of random arrangements whose statistic is at least as large, (1 + those) / (1 + all). Packed particles
    /// do not overlap, so their counts vary less: large values are usual, small values show that sections misrepresent
    /// the sizes.
    pub p_value: f64,
}

const BINS: usize = 8;
const STREAM: u64 = 24;

/// Cuts a packing by `planes` equally spaced planes perpendicular to each axis, with a random first depth, and compares
/// the profile sizes with those of `replicates` random arrangements of the same particles, cut in the same way.
///
/// Means include the packing as one of the arrangements. For independent particles every rank is then equally likely,
/// and `p_value` is at most `k / (1 + replicates)` with exactly that probability.
///
/// The expectation is simulated, not computed from a formula, so the test holds for particles of any shape. Cost: (1 +
/// replicates) × sections.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology_anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate, section_test};
/// use stereology_shape::{Arrangement, Body, UnitBody};
///
/// let spheres = [UnitBody::new(&Body::sphere(1.0)?)];
/// let grains = mix(&lognormal_sizes(300, 0.3, 0)?, &[1.0], 0)?;
/// let period = box_for_fraction(&spheres, &grains, 0.5)?;
/// let start = Arrangement::new(spheres, populate(&grains, &period, 0), period)?;
/// let packing = pack(&start, &PackOptions::default(), &|_| ControlFlow::Continue(()))?;
/// let test = section_test(&packing, 5, 50, 0);
/// assert!(test.p_value > 1e-3);
/// assert!((test.profiles_per_area / test.expected_per_area - 1.0).abs() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn section_test(packing: &Packing, planes: usize, replicates: usize, seed: u64) -> SectionTest {
    let (bodies, period) = (packing.bodies(), packing.period());
    let largest = packing.particles().iter().map(|p| p.size).fold(0.0, f64::max);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(STREAM << 32);
    let profiles = count(bodies, packing.particles(), period, planes, largest, &mut rng);
    let random: Vec<Vec<f64>> = (0..replicates)
        .into_par_iter()
        .map(|replicate| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream((STREAM << 32) + 1 + replicate as u64);
            let scattered: Vec<Particle> = packing
                .particles()
                .iter()
                .map(|p| Particle {
                    position: anywhere(&mut rng, period).into(),
                    orientation: isotropic_rotation(&mut rng),
                    ..*p
                })
                .collect();
            count(bodies, &scattered, period, planes, largest, &mut rng)
        })
        .collect();
    let expected: Vec<f64> = (0..BINS)
        .map(|bin| random.iter().map(|counts| counts[bin]).sum::<f64>() / replicates.max(1) as f64)
        .collect();
    let pooled: Vec<f64> = (0..BINS)
        .map(|bin| (profiles[bin] + replicates as f64 * expected[bin]) / (1 + replicates) as f64)
        .collect();
    let statistic = |counts: &[f64]| {
        let terms = counts.iter().zip(&pooled).filter(|(_, e)| **e > 0.0);
        terms.map(|(o, e)| (o - e).powi(2) / e).sum::<f64>()
    };
    let own = statistic(&profiles);
    let as_large = random.iter().filter(|counts| statistic(counts) >= own).count();
    let sides = period.sides();
    let area = planes as f64 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x);
    SectionTest {
        profiles_per_area: profiles.iter().sum::<f64>() / area,
        expected_per_area: expected.iter().sum::<f64>() / area,
        profiles,
        expected,
        statistic: own,
        p_value: (1 + as_large) as f64 / (1 + replicates) as f64,
    }
}

/// Number of profiles on planes perpendicular to all axes, by size in equal bins up to the largest.
fn count(
    bodies: &[UnitBody],
    particles: &[Particle],
    period: &PeriodicBox,
    planes: usize,
    largest: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<f64> {
    let mut counts = vec![0.0; BINS];
    for axis in 0..3 {
        let side = period.sides()[axis];
        let spacing = side / planes.max(1) as f64;
        let first = rng.random::<f64>() * spacing;
        let mut world = Vector3::zeros();
        world[axis] = 1.0;
        let world = nalgebra::UnitVector3::new_unchecked(world);
        for particle in particles {
            let body = &bodies[particle.shape];
            let normal = particle.orientation.inverse() * world;
            let reach = body.bounding_radius() * particle.size;
            let from = -floor(-(particle.position[axis] - reach - first) / spacing);
            let to = floor((particle.position[axis] + reach - first) / spacing);
            for plane in from..=to {
                let height = first + plane as f64 * spacing - particle.position[axis];
                for area in body.profile_areas(&normal, height / particle.size) {
                    let size = (4.0 * area / std::f64::consts::PI).sqrt() * particle.size;
                    counts[truncated(size / largest * BINS as f64).min(BINS - 1)] += 1.0;
                }
            }
        }
    }
    counts
}
