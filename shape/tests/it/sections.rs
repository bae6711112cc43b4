//! Sections: areas that integrate to the volume, and separate profiles.

use approx::assert_relative_eq;
use nalgebra::{UnitVector3, Vector3};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_4;
use stereology_shape::{Body, ClosedMesh, SectionAreas, TriangleMesh, UnitBody, section_polygons};

use crate::random_shapes::{directions, fat_l, hollow_cube, polytopes, torus};

/// ∫ A dh by Simpson's rule between neighbouring heights of vertices, where A is a parabola: exact.
fn volume_by_sections(mesh: &ClosedMesh, normal: &UnitVector3<f64>) -> f64 {
    let body_area = |offset: f64| {
        section_polygons(mesh, normal, offset)
            .iter()
            .map(|p| p.area)
            .sum::<f64>()
    };
    let mut heights: Vec<f64> = mesh.vertices().iter().map(|v| v.coords.dot(normal)).collect();
    heights.sort_by(f64::total_cmp);
    let slabs = heights.windows(2).map(|pair| {
        let (low, high) = (pair[0], pair[1]);
        let at = |share: f64| body_area(low + share * (high - low));
        // Gauss-Legendre with two points: exact for cubics, never on a vertex.
        let reach = 0.5 / 3.0_f64.sqrt();
        0.5 * (high - low) * (at(0.5 - reach) + at(0.5 + reach))
    });
    slabs.sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn section_areas_integrate_to_the_volume_in_every_direction(mesh in polytopes(), normal in directions()) {
        assert_relative_eq!(volume_by_sections(&mesh, &normal), mesh.volume(), max_relative = 1e-9);
        for mesh in [fat_l(), hollow_cube(), torus()] {
            assert_relative_eq!(volume_by_sections(&mesh, &normal), mesh.volume(), max_relative = 1e-9);
        }
    }

    #[test]
    fn no_profile_is_larger_than_the_largest(mesh in polytopes(), normal in directions(), offset in -1.0..1.0_f64) {
        let body = Body::from_mesh(mesh);
        for area in body.profile_areas(&normal, offset) {
            prop_assert!(area <= body.largest_section_area() * (1.0 + 1e-9));
        }
        for area in UnitBody::new(&body).profile_areas(&normal, 0.3 * offset) {
            prop_assert!(area <= FRAC_PI_4 * (1.0 + 1e-9));
        }
    }
}

#[test]
fn a_torus_at_its_equator_is_one_ring() {
    let mesh = torus();
    let ring = section_polygons(&mesh, &Vector3::z_axis(), 0.01);
    assert_eq!((ring.len(), ring[0].holes.len()), (1, 1));
    assert!(ring[0].area > 0.0 && ring[0].outer.iter().all(|p| (p.z - 0.01).abs() < 1e-12));
    let discs = Body::from_mesh(mesh).profile_areas(&Vector3::x_axis(), 0.0);
    assert_eq!(discs.len(), 2);
    assert_relative_eq!(discs[0], discs[1], max_relative = 1e-9);
}

#[test]
fn an_island_in_a_hole_is_a_profile_of_its_own() {
    let mesh = hollow_cube()
        .as_triangle_mesh()
        .clone()
        .with(&TriangleMesh::cuboid([0.5; 3]));
    let mesh = ClosedMesh::try_from(mesh).unwrap();
    assert!(mesh.repairs().is_empty());
    let profiles = section_polygons(&mesh, &Vector3::z_axis(), 0.1);
    let areas: Vec<f64> = profiles.iter().map(|p| p.area).collect();
    assert_eq!(areas.len(), 2);
    assert_relative_eq!(areas[0], 3.0, max_relative = 1e-12);
    assert_relative_eq!(areas[1], 0.25, max_relative = 1e-12);
}

