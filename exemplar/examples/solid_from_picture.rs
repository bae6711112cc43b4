//! A layered solid from one image, and how similar its slices are to the image.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use ndarray::{Array2, Axis};
use std::ops::ControlFlow;
use stereology_exemplar::{Domain, Exemplar, SolidOptions, Views, synthesize_solid};
use stereology_metrics::{Family, MeasureOptions, compare, sections};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let layers = Array2::from_shape_fn((64, 64), |(z, x)| {
        0.5 + 0.4 * (0.9 * z as f32 + 1.5 * (0.11 * x as f32).sin()).sin()
    });
    let exemplar = Exemplar::grey(layers.view())?;
    let options = SolidOptions::default().with_views(Views::Two);
    let solid = synthesize_solid(&[exemplar], &Domain::new([32; 3])?, &options, &|_| {
        ControlFlow::Continue(())
    })?;
    let picture = layers.insert_axis(Axis(2));
    let slices = sections(solid.values.view(), Family::Xz);
    let found = compare(&[picture.view()], &slices, None, &MeasureOptions::new(0.5), &|_| {
        ControlFlow::Continue(())
    })?;
    for (name, figure) in found.figures() {
        if let Some(value) = figure.value {
            println!("{name}: {value:.4}");
        }
    }
    println!("{:.0} % of the image's pixels are used", 100.0 * solid.coverage);
    Ok(())
}
