//! The particles while they move, and the energy of their overlaps.
//!
//! # Formula
//!
//! ```text
//! E = Σ over pairs ½ δ²,    δ = (1 + ε − γ) w   where γ < 1 + ε
//! ```
//!
//! `γ` is the gauge of the pair and `w` the width of the difference body along the direction found, so `δ` is the depth of the overlap of the swollen bodies
//! in that direction, for spheres `swollen radii − distance`. The force is `δ` along that direction, at the point where the shrunken bodies meet: a contact
//! has stiffness 1 whatever the shapes. (Depth relative to the size of a particle instead makes flat contacts of rods stiffer than their ends; a thousand
//! iterations against eighty.) Unit of energy: length².

use crate::difference::Posed;
use crate::gauge::{Gauge, Search};
use crate::neighbours::{Neighbour, Neighbours};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;
use stereology_shape::{BodyKind, Particle, PeriodicBox, UnitBody};

/// Particles in motion.
#[derive(Clone, Debug)]
pub(crate) struct Assembly<'a> {
    bodies: &'a [UnitBody],
    particles: Vec<Particle>,
    sides: Vector3<f64>,
    /// All bodies are spheres, or are taken for spheres of their volume: nothing rotates, and pairs take the closed form.
    pub(crate) round: bool,
    /// Radius of the sphere of the same volume.
    pub(crate) radius: Vec<f64>,
    /// Not wrapped while neighbours are valid.
    pub(crate) centre: Vec<Vector3<f64>>,
    rotation: Vec<UnitQuaternion<f64>>,
    matrix: Vec<Matrix3<f64>>,
    /// An upper bound of the way any point of a (slightly swollen) particle has gone; only if not round.
    travelled: Vec<f64>,
}

/// One overlap: pushes `b` by `force` at `on_b` and `a` by the opposite at `on_a` (from the centroids).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Push {
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) force: Vector3<f64>,
    pub(crate) on_a: Vector3<f64>,
    pub(crate) on_b: Vector3<f64>,
}

/// The overlaps of one state, in blocks of fixed order.
#[derive(Debug, Default)]
pub(crate) struct Overlaps {
    blocks: Vec<Block>,
    pub(crate) energy: f64,
    /// Largest overlap at the true sizes, `1 − γ`; not positive if none.
    pub(crate) worst: f64,
}

#[derive(Debug, Default)]
struct Block {
    pushes: Vec<Push>,
    energy: f64,
    worst: f64,
}

impl Overlaps {
    /// All pushes, always in the same order.
    pub(crate) fn pushes(&self) -> impl Iterator<Item = &Push> {
        self.blocks.iter().flat_map(|block| &block.pushes)
    }
}

/// What is remembered of a pair while it stays in the list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    /// The last direction that parted it, or came nearest to; zero if none yet.
    normal: Vector3<f64>,
    /// Until both have travelled so far together they cannot meet.
    safe_until: f64,
}

impl Memory {
    pub(crate) const NONE: Self = Self {
        normal: Vector3::new(0.0, 0.0, 0.0),
        safe_until: f64::NEG_INFINITY,
    };
}

/// Bodies in one block of work; fixed, so that sums do not depend on threads.
const BLOCK: usize = 256;

/// Below this many bodies a second thread costs more than it saves.
const ALONE: usize = 2 * BLOCK;

/// Bodies are never swollen more than this while they are packed.
pub(crate) const SWELLING_MOST: f64 = 1.05;

