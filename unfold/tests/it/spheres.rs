//! Kernels of spheres in closed form, as a user without `stereology-kmatrix` writes them.

use nalgebra::DMatrix;
use std::f64::consts::PI;
use stereology_unfold::{Kernel, SizeBins, divided_edges, fitting_edges, fitting_profile_edges};

/// D F(d / D): length of offsets at which a sphere of diameter D shows a profile up to d.
fn below(d: f64, diameter: f64) -> f64 {
    if d >= diameter {
        diameter
    } else {
        diameter - (diameter * diameter - d * d).sqrt()
    }
}

/// ∫ of [`below`] over the diameters up to `top`.
fn integral(d: f64, top: f64) -> f64 {
    if d >= top {
        return 0.5 * top * top;
    }
    let root = (top * top - d * d).sqrt();
    let log = if d > 0.0 { d * d * ((top + root) / d).ln() } else { 0.0 };
    0.5 * top * top - 0.5 * (top * root - log)
}

pub(crate) fn upper_edge(profile_edges: &[f64], size_edges: &[f64]) -> Kernel {
    let matrix = DMatrix::from_fn(profile_edges.len() - 1, size_edges.len() - 1, |i, j| {
        let diameter = size_edges[j + 1];
        below(profile_edges[i + 1], diameter) - below(profile_edges[i], diameter)
    });
    Kernel::new(matrix, SizeBins::upper_edge(size_edges).unwrap(), PI / 6.0).unwrap()
}

pub(crate) fn integrated(profile_edges: &[f64], size_edges: &[f64]) -> Kernel {
    let matrix = DMatrix::from_fn(profile_edges.len() - 1, size_edges.len() - 1, |i, j| {
        let (a, b) = (size_edges[j], size_edges[j + 1]);
        let mean = |d: f64| (integral(d, b) - integral(d, a)) / (b - a);
        (mean(profile_edges[i + 1]) - mean(profile_edges[i])).max(0.0)
    });
    Kernel::new(matrix, SizeBins::integrated(size_edges).unwrap(), PI / 6.0).unwrap()
}

/// The bin-integrated kernel on 40 sub-bins or more, reported in `size_edges`, and the edges of its 100 or more profile
/// bins.
pub(crate) fn fine(size_edges: &[f64]) -> (Kernel, Vec<f64>) {
    let sub_edges = divided_edges(size_edges, 40, 0.0);
    let profile_edges = divided_edges(size_edges, 100, 0.0);
    let kernel = integrated(&profile_edges, &sub_edges);
    let sizes = kernel.sizes().clone().reported_in(size_edges).unwrap();
    (
        Kernel::new(kernel.matrix().clone(), sizes, PI / 6.0)
            .unwrap()
            .with_unit_surface(PI)
            .unwrap(),
        profile_edges,
    )
}

/// Kernel and profile edges from which all internal grids can be made, for profiles down to `smallest`.
pub(crate) fn on_grids(size_edges: &[f64], smallest: f64) -> (Kernel, Vec<f64>) {
    let profile_edges = fitting_profile_edges(size_edges, 100, smallest, 0.0, 0.0);
    let kernel = integrated(&profile_edges, &fitting_edges(size_edges, smallest, 0.0, 0.0));
    (kernel.reported_in(size_edges).unwrap(), profile_edges)
}
