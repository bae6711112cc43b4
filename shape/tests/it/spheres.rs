//! Sphere meshes against the sphere: every measure converges with the square of the edge length.

use approx::assert_relative_eq;
use nalgebra::Vector3;
use std::f64::consts::PI;
use stereology_shape::{Body, ClosedMesh, TriangleMesh, section_polygons};

fn icosphere(diameter: f64, subdivisions: u32) -> ClosedMesh {
    ClosedMesh::try_from(TriangleMesh::icosphere(diameter, subdivisions)).unwrap()
}

#[test]
fn measures_converge_at_second_order() {
    let sphere = Body::sphere(3.0).unwrap();
    let errors = |subdivisions| {
        let mesh = icosphere(3.0, subdivisions);
        [
            1.0 - mesh.volume() / sphere.volume(),
            1.0 - mesh.surface_area() / sphere.surface_area(),
            1.0 - mesh.mean_width() / sphere.mean_width(),
            1.0 - mesh.signed_mean_width() / sphere.mean_width(),
        ]
    };
    let (coarse, fine) = (errors(3), errors(4));
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(fine > 0.0 && fine < 3e-3, "inscribed: from below: {fine}");
        assert!((coarse / fine - 4.0).abs() < 0.1, "halved edges: {coarse} / {fine}");
    }
}

#[test]
fn largest_section_of_a_sphere_mesh_is_nearly_its_great_circle() {
    let body = Body::from_mesh(icosphere(2.0, 3));
    assert!(body.largest_section_area() < PI && body.largest_section_area() > 0.995 * PI);
    assert_relative_eq!(body.size(), 2.0, max_relative = 0.003);
}

#[test]
fn section_areas_are_those_of_discs() {
    let mesh = icosphere(2.0, 5);
    let sphere = Body::sphere(2.0).unwrap();
    for offset in [-0.9, -0.3, 0.0, 0.5, 0.8] {
        let normal = nalgebra::Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
        let profiles = section_polygons(&mesh, &normal, offset);
        assert_eq!(profiles.len(), 1);
        assert_relative_eq!(
            profiles[0].area,
            sphere.profile_areas(&normal, offset)[0],
            max_relative = 5e-3
        );
    }
}
