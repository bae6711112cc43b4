//! Radial spectrum of a speckled field and of its periodic component.
//!
//! `cargo run --example radial_spectrum`

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use ndarray::Array2;
use stereology_spectrum::{SpectrumError, periodic_component, radial_spectrum};

fn main() -> Result<(), SpectrumError> {
    let speckle = |y: usize, x: usize| ((y * 7919 + x * 104_729) ^ (x * y * 31)) % 97;
    let image = Array2::from_shape_fn((96, 128), |(y, x)| speckle(y, x) as f64 + 2.0 * x as f64);
    let raw = radial_spectrum(image.view(), 12)?;
    let closed = radial_spectrum(periodic_component(image.view())?.view(), 12)?;
    println!("cycles/pixel      power of the field   power of the periodic component");
    for i in 0..12 {
        println!(
            "{:12.3} {:13.1} {:13.1}",
            raw.frequency[i], raw.power[i], closed.power[i]
        );
    }
    Ok(())
}
