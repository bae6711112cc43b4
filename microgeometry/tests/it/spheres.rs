//! The sphere, where distances over the surface are angles.

use std::f64::consts::PI;

use stereology_microgeometry::{Adjacency, DualGraph, Metric, distribution_of, interface_distances};
use stereology_shape::TriangleMesh;

/// Triangles of the unit sphere, labelled by their height over a plane: their distances to the circle are known.
fn cap(adjacency: Adjacency, rim: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let ball = TriangleMesh::icosphere(2.0, 5);
    let polar: Vec<f64> = ball
        .triangles
        .iter()
        .map(|t| {
            let sum: nalgebra::Vector3<f64> = t.iter().map(|&v| ball.vertices[v as usize].coords).sum();
            (sum.z / sum.norm()).acos()
        })
        .collect();
    let labels: Vec<f64> = polar.iter().map(|theta| rim - theta).collect();
    let graph = DualGraph::new(&ball, adjacency, Metric::Isotropic).unwrap();
    (interface_distances(&graph, &labels), labels, graph.areas().to_vec())
}

/// A cap of angle θ₀: the fraction of the sphere farther than r inside its rim is (1 − cos(θ₀ − r))/2.
#[test]
fn a_caps_distances_are_in_closed_form() {
    let rim = 1.0;
    let (distances, _, areas) = cap(Adjacency::Vertices, rim);
    let bin = 0.1;
    let of = distribution_of(&distances, &areas, bin).unwrap();
    let beyond = |r: f64| (1.0 - (rim - r).cos()) / 2.0;
    let mut ahead = 0.0;
    for (k, share) in of.positive().iter().enumerate().take(9) {
        let expected = beyond(k as f64 * bin) - beyond((k + 1) as f64 * bin);
        ahead += share - expected;
        assert!(ahead.abs() < 0.01, "{k}: {share} {expected}");
    }
    assert!((of.positive_share() - beyond(0.0)).abs() < 0.003);
}

/// Paths over shared vertices are a few percent longer than great circles, those over edges about a fifth.
#[test]
fn vertex_neighbours_measure_better() {
    let mean_excess = |adjacency| {
        let (distances, labels, _) = cap(adjacency, PI / 2.0);
        let far = distances.iter().zip(&labels).filter(|(_, x)| x.abs() > 0.5);
        let (sum, count) = far.fold((0.0, 0), |(sum, count), (d, x)| (sum + d / x, count + 1));
        sum / f64::from(count)
    };
    let (corners, edges) = (mean_excess(Adjacency::Vertices), mean_excess(Adjacency::Edges));
    assert!((0.99..1.06).contains(&corners), "{corners}");
    assert!(edges > corners + 0.05 && edges < 1.35, "{edges}");
}
