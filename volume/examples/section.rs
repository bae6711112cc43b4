//! A solid of two kinds of rock, its section as a picture and the sizes of the profiles on it.
//!
//! `cargo run --release -p stereology-volume --example section -- PICTURE.png`
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody, isotropic_rotation};
use stereology_volume::{Axis, SlicePlane, Solid};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let side = 100.0;
    let period = PeriodicBox::new(Vector3::repeat(side))?;
    let mut particles: Vec<Particle> = Vec::new();
    while particles.len() < 300 {
        let position = Point3::from(Vector3::from_fn(|_, _| side * rng.random::<f64>()));
        let size = 5.0 + 12.0 * rng.random::<f64>().powi(2);
        let free = |other: &Particle| period.nearest(other.position - position).norm() > 0.6 * (other.size + size);
        if particles.iter().all(free) {
            let shape = particles.len() % 2;
            let orientation = isotropic_rotation(&mut rng);
            particles.push(Particle {
                shape,
                size,
                category: 0,
                position,
                orientation,
            });
        }
    }
    let tones = [[0.75_f32, 0.38, 0.28], [0.35, 0.42, 0.45]];
    let colours = particles
        .iter()
        .map(|p| tones[p.shape].map(|v| v + 0.1 * rng.random::<f32>()))
        .collect();
    let bodies = [1, 2].map(|seed| UnitBody::new(&Body::rock(seed))).to_vec();
    let solid = Solid::new(
        Arrangement::new(bodies, particles, period)?,
        colours,
        [0.86, 0.84, 0.8],
        None,
    )?;

    let profiles = solid.section_profiles(Axis::Z, 40.0);
    let area: f64 = profiles.iter().map(|(_, area)| area).sum();
    println!("{} profiles, area fraction {:.3}", profiles.len(), area / (side * side));
    if let Some(file) = std::env::args_os().nth(1) {
        solid
            .slice(&SlicePlane::across(Axis::Z, 40.0), 500, 500, side / 500.0)?
            .save(file)?;
    }
    Ok(())
}
