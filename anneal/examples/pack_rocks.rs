//! Packs a thousand rocks and spheres of lognormal sizes to a volume fraction of 0.45 and counts the profiles on a
//! section.
//!
//! ```text
//! cargo run --release -p stereology-anneal --example pack_rocks
//! ```

#![expect(clippy::print_stdout, reason = "an example shows its result")]

use nalgebra::Vector3;
use std::error::Error;
use std::ops::ControlFlow;
use stereology_anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate};
use stereology_shape::{Arrangement, Body, UnitBody};

fn main() -> Result<(), Box<dyn Error>> {
    let bodies = [UnitBody::new(&Body::rock(1)), UnitBody::new(&Body::sphere(1.0)?)];
    let grains = mix(&lognormal_sizes(1000, 0.3, 0)?, &[0.7, 0.3], 0)?;
    let period = box_for_fraction(&bodies, &grains, 0.45)?;
    let start = populate(&grains, &period, 0);
    let packing = pack(
        &Arrangement::new(&bodies[..], start, period)?,
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?;
    println!(
        "{} particles at a volume fraction of {:.6} in a box of side {:.3}, none overlap; {} iterations",
        packing.particles().len(),
        packing.fraction(),
        packing.sides().x,
        packing.iterations()
    );

    let depth = 0.5 * packing.sides().z;
    let mut area = 0.0;
    let mut profiles = 0;
    for particle in packing.particles() {
        let body = &packing.bodies()[particle.shape];
        let normal = particle.orientation.inverse() * Vector3::z_axis();
        for period in [-1.0, 0.0, 1.0] {
            let offset = (depth + period * packing.sides().z - particle.position.z) / particle.size;
            for profile in body.profile_areas(&normal, offset) {
                area += profile * particle.size.powi(2);
                profiles += 1;
            }
        }
    }
    let side = packing.sides().x;
    println!(
        "the section at mid height has {profiles} profiles with an area fraction of {:.3}",
        area / (side * side)
    );
    Ok(())
}
