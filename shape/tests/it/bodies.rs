//! Bodies against closed forms, and against themselves moved, rotated and scaled.

use approx::assert_relative_eq;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::f64::consts::PI;
use stereology_shape::{
    Arrangement, ArrangementError, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody, isotropic_rotation,
};

use crate::random_shapes::{fat_l, hollow_cube, polytopes, rotations};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn boxes_have_half_the_sum_of_their_edges_as_mean_width(edges in [0.1..5.0, 0.1..5.0, 0.1..5.0_f64]) {
        let mesh = ClosedMesh::try_from(TriangleMesh::cuboid(edges)).unwrap();
        let [a, b, c] = edges;
        assert_relative_eq!(mesh.mean_width(), 0.5 * (a + b + c), max_relative = 1e-12);
        assert_relative_eq!(mesh.surface_area(), 2.0 * (a * b + b * c + c * a), max_relative = 1e-12);
        assert_relative_eq!(mesh.volume(), a * b * c, max_relative = 1e-12);
    }

    /// The largest section of a box contains its longest edge and the diagonal of the other two.
    #[test]
    fn largest_section_of_a_box_contains_the_longest_edge_and_a_diagonal(edges in [0.2..1.0, 0.2..1.0, 0.2..1.0_f64]) {
        let [mut a, mut b, mut c] = edges;
        if a > b { std::mem::swap(&mut a, &mut b); }
        if b > c { std::mem::swap(&mut b, &mut c); }
        if a > b { std::mem::swap(&mut a, &mut b); }
        assert_relative_eq!(Body::cuboid(edges).unwrap().largest_section_area(), c * a.hypot(b), max_relative = 1e-6);
    }

    #[test]
    fn largest_section_of_an_ellipsoid_is_perpendicular_to_its_shortest_axis(axes in [0.3..1.0, 0.3..1.0, 0.3..1.0_f64]) {
        let exact = Body::ellipsoid(axes).unwrap();
        let mesh = ClosedMesh::try_from(exact.to_triangles(2)).unwrap();
        assert_relative_eq!(mesh.mean_width(), exact.mean_width(), max_relative = 0.03);
        assert_relative_eq!(mesh.surface_area(), exact.surface_area(), max_relative = 0.05);
        let found = Body::from_mesh(mesh).largest_section_area() / exact.largest_section_area();
        prop_assert!(found < 1.0 && found > 0.96, "{}", found);
    }

    #[test]
    fn measures_do_not_depend_on_position_orientation_or_unit(mesh in polytopes(), turn in rotations(), scale in 0.01..100.0_f64) {
        let place = |p: &Point3<f64>| Point3::from((turn * p.coords + Vector3::new(3.0, -4.0, 5.0)) * scale);
        let moved = ClosedMesh::try_from(mesh.as_triangle_mesh().mapped(place)).unwrap();
        assert_relative_eq!(moved.volume(), mesh.volume() * scale.powi(3), max_relative = 1e-9);
        assert_relative_eq!(moved.surface_area(), mesh.surface_area() * scale.powi(2), max_relative = 1e-9);
        assert_relative_eq!(moved.mean_width(), mesh.mean_width() * scale, max_relative = 1e-9);
        assert_relative_eq!(moved.centroid(), place(&mesh.centroid()), max_relative = 1e-9);
        prop_assert!(moved.is_convex());
        let [own, other] = [mesh, moved].map(|mesh| Body::from_mesh(mesh).size());
        // Largest sections are found by a search that sometimes misses the global maximum slightly.
        assert_relative_eq!(other, own * scale, max_relative = 1e-4);
    }

    #[test]
    fn particles_map_there_and_back(seed in 0..1000_u64, p in [-9.0..9.0, -9.0..9.0, -9.0..9.0_f64], size in 0.01..100.0_f64) {
        use rand::SeedableRng;
        let orientation = isotropic_rotation(&mut rand_chacha::ChaCha8Rng::seed_from_u64(seed));
        let particle = Particle { shape: 0, size, category: 0, position: Point3::new(1.0, 2.0, 3.0), orientation };
        let p = Point3::from(p);
        assert_relative_eq!(particle.to_local(&particle.to_world(&p)), p, epsilon = 1e-12);
    }

    #[test]
    fn boxes_repeat(sides in [0.1..9.0, 0.1..9.0, 0.1..9.0_f64], p in [-99.0..99.0, -99.0..99.0, -99.0..99.0_f64]) {
        let period = PeriodicBox::new(Vector3::from(sides)).unwrap();
        let p = Point3::from(p);
        let wrapped = period.wrap(&p);
        for k in 0..3 {
            prop_assert!(wrapped[k] >= 0.0 && wrapped[k] < sides[k]);
        }
        prop_assert!(period.nearest(wrapped - p).norm() < 1e-9, "a copy of the same point");
        let nearest = period.nearest(p.coords);
        for k in 0..3 {
            prop_assert!(nearest[k].abs() <= 0.5 * sides[k] * (1.0 + 1e-12));
        }
    }

    #[test]
    fn rocks_are_angular_and_convex(seed in any::<u64>()) {
        let rock = Body::rock(seed);
        let mesh = rock.mesh().unwrap();
        prop_assert!(rock.is_convex());
        prop_assert!((16..=38).contains(&mesh.triangles().len()));
        prop_assert!(rock.size() > 0.4 && rock.size() < 1.1, "{}", rock.size());
    }
}

