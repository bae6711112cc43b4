//! Statistics of packings, tested against theory.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::ops::ControlFlow;
use stereology_anneal::{
    Distance, PackOptions, Packing, bond_order, box_for_fraction, carnahan_starling, equilibrate, lognormal_sizes, mix,
    orientation_tensor, pack, populate, radial_distribution, section_test,
};
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};

fn packed(bodies: &[UnitBody], count: usize, sigma: f64, fraction: f64, seed: u64) -> Packing {
    let grains = mix(&lognormal_sizes(count, sigma, seed).unwrap(), &[1.0], seed).unwrap();
    let period = box_for_fraction(bodies, &grains, fraction).unwrap();
    pack(
        &Arrangement::new(bodies, populate(&grains, &period, seed), period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )
    .unwrap()
}

fn sphere() -> [UnitBody; 1] {
    [UnitBody::new(&Body::sphere(1.0).unwrap())]
}

/// Equal spheres in equilibrium have the contact values of Carnahan and Starling: 2.48 at .3, 4.66 at .45.
///
/// Ten snapshots of 800 spheres contain about 10⁵ pairs below 1.25: the fitted contact value varies by about 1 %
/// (measured over seeds), and the equation is accurate to 1 %; a tolerance of 8 % gives a false-alarm rate below 10⁻⁶.
#[test]
fn equilibrium_obeys_carnahan_and_starling() {
    for (fraction, seed) in [(0.3, 1), (0.45, 2)] {
        let mut packing = packed(&sphere(), 800, 0.0, fraction, seed);
        packing = equilibrate(&packing, 200, seed, &|_| ControlFlow::Continue(())).unwrap();
        let mut mean = 0.0;
        for snapshot in 0..10 {
            packing = equilibrate(&packing, 15, 100 * seed + snapshot, &|_| ControlFlow::Continue(())).unwrap();
            let radial = radial_distribution(packing.particles(), packing.period(), Distance::Contacts, 2.0, 80);
            assert!(
                radial
                    .g
                    .iter()
                    .zip(&radial.edges)
                    .all(|(g, edge)| *edge > 1.0 || *g == 0.0)
            );
            mean += radial.at_contact().unwrap() / 10.0;
        }
        let expected = carnahan_starling(fraction);
        assert!((mean / expected - 1.0).abs() < 0.08, "{mean} {expected}");
    }
}

/// In a simple cubic lattice a particle has 6 neighbours at 1, 12 at √2, 8 at √3.
#[test]
fn a_lattice_has_its_shells() {
    let at = |k: i32| Particle {
        shape: 0,
        size: 1.0,
        category: 0,
        position: Point3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)),
        orientation: UnitQuaternion::identity(),
    };
    let particles: Vec<Particle> = (0..64).map(at).collect();
    let period = PeriodicBox::new(Vector3::repeat(4.0)).unwrap();
    let radial = radial_distribution(&particles, &period, Distance::Centres, 1.9, 19);
    let shells: Vec<u64> = radial.pairs.iter().copied().filter(|&n| n > 0).collect();
    assert_eq!(shells, [64 * 3, 64 * 6, 64 * 4]);
    // Q6 of the cubic lattice is .3536.
    assert!((bond_order(&particles, &period, 1.2).global - 0.125_f64.sqrt()).abs() < 1e-3);
}

/// Packed spheres are not crystalline: their bonds have no order of degree 6.
#[test]
fn packings_are_disordered_and_isotropic() {
    let packing = packed(&sphere(), 1000, 0.3, 0.6, 3);
    let order = bond_order(packing.particles(), packing.period(), 1.2);
    assert!(order.bonds > 2000);
    // For independent bonds one packing in a million exceeds 2.05 / √bonds (χ² of 13 degrees of freedom above 54.6).
    // Bonds of one particle exclude each other, so Q6 varies more, and the bound is wider.
    assert!(order.global < 3.0 / (order.bonds as f64).sqrt(), "{order:?}");
    let rods = [UnitBody::new(&Body::cuboid([1.0, 1.0, 4.0]).unwrap())];
    let packing = packed(&rods, 300, 0.2, 0.25, 3);
    let tensor = orientation_tensor(packing.particles(), &Vector3::z()).unwrap();
    // χ² of 5 degrees of freedom exceeds this once in a million.
    assert!(tensor.bingham < 35.9, "{tensor:?}");
    let aligned: Vec<Particle> = packing
        .particles()
        .iter()
        .map(|p| Particle {
            orientation: UnitQuaternion::identity(),
            ..*p
        })
        .collect();
    let tensor = orientation_tensor(&aligned, &Vector3::z()).unwrap();
    assert!(tensor.bingham > 1000.0 && (tensor.eigenvalues[2] - 1.0).abs() < 1e-12);
}

/// N_A = H N_V on planes through a packing of spheres and of rocks.
#[test]
fn sections_represent_the_packing() {
    for bodies in [sphere(), [UnitBody::new(&Body::rock(2))]] {
        let packing = packed(&bodies, 400, 0.3, 0.45, 4);
        let test = section_test(&packing, 8, 99, 0);
        // Packed particles exclude each other, so their counts vary less than those of random arrangements, of which 2
        // % would fail here.
        assert!(test.p_value > 0.02, "{test:?}");
        let widths: f64 = packing
            .particles()
            .iter()
            .map(|p| bodies[0].mean_width() * p.size)
            .sum();
        let expected = widths / packing.period().volume();
        assert!(
            (test.expected_per_area / expected - 1.0).abs() < 0.01,
            "{test:?} {expected}"
        );
        assert!(
            (test.profiles_per_area / expected - 1.0).abs() < 0.05,
            "{test:?} {expected}"
        );
    }
}

