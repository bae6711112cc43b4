//! The certificate: proof, pair by pair, that no two particles share a point of their insides.

use crate::difference::Posed;
use crate::gauge::{Gauge, Search};
use crate::neighbours::Neighbours;
use crate::particles::{ParticleError, check, fraction};
use crate::separating_axis::{best_axis, depth_across_faces};
use crate::surfaces::{self, Placed, Surface};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::fmt;
use stereology_shape::{Particle, PeriodicBox, UnitBody};

/// Particles in a periodic box of which it is proved that none overlap, at their true sizes.
///
/// Only [`Packing::verify`] makes one, directly or at the end of [`pack`](crate::pack). Positions are in the box.
///
/// # Method
///
/// Every pair of particles and of their periodic images, a particle's own images too, whose bounding spheres meet must show a witness: spheres their
/// distance, convex bodies a direction `n` in which they lie apart,
///
/// ```text
/// h_A(n) + h_B(−n) ≤ n·(c_B − c_A)        h: how far the body reaches from its centroid c in a direction
/// ```
///
/// However the direction was found, the inequality proves the pair apart. Nothing is moved. Touching is no overlap; an allowance of 10⁻¹² of the reach
/// stands for the rounding of coordinates. Bodies that are not convex, if not even their hulls meet, are apart likewise; else all faces of the two meshes (as
/// given, not parts or proxies of them) must show such a direction pair by pair, and no piece of either surface may lie inside the other.
#[derive(Clone, Debug)]
pub struct Packing {
    bodies: Vec<UnitBody>,
    particles: Vec<Particle>,
    period: PeriodicBox,
    energies: Vec<f64>,
    iterations: usize,
}

/// Two particles that could not be shown apart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Overlap {
    /// Index of the particle that comes first.
    pub first: usize,
    /// Index of the other, which comes later; equal to `first` if a particle meets its own periodic image.
    pub second: usize,
    /// How far one must be moved to part them, along the direction in which they would part first if they shrank, or across a face of either: exact for spheres
    /// and for boxes that are aligned, else an upper bound; for bodies that are not convex the depth of the deepest crossing face or enclosed point. A length.
    pub depth: f64,
}

/// All overlaps of an arrangement that is not a packing.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Overlaps {
    /// The pairs, deepest first; a pair that meets in several periodic images is there several times.
    pub pairs: Vec<Overlap>,
    /// The deepest overlap over the mean size of all particles.
    pub max_overlap: f64,
}

impl fmt::Display for Overlaps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} pairs overlap by up to {:.3e} of the mean size; worst:",
            self.pairs.len(),
            self.max_overlap
        )?;
        for pair in self.pairs.iter().take(3) {
            write!(f, " {} and {} by {:.3e};", pair.first, pair.second, pair.depth)?;
        }
        Ok(())
    }
}

/// Why an arrangement is not a packing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// A particle is not one.
    #[error(transparent)]
    Particle(#[from] ParticleError),
    /// Particles overlap.
    #[error("{0}")]
    Overlap(Overlaps),
}