impl<'a> Assembly<'a> {
    /// The particles of valid shapes and sizes, in the box.
    pub(crate) fn new(bodies: &'a [UnitBody], particles: Vec<Particle>, period: &PeriodicBox) -> Self {
        let round = particles
            .iter()
            .all(|p| matches!(bodies[p.shape].body().kind(), BodyKind::Sphere { .. }));
        let radius = particles
            .iter()
            .map(|p| p.size * (0.75 / PI * bodies[p.shape].volume()).cbrt())
            .collect();
        let centre = particles.iter().map(|p| period.wrap(&p.position).coords).collect();
        let rotation: Vec<_> = particles.iter().map(|p| p.orientation).collect();
        let matrix = rotation.iter().map(|q| q.to_rotation_matrix().into_inner()).collect();
        let travelled = vec![0.0; particles.len()];
        Self {
            bodies,
            sides: period.sides(),
            round,
            radius,
            centre,
            rotation,
            matrix,
            travelled,
            particles,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.centre.len()
    }

    /// The particles where they are now, in the box.
    pub(crate) fn into_particles(self, period: &PeriodicBox) -> Vec<Particle> {
        let mut particles = self.particles;
        for (i, particle) in particles.iter_mut().enumerate() {
            particle.position = period.wrap(&Point3::from(self.centre[i]));
            particle.orientation = self.rotation[i];
        }
        particles
    }

    /// Brings all centres into the box. Neighbours found before are void.
    pub(crate) fn wrap(&mut self, period: &PeriodicBox) {
        for centre in &mut self.centre {
            *centre = period.wrap(&Point3::from(*centre)).coords;
        }
    }

    /// Pairs that can overlap at sizes times `swelling` before anyone moves by half of `skin`. Centres are in the box.
    pub(crate) fn neighbours(&self, swelling: f64, skin: f64) -> Neighbours {
        let reach: Vec<f64> = (0..self.len()).map(|i| self.reach(i) * swelling).collect();
        Neighbours::find(&self.centre, &reach, self.sides, skin)
    }

    pub(crate) fn reach(&self, i: usize) -> f64 {
        if self.round {
            self.radius[i]
        } else {
            self.body(i).bounding_radius() * self.particles[i].size
        }
    }

    fn body(&self, i: usize) -> &UnitBody {
        &self.bodies[self.particles[i].shape]
    }

    pub(crate) fn posed(&self, i: usize) -> Posed<'_> {
        Posed {
            body: self.body(i),
            size: self.particles[i].size,
            rotation: &self.matrix[i],
        }
    }

    /// Moves a particle.
    pub(crate) fn shift(&mut self, i: usize, way: &Vector3<f64>) {
        self.centre[i] += way;
        self.travelled[i] += way.norm();
    }

    /// Turns a particle by a rotation vector.
    pub(crate) fn turn(&mut self, i: usize, angle: &Vector3<f64>) {
        let mut rotation = UnitQuaternion::from_scaled_axis(*angle) * self.rotation[i];
        rotation.renormalize();
        self.rotation[i] = rotation;
        self.matrix[i] = rotation.to_rotation_matrix().into_inner();
        self.travelled[i] += SWELLING_MOST * self.reach(i) * angle.norm();
    }

    /// All overlaps at sizes times `swelling`.
    pub(crate) fn overlaps(
        &mut self,
        neighbours: &Neighbours,
        memory: &mut [Memory],
        swelling: f64,
        found: &mut Overlaps,
    ) {
        found.blocks.resize_with(self.len().div_ceil(BLOCK), Block::default);
        let this = &*self;
        if this.round {
            let work = |(number, block): (usize, &mut Block)| this.sphere_block(number, neighbours, swelling, block);
            if this.len() <= 4 * ALONE {
                found.blocks.iter_mut().enumerate().for_each(work);
            } else {
                found.blocks.par_iter_mut().enumerate().for_each(work);
            }
        } else {
            let mut parts = Vec::with_capacity(found.blocks.len());
            let mut rest = memory;
            for number in 0..found.blocks.len() {
                let from = neighbours.of(number * BLOCK).0;
                let to = if (number + 1) * BLOCK < this.len() {
                    neighbours.of((number + 1) * BLOCK).0
                } else {
                    neighbours.len()
                };
                let (part, later) = rest.split_at_mut(to - from);
                parts.push(part);
                rest = later;
            }
            let work = |(number, (block, part)): (usize, (&mut Block, &mut [Memory]))| {
                this.convex_block(number, neighbours, part, swelling, block);
            };
            if this.len() <= ALONE {
                found.blocks.iter_mut().zip(parts).enumerate().for_each(work);
            } else {
                found.blocks.par_iter_mut().zip(parts).enumerate().for_each(work);
            }
        }
        found.energy = found.blocks.iter().map(|b| b.energy).sum();
        found.worst = found.blocks.iter().map(|b| b.worst).fold(f64::NEG_INFINITY, f64::max);
    }

