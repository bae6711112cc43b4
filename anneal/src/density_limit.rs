//! How dense a packing can be asked for.

use std::f64::consts::{PI, SQRT_2};
use stereology_shape::{BodyKind, Particle, UnitBody};

/// The volume fraction above which a request is refused without trying.
///
/// # Formula
///
/// ```text
/// 1 − (1 − δ)^(1 + ln ρ / ln 2.4),     ρ = largest over smallest diameter at equal volume
/// ```
///
/// `δ` is the densest packing of equal bodies: π/√18 = .7405 for spheres (Hales 2005, a theorem), .7707 for ellipsoids (Donev et al. 2004, the densest
/// known), 1 for others (bricks fill space; only more than all of it is refused). Smaller spheres fit between larger ones from a ratio of about 2.4 (1 / .414, the octahedral hole), and can then fill
/// the rest as densely again. With a mixture of kinds the largest `δ` counts. Random packings end well below: about .64 for equal spheres.
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
    let (mut densest, mut smallest, mut largest) = (0.0_f64, f64::INFINITY, 0.0_f64);
    for particle in particles {
        let Some(body) = bodies.get(particle.shape) else {
            continue;
        };
        let density = match body.body().kind() {
            BodyKind::Sphere { .. } => PI / (3.0 * SQRT_2),
            BodyKind::Ellipsoid { .. } => 0.7707,
            _ => 1.0,
        };
        densest = densest.max(density);
        let diameter = particle.size * body.volume().cbrt();
        smallest = smallest.min(diameter);
        largest = largest.max(diameter);
    }
    if largest == 0.0 {
        return 1.0;
    }
    let generations = 1.0 + (largest / smallest).ln() / 2.4_f64.ln();
    1.0 - (1.0 - densest).powf(generations)
}
