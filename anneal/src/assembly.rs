//! The particles while they move: positions, orientations and the convex solids that they consist of.

use crate::difference::{Posed, Solid};
use crate::neighbours::Neighbours;
use crate::proxies::{Part, StandIn};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use stereology_shape::{BodyKind, Particle, PeriodicBox, UnitBody};

/// Particles in motion.
#[derive(Clone, Debug)]
pub(crate) struct Assembly<'a> {
    bodies: &'a [UnitBody],
    /// Representation of each body.
    stand_ins: &'a [StandIn],
    particles: Vec<Particle>,
    sides: Vector3<f64>,
    /// All bodies are spheres, or are treated as spheres of equal volume: nothing rotates, and pairs have a closed
    /// form.
    pub(crate) round: bool,
    /// Radius of the sphere of equal volume.
    pub(crate) radius: Vec<f64>,
    /// Not wrapped while neighbours are valid.
    pub(crate) centre: Vec<Vector3<f64>>,
    rotation: Vec<UnitQuaternion<f64>>,
    matrix: Vec<Matrix3<f64>>,
    /// Vectors from the centre of each particle to the centres of its parts, in world axes, particle by particle.
    arms: Vec<Vector3<f64>>,
    first_arm: Vec<usize>,
    /// Upper bound of the distance that any point of the (slightly swollen) particle has moved; only if not round.
    pub(crate) travelled: Vec<f64>,
}

/// Largest swelling of bodies while they are packed.
pub(crate) const SWELLING_MOST: f64 = 1.05;

impl<'a> Assembly<'a> {
    /// `particles` have been checked.
    pub(crate) fn new(
        bodies: &'a [UnitBody],
        stand_ins: &'a [StandIn],
        particles: Vec<Particle>,
        period: &PeriodicBox,
    ) -> Self {
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
        let mut first_arm = Vec::with_capacity(particles.len());
        let mut arms = 0;
        for particle in &particles {
            first_arm.push(arms);
            arms += stand_ins[particle.shape].parts.len();
        }
        let mut assembly = Self {
            bodies,
            stand_ins,
            arms: vec![Vector3::zeros(); arms],
            first_arm,
            sides: period.sides(),
            round,
            radius,
            centre,
            rotation,
            matrix,
            travelled,
            particles,
        };
        (0..assembly.len()).for_each(|i| assembly.place_arms(i));
        assembly
    }

    fn place_arms(&mut self, i: usize) {
        let particle = &self.particles[i];
        let parts = &self.stand_ins[particle.shape].parts;
        for (arm, part) in self.arms[self.first_arm[i]..].iter_mut().zip(parts) {
            *arm = self.matrix[i] * part.centre * particle.size;
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.centre.len()
    }

    /// The particles at their current positions, in the box.
    pub(crate) fn into_particles(self, period: &PeriodicBox) -> Vec<Particle> {
        let mut particles = self.particles;
        for (i, particle) in particles.iter_mut().enumerate() {
            particle.position = period.wrap(&Point3::from(self.centre[i]));
            particle.orientation = self.rotation[i];
        }
        particles
    }

    /// Brings all centres into the box. Invalidates neighbours found before.
    pub(crate) fn wrap(&mut self, period: &PeriodicBox) {
        for centre in &mut self.centre {
            *centre = period.wrap(&Point3::from(*centre)).coords;
        }
    }

    /// Pairs that can overlap at sizes times `swelling` before any particle has moved by half of `skin`. Centres are in
    /// the box.
    pub(crate) fn neighbours(&self, swelling: f64, skin: f64) -> Neighbours {
        let reach: Vec<f64> = (0..self.len()).map(|i| self.reach(i) * swelling).collect();
        Neighbours::find(&self.centre, &reach, self.sides, skin)
    }

    pub(crate) fn reach(&self, i: usize) -> f64 {
        if self.round {
            self.radius[i]
        } else {
            self.stand_ins[self.particles[i].shape].reach * self.particles[i].size
        }
    }

    fn parts(&self, i: usize) -> &[Part] {
        &self.stand_ins[self.particles[i].shape].parts
    }

    /// A particle as one convex solid.
    pub(crate) fn posed(&self, i: usize) -> Posed<'_> {
        Posed {
            solid: Solid::Body(&self.bodies[self.particles[i].shape]),
            size: self.particles[i].size,
            rotation: &self.matrix[i],
        }
    }

    /// The convex solids of a particle: vector from its centre to theirs, their radius about that, and the solid.
    pub(crate) fn solids(&self, i: usize) -> impl Iterator<Item = (Vector3<f64>, f64, Posed<'_>)> {
        let size = self.particles[i].size;
        let parts = self.parts(i);
        let whole = parts
            .is_empty()
            .then(|| (Vector3::zeros(), self.reach(i), self.posed(i)));
        whole.into_iter().chain(parts.iter().enumerate().map(move |(k, part)| {
            let posed = Posed {
                solid: Solid::Points(&part.points),
                size,
                rotation: &self.matrix[i],
            };
            (self.arms[self.first_arm[i] + k], part.reach * size, posed)
        }))
    }

    /// Whether some bodies have concavities in which others can be trapped.
    pub(crate) fn can_entangle(&self) -> bool {
        !self.round && self.stand_ins.iter().any(|stand_in| stand_in.parts.len() > 1)
    }

    /// Whether a particle is a single convex solid.
    pub(crate) fn single(&self, i: usize) -> bool {
        self.parts(i).is_empty()
    }

    pub(crate) fn size(&self, i: usize) -> f64 {
        self.particles[i].size
    }

    /// Position and orientation of a particle.
    pub(crate) fn pose(&self, i: usize) -> (Vector3<f64>, UnitQuaternion<f64>) {
        (self.centre[i], self.rotation[i])
    }

    /// Sets position and orientation of a particle.
    pub(crate) fn set_pose(&mut self, i: usize, (centre, rotation): (Vector3<f64>, UnitQuaternion<f64>)) {
        self.centre[i] = centre;
        if !self.round && rotation != self.rotation[i] {
            self.matrix[i] = rotation.to_rotation_matrix().into_inner();
            self.rotation[i] = rotation;
            self.place_arms(i);
        }
    }

    /// Moves a particle.
    pub(crate) fn shift(&mut self, i: usize, way: &Vector3<f64>) {
        self.centre[i] += way;
        self.travelled[i] += way.norm();
    }

    /// Rotates a particle by a rotation vector.
    pub(crate) fn turn(&mut self, i: usize, angle: &Vector3<f64>) {
        let mut rotation = UnitQuaternion::from_scaled_axis(*angle) * self.rotation[i];
        rotation.renormalize();
        self.rotation[i] = rotation;
        self.matrix[i] = rotation.to_rotation_matrix().into_inner();
        self.place_arms(i);
        self.travelled[i] += SWELLING_MOST * self.reach(i) * angle.norm();
    }
}
