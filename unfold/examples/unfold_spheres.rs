//! From profile diameters to spheres per volume, by three methods: `cargo run -p stereology-unfold --example unfold_spheres`
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use std::f64::consts::PI;
use stereology_unfold::{Bootstrap, Kernel, Method, ProfileCounts, SizeBins, UnfoldOptions, equal_edges, unfold};

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

    // The share of a sphere's profiles below x diameters is 1 - sqrt(1 - x²).
    let edges = equal_edges(1.0, 10);
    let below = |d: f64, diameter: f64| diameter - (diameter * diameter - d.min(diameter).powi(2)).sqrt();
    let matrix = DMatrix::from_fn(10, 10, |i, j| {
        below(edges[i + 1], edges[j + 1]) - below(edges[i], edges[j + 1])
    });
    let spheres = Kernel::new(matrix, SizeBins::upper_edge(&edges)?, PI / 6.0)?;

    let counts = ProfileCounts::from_sizes(&profiles, None, &edges, area)?;
    println!("{} profiles on an area of {area}", counts.profiles());
    for method in [Method::Paper, Method::Nnls, Method::Em] {
        let options = UnfoldOptions::default()
            .with_method(method)
            .with_bootstrap(Bootstrap::default());
        let found = unfold(&counts, &spheres, &options)?;
        let interval = found.total.interval.ok_or("no interval")?;
        println!(
            "{:>5}: {:.3} spheres per unit volume ({:.3} to {:.3}), mean diameter {:.3}, volume fraction {:.4}, deviance {:.1}",
            method.name(),
            found.total.value,
            interval.lower,
            interval.upper,
            found.mean_size.value,
            found.volume_fraction.value,
            found.deviance
        );
        for finding in &found.findings {
            println!("       {}: {finding}", finding.code());
        }
    }
    Ok(())
}
