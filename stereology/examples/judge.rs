//! How similar are two textures? `cargo run --release -p stereology --example judge`

#![allow(clippy::print_stdout, reason = "an example shows its result")]

use ndarray::Array3;
use std::ops::ControlFlow;
use stereology::grow::{GrowOptions, grow_image};
use stereology::pipeline::{CompareOptions, compare_solid};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let go = |_: f64| ControlFlow::Continue(());
    // Crossed waves, and what grows from them by Efros and Leung's method.
    let exemplar = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| {
        let (y, x) = (y as f32, x as f32);
        0.5 + 0.25 * (0.5 * x + 0.2 * y).sin() + 0.25 * (0.35 * y - 0.1 * x).cos()
    });
    for window in [0, 5, 9] {
        let grown = grow_image(
            exemplar.view(),
            [64, 64],
            &GrowOptions::default().with_window(window),
            &go,
        )?;
        let found = compare_solid(&[exemplar.view()], &[grown.view()], &CompareOptions::default(), &go)?;
        println!("window {window}:");
        for (name, figure) in found.figures() {
            if let Some(floors) = figure.in_floors() {
                println!(
                    "  {name:22} {:8.4}, {floors:6.2} floors from the ideal",
                    figure.value.unwrap_or(f64::NAN)
                );
            }
        }
    }
    Ok(())
}
