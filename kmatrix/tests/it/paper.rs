//! The paper's own way and its claims.

use crate::meshes::{body, torus};
use stereology_kmatrix::{
    LargestArea, MonteCarloOptions, SectionLaw, SectionLawError, SectionOptions, Sizes, Slicing, condition_number,
    geometric_classes,
};
use stereology_shape::{Body, TriangleMesh};

/// "This process converged to a residual of < 0.5% for each histogram bin within 100,000 iterations" (section 3.2).
#[test]
fn residuals_fall_below_half_a_percent() {
    let sphere = Body::sphere(1.0).unwrap();
    let exact = SectionLaw::sphere(1.0).unwrap();
    let residuals = exact.residuals(&sphere, 10, &MonteCarloOptions::default()).unwrap();
    let worst = |k: usize| residuals[k].per_bin.iter().fold(0.0_f64, |worst, r| worst.max(r.abs()));
    assert_eq!(residuals.last().unwrap().iterations, 100_000);
    assert!(worst(199) < 5e-3, "{}", worst(199));
    assert!(worst(0) > worst(199));
    assert!(residuals.iter().all(|r| r.per_bin.iter().sum::<f64>().abs() < 1e-12));
}

/// Sections drawn and counted in pixels tend to those cut as polygons.
#[test]
fn the_stencil_buffer_finds_the_same_law() {
    let torus = body(torus());
    let exact = SectionLaw::of_body(&torus, &SectionOptions::default().with_directions(32 * 16)).unwrap();
    let options = MonteCarloOptions::default()
        .with_iterations(3_000)
        .with_slicing(Slicing::Raster { resolution: 128 })
        .with_largest(LargestArea::Encountered);
    let drawn = SectionLaw::monte_carlo(&torus, &options).unwrap();
    let error = exact.standard_error(5).hypot(drawn.standard_error(5));
    // Pixels add up to 2 % of the size of small profiles, and the largest area met is low.
    assert!((exact.k_matrix(5) - drawn.k_matrix(5)).amax() < 6.1 * error + 0.02);
    assert!((drawn.profiles_per_hit() / exact.profiles_per_hit() - 1.0).abs() < 0.05);
    assert!(drawn.max_area() < 1.03 * exact.max_area());
    let refused = SectionLaw::monte_carlo(&torus, &options.with_slicing(Slicing::Raster { resolution: 2 }));
    assert!(matches!(refused, Err(SectionLawError::TooFew { .. })));
}

/// Saltikov's geometric classes can be inverted too; equal classes are no worse for spheres, and far better for cubes
/// of few bins.
#[test]
fn classes_are_compared_by_their_condition() {
    let edges = geometric_classes(12);
    assert!((edges[11] - 0.794_328).abs() < 1e-6 && edges.len() == 13);
    for body in [Body::sphere(1.0).unwrap(), body(TriangleMesh::cuboid([1.0; 3]))] {
        let law = SectionLaw::of_body(&body, &SectionOptions::default().with_directions(512)).unwrap();
        let geometric = condition_number(&law.kernel(&edges, &edges, Sizes::UpperEdge).unwrap());
        assert!(geometric > 1.0 && geometric.is_finite());
        assert!(condition_number(&law.k_matrix(12)) > 1.0);
    }
}

/// The reported error is honest: laws to 0.5 % differ from a law to 0.04 % by no more than 6.1 of the largest standard
/// error they tell.
#[test]
fn reported_errors_hold_for_every_seed() {
    for body in [body(TriangleMesh::cuboid([1.0, 1.0, 2.0])), body(torus())] {
        let fine = SectionOptions::default().with_tolerance(4e-4).with_seed(1000);
        let reference = SectionLaw::of_body(&body, &fine).unwrap();
        for seed in 0..6 {
            let law =
                SectionLaw::of_body(&body, &SectionOptions::default().with_tolerance(5e-3).with_seed(seed)).unwrap();
            let difference = law.k_matrix(10) - reference.k_matrix(10);
            let error = law.standard_error(10).hypot(reference.standard_error(10));
            assert!(difference.amax() <= 6.1 * error, "{} {error}", difference.amax());
        }
    }
}

#[test]
fn a_tolerance_out_of_reach_is_said_at_once() {
    let cube = body(TriangleMesh::cuboid([1.0; 3]));
    let refused = SectionLaw::of_body(&cube, &SectionOptions::default().with_tolerance(1e-12));
    assert!(matches!(
        refused,
        Err(SectionLawError::NotReached { directions: 256, .. })
    ));
}
