//! Packings in equilibrium: Monte Carlo moves of hard bodies.

use crate::assembly::Assembly;
use crate::certificate::Packing;
use crate::one_by_one::{OneByOne, in_ball};
use crate::pack::PackError;
use crate::proxies::{Proxy, StandIn};
use crate::sequential::CLEARANCE;
use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use stereology_metrics::Progress;

const STREAM: u64 = 23;

/// A packing after `sweeps` random moves of every particle, where moves that cause an overlap are rejected: hard-body
/// Monte Carlo (Metropolis et al. 1953).
///
/// [`pack`](crate::pack) stops as soon as no particles overlap, so the result has many near contacts. Theory describes
/// hard particles in equilibrium, which does not depend on how they were packed. Steps are adapted to an acceptance of
/// 30 to 50 %. Spheres at .45 reach equilibrium in a few hundred sweeps; at .55 and above they may crystallise if their
/// sizes are similar. Cost: a microsecond per sphere and sweep, about twenty for polyhedra; uses one core.
///
/// # Errors
///
/// [`PackError::Cancelled`].
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology_anneal::{PackOptions, box_for_fraction, equilibrate, mix, pack, populate};
/// use stereology_shape::{Arrangement, Body, UnitBody};
///
/// let spheres = [UnitBody::new(&Body::sphere(1.0)?)];
/// let grains = mix(&[1.0; 100], &[1.0], 0)?;
/// let period = box_for_fraction(&spheres, &grains, 0.3)?;
/// let start = Arrangement::new(spheres, populate(&grains, &period, 0), period)?;
/// let packing = pack(&start, &PackOptions::default(), &|_| ControlFlow::Continue(()))?;
/// let later = equilibrate(&packing, 20, 0, &|_| ControlFlow::Continue(()))?;
/// assert!((later.fraction() - 0.3).abs() < 1e-12 && later.particles() != packing.particles());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn equilibrate(packing: &Packing, sweeps: usize, seed: u64, progress: Progress<'_>) -> Result<Packing, PackError> {
    let stand_ins: Vec<StandIn> = packing
        .bodies()
        .iter()
        .map(|body| StandIn::of(body, Proxy::Parts, 0.02))
        .collect();
    let period = *packing.period();
    let mut assembly = Assembly::new(packing.bodies(), &stand_ins, packing.particles().to_vec(), &period);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(STREAM);
    let mean = assembly.radius.iter().sum::<f64>() / assembly.len().max(1) as f64;
    let (mut step, mut angle) = (0.3 * mean, 0.3_f64);
    let mut bodies = OneByOne::full(&mut assembly, &period, CLEARANCE);
    for sweep in 0..sweeps {
        if progress(sweep as f64 / sweeps as f64).is_break() {
            return Err(PackError::Cancelled);
        }
        let mut taken = 0;
        for i in 0..bodies.assembly.len() {
            let (centre, rotation) = bodies.assembly.pose(i);
            let shifted = centre + in_ball(&mut rng) * step;
            let turned = if bodies.assembly.round {
                rotation
            } else {
                let mut turned = UnitQuaternion::from_scaled_axis(in_ball(&mut rng) * angle) * rotation;
                turned.renormalize();
                turned
            };
            bodies.try_pose(i, shifted, turned);
            if bodies.vacant(i) {
                bodies.settle(i);
                taken += 1;
            } else {
                bodies.assembly.set_pose(i, (centre, rotation));
            }
        }
        let acceptance = taken as f64 / bodies.assembly.len().max(1) as f64;
        let factor = if acceptance > 0.5 {
            1.1
        } else if acceptance < 0.3 {
            0.9
        } else {
            1.0
        };
        step = (step * factor).min(0.25 * period.sides().min());
        angle = (angle * factor).min(1.0);
    }
    let particles = assembly.into_particles(&period);
    // No accepted move overlaps, so verification can fail only by rounding: then return the packing unchanged.
    Ok(Packing::verify(&packing.with_particles(particles)?).unwrap_or_else(|_| packing.clone()))
}
