//! Renders a mesh carved from marble.
//!
//! `cargo run --release -p stereology-render --example carve -- MESH IMAGE.png`; without a mesh, a torus.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use nalgebra::Point3;
use std::time::Instant;
use stereology_render::{BlockOptions, Camera, RenderOptions, render_block, render_mesh};
use stereology_shape::{TriangleMesh, read_mesh};

/// Marble: a wave distorted by waves of lower frequency.
#[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
fn marble(p: &Point3<f64>) -> [f32; 3] {
    let mut q = p.coords;
    let mut bend = 0.0;
    for octave in 0..5 {
        let turned = nalgebra::Vector3::new(0.8 * q.x + 0.6 * q.y, 0.8 * q.y - 0.6 * q.z, 0.8 * q.z + 0.6 * q.x);
        q = 1.9 * turned + nalgebra::Vector3::new(1.3, 0.7, 2.1);
        bend += (q.x.sin() * q.y.sin() + q.z.sin()) * 0.55_f64.powi(octave);
    }
    let vein = (1.0 - (1.6 * p.x + 1.2 * p.y + 1.7 * bend).sin().abs()).powi(4) as f32;
    [0.91 - 0.62 * vein, 0.89 - 0.58 * vein, 0.86 - 0.52 * vein]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let start = Instant::now();
    let image = match arguments.first().map(String::as_str) {
        Some("block") => render_block(
            &|p| marble(&(p * 5.0)),
            nalgebra::Vector3::repeat(1.0),
            &BlockOptions::default(),
        )?,
        Some(file) => rendered(&read_mesh(file)?, arguments.get(2))?,
        None => rendered(&TriangleMesh::torus(2.0, 0.8, 64, 32), None)?,
    };
    println!("{:?} in {:.1} s", image.dimensions(), start.elapsed().as_secs_f64());
    if let Some(file) = arguments.get(1) {
        image.save(file)?;
    }
    Ok(())
}

fn rendered(mesh: &TriangleMesh, azimuth: Option<&String>) -> Result<image::RgbImage, Box<dyn std::error::Error>> {
    let (low, high) = mesh.bounding_box().ok_or("no vertices")?;
    let scale = 5.0 / (high - low).amax();
    let camera = Camera {
        azimuth: azimuth.map_or(Ok(35.0), |a| a.parse())?,
        ..Camera::default()
    };
    let colour = |p: &Point3<f64>| marble(&Point3::from(scale * (p - low)));
    Ok(render_mesh(mesh, &colour, &camera, &RenderOptions::default())?)
}
