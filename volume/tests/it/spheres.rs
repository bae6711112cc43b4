//! Solids of spheres without overlap, placed one at a time at random: their properties are known exactly.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::LazyLock;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody, isotropic_rotation};
use stereology_volume::Solid;

/// Positions and sizes that do not overlap, in a box of sides that are exact in binary, so that a step of a period is
/// exact.
pub(crate) fn placed(seed: u64, wanted: usize, sides: [f64; 3], sizes: [f64; 2]) -> Vec<(Point3<f64>, f64)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let period = PeriodicBox::new(sides.into()).unwrap();
    let mut placed: Vec<(Point3<f64>, f64)> = Vec::new();
    for _ in 0..20 * wanted {
        let p = Point3::from(Vector3::from_fn(|k, _| sides[k] * rng.random::<f64>()));
        let size = sizes[0] + (sizes[1] - sizes[0]) * rng.random::<f64>();
        let free = placed
            .iter()
            .all(|(q, other)| period.nearest(p - q).norm() > 0.5 * (size + other));
        if free && placed.len() < wanted {
            placed.push((p, size));
        }
    }
    placed
}

/// Particles with random orientations, categories and colours.
pub(crate) fn solid_of(bodies: &[Body], placed: &[(Point3<f64>, f64)], sides: [f64; 3]) -> Solid {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let bodies: Vec<UnitBody> = bodies.iter().map(UnitBody::new).collect();
    let particles: Vec<Particle> = placed
        .iter()
        .enumerate()
        .map(|(i, &(position, size))| Particle {
            shape: i % bodies.len(),
            size,
            category: u8::try_from(i % 3).unwrap(),
            position,
            orientation: isotropic_rotation(&mut rng),
        })
        .collect();
    let colours = particles
        .iter()
        .map(|_| [rng.random(), rng.random(), rng.random()])
        .collect();
    Solid::new(
        Arrangement::new(bodies, particles, PeriodicBox::new(sides.into()).unwrap()).unwrap(),
        colours,
        [0.5, 0.6, 0.7],
        None,
    )
    .unwrap()
}

pub(crate) fn spheres(seed: u64) -> Solid {
    let sides = [8.0, 8.0, 8.0];
    solid_of(
        &[Body::sphere(1.0).unwrap()],
        &placed(seed, 60, sides, [0.8, 2.4]),
        sides,
    )
}

/// Three kinds of bodies in a box that is not a cube; rocks and ellipsoids extend beyond their size and may overlap.
pub(crate) fn mixture(seed: u64) -> Solid {
    // The largest section of a rock takes some time to find.
    static BODIES: LazyLock<[Body; 3]> = LazyLock::new(|| {
        [
            Body::sphere(1.0).unwrap(),
            Body::rock(5),
            Body::ellipsoid([1.0, 0.6, 0.4]).unwrap(),
        ]
    });
    let sides = [8.0, 4.0, 16.0];
    solid_of(&*BODIES, &placed(seed, 40, sides, [0.5, 3.0]), sides)
}
