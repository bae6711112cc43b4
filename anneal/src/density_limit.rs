//! An upper bound of the volume fraction.

use std::f64::consts::{PI, SQRT_2};
use stereology_shape::{BodyKind, Particle, UnitBody};

/// The volume fraction above which a request is refused without an attempt.
///
/// # Formula
///
/// ```text
/// smaller of  Δ(δ, ρ)  and  Δ(.7405, ρ of the spheres) / (volume of the spheres / volume of the bodies)
/// Δ(δ, ρ) = 1 − (1 − δ)^(1 + ln ρ / ln 2.4)
/// ```
///
/// `δ` is the densest packing of equal bodies: π/√18 = .7405 for spheres (Hales 2005, a theorem), .7707 for ellipsoids
/// (Donev et al. 2004, the densest known), 1 for others (bricks fill space). `ρ` is the ratio of the largest to the
/// smallest diameter of spheres of equal volume: smaller spheres fit between larger ones from a ratio of about 2.4 (1 /
/// .414, the octahedral hole), and can then fill the remaining space with the same density. For a mixture, the largest
/// `δ` counts.
///
/// The spheres are those inscribed in the bodies about their centroids. They cannot be packed more densely than spheres
/// (Torquato & Jiao 2009, eq. 6), which limits nearly round bodies: a mesh of a sphere, a dodecahedron at .98. Random
/// packings end far below these limits: about .64 for equal spheres.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion};
/// use stereology_shape::{Body, Particle, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let particle = Particle { shape: 0, size: 1.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// assert!((stereology_anneal::density_limit(&[ball], &[particle; 9]) - 0.7405).abs() < 1e-4);
/// # Ok::<(), stereology_shape::BodyError>(())
/// ```
#[must_use]
pub fn density_limit(bodies: &[UnitBody], particles: &[Particle]) -> f64 {
    let (mut densest, mut volume, mut of_spheres) = (0.0_f64, 0.0, 0.0);
    let (mut diameters, mut spheres) = (Range::EMPTY, Range::EMPTY);
    for particle in particles {
        let Some(body) = bodies.get(particle.shape) else {
            continue;
        };
        let density = match body.body().kind() {
            BodyKind::Sphere { .. } => SPHERES,
            BodyKind::Ellipsoid { .. } => 0.7707,
            _ => 1.0,
        };
        densest = densest.max(density);
        diameters.widen(particle.size * body.volume().cbrt());
        let radius = particle.size * body.inscribed_radius().max(0.0);
        spheres.widen(radius);
        volume += body.volume() * particle.size.powi(3);
        of_spheres += 4.0 / 3.0 * PI * radius.powi(3);
    }
    if volume <= 0.0 {
        return 1.0;
    }
    let mut limit = diameters.filled(densest);
    if spheres.smallest > 0.0 {
        limit = limit.min(spheres.filled(SPHERES) * volume / of_spheres);
    }
    limit
}

/// Density of the densest packing of equal spheres.
const SPHERES: f64 = PI / (3.0 * SQRT_2);

/// The smallest and the largest of some lengths.
struct Range {
    smallest: f64,
    largest: f64,
}

impl Range {
    const EMPTY: Self = Self {
        smallest: f64::INFINITY,
        largest: 0.0,
    };

    fn widen(&mut self, length: f64) {
        self.smallest = self.smallest.min(length);
        self.largest = self.largest.max(length);
    }

    /// Density of bodies of these sizes, if that of equal bodies is `alone`.
    fn filled(&self, alone: f64) -> f64 {
        let generations = 1.0 + (self.largest / self.smallest).ln() / 2.4_f64.ln();
        1.0 - (1.0 - alone).powf(generations)
    }
}
