//! Brute-force methods, against which the fast ones are tested.

use nalgebra::{Matrix3, Vector3};
use stereology_shape::{Particle, PeriodicBox, UnitBody};

/// Depths of all overlaps of spheres and their images within three periods, by trying all pairs.
pub(crate) fn sphere_overlaps(particles: &[Particle], period: &PeriodicBox) -> Vec<(usize, usize, f64)> {
    let mut found = Vec::new();
    for (i, p) in particles.iter().enumerate() {
        for (j, q) in particles.iter().enumerate().skip(i) {
            for image in periods(3) {
                if i == j && image <= [0; 3] {
                    continue;
                }
                let shift = Vector3::from(image.map(f64::from)).component_mul(&period.sides());
                let depth = 0.5 * (p.size + q.size) - (q.position - p.position + shift).norm();
                if depth > 0.0 {
                    found.push((i, j, depth));
                }
            }
        }
    }
    found.sort_by(|p, q| q.2.total_cmp(&p.2));
    found
}

/// All images up to `most` periods away along each axis.
pub(crate) fn periods(most: i32) -> impl Iterator<Item = [i32; 3]> {
    let range = -most..=most;
    range.clone().flat_map(move |x| {
        let range = range.clone();
        range.clone().flat_map(move |y| range.clone().map(move |z| [x, y, z]))
    })
}

/// Whether two boxes with given full edges overlap by more than rounding: the fifteen axes of Gottschalk.
pub(crate) fn boxes_overlap(edges: [Vector3<f64>; 2], turns: [Matrix3<f64>; 2], offset: &Vector3<f64>) -> bool {
    let mut axes: Vec<Vector3<f64>> = turns
        .iter()
        .flat_map(|turn| turn.column_iter().map(Into::into).collect::<Vec<_>>())
        .collect();
    for i in 0..3 {
        for j in 3..6 {
            axes.push(axes[i].cross(&axes[j]));
        }
    }
    axes.iter().filter_map(|axis| axis.try_normalize(1e-9)).all(|axis| {
        let reach = |k: usize| {
            (0..3)
                .map(|e| 0.5 * edges[k][e] * turns[k].column(e).dot(&axis).abs())
                .sum::<f64>()
        };
        reach(0) + reach(1) - axis.dot(offset).abs() > 1e-9
    })
}

/// Full edges, in unit-body coordinates, of a box created by `Body::cuboid`.
pub(crate) fn unit_edges(body: &UnitBody, edges: [f64; 3]) -> Vector3<f64> {
    Vector3::from(edges) / body.body().size()
}
