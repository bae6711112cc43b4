//! The fast mode: overlaps push particles apart, with inertia and friction.
//!
//! # Formula
//!
//! ```text
//! v ← μ v + Δt F / m,     x ← x + Δt v,      μ = .9 … .98,  Δt = .6 in units in which a contact has stiffness 1 and the lightest particle mass 1
//! ```
//!
//! and likewise for rotations: gradient descent with momentum (Polyak 1964). FIRE (Bitzek et al. 2006) stops all
//! particles whenever the total energy rises. Compared with it, this method needs less than half the iterations for
//! spheres (lognormal σ .3, 10,000 at .64: 185-400 against 581), and does not stall on flat faces: their energy has
//! creases, on which a few rattling cubes stop all particles repeatedly (500 cubes at .6: 75 iterations; FIRE did not
//! end in 2,000).

use crate::assembly::Assembly;
use crate::contacts::{Memory, Overlaps};
use crate::neighbours::Neighbours;
use crate::one_by_one::{OneByOne, anywhere};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_shape::{PeriodicBox, isotropic_rotation};

/// How a relaxation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Apart,
    Stuck,
    Cancelled,
}

/// Limits of a relaxation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Sizes are multiplied by this while relaxing, so that overlaps at true size vanish in a finite number of
    /// iterations.
    pub(crate) swelling: f64,
    pub(crate) iterations: usize,
    pub(crate) seed: u64,
}

/// Pairs count as separate if their gap exceeds rounding errors.
pub(crate) const APART: f64 = -1e-9;

/// Longest stable time step for a particle with twelve contacts of stiffness 1 (measured: .8 diverges for cubes).
const STEP: f64 = 0.6;
const SHORTEST_STEP: f64 = 0.15;
/// In one step no particle moves by more than this fraction of its radius or of the mean radius, whichever is larger,
/// or rotates by more than this angle. The mean radius counts because a small particle inside a large one has far to
/// go.
const STRIDE: f64 = 0.2;
/// Progress is checked after so many iterations.
const WATCH: usize = 100;
/// Maximum number of random perturbations of all particles.
const SHAKES: u64 = 3;
/// Maximum number of times that entangled particles are moved elsewhere.
const RESCUES: u64 = 30;
const RESCUE_STREAM: u64 = 1 << 20;
/// An overlap of this fraction of the width of a pair that no longer decreases shows that there is no room.
const HOPELESS: f64 = 0.03;

/// Relaxes until no pair overlaps at true size. Energies are appended to `trace`.
pub(crate) fn relax(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    limits: &Limits,
    trace: &mut Vec<f64>,
    progress: &dyn Fn(&Overlaps) -> ControlFlow<()>,
) -> End {
    let mut motion = Motion::new(assembly);
    let mut nearby = Nearby::new(assembly, period, limits.swelling);
    let mut overlaps = Overlaps::default();
    let mut shakes = 0;
    let mut rescues = 0;
    let mut before = f64::INFINITY;
    let mut swelling = limits.swelling;
    for iteration in 0..limits.iterations {
        nearby.follow(assembly, period);
        assembly.overlaps(&nearby.neighbours, &mut nearby.memory, swelling, &mut overlaps);
        trace.push(overlaps.energy);
        if overlaps.worst < APART {
            return End::Apart;
        }
        if progress(&overlaps).is_break() {
            return End::Cancelled;
        }
        if iteration % WATCH == WATCH - 1 {
            // A perturbation frees particles that block each other slightly; deep overlaps that persist show that there
            // is no room.
            let hopeless = overlaps.worst > HOPELESS;
            let patience = match (assembly.can_entangle(), hopeless) {
                (true, _) => WATCH,
                (false, true) => 4 * WATCH,
                (false, false) => 10 * WATCH,
            };
            if overlaps.energy > 0.9 * before && motion.age > patience && assembly.can_entangle() && rescues < RESCUES {
                rescues += 1;
                rescue(assembly, period, &overlaps, swelling, limits.seed, rescues);
                motion = Motion::new(assembly);
                before = f64::INFINITY;
                continue;
            }
            if overlaps.energy > 0.98 * before && motion.age > patience {
                if hopeless || shakes == SHAKES {
                    return End::Stuck;
                }
                shakes += 1;
                swelling = 1.0 + 0.5 * (swelling - 1.0);
                shake(assembly, limits.seed, shakes);
                motion = Motion::new(assembly);
                before = f64::INFINITY;
                continue;
            }
            if overlaps.energy > before {
                motion.step = (0.7 * motion.step).max(SHORTEST_STEP);
            }
            before = overlaps.energy;
        }
        motion.advance(assembly, &overlaps);
    }
    End::Stuck
}

/// Moves the smaller particle of each of the deepest overlaps to the best of many random positions.
///
/// Linked rings that are too thick for each other can only be separated in this way.
fn rescue(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    overlaps: &Overlaps,
    swelling: f64,
    seed: u64,
    number: u64,
) {
    const POSITIONS: usize = 100;
    let deepest = overlaps.pushes().map(|push| push.force.norm()).fold(0.0, f64::max);
    let mut trapped: Vec<usize> = overlaps
        .pushes()
        .filter(|push| push.force.norm() > 0.5 * deepest)
        .map(|push| (push.a as usize, push.b as usize))
        .map(|(a, b)| if assembly.radius[a] < assembly.radius[b] { a } else { b })
        .collect();
    trapped.sort_unstable();
    trapped.dedup();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(RESCUE_STREAM + number);
    let mut bodies = OneByOne::full(assembly, period, swelling);
    for i in trapped {
        let mut best = (f64::INFINITY, bodies.assembly.pose(i));
        for _ in 0..POSITIONS {
            let centre = anywhere(&mut rng, period);
            bodies.try_pose(i, centre, isotropic_rotation(&mut rng));
            let energy = bodies.energy(i);
            if energy < best.0 {
                best = (energy, bodies.assembly.pose(i));
            }
        }
        bodies.assembly.set_pose(i, best.1);
        bodies.settle(i);
    }
}

