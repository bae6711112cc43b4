//! Impossible packings are refused, before or after an attempt.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_anneal::{Mode, PackError, PackOptions, Packing, box_for_fraction, density_limit, mix, pack, populate};
use stereology_shape::{Arrangement, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody};

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
    pack(
        &Arrangement::new(bodies, populate(&grains, &period, 0), period).unwrap(),
        options,
        &|_| ControlFlow::Continue(()),
    )
}

#[test]
fn more_than_the_densest_is_refused_at_once() {
    assert!(matches!(
        try_pack(&[sphere()], 500, 0.75, &PackOptions::default()),
        Err(PackError::TooDense { .. })
    ));
}

/// Bodies that contain a sphere cannot be packed more densely than the spheres: .7405 divided by their fraction of the
/// volume.
#[test]
fn nearly_round_bodies_are_refused_at_nearly_the_same_fraction() {
    let round = ClosedMesh::try_from(TriangleMesh::icosphere(1.0, 3)).unwrap();
    let round = UnitBody::new(&Body::from_mesh(round));
    let Err(PackError::TooDense { limit, .. }) = try_pack(&[round], 50, 0.78, &PackOptions::default()) else {
        panic!("packed at .78")
    };
    assert!((0.7405..0.77).contains(&limit), "{limit}");
    // The limit of a mixture of spheres and cubes lies between their limits.
    let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
    let limit = |bodies: &[UnitBody]| {
        let grains = mix(&[1.0; 40], &vec![1.0; bodies.len()], 0).unwrap();
        density_limit(
            bodies,
            &populate(&grains, &PeriodicBox::new(Vector3::repeat(9.0)).unwrap(), 0),
        )
    };
    assert!((limit(&[sphere()]) - 0.7405).abs() < 1e-4);
    assert!((limit(std::slice::from_ref(&cube)) - 1.0).abs() < 1e-12);
    assert!((0.75..=1.0).contains(&limit(&[sphere(), cube])));
}

#[test]
fn jamming_is_reported_with_the_remaining_overlaps() {
    let options = PackOptions::default().with_mode(Mode::Fast {
        iterations: 300,
        swelling: None,
    });
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
    let result = pack(
        &Arrangement::new([sphere()], vec![particle()], period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    );
    assert!(matches!(result, Err(PackError::TooWide { index: 0, .. })));
}

#[test]
fn options_out_of_range_are_refused() {
    let period = PeriodicBox::new(Vector3::repeat(3.0)).unwrap();
    let result = pack(
        &Arrangement::new([sphere()], vec![], period).unwrap(),
        &PackOptions::default().with_mode(Mode::Paper {
            iterations: 1,
            swelling: Some(2.0),
        }),
        &|_| ControlFlow::Continue(()),
    );
    assert!(matches!(result, Err(PackError::Swelling(_))));
    let tight = PackOptions::default().with_tolerance(0.0);
    let result = pack(&Arrangement::new([sphere()], vec![], period).unwrap(), &tight, &|_| {
        ControlFlow::Continue(())
    });
    assert!(matches!(result, Err(PackError::Tolerance(_))));
}

#[test]
fn a_jam_reports_the_fraction_reached() {
    let options = PackOptions::default().with_mode(Mode::Sequential { tries: 2000 });
    let Err(PackError::Jammed(jam)) = try_pack(&[sphere()], 300, 0.5, &options) else {
        panic!("placed one by one at .5")
    };
    // Random sequential addition ends at .384; two thousand tries come close.
    assert!((0.3..0.384).contains(&jam.reached), "{}", jam.reached);
    assert!(jam.placed.len() < jam.count && jam.count == 300 && jam.tries == 2000);
    assert!(jam.to_string().contains("jammed at"));
    assert!(Packing::verify(&Arrangement::new([sphere()], jam.placed.clone(), jam_box(&jam)).unwrap()).is_ok());
}

fn jam_box(jam: &stereology_anneal::Jam) -> PeriodicBox {
    let volume = jam.count as f64 * std::f64::consts::PI / 6.0 / 0.5;
    PeriodicBox::new(Vector3::repeat(volume.cbrt())).unwrap()
}

#[test]
fn an_empty_arrangement_is_a_packing() {
    let period = PeriodicBox::new(Vector3::repeat(3.0)).unwrap();
    let packing = pack(
        &Arrangement::new([], vec![], period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!(packing.fraction().abs() < 1e-300 && packing.particles().is_empty());
}

/// Progress increases from 0 to 1, and every call can cancel the work.
#[test]
fn progress_and_cancelling() {
    let grains = mix(&[1.0; 300], &[1.0], 0).unwrap();
    let bodies = [UnitBody::new(&Body::rock(2))];
    let period = box_for_fraction(&bodies, &grains, 0.4).unwrap();
    let run = |stop_at: usize| {
        let calls = AtomicUsize::new(0);
        let last = std::sync::Mutex::new(0.0_f64);
        let result = pack(
            &Arrangement::new(&bodies[..], populate(&grains, &period, 0), period).unwrap(),
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
