//! Guarantees of `pack`.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::ops::ControlFlow;
use stereology_anneal::{
    Mode, PackError, PackOptions, Packing, box_for_fraction, lognormal_sizes, mix, overlaps, pack, populate,
};
use stereology_shape::{Arrangement, Body, Particle, UnitBody};

fn packed(
    bodies: &[UnitBody],
    count: usize,
    sigma: f64,
    fraction: f64,
    seed: u64,
    options: &PackOptions,
) -> Result<Packing, PackError> {
    let grains = mix(
        &lognormal_sizes(count, sigma, seed).unwrap(),
        &vec![1.0; bodies.len()],
        seed,
    )
    .unwrap();
    let period = box_for_fraction(bodies, &grains, fraction).unwrap();
    pack(
        &Arrangement::new(bodies, populate(&grains, &period, seed), period)?,
        options,
        &|_| ControlFlow::Continue(()),
    )
}

fn zoo() -> Vec<UnitBody> {
    [
        Body::sphere(1.0).unwrap(),
        Body::ellipsoid([2.0, 1.0, 0.7]).unwrap(),
        Body::cuboid([1.0, 1.0, 1.0]).unwrap(),
        Body::cylinder(1.0, 2.0).unwrap(),
        Body::rock(1),
    ]
    .iter()
    .map(UnitBody::new)
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Any mixture with any spread of sizes is certified, in the box, and exactly as dense as requested.
    #[test]
    fn mixtures_pack_exactly(count in 1_usize..150, sigma in 0.0..0.6_f64, fraction in 0.02..0.4_f64, seed in 0_u64..100) {
        let packing = match packed(&zoo(), count, sigma, fraction, seed, &PackOptions::default()) {
            Ok(packing) => packing,
            // A few particles in a small box may not fit beside their own images.
            Err(PackError::Arrangement(_) | PackError::TooWide { .. } | PackError::Unresolved(_)) if count < 8 => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        prop_assert!((packing.fraction() - fraction).abs() < 1e-9);
        prop_assert_eq!(packing.particles().len(), count);
        for particle in packing.particles() {
            prop_assert_eq!(particle.position, packing.period().wrap(&particle.position));
        }
        prop_assert!(overlaps(&packing).is_empty());
    }
}

#[test]
fn dense_spheres_are_packed() {
    let spheres = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let packing = packed(&spheres, 1000, 0.3, 0.64, 0, &PackOptions::default()).unwrap();
    assert!((packing.fraction() - 0.64).abs() < 1e-9);
    assert_eq!(packing.energies().len(), packing.iterations());
    assert!(packing.energies().first() > packing.energies().last());
}

#[test]
fn wide_sizes_are_packed() {
    let spheres = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    packed(&spheres, 1000, 0.8, 0.55, 2, &PackOptions::default()).unwrap();
}

/// Small particles inside particles a thousand times their size escape without needing one step per own width.
#[test]
fn small_particles_escape_from_large_ones() {
    let spheres = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let mut sizes = vec![1.0; 20];
    sizes.extend((1..400).map(|k| 0.2 / f64::from(k)));
    let grains = mix(&sizes, &[1.0], 0).unwrap();
    let period = box_for_fraction(&spheres, &grains, 0.4).unwrap();
    let start = populate(&grains, &period, 0);
    let packing = pack(
        &Arrangement::new(&spheres[..], start, period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!(packing.iterations() < 500, "{}", packing.iterations());
}

#[test]
fn faces_pack_flat() {
    // For faces in contact the energy has creases, on which dynamics that stop at every uphill step stall.
    let cubes = [UnitBody::new(&Body::cuboid([1.0; 3]).unwrap())];
    packed(&cubes, 200, 0.0, 0.55, 1, &PackOptions::default()).unwrap();
}

#[test]
fn rods_are_packed() {
    let rods = [UnitBody::new(&Body::cuboid([1.0, 1.0, 5.0]).unwrap())];
    packed(&rods, 150, 0.2, 0.3, 1, &PackOptions::default()).unwrap();
}

#[test]
fn the_method_of_the_paper_packs_without_rotation() {
    let bodies = zoo();
    let grains = mix(&lognormal_sizes(200, 0.3, 3).unwrap(), &[1.0; 5], 3).unwrap();
    let period = box_for_fraction(&bodies, &grains, 0.25).unwrap();
    let start = populate(&grains, &period, 3);
    let options = PackOptions::default().with_mode(Mode::paper());
    let packing = pack(
        &Arrangement::new(&bodies[..], start.clone(), period).unwrap(),
        &options,
        &|_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!(
        packing
            .particles()
            .iter()
            .zip(&start)
            .all(|(now, then)| now.orientation == then.orientation)
    );
}

#[test]
fn threads_change_no_bit() {
    let run = |threads: usize| -> Vec<Particle> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let spheres = packed(&zoo()[..1], 3000, 0.3, 0.55, 9, &PackOptions::default()).unwrap();
            let mixture = packed(&zoo(), 700, 0.3, 0.35, 9, &PackOptions::default()).unwrap();
            [spheres.particles().to_vec(), mixture.particles().to_vec()].concat()
        })
    };
    let bits = |particles: Vec<Particle>| -> Vec<u64> {
        let numbers = |p: &Particle| {
            p.position
                .iter()
                .chain(p.orientation.coords.iter())
                .map(|x| x.to_bits())
                .collect::<Vec<_>>()
        };
        particles.iter().flat_map(numbers).collect()
    };
    let alone = bits(run(1));
    assert_eq!(alone, bits(run(2)));
    assert_eq!(alone, bits(run(3)));
}

#[test]
fn packing_a_packing_changes_nothing() {
    let packing = packed(&zoo(), 50, 0.2, 0.3, 4, &PackOptions::default()).unwrap();
    let again = pack(
        &packing,
        &PackOptions::default().with_mode(Mode::Fast {
            iterations: 1,
            swelling: Some(1.001),
        }),
        &|_| ControlFlow::Continue(()),
    );
    assert_eq!(packing.particles(), again.unwrap().particles());
}

#[test]
fn identical_particles_at_one_position_separate() {
    let bodies = zoo();
    let period = stereology_shape::PeriodicBox::new(Vector3::repeat(6.0)).unwrap();
    let same = |shape| Particle {
        shape,
        size: 1.0,
        category: 0,
        position: nalgebra::Point3::new(1.0, 2.0, 3.0),
        orientation: UnitQuaternion::identity(),
    };
    for shape in 0..bodies.len() {
        pack(
            &Arrangement::new(&bodies[..], vec![same(shape); 8], period).unwrap(),
            &PackOptions::default(),
            &|_| ControlFlow::Continue(()),
        )
        .unwrap();
    }
}
