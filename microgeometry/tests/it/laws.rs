//! Laws that hold for every mesh, distribution and seed.

use proptest::prelude::*;
use stereology_microgeometry::{
    Adjacency, ContactDistribution, DualGraph, Method, Metric, ReconstructOptions, Weighting, violations,
};
use stereology_shape::TriangleMesh;

use crate::on;

fn mesh_of(kind: usize) -> TriangleMesh {
    match kind {
        0 => TriangleMesh::icosphere(2.0, 3),
        1 => TriangleMesh::torus(2.0, 0.7, 40, 20),
        2 => {
            // Open, uneven: a strip of long and short triangles.
            let mut mesh = TriangleMesh::cylinder(1.0, 3.0, 40);
            mesh.triangles.truncate(mesh.triangles.len() - 30);
            mesh
        }
        _ => {
            let small = TriangleMesh::icosphere(0.7, 2).mapped(|p| p + nalgebra::Vector3::new(3.0, 0.0, 0.0));
            TriangleMesh::icosphere(2.0, 2).with(&small)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// No two neighbours differ by more than their distance, so no two triangles do; and the labels of the whole
    /// surface sum to one.
    #[test]
    fn labels_never_change_faster_than_the_way(
        kind in 0..4_usize,
        negative in prop::collection::vec(0.0..1.0_f64, 1..9),
        positive in prop::collection::vec(0.0..1.0_f64, 1..9),
        units in 4.0..40.0_f64,
        paper in any::<bool>(),
        seed in 0..1000_u64,
    ) {
        prop_assume!(negative.iter().chain(&positive).sum::<f64>() > 0.01);
        let mesh = mesh_of(kind);
        let of = ContactDistribution::new(1.0, negative, positive).unwrap();
        let method = if paper { Method::Paper } else { Method::Tight };
        let made = on(&mesh, units, &of, &ReconstructOptions::default().with_method(method).with_seed(seed));
        prop_assert_eq!(made.labels.len(), mesh.triangles.len());
        prop_assert!(made.labels.iter().all(|x| x.is_finite()));
        let scaled = stereology_microgeometry::to_distribution_units(&mesh, units).unwrap();
        let adjacency = if paper { Adjacency::Edges } else { Adjacency::Vertices };
        let graph = DualGraph::new(&scaled, adjacency, Metric::Isotropic).unwrap();
        prop_assert_eq!(violations(&graph, &made.labels), 0);
        prop_assert!((0.0..=1.0).contains(&made.left_over) && made.misplaced <= 1.0 + 1e-9);
    }

    /// A mesh twice as large with bins twice as wide gets the same labels, doubled.
    #[test]
    fn scaling_mesh_and_bins_together_changes_nothing(factor in prop::sample::select(vec![0.25, 0.5, 2.0, 8.0]), seed in 0..50_u64) {
        let mesh = TriangleMesh::torus(2.0, 0.7, 40, 20);
        let of = ContactDistribution::new(1.0, vec![3.0, 2.0, 1.0], vec![2.0, 1.0, 1.0, 0.5]).unwrap();
        let options = ReconstructOptions::default().with_seed(seed);
        let one = on(&mesh, 15.0, &of, &options);
        let two = on(&mesh, 15.0 * factor, &of.magnified(factor).unwrap(), &options);
        for (a, b) in one.labels.iter().zip(&two.labels) {
            prop_assert_eq!(a * factor, *b);
        }
    }
}

/// Each bin has as many labels as the histogram requires, to a per cent of the triangles, where every triangle counts
/// one and the mesh can have the distribution.
#[test]
fn counts_are_those_of_the_histogram() {
    let mesh = TriangleMesh::icosphere(2.0, 5);
    let of = ContactDistribution::new(1.0, vec![0.25, 0.15, 0.08, 0.02], vec![0.25, 0.15, 0.08, 0.02]).unwrap();
    let made = on(
        &mesh,
        40.0,
        &of,
        &ReconstructOptions::default().with_weighting(Weighting::Count),
    );
    assert!(
        made.misplaced < 0.01 && made.left_over < 0.001,
        "{} {}",
        made.misplaced,
        made.left_over
    );
    let counted = made.labels.iter().filter(|x| **x >= 2.0 && **x < 3.0).count() as f64;
    assert!((counted - 0.08 * 20480.0).abs() <= 0.01 * 20480.0, "{counted}");
}

/// The same seed gives the same bits at one thread and at four, another seed another instance.
#[test]
fn same_seed_same_bits() {
    let mesh = TriangleMesh::icosphere(2.0, 4);
    let of = ContactDistribution::new(1.0, vec![0.3, 0.2], vec![0.3, 0.15, 0.05]).unwrap();
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| on(&mesh, 25.0, &of, &ReconstructOptions::default().with_seed(seed)).labels)
    };
    assert_eq!(with(1, 3), with(4, 3));
    assert_ne!(with(1, 3), with(1, 4));
}
