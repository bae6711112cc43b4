//! What cannot be packed is said to be so, before or after trying.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_anneal::{
    PackError, PackOptions, Packing, ParticleError, VerifyError, box_for_fraction, mix, pack, populate,
};
use stereology_shape::{Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody};

fn sphere() -> UnitBody {
    UnitBody::new(&Body::sphere(1.0).unwrap())
}

fn particle() -> Particle {
    Particle {
        shape: 0,
        size: 1.0,
        category: 0,
        position: Point3::origin(),
        orientation: UnitQuaternion::identity(),
    }
}

fn try_pack(bodies: &[UnitBody], count: usize, fraction: f64, options: &PackOptions) -> Result<Packing, PackError> {
    let grains = mix(&vec![1.0; count], &[1.0], 0).unwrap();
    let period = box_for_fraction(bodies, &grains, fraction).unwrap();
    pack(bodies, populate(&grains, &period, 0), &period, options, &|_| {
        ControlFlow::Continue(())
    })
}

#[test]
fn more_than_the_densest_is_refused_at_once() {
    assert!(matches!(
        try_pack(&[sphere()], 500, 0.75, &PackOptions::default()),
        Err(PackError::TooDense { .. })
    ));
}

#[test]
fn jamming_is_reported_with_what_remains() {
    let options = PackOptions::default().with_iterations(300);
    let Err(PackError::Unresolved(failure)) = try_pack(&[sphere()], 200, 0.72, &options) else {
        panic!("packed at .72")
    };
    assert_eq!(failure.particles.len(), 200);
    assert!(failure.overlaps.max_overlap > 0.0 && failure.iterations == 300);
    let deepest = failure.overlaps.pairs[0];
    assert!(deepest.depth > 0.0 && deepest.first <= deepest.second);
    assert!(failure.to_string().contains("larger box"));
}

#[test]
fn a_particle_wider_than_the_box_is_refused() {
    let period = PeriodicBox::new(Vector3::new(0.9, 2.0, 2.0)).unwrap();
    let result = pack(&[sphere()], vec![particle()], &period, &PackOptions::default(), &|_| {
        ControlFlow::Continue(())
    });
    assert!(matches!(result, Err(PackError::TooWide { index: 0, .. })));
}

#[test]
fn values_that_are_none_are_refused() {
    let period = PeriodicBox::new(Vector3::repeat(3.0)).unwrap();
    let refused = |particle: Particle| match Packing::verify(&[sphere()], vec![particle], &period) {
        Err(VerifyError::Particle(error)) => error,
        other => panic!("{other:?}"),
    };
    assert!(matches!(
        refused(Particle { shape: 1, ..particle() }),
        ParticleError::NoSuchShape { shape: 1, .. }
    ));
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(Particle { size, ..particle() }),
            ParticleError::Size { .. }
        ));
    }
    assert!(matches!(
        refused(Particle {
            size: 20.0,
            ..particle()
        }),
        ParticleError::TooLong { .. }
    ));
    let position = Point3::new(f64::NAN, 0.0, 0.0);
    assert!(matches!(
        refused(Particle { position, ..particle() }),
        ParticleError::Place { .. }
    ));
    let result = pack(
        &[sphere()],
        vec![],
        &period,
        &PackOptions::default().with_swelling(2.0),
        &|_| ControlFlow::Continue(()),
    );
    assert!(matches!(result, Err(PackError::Swelling(_))));
}

#[test]
fn no_particles_are_a_packing() {
    let period = PeriodicBox::new(Vector3::repeat(3.0)).unwrap();
    let packing = pack(&[], vec![], &period, &PackOptions::default(), &|_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(packing.fraction().abs() < 1e-300 && packing.particles().is_empty());
}

/// Progress grows from 0 to 1 and can stop the work at any call.
#[test]
fn progress_and_cancelling() {
    let grains = mix(&[1.0; 300], &[1.0], 0).unwrap();
    let bodies = [UnitBody::new(&Body::rock(2))];
    let period = box_for_fraction(&bodies, &grains, 0.4).unwrap();
    let run = |stop_at: usize| {
        let calls = AtomicUsize::new(0);
        let last = std::sync::Mutex::new(0.0_f64);
        let result = pack(
            &bodies,
            populate(&grains, &period, 0),
            &period,
            &PackOptions::default(),
            &|done| {
                let mut last = last.lock().unwrap();
                assert!(done >= *last && done <= 1.0);
                *last = done;
                if calls.fetch_add(1, Ordering::Relaxed) == stop_at {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        );
        (result, calls.into_inner())
    };
    let (packing, calls) = run(usize::MAX);
    assert!(packing.is_ok() && calls > 5);
    for stop_at in [0, 1, calls / 2] {
        assert!(matches!(run(stop_at).0, Err(PackError::Cancelled)));
    }
}

/// Two cubes joined at an edge region: an L, whose hull is larger.
fn bracket() -> UnitBody {
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
    UnitBody::new(&Body::from_mesh(
        ClosedMesh::try_from(TriangleMesh { vertices, triangles }).unwrap(),
    ))
}

#[test]
fn hollow_bodies_are_refused_or_packed_as_their_hulls() {
    let bodies = [bracket()];
    assert!(!bodies[0].is_convex());
    let refused = try_pack(&bodies, 100, 0.2, &PackOptions::default());
    assert!(matches!(refused, Err(PackError::NotConvex { shape: 0 })));
    let packing = try_pack(&bodies, 100, 0.2, &PackOptions::default().with_hulls()).unwrap();
    assert!((packing.fraction() - 0.2).abs() < 1e-9);
}
