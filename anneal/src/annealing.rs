//! Simulated annealing: single moves accepted by the Metropolis rule at a falling temperature.
//!
//! # Formula
//!
//! ```text
//! E = Σ ½ δ²,   a move is accepted with probability min(1, exp(−ΔE / T)),   T from 2 10⁻² to 10⁻⁸ r̄² by one factor a sweep
//! ```
//!
//! A sweep attempts to shift and rotate every particle once. The step size is adapted so that 30 to 40 % of the moves
//! are accepted at every temperature. A tenth of the moves swap the positions of two particles of different size, and a
//! twentieth move a particle with more overlap energy than the mean to a random position. The remaining overlap is
//! removed by a quench with the descent of [`Mode::Fast`](crate::Mode::Fast).
//!
//! # References
//!
//! Kirkpatrick, Gelatt & Vecchi 1983; Metropolis et al. 1953. Jagnow, Dorsey & Rushmeier 2004 (section 4.1) mention
//! simulated annealing, but describe a relaxation without temperature, which is [`Mode::Paper`](crate::Mode::Paper).

use crate::assembly::Assembly;
use crate::damped::{self, End, Limits};
use crate::one_by_one::{OneByOne, anywhere, in_ball};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_metrics::Progress;
use stereology_shape::{PeriodicBox, isotropic_rotation};

/// Sweeps from the first to the last temperature.
const SWEEPS: usize = 200;
/// First and last temperature, in units of the squared mean radius.
const HOT: f64 = 2e-2;
const COLD: f64 = 1e-8;
/// Below this step, in mean radii, all particles are held by their neighbours.
const FROZEN: f64 = 1e-4;
const STREAM: u64 = 22;

/// Cools and quenches. The energy after each sweep is appended to `trace`.
pub(crate) fn anneal(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    limits: &Limits,
    trace: &mut Vec<f64>,
    progress: Progress<'_>,
) -> End {
    let mean = assembly.radius.iter().sum::<f64>() / assembly.len().max(1) as f64;
    let sweeps = SWEEPS.min(limits.iterations);
    let cooling = (COLD / HOT).powf(1.0 / SWEEPS as f64);
    let mut temperature = HOT * mean * mean;
    let mut rng = ChaCha8Rng::seed_from_u64(limits.seed);
    rng.set_stream(STREAM);
    let mut chain = Chain {
        bodies: OneByOne::full(assembly, period, limits.swelling),
        period: *period,
        step: 0.5 * mean,
        angle: 0.5,
        per_particle: 0.0,
    };
    for sweep in 0..sweeps {
        if progress(0.9 * sweep as f64 / SWEEPS as f64).is_break() {
            return End::Cancelled;
        }
        let energy = chain.sweep(temperature, &mut rng);
        trace.push(energy);
        temperature *= cooling;
        if energy <= 0.0 || chain.step < FROZEN * mean {
            break;
        }
    }
    let rest = Limits {
        iterations: limits.iterations - sweeps,
        ..*limits
    };
    damped::relax(assembly, period, &rest, trace, &|_| progress(0.95))
}

struct Chain<'a, 'b> {
    bodies: OneByOne<'a, 'b>,
    period: PeriodicBox,
    /// Longest shift.
    step: f64,
    /// Largest rotation.
    angle: f64,
    /// Mean energy per particle in the previous sweep.
    per_particle: f64,
}