impl Packing {
    /// Proves that no particles overlap.
    ///
    /// Cost: N log N for the pairs, microseconds a pair.
    ///
    /// # Errors
    ///
    /// [`VerifyError::Overlap`] with every pair for which no witness was found; [`VerifyError::Particle`] for shapes that do not exist, sizes, positions and
    /// orientations that are not numbers, and particles longer than four times the shortest side of the box.
    ///
    /// # Examples
    ///
    /// ```
    /// use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// use stereology_anneal::Packing;
    /// use stereology_shape::{Body, Particle, PeriodicBox, UnitBody};
    ///
    /// let ball = UnitBody::new(&Body::sphere(1.0)?);
    /// let at = |x| Particle { shape: 0, size: 1.0, category: 0, position: Point3::new(x, 0.0, 0.0), orientation: UnitQuaternion::identity() };
    /// let period = PeriodicBox::new(Vector3::new(4.0, 2.0, 2.0))?;
    /// let touching = Packing::verify(&[ball.clone()], vec![at(0.0), at(1.0)], &period)?;
    /// assert!((touching.fraction() - std::f64::consts::PI / 3.0 / 16.0).abs() < 1e-12);
    /// assert!(Packing::verify(&[ball], vec![at(0.0), at(0.999)], &period).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn verify(bodies: &[UnitBody], particles: Vec<Particle>, period: &PeriodicBox) -> Result<Self, VerifyError> {
        // First, because wrapping would hide positions that are not numbers.
        check(bodies, &particles, period)?;
        let particles: Vec<Particle> = particles
            .into_iter()
            .map(|p| Particle {
                position: period.wrap(&p.position),
                ..p
            })
            .collect();
        let pairs = overlaps(bodies, &particles, period)?;
        if pairs.is_empty() {
            return Ok(Self {
                bodies: bodies.to_vec(),
                particles,
                period: *period,
                energies: Vec::new(),
                iterations: 0,
            });
        }
        let mean = particles.iter().map(|p| p.size).sum::<f64>() / particles.len() as f64;
        let max_overlap = pairs[0].depth / mean;
        Err(VerifyError::Overlap(Overlaps { pairs, max_overlap }))
    }

    pub(crate) fn with_energies(mut self, energies: Vec<f64>) -> Self {
        self.iterations = energies.len();
        self.energies = energies;
        self
    }

    pub(crate) fn with_tries(mut self, tries: usize) -> Self {
        self.iterations = tries;
        self
    }

    /// The bodies particles are of.
    #[must_use]
    pub fn bodies(&self) -> &[UnitBody] {
        &self.bodies
    }

    /// The particles, in the order they were given.
    #[must_use]
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// The particles, without the proof.
    #[must_use]
    pub fn into_particles(self) -> Vec<Particle> {
        self.particles
    }

    /// The box that repeats.
    #[must_use]
    pub fn period(&self) -> &PeriodicBox {
        &self.period
    }

    /// Sides of the box along x, y, z.
    #[must_use]
    pub fn sides(&self) -> Vector3<f64> {
        self.period.sides()
    }

    /// Volume of the particles over that of the box.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        fraction(&self.bodies, &self.particles, &self.period)
    }

    /// The deepest overlap over the mean size: 0, by the certificate.
    #[must_use]
    pub fn max_overlap(&self) -> f64 {
        0.0
    }

    /// How often overlaps were found and relaxed to get here, or places tried if sequentially; 0 if the packing was only verified.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Energy of the overlaps at each iteration, Σ ½ depth² over pairs of slightly swollen particles; length².
    ///
    /// Of bodies that are not spheres the first part, up to a hundred values, is that of spheres of their volumes.
    #[must_use]
    pub fn energies(&self) -> &[f64] {
        &self.energies
    }
}

