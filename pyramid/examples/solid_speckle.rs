//! A volume from an image: the power spectrum of its slices compared with that of the image, for each mode.
//!
//! `cargo run --release --example solid_speckle`
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::ops::ControlFlow;

use ndarray::{Array3, Axis};
use stereology_pyramid::{Exemplar, Mode, TextureError, TextureOptions, synthesize_volume};
use stereology_spectrum::radial_spectrum;

fn main() -> Result<(), TextureError> {
    // Light spots on a dark background.
    let spots: Vec<(usize, usize)> = (0..150).map(|i| (i * 7919 % 64, i * i * 104_729 % 64)).collect();
    let image = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| {
        let wrapped = |a: usize, b: usize| a.abs_diff(b).min(64 - a.abs_diff(b)) as f32;
        spots
            .iter()
            .map(|&(v, u)| (-(wrapped(y, v).powi(2) + wrapped(x, u).powi(2)) / 4.0).exp())
            .sum::<f32>()
    });
    let wanted = radial_spectrum(image.index_axis(Axis(2), 0), 8).expect("a finite image");
    println!("power of slices divided by power of the image, by frequency (cycles per pixel)");
    println!(
        "          {}",
        wanted.frequency[..5]
            .iter()
            .map(|f| format!("{f:7.3}"))
            .collect::<String>()
    );
    for mode in [Mode::Volume, Mode::Spectrum, Mode::Slices] {
        let options = TextureOptions::default().with_mode(mode);
        let progress = |_| ControlFlow::Continue(());
        let volume = synthesize_volume(&Exemplar::new(image.view()), [48, 64, 64], &options, &progress)?;
        let mut power = [0.0; 5];
        for slice in volume.outer_iter() {
            let found = radial_spectrum(slice.index_axis(Axis(2), 0), 8).expect("a finite volume");
            power.iter_mut().zip(&found.power).for_each(|(p, f)| *p += f / 48.0);
        }
        let ratios: String = power
            .iter()
            .zip(&wanted.power)
            .map(|(p, w)| format!("{:7.2}", p / w))
            .collect();
        println!("{:10}{ratios}", format!("{mode:?}"));
    }
    Ok(())
}
