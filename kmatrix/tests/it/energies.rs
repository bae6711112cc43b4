//! Second moments of areas: the self-energy of the body.

use crate::meshes::{angle, body, hollow_cube, jack, torus};
use approx::assert_relative_eq;
use std::f64::consts::PI;
use stereology_kmatrix::{MonteCarloOptions, SectionLaw, SectionOptions};
use stereology_shape::{Body, TriangleMesh};

fn law(body: &Body, directions: usize) -> SectionLaw {
    SectionLaw::of_body(body, &SectionOptions::default().with_directions(directions)).unwrap()
}

fn energy_error(law: &SectionLaw) -> f64 {
    law.mean_square_section_area_standard_error() * law.caliper_hull()
}

/// ⟨A²⟩ = ½ ∬ dx dy / |x − y|: 0.94115632 for the unit cube, 16 π² R⁵ / 15 for a ball.
#[test]
fn mean_square_area_is_the_self_energy() {
    let cube = law(&Body::cuboid([1.0; 3]).unwrap(), 32 * 64);
    let error = energy_error(&cube);
    assert!((cube.self_energy() - 0.941_156_32).abs() < 6.1 * error, "{error}");
    assert!(error < 2e-3, "{error}");
    let ball = law(&body(TriangleMesh::icosphere(2.0, 4)), 32 * 2);
    assert_relative_eq!(ball.self_energy(), 16.0 * PI * PI / 15.0, max_relative = 0.01);
}

/// Two unit cubes far apart: their own energies, and that of two points a distance away (no plane knows of it but
/// through the total area).
#[test]
fn energy_of_two_bodies_has_their_interaction() {
    let cube = TriangleMesh::cuboid([1.0; 3]);
    let apart = 6.0;
    let pair = body(
        cube.clone()
            .with(&cube.mapped(|p| nalgebra::Point3::new(p.x + apart, p.y, p.z))),
    );
    let law = law(&pair, 32 * 256);
    let expected = 2.0 * 0.941_156_32 + 1.0 / apart;
    let error = energy_error(&law);
    // The interaction of cubes differs from that of points by (1/d)^5 only.
    assert!(
        (law.self_energy() - expected).abs() < 6.1 * error + 1e-3,
        "{} {expected} {error}",
        law.self_energy()
    );
    assert_relative_eq!(law.mean_section_area(), 2.0 / law.caliper_hull(), max_relative = 1e-12);
}

/// The ellipsoid's closed form against its mesh.
#[test]
fn closed_form_of_ellipsoids() {
    let exact = Body::ellipsoid([0.5, 1.0, 1.5]).unwrap();
    let mesh = body(exact.to_triangles(4));
    let (exact, swept) = (law(&exact, 1), law(&mesh, 32 * 16));
    assert_relative_eq!(swept.self_energy(), exact.self_energy(), max_relative = 0.015);
    assert_relative_eq!(
        swept.mean_square_profile_area(),
        exact.mean_square_profile_area(),
        max_relative = 0.015
    );
}

/// Sections cut one by one have the same second moments, of profiles and of whole sections.
#[test]
fn second_moments_are_those_of_random_sections() {
    for triangles in [torus(), jack(), angle(), hollow_cube()] {
        let body = body(triangles);
        let swept = law(&body, 32 * 32);
        let cut = SectionLaw::monte_carlo(&body, &MonteCarloOptions::default().with_iterations(4_000)).unwrap();
        let error = energy_error(&swept).hypot(energy_error(&cut));
        assert!((swept.self_energy() - cut.self_energy()).abs() < 6.1 * error);
        let error = swept
            .mean_square_profile_area_standard_error()
            .hypot(cut.mean_square_profile_area_standard_error());
        // The profiles' mean square is over H_eff, whose own error counts twice at most.
        let slack =
            2.0 * cut.caliper_effective_standard_error() / cut.caliper_effective() * cut.mean_square_profile_area();
        assert!((swept.mean_square_profile_area() - cut.mean_square_profile_area()).abs() < 6.1 * (error + slack));
    }
}