/// All pairs of particles that cannot be shown apart, deepest first: what [`Packing::verify`] finds.
///
/// # Errors
///
/// [`ParticleError`], as there.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_shape::{Body, Particle, PeriodicBox, UnitBody};
///
/// // A sphere of diameter 1 in a box of side 0.8 meets its six nearest images: three pairs.
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let only = Particle { shape: 0, size: 1.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let found = stereology_anneal::overlaps(&[ball], &[only], &PeriodicBox::new(Vector3::repeat(0.8))?)?;
/// assert_eq!(found.len(), 3);
/// assert!((found[0].depth - 0.2).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn overlaps(
    bodies: &[UnitBody],
    particles: &[Particle],
    period: &PeriodicBox,
) -> Result<Vec<Overlap>, ParticleError> {
    check(bodies, particles, period)?;
    let centres: Vec<Vector3<f64>> = particles.iter().map(|p| period.wrap(&p.position).coords).collect();
    let reach: Vec<f64> = particles
        .iter()
        .map(|p| bodies[p.shape].bounding_radius() * p.size)
        .collect();
    let turns: Vec<Matrix3<f64>> = particles
        .iter()
        .map(|p| p.orientation.to_rotation_matrix().into_inner())
        .collect();
    let surfaces: Vec<Option<Surface>> = surfaces_needed(bodies, particles);
    // The skin makes up for the rounding of the reach.
    let skin = 1e-9 * reach.iter().copied().fold(0.0, f64::max);
    let neighbours = Neighbours::find(&centres, &reach, period.sides(), skin);
    let mut found: Vec<Overlap> = (0..particles.len())
        .into_par_iter()
        .with_min_len(64)
        .flat_map_iter(|first| {
            let (centres, turns, neighbours, surfaces) = (&centres, &turns, &neighbours, &surfaces);
            neighbours.of(first).1.iter().filter_map(move |neighbour| {
                let second = neighbour.other as usize;
                let offset = centres[second] + neighbours.images.shift(neighbour.image) - centres[first];
                let placed = |i: usize| Placed {
                    body: &bodies[particles[i].shape],
                    surface: surfaces[particles[i].shape].as_ref(),
                    size: particles[i].size,
                    rotation: &turns[i],
                };
                let depth = depth(&placed(first), &placed(second), &offset);
                (depth > 0.0).then_some(Overlap {
                    first: first.min(second),
                    second: first.max(second),
                    depth,
                })
            })
        })
        .collect();
    found.sort_by(|p, q| {
        q.depth
            .total_cmp(&p.depth)
            .then(p.first.cmp(&q.first))
            .then(p.second.cmp(&q.second))
    });
    Ok(found)
}

/// Allowance for the rounding of coordinates and support points.
const ROUNDING: f64 = 1e-12;

/// The surfaces of meshes that meet, or are, bodies that are not convex.
fn surfaces_needed(bodies: &[UnitBody], particles: &[Particle]) -> Vec<Option<Surface>> {
    let hollow = particles.iter().any(|p| !bodies[p.shape].is_convex());
    bodies
        .iter()
        .map(|body| if hollow { Surface::of(body) } else { None })
        .collect()
}

/// 0 if a witness shows two bodies apart, else how deep they overlap.
fn depth(a: &Placed<'_>, b: &Placed<'_>, offset: &Vector3<f64>) -> f64 {
    if a.is_sphere() && b.is_sphere() {
        let touching = 0.5 * (a.size + b.size);
        let distance = offset.norm();
        return if distance >= touching * (1.0 - ROUNDING) {
            0.0
        } else {
            touching - distance
        };
    }
    let convex = a.body.is_convex() && b.body.is_convex();
    let (hull_a, hull_b) = (a.hull(), b.hull());
    let search = Search {
        enough: 1.0,
        precision: 1e-13,
        steps: 200,
    };
    let gauge = Gauge::search(&hull_a, &hull_b, offset, &search);
    if witnessed(&hull_a, &hull_b, offset, &gauge.normal) {
        return 0.0;
    }
    if !convex {
        // Hulls that meet prove nothing.
        return surfaces::depth(a, b, offset);
    }
    let mut value = gauge.value;
    if gauge.at_most >= 1.0 - 1e-9
        && let Some((quotient, axis)) = best_axis(&hull_a, &hull_b, offset)
    {
        // The search ended on a degenerate portal, or too near to touching to tell.
        if witnessed(&hull_a, &hull_b, offset, &axis) {
            return 0.0;
        }
        value = value.max(quotient);
    }
    let depth = (1.0 - value) * gauge.width;
    depth_across_faces(&hull_a, &hull_b, offset)
        .map_or(depth, |across| across.min(depth))
        .max(f64::MIN_POSITIVE)
}

/// Whether the bodies lie apart in a direction, computed from their support points in world axes and nothing else.
fn witnessed(a: &Posed<'_>, b: &Posed<'_>, offset: &Vector3<f64>, normal: &Vector3<f64>) -> bool {
    *normal != Vector3::zeros() && (a.reach(normal) + b.reach(&-normal)) * (1.0 - ROUNDING) <= normal.dot(offset)
}
