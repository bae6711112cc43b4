//! The certificate: a proof, pair by pair, that no two particles share an interior point.

use crate::difference::Posed;
use crate::gauge::{Gauge, Search};
use crate::neighbours::Neighbours;
use crate::separating_axis::{best_axis, depth_across_faces};
use crate::surfaces::{self, Placed, Surface};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::fmt;
use std::ops::Deref;
use stereology_shape::{Arrangement, Particle, UnitBody};

/// An [`Arrangement`] in which no particles overlap at their true sizes, as proved by [`Packing::verify`].
///
/// Only [`Packing::verify`] creates one, directly or at the end of [`pack`](crate::pack). Positions are in the box. It
/// dereferences to its arrangement; [`Packing::certificate`] summarises the proof.
///
/// # Method
///
/// Every pair of particles whose bounding spheres overlap, including all periodic images and a particle and its own
/// images, needs a witness: spheres their distance, convex bodies a direction `n` in which they are separate,
///
/// ```text
/// h_A(n) + h_B(−n) ≤ n·(c_B − c_A)        h: support function about the centroid c
/// ```
///
/// The inequality proves the pair separate, however the direction was found. Nothing is moved. Touching is not an
/// overlap; a tolerance of 10⁻¹² of the reach allows for the rounding of coordinates. Bodies that are not convex are
/// separate if their hulls are; otherwise all pairs of faces of the two meshes (as given, not parts or proxies of them)
/// need such a direction, and no connected component of either surface may lie inside the other body.
#[derive(Clone, Debug)]
pub struct Packing {
    arrangement: Arrangement,
    certificate: Certificate,
    energies: Vec<f64>,
    iterations: usize,
}

/// Two particles that could not be proved separate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Overlap {
    /// The smaller index.
    pub first: usize,
    /// The larger index; equal to `first` if a particle overlaps its own periodic image.
    pub second: usize,
    /// Distance by which one must be moved to separate them, along the direction in which they would separate first if
    /// they shrank, or along a face normal of either: exact for spheres and for aligned boxes, otherwise an upper
    /// bound. For bodies that are not convex, the depth of the deepest crossing face or enclosed point. A length.
    pub depth: f64,
}

/// All overlaps of an arrangement that is not a packing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub struct Overlaps {
    /// The pairs, deepest first; a pair that overlaps in several periodic images occurs several times.
    pub pairs: Vec<Overlap>,
    /// The deepest overlap divided by the mean size of all particles.
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

/// Summary of the proof of a packing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Number of pairs of particles and periodic images whose bounding spheres overlap; each was proved separate.
    pub pairs: usize,
    /// Lower bound of the smallest distance between the surfaces of such a pair, a length: 0 if particles touch or two
    /// bodies that are not convex interlock; infinite without pairs.
    pub least_gap: f64,
}

impl Deref for Packing {
    type Target = Arrangement;

    fn deref(&self) -> &Arrangement {
        &self.arrangement
    }
}

