//! A photograph (or the built-in sample) to its solid: prints how its sections compare, writes one beside the
//! photograph.
//!
//! `cargo run --release --example synthesize -p stereology -- [PHOTO SHAPE OUT.png]`

#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::ops::ControlFlow;
use stereology::pipeline::{ParticleTypes, SynthesisOptions, synthesize};
use stereology::{sample, segment, shape::Body, volume::SlicePlane};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let photo = match arguments.first() {
        Some(path) => segment::read_photo(path)?,
        None => sample::photo()?,
    };
    let types = match arguments.get(1) {
        Some(spec) => ParticleTypes::parse(&[spec])?,
        None => {
            let shapes = sample::truth()?.shapes;
            let bodies = shapes
                .into_iter()
                .map(|of| Ok((of.shape.clone(), Body::parse(&of.shape)?, of.share)));
            ParticleTypes::new(bodies.collect::<Result<_, Box<dyn std::error::Error>>>()?)?
        }
    };
    let made = synthesize(&photo, None, &types, &SynthesisOptions::default(), &|_, _| {
        ControlFlow::Continue(())
    })?;
    println!(
        "{} profiles, area fraction {:.3}",
        made.segmentation.profiles.len(),
        made.segmentation.area_fraction
    );
    println!(
        "{} particles in a box of side {}",
        made.packing.particles().len(),
        made.packing.sides().x
    );
    println!("sections, exact:       {:?}", made.verification.exact);
    println!("sections, resegmented: {:?}", made.verification.resegmented);
    for warning in &made.findings {
        println!("warning [{}]: {}", warning.code, warning.message);
    }
    if let Some(path) = arguments.get(2) {
        let plane = SlicePlane::oblique(nalgebra::Vector3::new(1.0, 2.0, 3.0), 0.0)?;
        made.solid
            .slice(&plane, photo.width(), photo.height(), 1.0)?
            .save(path)?;
    }
    Ok(())
}
