//! Bodies that are not convex are packed as parts or proxies, and certified as meshes.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_anneal::{
    ConvexParts, PackOptions, Packing, Proxy, box_for_fraction, lognormal_sizes, mix, overlaps, pack, populate,
};
use stereology_shape::{
    Arrangement, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody, isotropic_rotation,
};

/// An L of three unit cubes: a prism over its outline.
pub(crate) fn bracket() -> UnitBody {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let vertices = [0.0, 1.0]
        .iter()
        .flat_map(|&z| outline.map(|[x, y]| Point3::new(x, y, z)))
        .collect();
    let mut triangles = vec![];
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.push([a, c, b]);
        triangles.push([a + 6, b + 6, c + 6]);
    }
    for i in 0..6_u32 {
        let j = (i + 1) % 6;
        triangles.push([i, j, j + 6]);
        triangles.push([i, j + 6, i + 6]);
    }
    let mesh = ClosedMesh::try_from(TriangleMesh { vertices, triangles }).unwrap();
    UnitBody::new(&Body::from_mesh(mesh))
}

fn ring() -> UnitBody {
    let mesh = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.5, 24, 12)).unwrap();
    UnitBody::new(&Body::from_mesh(mesh))
}

/// Three crossed bars of 5 x 1 x 1: the outer faces of thirteen cubes.
fn jack() -> UnitBody {
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    let inside = |cube: [i32; 3]| {
        let off = cube.iter().filter(|&&x| x != 2).count();
        off <= 1 && cube.iter().all(|x| (0..5).contains(x))
    };
    for k in 0..125 {
        let cube = [k % 5, k / 5 % 5, k / 25];
        for (axis, step) in [(0, 1), (1, 1), (2, 1), (0, -1), (1, -1), (2, -1)] {
            let mut beside = cube;
            beside[axis] += step;
            if !inside(cube) || inside(beside) {
                continue;
            }
            let first = u32::try_from(mesh.vertices.len()).unwrap();
            for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut corner = cube;
                corner[axis] += (step + 1) / 2;
                corner[(axis + 1) % 3] += u;
                corner[(axis + 2) % 3] += v;
                mesh.vertices.push(Point3::from(corner.map(f64::from)));
            }
            let faces = if step > 0 {
                [[0, 1, 2], [0, 2, 3]]
            } else {
                [[0, 2, 1], [0, 3, 2]]
            };
            mesh.triangles.extend(faces.map(|face| face.map(|v| first + v)));
        }
    }
    mesh.weld();
    UnitBody::new(&Body::from_mesh(ClosedMesh::try_from(mesh).unwrap()))
}

fn at(shape: usize, size: f64, position: Vector3<f64>) -> Particle {
    Particle {
        shape,
        size,
        category: 0,
        position: position.into(),
        orientation: UnitQuaternion::identity(),
    }
}

#[test]
fn a_bracket_is_two_boxes_and_a_box_is_one() {
    let parts = ConvexParts::of(&bracket(), 0.01);
    assert_eq!(parts.hulls().len(), 2);
    assert!(parts.excess() < 1e-9);
    // Three crossed bars are at most seven boxes, including the central one, which has no outer surface.
    let parts = ConvexParts::of(&jack(), 0.01);
    let volume: f64 = parts.hulls().iter().map(ClosedMesh::volume).sum();
    assert!((volume / jack().volume() - 1.0).abs() < 1e-9 && parts.excess() < 1e-9);
    assert!(parts.hulls().len() <= 7, "{}", parts.hulls().len());
    let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
    assert_eq!(ConvexParts::of(&cube, 0.01).hulls().len(), 1);
    assert!(
        ConvexParts::of(&UnitBody::new(&Body::sphere(1.0).unwrap()), 0.01)
            .hulls()
            .is_empty()
    );
}

#[test]
fn concave_bodies_are_packed_as_parts_and_as_proxies() {
    let bodies = [bracket(), ring(), UnitBody::new(&Body::sphere(1.0).unwrap())];
    let grains = mix(&lognormal_sizes(90, 0.3, 1).unwrap(), &[1.0; 3], 1).unwrap();
    let period = box_for_fraction(&bodies, &grains, 0.2).unwrap();
    for proxy in [Proxy::Parts, Proxy::Hull, Proxy::Outline] {
        let options = PackOptions::default().with_proxy(proxy);
        let start = populate(&grains, &period, 1);
        let packing = pack(
            &Arrangement::new(&bodies[..], start, period).unwrap(),
            &options,
            &|_| ControlFlow::Continue(()),
        )
        .unwrap();
        assert!((packing.fraction() - 0.2).abs() < 1e-9, "{proxy:?}");
    }
}

/// Two linked rings do not overlap, although the hull of each contains a piece of the other; shifted into each other
/// they do.
#[test]
fn linked_rings_are_separate() {
    let ring = ring();
    let size = ring.body().size();
    let period = PeriodicBox::new(Vector3::repeat(10.0)).unwrap();
    let pair = |offset: f64| {
        let mut second = at(0, size, Vector3::new(5.0 + offset, 5.0, 5.0));
        second.orientation = UnitQuaternion::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        vec![at(0, size, Vector3::repeat(5.0)), second]
    };
    assert!(Packing::verify(&Arrangement::new([ring.clone()], pair(1.0), period).unwrap()).is_ok());
    assert!(Packing::verify(&Arrangement::new([ring.clone()], pair(0.2), period).unwrap()).is_err());
    assert!(Packing::verify(&Arrangement::new([ring], pair(2.7), period).unwrap()).is_ok());
}

