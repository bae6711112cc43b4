//! Relief on a ball from a synthetic test image: `cargo run --release -p stereology-microgeometry --example relief`.

#![allow(clippy::print_stdout, reason = "a program")]

use std::error::Error;
use std::ops::ControlFlow;

use ndarray::Array2;
use stereology_microgeometry::{
    EstimateOptions, ReconstructOptions, contact_of_image, displace, reconstruct, to_distribution_units,
};
use stereology_shape::TriangleMesh;

fn main() -> Result<(), Box<dyn Error>> {
    // Pebbles: light where one is.
    let picture = Array2::from_shape_fn((240, 240), |(y, x)| {
        let (row, column) = (y / 30, x / 30);
        let radius = 7.0 + ((row * 5 + column * 3) % 7) as f64;
        ((y % 30) as f64 - 14.5).hypot((x % 30) as f64 - 14.5) < radius
    });
    let contact = contact_of_image(picture.view(), &EstimateOptions::default())?;
    let ball = TriangleMesh::icosphere(2.0, 5);
    let scaled = to_distribution_units(&ball, 60.0)?;
    let made = reconstruct(&scaled, &contact, &ReconstructOptions::default(), &|_| {
        ControlFlow::Continue(())
    })?;
    println!(
        "{} triangles, {:.2} % left over, {} violations; labels {:.3} bins from the picture's distances, measured again {:.2}",
        made.labels.len(),
        100.0 * made.left_over,
        made.violations,
        made.emd_labels,
        made.emd_measured.unwrap_or(f64::NAN)
    );
    let relief = displace(&ball, &made.labels, &"in,0.01,sqrt".parse()?, &"out,0.02,sqrt".parse()?)?;
    let heights = relief.mesh.vertices.iter().map(|p| p.coords.norm());
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), h| (low.min(h), high.max(h)));
    println!("radii between {low:.3} and {high:.3} of a ball of radius 1");
    Ok(())
}