/// Every statistic has its theoretical distribution for independent particles.
///
/// A hundred arrangements of 500: means of Bingham's statistic (χ² of 5 degrees) and of bonds × Q6² × 13 (nearly χ² of
/// 13, because bonds that share a particle are independent) lie within 4.9 of their standard deviations; each of twenty
/// bins of g(r) within 5.4 of those of Poisson counts (a false-alarm rate of at most 10⁻⁶ over twenty bins).
#[test]
fn statistics_of_independent_particles_are_calibrated() {
    let period = PeriodicBox::new(Vector3::new(9.0, 8.0, 7.0)).unwrap();
    let grains = mix(&[1.0; 500], &[1.0], 0).unwrap();
    let (mut bingham, mut order, mut pairs, mut expected) = (0.0, 0.0, vec![0_u64; 20], vec![0.0; 20]);
    for seed in 0..100 {
        let particles = populate(&grains, &period, seed);
        bingham += orientation_tensor(&particles, &Vector3::y()).unwrap().bingham / 100.0;
        let bonds = bond_order(&particles, &period, 0.6);
        order += bonds.bonds as f64 * bonds.global.powi(2) / 100.0;
        let radial = radial_distribution(&particles, &period, Distance::Centres, 2.0, 20);
        for bin in 0..20 {
            pairs[bin] += radial.pairs[bin];
            expected[bin] += radial.pairs[bin] as f64 / radial.g[bin].max(1e-9);
        }
    }
    assert!((bingham - 5.0).abs() < 4.9 * (10.0_f64 / 100.0).sqrt(), "{bingham}");
    assert!((order - 1.0).abs() < 4.9 * (2.0_f64 / 13.0 / 100.0).sqrt(), "{order}");
    for (bin, (pairs, expected)) in pairs.iter().zip(expected).enumerate().skip(1) {
        let deviation = (*pairs as f64 - expected) / expected.sqrt();
        assert!(deviation.abs() < 5.4, "{bin}: {pairs} {expected}");
    }
}

/// For dilute particles, which are independent, p is .1 or less in one of ten packings: of 200, fewer than 3 or more
/// than 44 once in a million. Planes with the spacing of a lattice cut every sphere at the same height, and the test
/// detects it.
#[test]
fn the_section_test_is_calibrated_and_detects_layers() {
    let bodies = sphere();
    let grains = mix(&lognormal_sizes(120, 0.3, 1).unwrap(), &[1.0], 1).unwrap();
    let period = box_for_fraction(&bodies, &grains, 0.002).unwrap();
    let low = (0..200)
        .filter(|seed| {
            let packing = pack(
                &Arrangement::new(&bodies[..], populate(&grains, &period, *seed), period).unwrap(),
                &PackOptions::default(),
                &|_| ControlFlow::Continue(()),
            );
            section_test(&packing.unwrap(), 20, 19, *seed).p_value < 0.101
        })
        .count();
    assert!((3..=44).contains(&low), "{low}");
    let lattice = (0..216).map(|k| Particle {
        shape: 0,
        size: 1.0,
        category: 0,
        position: Point3::new(f64::from(k % 6), f64::from(k / 6 % 6), f64::from(k / 36)),
        orientation: UnitQuaternion::identity(),
    });
    let crystal = Packing::verify(
        &Arrangement::new(
            &bodies[..],
            lattice.collect::<Vec<_>>(),
            PeriodicBox::new(Vector3::repeat(6.0)).unwrap(),
        )
        .unwrap(),
    )
    .unwrap();
    assert!((section_test(&crystal, 6, 99, 0).p_value - 0.01).abs() < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// On planes through equal spheres N_A = D N_V, whatever their positions.
    #[test]
    fn sections_of_spheres_obey_the_fundamental_relation(diameter in 0.1..10.0_f64, fraction in 0.1..0.55_f64, seed in 0_u64..1000) {
        let bodies = sphere();
        let grains = mix(&[diameter; 300], &[1.0], seed).unwrap();
        let period = box_for_fraction(&bodies, &grains, fraction).unwrap();
        let packing = pack(&Arrangement::new(&bodies[..], populate(&grains, &period, seed), period).unwrap(), &PackOptions::default(), &|_| ControlFlow::Continue(())).unwrap();
        let test = section_test(&packing, 10, 2, seed);
        let expected = diameter * 300.0 / period.volume();
        let profiles: f64 = test.profiles.iter().sum();
        // The spacing of planes is less than a diameter, so counts vary far less than Poisson counts: 4.9 standard
        // deviations give a false-alarm rate below 10⁻⁶.
        prop_assert!((test.profiles_per_area / expected - 1.0).abs() < 4.9 / profiles.sqrt());
    }

    /// Statistics do not depend on the origin of the box.
    #[test]
    fn a_translation_leaves_the_statistics(shift in prop::array::uniform3(-9.0..9.0_f64), seed in 0_u64..100) {
        let period = PeriodicBox::new(Vector3::new(3.0, 5.0, 4.0)).unwrap();
        let grains = mix(&lognormal_sizes(80, 0.3, seed).unwrap(), &[1.0], seed).unwrap();
        let here = populate(&grains, &period, seed);
        let there: Vec<Particle> = here.iter().map(|p| Particle { position: p.position + Vector3::from(shift), ..*p }).collect();
        let g = |particles: &[Particle]| radial_distribution(particles, &period, Distance::Contacts, 3.0, 7).pairs;
        prop_assert_eq!(g(&here), g(&there));
        let order = [&here, &there].map(|particles| bond_order(particles, &period, 1.3));
        prop_assert_eq!(order[0].bonds, order[1].bonds);
        prop_assert!((order[0].global - order[1].global).abs() < 1e-9);
    }
}