impl Packing {
    /// Proves that no particles overlap.
    ///
    /// Cost: N log N for finding the pairs, microseconds per pair.
    ///
    /// # Errors
    ///
    /// [`Overlaps`] with every pair for which no witness was found.
    ///
    /// # Examples
    ///
    /// ```
    /// use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// use stereology_anneal::Packing;
    /// use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    ///
    /// let ball = UnitBody::new(&Body::sphere(1.0)?);
    /// let at = |x| Particle { shape: 0, size: 1.0, category: 0, position: Point3::new(x, 0.0, 0.0), orientation: UnitQuaternion::identity() };
    /// let period = PeriodicBox::new(Vector3::new(4.0, 2.0, 2.0))?;
    /// let touching = Arrangement::new([ball], [at(0.0), at(1.0)], period)?;
    /// let packing = Packing::verify(&touching)?;
    /// assert!((packing.fraction() - std::f64::consts::PI / 3.0 / 16.0).abs() < 1e-12);
    /// assert_eq!((packing.certificate().pairs, packing.certificate().least_gap), (1, 0.0));
    /// assert!(Packing::verify(&touching.with_particles([at(0.0), at(0.999)])?).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn verify(arrangement: &Arrangement) -> Result<Self, Overlaps> {
        let arrangement = arrangement.wrapped();
        let Examined { pairs, certificate } = examine(&arrangement);
        if pairs.is_empty() {
            return Ok(Self {
                arrangement,
                certificate,
                energies: Vec::new(),
                iterations: 0,
            });
        }
        let particles = arrangement.particles();
        let mean = particles.iter().map(|p| p.size).sum::<f64>() / particles.len() as f64;
        let max_overlap = pairs[0].depth / mean;
        Err(Overlaps { pairs, max_overlap })
    }

    pub(crate) fn with_energies(mut self, energies: Vec<f64>) -> Self {
        self.iterations = energies.len();
        self.energies = energies;
        self
    }

    /// The same packing, found in this number of iterations: for one that is read from a file.
    #[must_use]
    pub fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// The particles and their box, without the certificate.
    #[must_use]
    pub fn arrangement(&self) -> &Arrangement {
        &self.arrangement
    }

    /// Number of pairs that the proof examined, and the smallest gap.
    #[must_use]
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// The deepest overlap divided by the mean size: 0, by the certificate.
    #[must_use]
    pub fn max_overlap(&self) -> f64 {
        0.0
    }

    /// Number of iterations of the relaxation, or of positions tried in [`Mode::Sequential`](crate::Mode::Sequential);
    /// 0 if the packing was only verified.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Energy of the overlaps at each iteration, Σ ½ depth² over pairs of slightly swollen particles; length².
    ///
    /// For bodies that are not spheres, up to a hundred values at the beginning are those of spheres of equal volume.
    #[must_use]
    pub fn energies(&self) -> &[f64] {
        &self.energies
    }
}

/// All pairs of particles that cannot be proved separate, deepest first, as [`Packing::verify`] finds them.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
///
/// // A sphere of diameter 1 in a box of side 0.8 overlaps its six nearest images: three pairs.
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let only = Particle { shape: 0, size: 1.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let found = stereology_anneal::overlaps(&Arrangement::new([ball], [only], PeriodicBox::new(Vector3::repeat(0.8))?)?);
/// assert_eq!(found.len(), 3);
/// assert!((found[0].depth - 0.2).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn overlaps(arrangement: &Arrangement) -> Vec<Overlap> {
    examine(arrangement).pairs
}

/// The overlapping pairs of an arrangement, deepest first, and the summary of the other pairs.
struct Examined {
    pairs: Vec<Overlap>,
    certificate: Certificate,
}

impl Examined {
    fn nothing() -> Self {
        Self {
            pairs: Vec::new(),
            certificate: Certificate {
                pairs: 0,
                least_gap: f64::INFINITY,
            },
        }
    }

    /// The results of both.
    fn joined(mut self, other: Self) -> Self {
        self.pairs.extend(other.pairs);
        self.certificate.pairs += other.certificate.pairs;
        self.certificate.least_gap = self.certificate.least_gap.min(other.certificate.least_gap);
        self
    }
}

