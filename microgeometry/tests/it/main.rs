//! Laws of reconstructions: labels obey their bounds and their distribution on any mesh.

#![allow(clippy::unwrap_used)] // a test that cannot set itself up should stop there
#![allow(clippy::cast_possible_truncation)] // pixels and triangles of small tests
#![allow(clippy::float_cmp)] // powers of two, and what must be the same bits

mod bad_input;
mod explorations;
mod laws;
mod materials;
mod meshes;
mod spheres;

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_microgeometry::{
    ContactDistribution, EstimateOptions, ReconstructOptions, Reconstruction, contact_of_image, reconstruct,
    to_distribution_units,
};
use stereology_shape::TriangleMesh;

/// A periodic random field thresholded at zero: waves of about one length in all directions.
fn random_field(seed: u64, wave: f64) -> ContactDistribution {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let n = 256.0;
    let waves: Vec<[f64; 3]> = (0..60)
        .map(|_| {
            let turn = TAU * random.random::<f64>();
            let steps = n / wave * (0.5 + random.random::<f64>());
            let k = |c: f64| TAU / n * (steps * c).round();
            [k(turn.cos()), k(turn.sin()), TAU * random.random::<f64>()]
        })
        .collect();
    let picture = Array2::from_shape_fn((256, 256), |(y, x)| {
        waves
            .iter()
            .map(|[ky, kx, phase]| (ky * y as f64 + kx * x as f64 + phase).cos())
            .sum::<f64>()
            > 0.0
    });
    contact_of_image(picture.view(), &EstimateOptions::default()).unwrap()
}

fn on(mesh: &TriangleMesh, units: f64, of: &ContactDistribution, options: &ReconstructOptions) -> Reconstruction {
    let scaled = to_distribution_units(mesh, units).unwrap();
    reconstruct(&scaled, of, options, &|_| ControlFlow::Continue(())).unwrap()
}
