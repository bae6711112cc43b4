//! Textures: the steerable pyramid beside pyrtools and beside the Fourier transforms that it needs; then syntheses.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use ndarray::{Array2, Array3};
use stereology::pyramid::{
    Cut, Exemplar, Matching, Mode, SteerablePyramid, TextureOptions, synthesize_image, synthesize_volume,
};
use stereology::spectrum::{Complex, RealFft};

use super::bench::{Bench, Row, Section};

const SCRIPT: &str = include_str!("textures.py");
const SIDES: [usize; 2] = [512, 1024];
const LEVELS: usize = 4;
const ORIENTATIONS: usize = 4;

pub fn measure(bench: &Bench) -> Result<Section> {
    let answer = bench.ask_peer("pyrtools", SCRIPT, &SIDES.map(|side| side.to_string()))?;
    let mut rows = Vec::new();
    for (i, side) in SIDES.into_iter().enumerate() {
        let image = Array2::from_shape_fn((side, side), |(y, x)| {
            ((y * y + 31 * x + 3 * x * y) % 101) as f64 / 101.0
        });
        let (ours, error) = bench.time(2, || {
            let pyramid = SteerablePyramid::new([side, side], LEVELS, ORIENTATIONS)?;
            let back = pyramid.reconstruct(&pyramid.build(image.view())?);
            Ok(image.iter().zip(&back).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
        })?;
        let (floor, transforms) = transforms_alone(bench, side)?;
        let number = |name: &str| match &answer {
            Ok(answer) => {
                let number = answer["rows"][i][name].as_f64();
                number
                    .map(Some)
                    .with_context(|| format!("{name} of the reference program is not a number"))
            }
            Err(_) => Ok(None),
        };
        let theirs = number("error")?.map_or(String::new(), |error| format!(", reference {error:.0e}"));
        rows.push(Row {
            task: format!("{side} x {side}, f64: pyramid planned, built and reconstructed"),
            ours,
            peer: number("seconds")?,
            remark: format!(
                "only its {transforms} Fourier transforms, without planning: {floor:.3} s; largest error {error:.0e}{theirs}"
            ),
        });
    }
    let exemplar = Array3::from_shape_fn((128, 128, 3), |(y, x, c)| {
        ((y * y + 31 * x + x * y * (c + 3)) % 101) as f32 / 101.0
    });
    let exemplar = Exemplar::new(exemplar.view());
    let go = |_: f64| ControlFlow::Continue(());
    let options = TextureOptions::default();
    let (ours, _) = bench.time(1, || Ok(synthesize_image(&exemplar, [512, 512], &options, &go)?))?;
    rows.push(alone("512 x 512 in colour, 5 iterations", ours, "target: 1.5"));
    for (name, options, asked) in [
        ("`volume`", options.clone().with_mode(Mode::Volume), "target: 5"),
        ("`spectrum`", options.clone().with_mode(Mode::Spectrum), ""),
        ("`slices`, axes only", options.clone().with_cuts(Cut::Axes), ""),
        ("`slices`", options.clone(), "target: 12"),
        (
            "`slices`, ranks",
            options.clone().with_matching(Matching::Exact),
            "target: 25",
        ),
    ] {
        let (ours, _) = bench.time(1, || Ok(synthesize_volume(&exemplar, [128; 3], &options, &go)?))?;
        rows.push(alone(
            &format!("128 x 128 x 128 in colour, 5 iterations: {name}"),
            ours,
            asked,
        ));
    }
    Ok(Section {
        words: format!(
            "Steerable pyramid of {LEVELS} levels and {ORIENTATIONS} orientations of a noise image; reference: `SteerablePyramidFreq` of order 3 with its \
             `recon_pyr`. Then Heeger-Bergen syntheses from 128 x 128 pixels, for which no other program in three dimensions is known."
        ),
        peer: answer
            .as_ref()
            .map(|answer| answer["version"].as_str().unwrap_or("pyrtools").to_owned())
            .map_err(Clone::clone),
        rows,
    })
}

fn alone(task: &str, ours: f64, remark: &str) -> Row {
    Row {
        task: task.to_owned(),
        ours,
        peer: None,
        remark: remark.to_owned(),
    }
}

/// CPU seconds of only the Fourier transforms that a pyramid and its reconstruction need, and their number.
fn transforms_alone(bench: &Bench, side: usize) -> Result<(f64, usize)> {
    let mut plans = Vec::new();
    for level in 0..=LEVELS {
        let bands = if level == LEVELS { 1 } else { ORIENTATIONS } + 2 * usize::from(level == 0);
        plans.push((RealFft::<f64>::new(&[side >> level, side >> level])?, bands));
    }
    let count = plans.iter().map(|(_, bands)| 2 * bands).sum();
    let (seconds, ()) = bench.time(2, || {
        for (fft, bands) in &plans {
            let mut field = vec![0.5; fft.samples()];
            let mut spectrum = vec![Complex::new(0.0, 0.0); fft.spectrum_shape().iter().product()];
            let mut work = fft.work();
            for _ in 0..*bands {
                fft.forward_into(&field, &mut spectrum, &mut work);
                fft.inverse_into(&mut spectrum, &mut field, &mut work);
                field.fill(0.5);
            }
        }
        Ok(())
    })?;
    Ok((seconds, count))
}
