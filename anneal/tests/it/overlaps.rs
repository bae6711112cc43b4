//! The certificate finds all overlaps and no others.

use crate::brute_force::{boxes_overlap, sphere_overlaps, unit_edges};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_anneal::{Packing, overlaps};
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody, isotropic_rotation};

fn sphere() -> UnitBody {
    UnitBody::new(&Body::sphere(1.0).unwrap())
}

fn at(size: f64, position: [f64; 3]) -> Particle {
    Particle {
        shape: 0,
        size,
        category: 0,
        position: Point3::from(position),
        orientation: UnitQuaternion::identity(),
    }
}

fn scattered(count: usize, largest: f64, sides: [f64; 3], seed: u64) -> (Vec<Particle>, PeriodicBox) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut particle = || Particle {
        shape: 0,
        // Sizes spread over more than a decade.
        size: largest * (-2.5 * rng.random::<f64>()).exp(),
        category: 0,
        position: Point3::from(sides.map(|side| side * rng.random::<f64>())),
        orientation: isotropic_rotation(&mut rng),
    };
    (
        (0..count).map(|_| particle()).collect(),
        PeriodicBox::new(Vector3::from(sides)).unwrap(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Two spheres overlap by the sum of their radii minus their distance, at any position.
    #[test]
    fn two_spheres_overlap_by_radii_minus_distance(
        sizes in (0.1..2.0_f64, 0.1..2.0_f64),
        gap in -0.9..0.9_f64,
        direction in (0.0..1.0_f64, 0.0..1.0_f64),
        place in prop::array::uniform3(-20.0..20.0_f64),
    ) {
        let touching = 0.5 * (sizes.0 + sizes.1);
        let distance = touching * (1.0 + gap);
        let (z, angle) = (2.0 * direction.0 - 1.0, direction.1 * std::f64::consts::TAU);
        let offset = Vector3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z) * distance;
        let first = Point3::from(place);
        let second = first + offset;
        let particles = [at(sizes.0, place), at(sizes.1, [second.x, second.y, second.z])];
        let found = overlaps(&Arrangement::new([sphere()], &particles[..], PeriodicBox::new(Vector3::repeat(10.0)).unwrap()).unwrap());
        if gap < -1e-9 {
            prop_assert_eq!(found.len(), 1);
            prop_assert!((found[0].depth - (touching - distance)).abs() < 1e-9);
        } else if gap > 1e-9 {
            prop_assert!(found.is_empty());
        }
    }

    /// All pairs of all images, in boxes of any proportions with spheres up to larger than the box.
    #[test]
    fn spheres_agree_with_trying_all_pairs(
        count in 1_usize..60, largest in 0.2..2.5_f64, sides in prop::array::uniform3(1.0..6.0_f64), seed in 0_u64..1000,
    ) {
        let (particles, period) = scattered(count, largest, sides, seed);
        let found = overlaps(&Arrangement::new([sphere()], &particles[..], period).unwrap());
        let expected = sphere_overlaps(&particles, &period);
        prop_assert_eq!(found.len(), expected.len());
        for (pair, (_, _, depth)) in found.iter().zip(expected) {
            prop_assert!((pair.depth - depth).abs() < 1e-9);
        }
    }

    /// Overlaps do not depend on the origin of the box.
    #[test]
    fn a_translation_leaves_the_overlaps(shift in prop::array::uniform3(-10.0..10.0_f64), seed in 0_u64..1000) {
        let (mut particles, period) = scattered(40, 1.5, [3.0, 4.0, 5.0], seed);
        let bodies = [UnitBody::new(&Body::rock(3))];
        let pairs = |particles: &[Particle]| {
            let mut pairs: Vec<_> = overlaps(&Arrangement::new(&bodies[..], particles, period).unwrap()).iter().map(|o| (o.first, o.second)).collect();
            pairs.sort_unstable();
            pairs
        };
        let before = pairs(&particles);
        for particle in &mut particles {
            particle.position += Vector3::from(shift);
        }
        prop_assert_eq!(before, pairs(&particles));
    }

    /// Boxes of any proportions in any orientation agree with the fifteen separating axes.
    #[test]
    fn boxes_agree_with_separating_axes(edges in prop::array::uniform3(0.2..2.0_f64), seed in 0_u64..10_000) {
        let body = UnitBody::new(&Body::cuboid(edges).unwrap());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..20 {
            let size = 0.5 + rng.random::<f64>();
            let mut particles = [at(1.0, [50.0; 3]), at(size, [0.0; 3])];
            particles[1].position = particles[0].position + Vector3::from_fn(|_, _| 1.5 * (2.0 * rng.random::<f64>() - 1.0));
            for particle in &mut particles {
                particle.orientation = isotropic_rotation(&mut rng);
            }
            agrees(&body, edges, &particles)?;
        }
    }

    /// Cubes on a lattice: aligned faces, edges and corners that touch, are barely separate, overlap barely or overlap
    /// deeply.
    #[test]
    fn lattice_cubes_agree_with_separating_axes(seed in 0_u64..10_000) {
        let body = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..50 {
            let edge = [1.0, 2.0, 3.0][rng.random_range(0..3)];
            let nudge = [0.0, 1e-7, -1e-7][rng.random_range(0..3)];
            let place = Vector3::from_fn(|_, _| 0.5 * f64::from(rng.random_range(-5..=5_i32)) + nudge);
            let mut particles = [at(body.body().size(), [50.0; 3]), at(edge * body.body().size(), [0.0; 3])];
            particles[1].position = particles[0].position + place;
            let quarter = std::f64::consts::FRAC_PI_4 * f64::from(rng.random_range(0..8_i32));
            particles[1].orientation = UnitQuaternion::from_euler_angles(0.0, 0.0, quarter);
            agrees(&body, [1.0; 3], &particles)?;
        }
    }
}

