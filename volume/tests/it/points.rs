//! Point queries: the search grid against brute force over all particles and images, and the results against each
//! other.

use crate::spheres::{mixture, solid_of, spheres};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use stereology_shape::Body;
use stereology_volume::Solid;

/// Offsets from every image of every particle that could matter to `p` in the box.
fn images(solid: &Solid, p: &Point3<f64>) -> Vec<(usize, Point3<f64>)> {
    let sides = solid.period().sides();
    let steps = || (-3..=3).map(f64::from);
    let mut images = Vec::new();
    for (index, particle) in solid.particles().iter().enumerate() {
        for (i, (j, k)) in steps().flat_map(|i| steps().flat_map(move |j| steps().map(move |k| (i, (j, k))))) {
            let moved = p + Vector3::new(i, j, k).component_mul(&sides);
            images.push((index, particle.to_local(&moved)));
        }
    }
    images
}

fn body_of(solid: &Solid, particle: usize) -> &stereology_shape::UnitBody {
    &solid.bodies()[solid.particles()[particle].shape]
}

fn point() -> impl Strategy<Value = Point3<f64>> {
    // Multiples of 2^-20: sums with a few periods are exact.
    prop::array::uniform3(0_u32..1 << 24).prop_map(|c| Point3::from(c.map(|c| f64::from(c) / f64::from(1 << 20))))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_particle_is_the_one_found_by_brute_force(seed in 0_u64..4, points in prop::collection::vec(point(), 24)) {
        let solid = mixture(seed);
        for p in points {
            let p = solid.period().wrap(&p);
            let found = images(&solid, &p).into_iter().find(|(i, local)| body_of(&solid, *i).contains(local));
            prop_assert_eq!(solid.id_at(&p), found.map(|(i, _)| i));
        }
    }

    #[test]
    fn the_distance_is_the_smallest_of_all(seed in 0_u64..4, points in prop::collection::vec(point(), 8)) {
        let solid = spheres(seed);
        for p in points {
            let p = solid.period().wrap(&p);
            let smallest = images(&solid, &p).into_iter()
                .map(|(i, local)| solid.particles()[i].size * body_of(&solid, i).signed_distance(&local))
                .fold(f64::INFINITY, f64::min);
            prop_assert!((solid.distance_at(&p) - smallest).abs() < 1e-12);
        }
    }

    #[test]
    fn everything_repeats_with_the_sides(seed in 0_u64..4, p in point(), steps in prop::array::uniform3(-3_i32..4)) {
        let solid = mixture(seed);
        let moved = p + Vector3::from(steps.map(f64::from)).component_mul(&solid.period().sides());
        prop_assert_eq!(solid.id_at(&p), solid.id_at(&moved));
        prop_assert_eq!(solid.colour_at(&p), solid.colour_at(&moved));
        prop_assert_eq!(solid.distance_at(&p), solid.distance_at(&moved));
    }

    /// Many points are evaluated in another order than given.
    #[test]
    fn colours_come_in_the_order_of_their_points(seed in 0_u64..4, points in prop::collection::vec(point(), 0..200)) {
        let solid = mixture(seed);
        let one_by_one: Vec<[f32; 3]> = points.iter().map(|p| solid.colour_at(p)).collect();
        prop_assert_eq!(solid.colours_at(&points), one_by_one);
    }

    #[test]
    fn id_category_colour_and_distance_agree(seed in 0_u64..4, p in point()) {
        let solid = mixture(seed);
        let (id, distance) = (solid.id_at(&p), solid.distance_at(&p));
        prop_assert!(distance.abs() < 1e-9 || (distance < 0.0) == id.is_some());
        prop_assert_eq!(solid.category_at(&p), id.map(|i| solid.particles()[i].category));
        prop_assert_eq!(solid.colour_at(&p), id.map_or(solid.binder(), |i| solid.colours()[i]));
    }
}

/// A body longer than the box overlaps its own images; all of them count.
#[test]
fn all_images_of_a_particle_longer_than_the_box_count() {
    let sides = [1.0, 4.0, 4.0];
    let needle = Body::ellipsoid([3.0, 1.0, 1.0]).unwrap();
    let solid = solid_of(&[needle], &[(Point3::new(0.25, 1.0, 1.0), 0.5)], sides);
    for i in 0..4096 {
        let p = Point3::new(
            f64::from(i % 16) / 16.0,
            f64::from(i / 16 % 16) / 4.0,
            f64::from(i / 256) / 4.0,
        );
        let found = images(&solid, &p)
            .into_iter()
            .any(|(i, local)| body_of(&solid, i).contains(&local));
        assert_eq!(solid.id_at(&p).is_some(), found, "{p}");
    }
}

#[test]
fn without_particles_all_is_binder() {
    let solid = solid_of(&[Body::sphere(1.0).unwrap()], &[], [1.0, 2.0, 4.0]);
    assert_eq!(solid.id_at(&Point3::new(0.5, 0.5, 0.5)), None);
    assert_eq!(solid.distance_at(&Point3::origin()), f64::INFINITY);
}

/// The search ends although the nearest particle is many short sides away.
#[test]
fn distances_in_a_box_of_any_proportions() {
    let long = f64::from(1 << 30);
    for axis in 0..3 {
        let mut sides = [1.0; 3];
        sides[axis] = 2.0 * long;
        let centre = Point3::from([0.5; 3]);
        let solid = solid_of(&[Body::sphere(1.0).unwrap()], &[(centre, 0.5)], sides);
        let mut p = centre;
        p[axis] += long;
        assert!((solid.distance_at(&p) - (long - 0.25)).abs() < 1e-6);
        p[axis] = 2.0 * long - 0.5;
        assert!((solid.distance_at(&p) - 0.75).abs() < 1e-6);
    }
}