#[test]
fn spheroids_have_the_known_mean_width_and_surface() {
    // Prolate, semi-axes 1, 1, 2: H = c + (a²/e) artanh-like closed form; S = 2πa² (1 + c/(a e) asin e).
    let e = (1.0 - 0.25_f64).sqrt();
    let body = Body::ellipsoid([1.0, 1.0, 2.0]).unwrap();
    assert_relative_eq!(
        body.surface_area(),
        2.0 * PI * (1.0 + 2.0 / e * e.asin()),
        max_relative = 1e-13
    );
    // ∫₀¹ √(1 + 3 t²) dt, twice.
    let root = 3.0_f64.sqrt();
    assert_relative_eq!(body.mean_width(), 2.0 + root.asinh() / root, max_relative = 1e-13);
    let ball = Body::ellipsoid([0.5; 3]).unwrap();
    assert_relative_eq!(ball.mean_width(), 1.0, max_relative = 1e-14);
    assert_relative_eq!(ball.surface_area(), PI, max_relative = 1e-14);
}

#[test]
fn largest_section_of_a_cube_contains_two_opposite_edges() {
    let cube = Body::cuboid([1.0; 3]).unwrap();
    assert_relative_eq!(cube.largest_section_area(), 2.0_f64.sqrt(), max_relative = 1e-9);
}

#[test]
fn signed_mean_width_counts_profiles_minus_holes() {
    // An L of three unit cubes: right angles along 21 of length, one of 1 concave: (21 - 1) (π/2) / 4π.
    assert_relative_eq!(fat_l().signed_mean_width(), 20.0 / 8.0, max_relative = 1e-12);
    // Section of a hollow cube: profiles minus holes are those of two cubes.
    assert_relative_eq!(hollow_cube().signed_mean_width(), 3.0 - 1.5, max_relative = 1e-12);
    // Smooth torus: the integral of mean curvature is 2π² R, so H = π R; the mesh is near.
    let fine = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 96, 48)).unwrap();
    assert_relative_eq!(fine.signed_mean_width(), PI, max_relative = 2e-3);
    assert!(
        fine.signed_mean_width() > fine.mean_width(),
        "upright sections show two profiles"
    );
}

/// Each fault of a particle has its own error, with the index of the particle.
#[test]
fn arrangements_refuse_particles_that_are_not_valid() {
    let ball = UnitBody::new(&Body::sphere(1.0).unwrap());
    let period = PeriodicBox::new(Vector3::new(5.0, 3.0, 4.0)).unwrap();
    let good = Particle {
        shape: 0,
        size: 1.0,
        category: 255,
        position: Point3::new(-40.0, 0.0, 1e9),
        orientation: UnitQuaternion::identity(),
    };
    assert!(Arrangement::new([ball.clone()], [good, good], period).is_ok());
    let refused = |particle: Particle| {
        Arrangement::new([ball.clone()], [good, particle], period)
            .map(|_| ())
            .unwrap_err()
    };
    assert!(matches!(
        refused(Particle { shape: 1, ..good }),
        ArrangementError::NoSuchShape {
            particle: 1,
            shape: 1,
            shapes: 1
        }
    ));
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(Particle { size, ..good }),
            ArrangementError::Size { particle: 1, .. }
        ));
    }
    for x in [f64::NAN, f64::INFINITY] {
        let position = Point3::new(0.0, x, 0.0);
        assert!(matches!(
            refused(Particle { position, ..good }),
            ArrangementError::Position { particle: 1, .. }
        ));
    }
    for quaternion in [
        [1.0, 0.1, 0.0, 0.0],
        [0.0; 4],
        [f64::NAN, 0.0, 0.0, 0.0],
        [f64::INFINITY, 0.0, 0.0, 0.0],
    ] {
        let [w, i, j, k] = quaternion;
        let orientation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, i, j, k));
        assert!(matches!(
            refused(Particle { orientation, ..good }),
            ArrangementError::Orientation { particle: 1, .. }
        ));
    }
    // A sphere's length is its size; four times the shortest side is allowed.
    assert!(matches!(
        refused(Particle { size: 12.1, ..good }),
        ArrangementError::TooLong { particle: 1, .. }
    ));
    assert!(Arrangement::new([ball.clone()], [Particle { size: 12.0, ..good }], period).is_ok());
}

proptest! {
    /// Wrapping moves each particle by whole sides of the box and changes nothing else.
    #[test]
    fn wrapping_keeps_everything_but_the_image(at in prop::array::uniform3(-50.0..50.0_f64), size in 0.1..2.0_f64) {
        let period = PeriodicBox::new(Vector3::new(5.0, 3.0, 4.0)).unwrap();
        let particle =
            Particle { shape: 0, size, category: 3, position: Point3::from(at), orientation: UnitQuaternion::identity() };
        let given = Arrangement::new([UnitBody::new(&Body::rock(1))], [particle], period).unwrap();
        let wrapped = given.wrapped();
        let moved = wrapped.particles()[0];
        prop_assert_eq!(Particle { position: particle.position, ..moved }, particle);
        prop_assert_eq!(wrapped.fraction(), given.fraction());
        for (k, x) in at.into_iter().enumerate() {
            let turns = (moved.position[k] - x) / period.sides()[k];
            prop_assert!((0.0..period.sides()[k]).contains(&moved.position[k]) && (turns - turns.round()).abs() < 1e-12);
        }
    }
}
