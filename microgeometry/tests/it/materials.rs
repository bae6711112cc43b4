//! Accuracy of reconstructed distributions.

use nalgebra::Vector3;
use stereology_microgeometry::{ContactDistribution, Law, Method, Metric, ReconstructOptions};
use stereology_shape::TriangleMesh;

use crate::{on, random_field};

/// A random field on 20,480 triangles: nothing left over, labels to a tenth of a bin, measured again to less than half
/// a bin.
#[test]
fn random_fields_are_rebuilt() {
    let of = random_field(1, 26.0);
    for seed in 0..3 {
        let made = on(
            &TriangleMesh::icosphere(2.0, 5),
            60.0,
            &of,
            &ReconstructOptions::default().with_seed(seed),
        );
        assert!(
            made.left_over < 0.005 && made.misplaced < 0.01,
            "{} {}",
            made.left_over,
            made.misplaced
        );
        assert!(
            made.emd_labels < 0.1 && made.emd_measured.unwrap() < 0.4,
            "{} {:?}",
            made.emd_labels,
            made.emd_measured
        );
    }
}

/// Distances measured again follow the distribution for long waves, thin structures, thin bodies, and triangles much
/// smaller than bins and about as large. Without moving the interface the error of the first row was 1.1 bins, that of
/// the third 1.3.
#[test]
fn distances_measured_again_are_as_asked() {
    let thin = ContactDistribution::from_laws(1.0, Law::Exponential(1.5), Law::Exponential(0.4), 0.2).unwrap();
    let ball = TriangleMesh::icosphere(2.0, 5);
    let rod = TriangleMesh::torus(2.0, 0.15, 600, 30);
    for (name, mesh, units, of) in [
        ("long waves", &ball, 45.0, &random_field(3, 60.0)),
        ("thin structures", &ball, 40.0, &thin),
        ("a thin body", &rod, 80.0, &thin),
        ("small triangles", &ball, 12.0, &random_field(4, 16.0)),
    ] {
        let made = on(mesh, units, of, &ReconstructOptions::default().with_seed(1));
        let off = made.emd_measured.unwrap();
        assert!(off < 0.4 && made.emd_labels < 0.1, "{name}: {off} {}", made.emd_labels);
        assert_eq!(made.violations, 0);
    }
}

/// The paper's method leaves 5 to 12 % over where triangles are about as large as bins.
#[test]
fn the_papers_method_leaves_triangles_over() {
    let of = random_field(1, 26.0);
    let options = ReconstructOptions::default().with_method(Method::Paper);
    let shares: Vec<f64> = (0..4)
        .map(|seed| on(&TriangleMesh::icosphere(2.0, 5), 60.0, &of, &options.with_seed(seed)).left_over)
        .collect();
    let mean = shares.iter().sum::<f64>() / 4.0;
    assert!((0.03..0.15).contains(&mean), "{shares:?}");
}

/// A distribution with distances longer than the mesh is reported as such, and its labels are still valid.
#[test]
fn what_a_mesh_cannot_hold_is_told() {
    let of = ContactDistribution::from_laws(1.0, Law::Uniform(30.0), Law::Uniform(30.0), 0.5).unwrap();
    let made = on(
        &TriangleMesh::icosphere(2.0, 3),
        10.0,
        &of,
        &ReconstructOptions::default(),
    );
    assert_eq!(made.violations, 0);
    assert!(made.misplaced > 0.2);
    let first = made.shortfalls[0];
    assert!(first.bin < -15 && first.got < first.wanted, "{first:?}");
}

/// With lengths along an axis shrunk, structures are longer along it: points at a given distance are in the same region
/// more often along it than across.
#[test]
fn an_anisotropic_metric_draws_structures_out() {
    let of = random_field(2, 40.0);
    let ball = TriangleMesh::icosphere(2.0, 5);
    let centre = |t: &[u32; 3]| {
        t.iter()
            .map(|&v| ball.vertices[v as usize].coords)
            .sum::<Vector3<f64>>()
            / 3.0
    };
    let centres: Vec<Vector3<f64>> = ball.triangles.iter().map(centre).collect();
    let near = |p: Vector3<f64>| {
        let far = |t: &usize| (centres[*t] - p).norm_squared();
        (0..centres.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
    };
    let belt = (0..centres.len()).filter(|&t| centres[t].z.abs() < 0.4).step_by(23);
    // A quarter of a wave away from each: up the axis, and around it.
    let triples: Vec<[usize; 3]> = belt
        .map(|t| {
            let p = centres[t];
            let around = Vector3::z().cross(&p).normalize();
            let up = p.cross(&around).normalize();
            [t, near(p + 0.2 * up), near(p + 0.2 * around)]
        })
        .collect();
    let agreement = |metric: Metric| {
        let made = on(&ball, 50.0, &of, &ReconstructOptions::default().with_metric(metric));
        assert_eq!(made.violations, 0);
        let same = |k: usize| {
            let side = |t: usize| made.labels[t].is_sign_negative();
            triples.iter().filter(|of| side(of[0]) == side(of[k])).count() as f64 / triples.len() as f64
        };
        same(1) - same(2)
    };
    let (even, drawn) = (
        agreement(Metric::Isotropic),
        agreement(Metric::along(Vector3::z(), 4.0).unwrap()),
    );
    assert!(even.abs() < 0.1 && drawn > 0.15, "{even} {drawn}");
}
