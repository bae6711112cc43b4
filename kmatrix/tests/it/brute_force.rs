//! The slicer that cuts one polygon at a time judges the sweep.

use crate::meshes::{angle, body, hollow_cube, jack, torus};
use stereology_kmatrix::{LargestArea, MonteCarloOptions, SectionLaw, SectionOptions};
use stereology_shape::{Body, TriangleMesh};

/// Both laws agree within 6.1 of their standard errors together (false-alarm rate below 1e-6 an entry).
fn agree(name: &str, body: &Body, iterations: usize) {
    let exact = SectionLaw::of_body(body, &SectionOptions::default().with_directions(32 * 32)).unwrap();
    let sliced = SectionLaw::monte_carlo(body, &MonteCarloOptions::default().with_iterations(iterations)).unwrap();
    let (errors, sliced_errors) = (exact.k_standard_errors(8), sliced.k_standard_errors(8));
    let difference = exact.k_matrix(8) - sliced.k_matrix(8);
    for i in 0..8 {
        for j in i..8 {
            let error = errors[(i, j)].hypot(sliced_errors[(i, j)]);
            assert!(
                difference[(i, j)].abs() <= 6.1 * error + 1e-9,
                "{name} ({i}, {j}): {} ± {error}",
                difference[(i, j)]
            );
        }
    }
    let error = exact
        .caliper_effective_standard_error()
        .hypot(sliced.caliper_effective_standard_error());
    let apart = (exact.caliper_effective() - sliced.caliper_effective()).abs();
    assert!(
        apart <= 6.1 * error + 1e-9,
        "{name}: H_eff {} and {}",
        exact.caliper_effective(),
        sliced.caliper_effective()
    );
    assert!(
        exact.largest_area_met() <= exact.max_area() * (1.0 + 1e-3),
        "{name}: {} over {}",
        exact.largest_area_met(),
        exact.max_area()
    );
}

#[test]
fn sweep_agrees_with_random_sections_of_convex_bodies() {
    agree("box", &Body::cuboid([1.0, 2.0, 4.0]).unwrap(), 20_000);
    agree("rock", &Body::rock(2), 20_000);
}

#[test]
fn sweep_agrees_with_random_sections_of_bodies_with_holes_and_arms() {
    for (name, triangles) in [
        ("torus", torus()),
        ("jack", jack()),
        ("angle", angle()),
        ("hollow cube", hollow_cube()),
    ] {
        agree(name, &body(triangles), 6_000);
    }
}

/// The closed forms stand at the top: random sections of a sphere and an ellipsoid agree with them.
#[test]
fn random_sections_agree_with_closed_forms() {
    for body in [Body::sphere(2.0).unwrap(), Body::ellipsoid([1.0, 2.0, 3.0]).unwrap()] {
        let exact = SectionLaw::of_body(&body, &SectionOptions::default()).unwrap();
        let sliced = SectionLaw::monte_carlo(&body, &MonteCarloOptions::default()).unwrap();
        let (errors, difference) = (sliced.k_standard_errors(10), exact.k_matrix(10) - sliced.k_matrix(10));
        for (difference, error) in difference.iter().zip(errors.iter()) {
            assert!(difference.abs() <= 6.1 * error + 1e-9);
        }
        assert!((exact.caliper_hull() - sliced.caliper_hull()).abs() < 0.02 * exact.caliper_hull());
        // The paper: below 0.5 % within 100,000 iterations.
        assert!(sliced.standard_error(10) < 5e-3);
    }
}

/// The largest area met at random is below the largest there is.
#[test]
fn encountered_maximum_is_low() {
    let cube = body(TriangleMesh::cuboid([1.0; 3]));
    let options = MonteCarloOptions::default()
        .with_iterations(10_000)
        .with_largest(LargestArea::Encountered);
    let met = SectionLaw::monte_carlo(&cube, &options).unwrap().max_area();
    // Low by 1 to 3 %, as documented in docs/kmatrix.md.
    let low = 1.0 - met / 2.0_f64.sqrt();
    assert!((0.01..0.03).contains(&low), "{low}");
}
