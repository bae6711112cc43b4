//! Directions spread evenly over the half-sphere.

use nalgebra::Vector3;
use std::f64::consts::PI;

/// Fibonacci lattice of `count` directions on the upper half-sphere. A direction and its opposite give the same
/// sections, so half a sphere is enough.
pub(crate) fn half_sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |k| {
        let z = (k as f64 + 0.5) / count as f64;
        let radius = ((1.0 - z) * (1.0 + z)).sqrt();
        let (sin, cos) = (golden_angle * k as f64).sin_cos();
        Vector3::new(radius * cos, radius * sin, z)
    })
}
