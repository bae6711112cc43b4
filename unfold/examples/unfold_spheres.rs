//! From profile diameters to spheres per volume, by the default and by the paper's method: `cargo run -p
//! stereology-unfold --example unfold_spheres`
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use std::f64::consts::PI;
use stereology_unfold::{
    Bootstrap, Method, ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, divided_edges, equal_edges, unfold,
};

fn main() -> Result<(), Box<dyn Error>> {
    // Spheres of diameter 0.4 to 1, one per unit volume; a plane cuts each in proportion to its diameter.
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let area = 1000.0;
    let profiles: Vec<f64> = (0..1000)
        .filter_map(|_| {
            let diameter: f64 = 0.4 + 0.6 * rng.random::<f64>();
            let depth = rng.random::<f64>() - 0.5; // 1000 spheres within half a unit of the plane: one per unit volume
            let chord = diameter * diameter - 4.0 * depth * depth;
            (chord > 0.0).then(|| chord.sqrt())
        })
        .collect();

    // The fraction of a sphere's profiles below x diameters is 1 - sqrt(1 - x²).
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let edges = equal_edges(1.0, 10);
    let (fine, profile_edges) = (divided_edges(&edges, 40, 0.0), divided_edges(&edges, 100, 0.0));
    let smooth = SizeBins::integrated(&fine)?.reported_in(&edges)?;
    for (method, bins, profile_edges) in [
        (Method::Auto, smooth, &profile_edges),
        (Method::Paper, SizeBins::upper_edge(&edges)?, &edges),
    ] {
        let spheres = capped_kernel(&law, 1.0, 0.0, profile_edges, bins, PI / 6.0)?;
        let counts = ProfileCounts::from_sizes(&profiles, None, profile_edges, area)?;
        let options = UnfoldOptions::default()
            .with_method(method)
            .with_bootstrap(Bootstrap::default());
        let found = unfold(&counts, &spheres, &options)?;
        let interval = found.total.interval.ok_or("no interval")?;
        println!(
            "{:>9}: {:.3} spheres per unit volume ({:.3} to {:.3}), mean diameter {:.3}, volume fraction {:.4}",
            found.method.name(),
            found.total.value,
            interval.lower,
            interval.upper,
            found.mean_size.value,
            found.volume_fraction.value,
        );
        for finding in &found.findings {
            println!("           {}: {}", finding.code, finding.message);
        }
    }
    Ok(())
}