fn agrees(body: &UnitBody, edges: [f64; 3], particles: &[Particle; 2]) -> Result<(), TestCaseError> {
    let unit = unit_edges(body, edges);
    let turns = particles.map(|p| p.orientation.to_rotation_matrix().into_inner());
    let offset = particles[1].position - particles[0].position;
    let expected = boxes_overlap(particles.map(|p| unit * p.size), turns, &offset);
    let found = overlaps(
        &Arrangement::new(
            std::slice::from_ref(body),
            particles.as_slice(),
            PeriodicBox::new(Vector3::repeat(100.0)).unwrap(),
        )
        .unwrap(),
    );
    // For depths below 1e-9 either result is correct.
    let really = found.iter().any(|o| o.depth > 2e-9);
    prop_assert_eq!(really, expected, "{:?} {:?}", found, particles);
    prop_assert!(expected || found.iter().all(|o| o.depth < 2e-9));
    Ok(())
}

#[test]
fn touching_passes_and_overlapping_fails() {
    let period = PeriodicBox::new(Vector3::new(10.0, 5.0, 5.0)).unwrap();
    let pair = |distance: f64| vec![at(1.0, [0.0; 3]), at(2.0, [distance, 0.0, 0.0])];
    assert!(Packing::verify(&Arrangement::new([sphere()], pair(1.5), period).unwrap()).is_ok());
    assert!(Packing::verify(&Arrangement::new([sphere()], pair(1.5 - 1e-9), period).unwrap()).is_err());
    let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
    let size = cube.body().size();
    let pair = |distance: f64| vec![at(size, [0.0; 3]), at(size, [distance, 0.3, 0.2])];
    assert!(Packing::verify(&Arrangement::new([cube.clone()], pair(1.0), period).unwrap()).is_ok());
    assert!(Packing::verify(&Arrangement::new([cube], pair(1.0 - 1e-9), period).unwrap()).is_err());
}

#[test]
fn cubes_fill_space() {
    let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
    let size = cube.body().size();
    let lattice: Vec<Particle> = (0..27)
        .map(|k| at(size, [k % 3, k / 3 % 3, k / 9].map(|x| f64::from(x) + 0.1)))
        .collect();
    let packing =
        Packing::verify(&Arrangement::new([cube], lattice, PeriodicBox::new(Vector3::repeat(3.0)).unwrap()).unwrap())
            .unwrap();
    assert!((packing.fraction() - 1.0).abs() < 1e-12);
}

#[test]
fn a_rod_longer_than_the_box_overlaps_only_itself() {
    // 3 x 0.4 x 0.4 in a box of side 2: along an axis it overlaps its own image; slightly rotated, it passes beside it.
    let rod = UnitBody::new(&Body::cuboid([3.0, 0.4, 0.4]).unwrap());
    let size = rod.body().size();
    let period = PeriodicBox::new(Vector3::repeat(2.0)).unwrap();
    let along = at(size, [1.0; 3]);
    let found = overlaps(&Arrangement::new([rod.clone()], [along], period).unwrap());
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].first, found[0].second), (0, 0));
    // The overlap is one unit along the rod, but only its width sideways.
    assert!((found[0].depth - 0.4).abs() < 1e-9);
    let turned = Particle {
        orientation: UnitQuaternion::from_euler_angles(0.0, 0.0, 0.5),
        ..along
    };
    assert!(Packing::verify(&Arrangement::new([rod], vec![turned], period).unwrap()).is_ok());
}

#[test]
fn spheres_and_ellipsoids_of_equal_axes_agree() {
    let ball = UnitBody::new(&Body::ellipsoid([0.5, 0.5, 0.5 + 1e-9]).unwrap());
    let (particles, period) = scattered(300, 1.0, [4.0, 4.0, 4.0], 5);
    let expected = overlaps(&Arrangement::new([sphere()], &particles[..], period).unwrap());
    let found = overlaps(&Arrangement::new([ball], &particles[..], period).unwrap());
    assert_eq!(found.len(), expected.len());
    for (p, q) in found.iter().zip(&expected) {
        assert!((p.depth - q.depth).abs() < 1e-6, "{p:?} {q:?}");
    }
}
