//! Inside, distance and support of unit bodies against brute force and closed forms.

use approx::assert_relative_eq;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use std::sync::LazyLock;
use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody, convex_hull};

use crate::random_shapes::{directions, fat_l, hollow_cube, points, polytopes, torus};

fn unit(mesh: ClosedMesh) -> UnitBody {
    UnitBody::new(&Body::from_mesh(mesh))
}

/// Bodies that are not convex, prepared once.
static HOLLOW: LazyLock<[UnitBody; 3]> = LazyLock::new(|| [unit(fat_l()), unit(torus()), unit(hollow_cube())]);
/// A convex body of many faces.
static FINE_SPHERE: LazyLock<UnitBody> =
    LazyLock::new(|| unit(ClosedMesh::try_from(TriangleMesh::icosphere(1.0, 3)).unwrap()));

/// The solid angle of the mesh seen from `p` over 4π: 1 inside, 0 outside (van Oosterom & Strackee 1983).
fn winding(mesh: &ClosedMesh, p: &Point3<f64>) -> f64 {
    let angles = mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.vertices()[i as usize] - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    });
    angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn inside_agrees_with_the_solid_angle(mesh in polytopes(), points in points(40..41)) {
        let convex = unit(mesh);
        for body in std::iter::once(&convex).chain(HOLLOW.iter()) {
            let mesh = body.mesh().unwrap();
            for p in &points {
                let inside = body.contains(p);
                prop_assert_eq!(inside, winding(mesh, p) > 0.5);
                prop_assert_eq!(inside, body.signed_distance(p) < 0.0);
                if inside {
                    prop_assert!(p.coords.norm() <= body.bounding_radius());
                } else {
                    prop_assert!(p.coords.norm() >= body.inscribed_radius());
                }
            }
        }
    }

    /// Moving away from the nearest point by h changes the distance by h: its gradient has length 1.
    #[test]
    fn distances_have_slope_one(axes in [0.2..1.0, 0.2..1.0, 0.2..1.0_f64], p in [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64]) {
        let body = UnitBody::new(&Body::ellipsoid(axes).unwrap());
        let p = Point3::from(p);
        let distance = body.signed_distance(&p);
        prop_assert_eq!(distance < 0.0, body.contains(&p));
        if distance > 0.0 {
            let h = 1e-5;
            let slope = |d: Vector3<f64>| (body.signed_distance(&(p + d * h)) - body.signed_distance(&(p - d * h))) / (2.0 * h);
            let gradient = Vector3::new(slope(Vector3::x()), slope(Vector3::y()), slope(Vector3::z()));
            assert_relative_eq!(gradient.norm(), 1.0, epsilon = 1e-6);
            let foot = p - gradient * distance;
            prop_assert!(body.signed_distance(&foot).abs() < 1e-6);
        }
    }

    /// The bound is never above the distance, and equal to it inside.
    #[test]
    fn bounds_are_below_the_distance(mesh in polytopes(), axes in [0.2..1.0, 0.2..1.0, 0.2..1.0_f64], points in points(40..41)) {
        let bodies = [unit(mesh), UnitBody::new(&Body::ellipsoid(axes).unwrap()), UnitBody::new(&Body::sphere(2.0).unwrap())];
        for body in bodies.iter().chain(&HOLLOW[..1]) {
            for p in &points {
                let (bound, distance) = (body.signed_distance_bound(p), body.signed_distance(p));
                prop_assert!(bound <= distance + 1e-12 && (bound > 0.0) == (distance > 0.0), "{bound} {distance}");
                prop_assert!(distance > 0.0 || bound == distance);
            }
        }
    }

    #[test]
    fn supports_touch_the_farthest_vertex(mesh in polytopes(), direction in directions()) {
        for body in [&unit(mesh), &HOLLOW[1], &FINE_SPHERE] {
            let farthest = body.mesh().unwrap().vertices().iter().map(|v| v.coords.dot(&direction)).fold(f64::MIN, f64::max);
            assert_relative_eq!(body.support(&direction).coords.dot(&direction), farthest, max_relative = 1e-14);
        }
        let body = UnitBody::new(&Body::ellipsoid([1.0, 2.0, 3.0]).unwrap());
        let touching = body.support(&direction);
        prop_assert!(body.signed_distance(&touching).abs() < 1e-9);
    }

    #[test]
    fn bodies_with_many_faces_give_the_same_results_as_with_few(points in points(60..61)) {
        for p in points {
            let distance = p.coords.norm() - 0.5;
            prop_assert!((FINE_SPHERE.signed_distance(&p) - distance).abs() < 0.01);
            if distance.abs() > 0.01 {
                prop_assert_eq!(FINE_SPHERE.contains(&p), distance < 0.0);
            }
        }
    }
}