#[test]
fn planes_through_vertices_edges_and_faces_cut_whole_profiles() {
    let cube = ClosedMesh::try_from(TriangleMesh::cuboid([2.0; 3])).unwrap();
    let area = |normal: [f64; 3], offset: f64| -> Vec<f64> {
        let normal = UnitVector3::new_normalize(Vector3::from(normal));
        section_polygons(&cube, &normal, offset)
            .iter()
            .map(|p| p.area)
            .collect()
    };
    assert_eq!(
        area([0.0, 0.0, 1.0], 1.0).len(),
        1,
        "the face itself, as the limit from below"
    );
    assert!(area([0.0, 0.0, 1.0], -1.0).is_empty());
    let diagonal = area([1.0, 1.0, 0.0], 0.0);
    assert_eq!(diagonal.len(), 1);
    assert_relative_eq!(diagonal[0], 4.0 * 2.0_f64.sqrt(), max_relative = 1e-12);
    assert!(
        area([1.0, 1.0, 1.0], 3.0_f64.sqrt()).iter().sum::<f64>() < 1e-12,
        "a corner only"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// ∫ A dh = V for every direction and every body.
    #[test]
    fn areas_add_up_to_the_volume(mesh in polytopes(), normal in directions(), seed in 0_u64..50) {
        let rough = Body::rough_rock(seed, 0.08).unwrap();
        for mesh in [&mesh, rough.mesh().unwrap()] {
            let mut areas = SectionAreas::new(mesh);
            let mut volume = 0.0;
            let defect = areas.sweep(&normal, |low, high, [a, b, c]| {
                let t = high - low;
                volume += t * (a + t * (b / 2.0 + t * c / 3.0));
            });
            prop_assert!(defect < 1e-7);
            prop_assert!((volume * areas.reach().powi(3) / mesh.volume() - 1.0).abs() < 1e-7);
        }
    }

    /// The largest section of a box goes through two opposite longest edges.
    #[test]
    fn largest_sections_of_boxes(mut edges in prop::array::uniform3(0.05..1.0_f64)) {
        let found = Body::cuboid(edges).unwrap().largest_section_area();
        edges.sort_by(f64::total_cmp);
        let exact = edges[2] * edges[0].hypot(edges[1]);
        prop_assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
    }
}

/// A cylinder's largest section is the larger of its base, the rectangle through its axis, and what lies between.
#[test]
fn a_cylinder_has_its_mean_width_and_largest_section() {
    let (d, l) = (1.0, 4.0);
    let can = Body::cylinder(d, l).unwrap();
    assert!((can.mean_width() - 0.5 * (l + std::f64::consts::FRAC_PI_2 * d)).abs() < 1e-3);
    assert!(can.largest_section_area() > d * l * (1.0 - 1e-3));
}

/// V = 2 a b c e₁ e₂ B(e₁/2 + 1, e₁) B(e₂/2, e₂/2); at e = 2 an octahedron, 4 a b c / 3.
#[test]
fn superellipsoids_have_their_volume() {
    let octahedron = Body::superellipsoid([1.0, 2.0, 3.0], [2.0, 2.0]).unwrap();
    assert!(
        (octahedron.volume() / 8.0 - 1.0).abs() < 0.01,
        "{}",
        octahedron.volume()
    );
    let ellipsoid = Body::superellipsoid([1.0, 2.0, 3.0], [1.0, 1.0]).unwrap();
    assert!((ellipsoid.volume() / Body::ellipsoid([1.0, 2.0, 3.0]).unwrap().volume() - 1.0).abs() < 0.01);
    // e₁ = e₂ = 2/3: |x|³ + |y|³ + |z|³ ≤ 1, volume 8 Γ(4/3)³ / Γ(2).
    let cubic = Body::superellipsoid([1.0; 3], [2.0 / 3.0; 2]).unwrap();
    assert!(
        (cubic.volume() / (8.0 * 0.892_979_5_f64.powi(3)) - 1.0).abs() < 0.01,
        "{}",
        cubic.volume()
    );
    assert!(Body::superellipsoid([1.0; 3], [3.0, 3.0]).unwrap().volume() < 4.0 / 3.0);
    assert!(Body::superellipsoid([1.0; 3], [0.0, 1.0]).is_err() && Body::rough_rock(1, f64::NAN).is_err());
}