fn examine(arrangement: &Arrangement) -> Examined {
    let (bodies, particles, period) = (arrangement.bodies(), arrangement.particles(), arrangement.period());
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
    // The skin allows for the rounding of the reach.
    let skin = 1e-9 * reach.iter().copied().fold(0.0, f64::max);
    let neighbours = Neighbours::find(&centres, &reach, period.sides(), skin);
    let placed = |i: usize| Placed {
        body: &bodies[particles[i].shape],
        surface: surfaces[particles[i].shape].as_ref(),
        size: particles[i].size,
        rotation: &turns[i],
    };
    let blocks: Vec<Examined> = (0..particles.len().div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let mut found = Examined::nothing();
            for first in block * BLOCK..particles.len().min((block + 1) * BLOCK) {
                for neighbour in neighbours.of(first).1 {
                    let second = neighbour.other as usize;
                    let offset = centres[second] + neighbours.images.shift(neighbour.image) - centres[first];
                    found.certificate.pairs += 1;
                    match separation(&placed(first), &placed(second), &offset) {
                        Separation::Apart { gap } => {
                            found.certificate.least_gap = found.certificate.least_gap.min(gap);
                        }
                        Separation::Overlap { depth } => found.pairs.push(Overlap {
                            first: first.min(second),
                            second: first.max(second),
                            depth,
                        }),
                    }
                }
            }
            found
        })
        .collect();
    let mut found = blocks.into_iter().fold(Examined::nothing(), Examined::joined);
    found.pairs.sort_by(|p, q| {
        q.depth
            .total_cmp(&p.depth)
            .then(p.first.cmp(&q.first))
            .then(p.second.cmp(&q.second))
    });
    found
}

/// Particles per task; fixed, so that the result does not depend on the number of threads.
const BLOCK: usize = 64;
/// Relative tolerance for the rounding of coordinates and support points.
const ROUNDING: f64 = 1e-12;

/// The surfaces of all meshes if any body is not convex.
fn surfaces_needed(bodies: &[UnitBody], particles: &[Particle]) -> Vec<Option<Surface>> {
    let hollow = particles.iter().any(|p| !bodies[p.shape].is_convex());
    bodies
        .iter()
        .map(|body| if hollow { Surface::of(body) } else { None })
        .collect()
}

/// Whether two bodies overlap.
enum Separation {
    /// A witness proves them separate by at least this length.
    Apart { gap: f64 },
    /// No witness was found; depth of the overlap.
    Overlap { depth: f64 },
}

fn separation(a: &Placed<'_>, b: &Placed<'_>, offset: &Vector3<f64>) -> Separation {
    if a.is_sphere() && b.is_sphere() {
        let touching = 0.5 * (a.size + b.size);
        let distance = offset.norm();
        return if distance >= touching * (1.0 - ROUNDING) {
            Separation::Apart {
                gap: (distance - touching).max(0.0),
            }
        } else {
            Separation::Overlap {
                depth: touching - distance,
            }
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
    if let Some(gap) = witnessed(&hull_a, &hull_b, offset, &gauge.normal) {
        return Separation::Apart { gap };
    }
    if !convex {
        // Overlapping hulls prove nothing.
        let depth = surfaces::depth(a, b, offset);
        return if depth > 0.0 {
            Separation::Overlap { depth }
        } else {
            Separation::Apart { gap: 0.0 }
        };
    }
    let mut value = gauge.value;
    if gauge.at_most >= 1.0 - 1e-9
        && let Some((quotient, axis)) = best_axis(&hull_a, &hull_b, offset)
    {
        // The search ended on a degenerate portal, or too close to touching to decide.
        if let Some(gap) = witnessed(&hull_a, &hull_b, offset, &axis) {
            return Separation::Apart { gap };
        }
        value = value.max(quotient);
    }
    let depth = (1.0 - value) * gauge.width;
    let depth = depth_across_faces(&hull_a, &hull_b, offset)
        .map_or(depth, |across| across.min(depth))
        .max(f64::MIN_POSITIVE);
    Separation::Overlap { depth }
}

/// Lower bound of the gap between the bodies from one direction, `None` if it does not separate them. Computed only
/// from their support points in world axes.
fn witnessed(a: &Posed<'_>, b: &Posed<'_>, offset: &Vector3<f64>, normal: &Vector3<f64>) -> Option<f64> {
    if *normal == Vector3::zeros() {
        return None;
    }
    let (reach, distance) = (a.reach(normal) + b.reach(&-normal), normal.dot(offset));
    (reach * (1.0 - ROUNDING) <= distance).then(|| ((distance - reach) / normal.norm()).max(0.0))
}