#[test]
fn a_body_in_the_hole_of_a_ring_is_separate_and_one_inside_its_tube_is_not() {
    let bodies = [
        ring(),
        UnitBody::new(&Body::sphere(1.0).unwrap()),
        UnitBody::new(&Body::ellipsoid([1.0, 0.9, 0.8]).unwrap()),
        bracket(),
    ];
    let size = bodies[0].body().size();
    let period = PeriodicBox::new(Vector3::repeat(10.0)).unwrap();
    let middle = Vector3::repeat(5.0);
    for shape in 1..4 {
        let pair = |size_of_other: f64, aside: f64| {
            let other = at(shape, size_of_other, middle + Vector3::x() * aside);
            overlaps(&Arrangement::new(&bodies[..], [at(0, size, middle), other], period).unwrap())
        };
        assert!(pair(0.9, 0.0).is_empty(), "{shape} in the hole");
        assert_eq!(pair(0.05, 1.0).len(), 1, "{shape} wholly inside the tube");
        assert_eq!(pair(0.9, 0.4).len(), 1, "{shape} across the surface");
        // The ring lies inside a larger body, and no faces cross.
        if shape < 3 {
            assert_eq!(pair(9.0, 0.1).len(), 1, "{shape} around the ring");
        }
    }
}

/// Two L-shaped bodies interlock to a plate of two by three, and plates fill space.
#[test]
fn brackets_fill_space() {
    let bracket = bracket();
    let size = bracket.body().size();
    let centroid = bracket.body().mesh().unwrap().centroid().coords;
    let upright = at(0, size, centroid);
    let half_turn = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::PI);
    let inverted = |corner: Vector3<f64>| Particle {
        orientation: half_turn,
        ..at(0, size, corner + half_turn * centroid)
    };
    let period = PeriodicBox::new(Vector3::new(2.0, 3.0, 1.0)).unwrap();
    let fitting = vec![upright, inverted(Vector3::new(2.0, 3.0, 0.0))];
    let packing = Packing::verify(&Arrangement::new([bracket.clone()], fitting, period).unwrap()).unwrap();
    assert!((packing.fraction() - 1.0).abs() < 1e-9);
    // The same planes, but with overlap.
    for corner in [[2.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.5, 3.0, 0.0]] {
        let period = PeriodicBox::new(Vector3::new(6.0, 6.0, 6.0)).unwrap();
        let pair = vec![upright, inverted(Vector3::from(corner))];
        assert!(
            Packing::verify(&Arrangement::new([bracket.clone()], pair, period).unwrap()).is_err(),
            "{corner:?}"
        );
    }
    let same = vec![upright, upright];
    let period = PeriodicBox::new(Vector3::new(6.0, 6.0, 6.0)).unwrap();
    assert!(Packing::verify(&Arrangement::new([bracket], same, period).unwrap()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Two bodies overlap if they share points: many random points detect every overlap that is not small.
    #[test]
    fn the_certificate_agrees_with_random_points(seed in 0_u64..100_000) {
        let bodies = [bracket(), ring(), UnitBody::new(&Body::rock(3)), UnitBody::new(&Body::ellipsoid([1.0, 0.6, 0.4]).unwrap())];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let period = PeriodicBox::new(Vector3::repeat(20.0)).unwrap();
        let shapes = [rng.random_range(0..2), rng.random_range(0..4)];
        let pair = [0, 1].map(|k| Particle {
            orientation: isotropic_rotation(&mut rng),
            ..at(shapes[k], 1.0 + rng.random::<f64>(), Vector3::repeat(10.0) + Vector3::from_fn(|_, _| 0.9 * k as f64 * (2.0 * rng.random::<f64>() - 1.0)))
        });
        let found = overlaps(&Arrangement::new(&bodies[..], &pair[..], period).unwrap());
        let [a, b] = &pair;
        let reach = bodies[b.shape].bounding_radius();
        let shared = (0..20_000).filter(|_| {
            let u = Point3::from(Vector3::from_fn(|_, _| reach * (2.0 * rng.random::<f64>() - 1.0)));
            bodies[b.shape].contains(&u) && bodies[a.shape].contains(&a.to_local(&b.to_world(&u)))
        }).count();
        if shared > 0 {
            prop_assert_eq!(found.len(), 1);
        } else if let Some(overlap) = found.first() {
            // An overlap without sampled points is shallow.
            prop_assert!(overlap.depth < 0.15, "{:?}", overlap);
        }
    }
}

/// Rings at random positions are often linked; those too thick to be linked are moved elsewhere instead of failing.
#[test]
fn rings_too_thick_to_be_linked_are_separated() {
    let thick = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 16, 8)).unwrap();
    let bodies = [UnitBody::new(&Body::from_mesh(thick))];
    let grains = mix(&lognormal_sizes(120, 0.4, 2).unwrap(), &[1.0], 2).unwrap();
    let period = box_for_fraction(&bodies, &grains, 0.2).unwrap();
    let start = populate(&grains, &period, 2);
    let packing = pack(
        &Arrangement::new(&bodies[..], start, period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!((packing.fraction() - 0.2).abs() < 1e-9);
}