    fn sphere_block(&self, number: usize, neighbours: &Neighbours, swelling: f64, block: &mut Block) {
        block.pushes.clear();
        (block.energy, block.worst) = (0.0, f64::NEG_INFINITY);
        for a in number * BLOCK..self.len().min((number + 1) * BLOCK) {
            let (centre, radius) = (self.centre[a], self.radius[a]);
            for &Neighbour { other, image } in neighbours.of(a).1 {
                let b = other as usize;
                let offset = self.centre[b] + neighbours.images.shift(image) - centre;
                let touching = radius + self.radius[b];
                let swollen = touching * swelling;
                let squared = offset.norm_squared();
                if squared >= swollen * swollen || a == b {
                    continue;
                }
                let distance = squared.sqrt();
                let depth = swollen - distance;
                let force = if distance > 1e-12 * touching {
                    offset * (depth / distance)
                } else {
                    arbitrary(a, b) * depth
                };
                block.energy += 0.5 * depth * depth;
                block.worst = block.worst.max(1.0 - distance / touching);
                block.pushes.push(Push {
                    a: a as u32,
                    b: other,
                    force,
                    on_a: Vector3::zeros(),
                    on_b: Vector3::zeros(),
                });
            }
        }
    }

    fn convex_block(
        &self,
        number: usize,
        neighbours: &Neighbours,
        memory: &mut [Memory],
        swelling: f64,
        block: &mut Block,
    ) {
        block.pushes.clear();
        (block.energy, block.worst) = (0.0, f64::NEG_INFINITY);
        let first = neighbours.of(number * BLOCK).0;
        for a in number * BLOCK..self.len().min((number + 1) * BLOCK) {
            let (from, list) = neighbours.of(a);
            for (pair, &Neighbour { other, image }) in list.iter().enumerate() {
                let memory = &mut memory[from + pair - first];
                let b = other as usize;
                let travelled = self.travelled[a] + self.travelled[b];
                if travelled < memory.safe_until {
                    continue;
                }
                let offset = self.centre[b] + neighbours.images.shift(image) - self.centre[a];
                if let Some(push) = self.meet(a, b, &offset, travelled, swelling, memory, block) {
                    block.pushes.push(push);
                }
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one step of the loop above, split for reading")]
    fn meet(
        &self,
        a: usize,
        b: usize,
        offset: &Vector3<f64>,
        travelled: f64,
        swelling: f64,
        memory: &mut Memory,
        block: &mut Block,
    ) -> Option<Push> {
        let squared = offset.norm_squared();
        let bounding = swelling * (self.reach(a) + self.reach(b));
        if squared >= bounding * bounding {
            memory.safe_until = travelled + squared.sqrt() - bounding;
            return None;
        }
        let (pose_a, pose_b) = (self.posed(a), self.posed(b));
        if memory.normal != Vector3::zeros() {
            let (value, width) = Gauge::along(&pose_a, &pose_b, offset, &memory.normal);
            if value >= swelling {
                memory.safe_until = travelled + (value - swelling) * width;
                return None;
            }
        }
        let search = Search {
            enough: swelling + PARTED,
            precision: 1e-4,
            steps: 24,
        };
        let gauge = Gauge::search(&pose_a, &pose_b, offset, &search);
        memory.normal = gauge.normal;
        if gauge.value >= swelling {
            memory.safe_until = travelled + (gauge.value - swelling) * gauge.width;
            return None;
        }
        memory.safe_until = f64::NEG_INFINITY;
        let depth = (swelling - gauge.value) * gauge.width;
        block.energy += 0.5 * depth * depth;
        block.worst = block.worst.max(1.0 - gauge.value);
        let normal = if gauge.value > 0.0 {
            gauge.normal
        } else {
            arbitrary(a, b)
        };
        Some(Push {
            a: a as u32,
            b: b as u32,
            force: normal * depth,
            on_a: gauge.on_a * gauge.value.max(0.0),
            on_b: gauge.on_b * gauge.value.max(0.0),
        })
    }
}

/// A search goes on past the first proof of separation until it has proved this much more room, so that the pair need not be asked again soon.
const PARTED: f64 = 0.05;

/// Where centres coincide: some direction, the same every time.
fn arbitrary(a: usize, b: usize) -> Vector3<f64> {
    let angle = (a as f64 * 0.618 + b as f64 * 0.414).fract() * std::f64::consts::TAU;
    let height = ((a as f64 * 0.755 + b as f64 * 0.57).fract() * 2.0 - 1.0) * 0.99;
    let around = (1.0 - height * height).sqrt();
    Vector3::new(around * angle.cos(), around * angle.sin(), height)
}
