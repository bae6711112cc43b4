//! What a shape measures: `cargo run --example measure_shape -- rock:7`, or any shape or mesh file.

use stereology_shape::{Body, UnitBody};

#[allow(clippy::print_stdout, reason = "an example shows its result")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spec = std::env::args().nth(1).unwrap_or_else(|| "rock:7".to_owned());
    let body = Body::parse(&spec)?;
    println!("{spec}");
    if let Some(mesh) = body.mesh() {
        println!("triangles           {}", mesh.triangles().len());
        for repair in mesh.repairs() {
            println!("repaired            {repair}");
        }
    }
    println!("convex              {}", body.is_convex());
    println!("volume              {:.6}", body.volume());
    println!("surface area        {:.6}", body.surface_area());
    println!(
        "mean width          {:.6}   (planes that hit it, per unit of plane distance)",
        body.mean_width()
    );
    println!(
        "signed mean width   {:.6}   (profiles less holes)",
        body.signed_mean_width()
    );
    println!(
        "largest section     {:.6}   (size {:.6})",
        body.largest_section_area(),
        body.size()
    );
    let unit = UnitBody::new(&body);
    println!(
        "at size 1: volume {:.4}, within radius {:.4}, around radius {:.4}",
        unit.volume(),
        unit.bounding_radius(),
        unit.inscribed_radius()
    );
    Ok(())
}