/// Moves and rotates every particle slightly at random.
fn shake(assembly: &mut Assembly<'_>, seed: u64, number: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    let mut draw = || Vector3::from_fn(|_, _| 0.3 * (2.0 * rng.random::<f64>() - 1.0));
    for i in 0..assembly.len() {
        let shift = draw() * assembly.radius[i];
        assembly.shift(i, &shift);
        if !assembly.round {
            assembly.turn(i, &draw());
        }
    }
}

/// The list of pairs that may overlap, renewed when a particle has moved too far.
struct Nearby {
    neighbours: Neighbours,
    memory: Vec<Memory>,
    swelling: f64,
    /// Positions when the list was made.
    place: Vec<Vector3<f64>>,
    mean: f64,
    skin: f64,
    age: usize,
}

impl Nearby {
    fn new(assembly: &mut Assembly<'_>, period: &PeriodicBox, swelling: f64) -> Self {
        let mean = assembly.radius.iter().sum::<f64>() / assembly.len().max(1) as f64;
        assembly.wrap(period);
        let skin = 0.8 * mean;
        let neighbours = assembly.neighbours(swelling, skin);
        let memory = vec![Memory::NONE; if assembly.round { 0 } else { neighbours.len() }];
        Self {
            neighbours,
            memory,
            swelling,
            place: assembly.centre.clone(),
            mean,
            skin,
            age: 0,
        }
    }

    fn follow(&mut self, assembly: &mut Assembly<'_>, period: &PeriodicBox) {
        self.age += 1;
        let far = 0.25 * self.skin * self.skin;
        if assembly
            .centre
            .iter()
            .zip(&self.place)
            .all(|(now, then)| (now - then).norm_squared() < far)
        {
            return;
        }
        // A wide skin costs at every step, a narrow one soon requires a new list.
        self.skin = if self.age < 6 {
            (1.3 * self.skin).min(2.0 * self.mean)
        } else {
            (0.8 * self.skin).max(0.2 * self.mean)
        };
        self.age = 0;
        assembly.wrap(period);
        self.neighbours = assembly.neighbours(self.swelling, self.skin);
        self.place.clone_from(&assembly.centre);
        if !assembly.round {
            self.memory.clear();
            self.memory.resize(self.neighbours.len(), Memory::NONE);
        }
    }
}

/// Velocities and forces of all particles.
struct Motion {
    velocity: Vec<Vector3<f64>>,
    force: Vec<Vector3<f64>>,
    spin: Vec<Vector3<f64>>,
    torque: Vec<Vector3<f64>>,
    mass: Vec<f64>,
    inertia: Vec<f64>,
    /// Mean radius.
    mean: f64,
    step: f64,
    age: usize,
}

impl Motion {
    fn new(assembly: &Assembly<'_>) -> Self {
        let count = assembly.len();
        let turning = if assembly.round { 0 } else { count };
        let mean = assembly.radius.iter().sum::<f64>() / count.max(1) as f64;
        // The number of contacts of a large particle grows with its surface: a mass proportional to the surface keeps
        // all frequencies equal.
        let mass: Vec<f64> = assembly.radius.iter().map(|r| (r / mean).powi(2).max(1.0)).collect();
        // A contact at the end of a rod rotates it most easily.
        let inertia = (0..turning)
            .map(|i| 0.4 * mass[i] * assembly.reach(i).powi(2))
            .collect();
        Self {
            velocity: vec![Vector3::zeros(); count],
            force: vec![Vector3::zeros(); count],
            spin: vec![Vector3::zeros(); turning],
            torque: vec![Vector3::zeros(); turning],
            mass,
            inertia,
            mean,
            step: STEP,
            age: 0,
        }
    }

    /// One step of the descent, from the overlaps just found.
    fn advance(&mut self, assembly: &mut Assembly<'_>, overlaps: &Overlaps) {
        self.gather(assembly, overlaps);
        self.age += 1;
        // Near jamming the slowest motions are very slow: let their momentum build up.
        let keep = match self.age {
            0..150 => 0.9,
            150..500 => 0.95,
            500..1500 => 0.97,
            _ => 0.98,
        };
        for i in 0..self.velocity.len() {
            let velocity = self.velocity[i] * keep + self.force[i] * (self.step / self.mass[i]);
            self.velocity[i] = bounded(velocity, STRIDE * assembly.radius[i].max(self.mean) / self.step);
            assembly.shift(i, &(self.velocity[i] * self.step));
        }
        for i in 0..self.spin.len() {
            let spin = self.spin[i] * keep + self.torque[i] * (self.step / self.inertia[i]);
            self.spin[i] = bounded(spin, STRIDE / self.step);
            assembly.turn(i, &(self.spin[i] * self.step));
        }
    }

    fn gather(&mut self, assembly: &Assembly<'_>, overlaps: &Overlaps) {
        self.force.fill(Vector3::zeros());
        self.torque.fill(Vector3::zeros());
        for push in overlaps.pushes() {
            let (a, b) = (push.a as usize, push.b as usize);
            self.force[a] -= push.force;
            self.force[b] += push.force;
            if !assembly.round {
                self.torque[a] -= push.on_a.cross(&push.force);
                self.torque[b] += push.on_b.cross(&push.force);
            }
        }
    }
}

fn bounded(vector: Vector3<f64>, most: f64) -> Vector3<f64> {
    let squared = vector.norm_squared();
    if squared > most * most {
        vector * (most / squared.sqrt())
    } else {
        vector
    }
}