#[test]
fn ellipsoid_distance_is_correct_on_the_axes_and_at_the_centre() {
    let axes = [1.0, 2.0, 4.0];
    let body = Body::ellipsoid(axes).unwrap();
    let unit = UnitBody::new(&body);
    let size = body.size();
    let at = |x: f64, y: f64, z: f64| unit.signed_distance(&Point3::new(x / size, y / size, z / size)) * size;
    assert_relative_eq!(at(0.0, 0.0, 0.0), -1.0, max_relative = 1e-12);
    assert_relative_eq!(at(3.0, 0.0, 0.0), 2.0, max_relative = 1e-12);
    assert_relative_eq!(at(0.0, 0.0, 6.0), 2.0, max_relative = 1e-12);
    assert_relative_eq!(at(0.5, 0.0, 0.0), -0.5, max_relative = 1e-12);
    // Inside on the longest axis, nearer than the radius of curvature a²/c from its end: the end itself; else a circle
    // of points.
    assert_relative_eq!(at(0.0, 0.0, 3.9), -0.1, max_relative = 1e-9);
    let (z, a, c) = (2.0_f64, 1.0_f64, 4.0_f64);
    let gap = c * c - a * a;
    let expected = a * (1.0 - z * z / gap).sqrt();
    assert_relative_eq!(at(0.0, 0.0, z), -expected, max_relative = 1e-9);
    assert_relative_eq!(at(1e-12, 0.0, z), -expected, max_relative = 1e-9);
    assert_relative_eq!(at(0.0, 1e-9, z), -expected, max_relative = 1e-6);
}

#[test]
fn a_box_has_true_distances_outside_its_corners() {
    let body = UnitBody::new(&Body::cuboid([2.0; 3]).unwrap());
    let half = body.support(&Vector3::new(1.0, 1.0, 1.0)).x;
    assert_relative_eq!(
        body.signed_distance(&Point3::new(half + 1.0, half + 2.0, half + 2.0)),
        3.0,
        max_relative = 1e-12
    );
    assert_relative_eq!(
        body.signed_distance(&Point3::new(half - 0.1, 0.0, 0.0)),
        -0.1,
        max_relative = 1e-12
    );
    assert_relative_eq!(body.inscribed_radius(), half, max_relative = 1e-12);
    assert_relative_eq!(body.bounding_radius(), half * 3.0_f64.sqrt(), max_relative = 1e-12);
}

#[test]
fn the_centroid_of_a_torus_is_outside() {
    let body = unit(torus());
    assert!(!body.contains(&Point3::origin()));
    assert_eq!(body.inscribed_radius(), 0.0);
}

/// Points along the edges of a turned cube lie off them by rounding, so its hull has slivers; their normals, which are
/// noise, must not cut anything off.
#[test]
fn slivers_cut_nothing_off() {
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, 0.5, 0.7);
    let corner = |k: usize| Vector3::new(k & 1, k >> 1 & 1, k >> 2).map(|x| x as f64 - 0.5);
    let mut points = Vec::new();
    for k in 0..8_usize {
        points.push(Point3::from(turn * corner(k)));
        for axis in 0..3 {
            let (from, to) = (turn * corner(k), turn * corner(k ^ (1 << axis)));
            points.extend((1..7).map(|step| Point3::from(from + (to - from) * (f64::from(step) / 7.3))));
        }
    }
    let hull = UnitBody::new(&Body::from_mesh(convex_hull(&points).unwrap()));
    let size = hull.body().size();
    for k in 0..8 {
        let near = Point3::from(turn * corner(k) * (0.999 / size));
        assert!(hull.contains(&near) && hull.signed_distance(&near) < 0.0, "corner {k}");
    }
}