impl Chain<'_, '_> {
    /// Attempts to move every particle once; returns the energy.
    fn sweep(&mut self, temperature: f64, rng: &mut ChaCha8Rng) -> f64 {
        let count = self.bodies.assembly.len();
        let (mut tried, mut taken) = (0_usize, 0_usize);
        let mut energy = 0.0;
        for i in 0..count {
            let before = self.bodies.energy(i);
            let kind = rng.random_range(0..20_u32);
            let after = match kind {
                0 if before > self.per_particle => self.reinsert(i, before, temperature, rng),
                1 | 2 => self.swap(i, rng.random_range(0..count), before, temperature, rng),
                _ => {
                    tried += 1;
                    let after = self.shift(i, before, temperature, rng);
                    taken += usize::from(after.is_some());
                    after
                }
            };
            // Every pair is counted from both sides.
            energy += 0.5 * after.unwrap_or(before);
        }
        self.per_particle = 2.0 * energy / count.max(1) as f64;
        let acceptance = taken as f64 / tried.max(1) as f64;
        let factor = if acceptance > 0.4 {
            1.15
        } else if acceptance < 0.3 {
            0.87
        } else {
            1.0
        };
        self.step = (self.step * factor).min(0.5 * self.period.sides().min());
        self.angle = (self.angle * factor).min(1.0);
        energy
    }

    /// Attempts a shift and a rotation; returns the energy of the particle if accepted.
    fn shift(&mut self, i: usize, before: f64, temperature: f64, rng: &mut ChaCha8Rng) -> Option<f64> {
        let (centre, rotation) = self.bodies.assembly.pose(i);
        let centre = centre + in_ball(rng) * self.step;
        let rotation = if self.bodies.assembly.round {
            rotation
        } else {
            let mut turned = UnitQuaternion::from_scaled_axis(in_ball(rng) * self.angle) * rotation;
            turned.renormalize();
            turned
        };
        self.attempt(i, centre, rotation, before, temperature, rng)
    }

    /// Attempts a random position and orientation.
    fn reinsert(&mut self, i: usize, before: f64, temperature: f64, rng: &mut ChaCha8Rng) -> Option<f64> {
        let centre = anywhere(rng, &self.period);
        let rotation = isotropic_rotation(rng);
        self.attempt(i, centre, rotation, before, temperature, rng)
    }

    fn attempt(
        &mut self,
        i: usize,
        centre: Vector3<f64>,
        rotation: UnitQuaternion<f64>,
        before: f64,
        temperature: f64,
        rng: &mut ChaCha8Rng,
    ) -> Option<f64> {
        let old = self.bodies.assembly.pose(i);
        self.bodies.try_pose(i, centre, rotation);
        let after = self.bodies.energy(i);
        if accepted(after - before, temperature, rng) {
            self.bodies.settle(i);
            Some(after)
        } else {
            self.bodies.assembly.set_pose(i, old);
            None
        }
    }

    /// Attempts to swap the positions of two particles of different size.
    fn swap(&mut self, i: usize, j: usize, before: f64, temperature: f64, rng: &mut ChaCha8Rng) -> Option<f64> {
        let (large, small) = (self.bodies.assembly.size(i), self.bodies.assembly.size(j));
        if i == j || (large / small).ln().abs() < 0.02 {
            return None;
        }
        let before = before + self.bodies.energy(j) - self.shared(i, j);
        let (of_i, of_j) = (self.bodies.assembly.pose(i), self.bodies.assembly.pose(j));
        self.bodies.try_pose(i, of_j.0, of_i.1);
        self.bodies.try_pose(j, of_i.0, of_j.1);
        self.bodies.settle(i);
        self.bodies.settle(j);
        let alone = self.bodies.energy(i);
        let after = alone + self.bodies.energy(j) - self.shared(i, j);
        if accepted(after - before, temperature, rng) {
            return Some(alone);
        }
        self.bodies.assembly.set_pose(i, of_i);
        self.bodies.assembly.set_pose(j, of_j);
        self.bodies.settle(i);
        self.bodies.settle(j);
        None
    }

    /// Energy of the overlaps between two particles, which the energy of each contains.
    fn shared(&self, i: usize, j: usize) -> f64 {
        let mut shared = 0.0;
        let _ = self.bodies.each_overlap(i, |other, overlap| {
            if other == j {
                shared += overlap;
            }
            ControlFlow::Continue(())
        });
        shared
    }
}

fn accepted(increase: f64, temperature: f64, rng: &mut ChaCha8Rng) -> bool {
    increase <= 0.0 || rng.random::<f64>() < (-increase / temperature).exp()
}
