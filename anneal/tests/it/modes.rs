//! Laws that all modes of packing obey.

use nalgebra::Vector3;
use proptest::prelude::*;
use std::ops::ControlFlow;
use stereology_anneal::{
    Mode, PackError, PackOptions, Packing, box_for_fraction, lognormal_sizes, mix, pack, populate,
};
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};

const MODES: [Mode; 4] = [Mode::fast(), Mode::paper(), Mode::anneal(), Mode::sequential()];

/// The mode with a limit of 3,000.
fn short(mode: Mode) -> Mode {
    let (iterations, swelling) = (3000, None);
    match mode {
        Mode::Paper { .. } => Mode::Paper { iterations, swelling },
        Mode::Anneal { .. } => Mode::Anneal { iterations, swelling },
        Mode::Sequential { .. } => Mode::Sequential { tries: iterations },
        _ => Mode::Fast { iterations, swelling },
    }
}

fn packed(bodies: &[UnitBody], count: usize, fraction: f64, options: &PackOptions) -> Result<Packing, PackError> {
    let grains = mix(&lognormal_sizes(count, 0.3, 5).unwrap(), &vec![1.0; bodies.len()], 5).unwrap();
    let period = box_for_fraction(bodies, &grains, fraction).unwrap();
    pack(
        &Arrangement::new(bodies, populate(&grains, &period, 5), period).unwrap(),
        options,
        &|_| ControlFlow::Continue(()),
    )
}

fn mixture() -> Vec<UnitBody> {
    [
        Body::sphere(1.0).unwrap(),
        Body::ellipsoid([1.5, 1.0, 0.8]).unwrap(),
        Body::rock(1),
    ]
    .iter()
    .map(UnitBody::new)
    .collect()
}

/// Every mode certifies the same fraction.
#[test]
fn every_mode_packs() {
    for mode in MODES {
        let packing = packed(&mixture(), 60, 0.2, &PackOptions::default().with_mode(mode)).unwrap();
        assert!((packing.fraction() - 0.2).abs() < 1e-9, "{mode:?}");
        assert!(packing.iterations() > 0);
    }
}

#[test]
fn annealing_packs_densely_and_reports_its_energies() {
    let spheres = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let packing = packed(&spheres, 300, 0.6, &PackOptions::default().with_mode(Mode::anneal())).unwrap();
    let energies = packing.energies();
    assert!(energies.len() > 20 && energies[10] > energies[energies.len() - 1]);
}

#[test]
fn every_mode_can_be_cancelled() {
    let spheres = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let grains = mix(&[1.0; 50], &[1.0], 0).unwrap();
    let period = box_for_fraction(&spheres, &grains, 0.3).unwrap();
    for mode in MODES {
        let options = PackOptions::default().with_mode(mode);
        let result = pack(
            &Arrangement::new(&spheres[..], populate(&grains, &period, 0), period).unwrap(),
            &options,
            &|_| ControlFlow::Break(()),
        );
        assert!(matches!(result, Err(PackError::Cancelled)), "{mode:?}");
    }
}

#[test]
fn threads_change_no_bit_in_any_mode() {
    let run = |threads: usize, mode: Mode| -> Vec<Particle> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = PackOptions::default().with_mode(mode);
        pool.install(|| packed(&mixture(), 100, 0.2, &options).unwrap().particles().to_vec())
    };
    for mode in MODES {
        assert_eq!(run(1, mode), run(2, mode), "{mode:?}");
    }
}

/// The number of particles is large enough for several threads: spheres, rocks with ellipsoids, and bodies moved as
/// convex parts.
#[test]
fn threads_change_no_bit_of_any_shape() {
    let kinds: [(Vec<UnitBody>, usize, f64); 3] = [
        (mixture()[..1].to_vec(), 2100, 0.3),
        (mixture(), 600, 0.25),
        (vec![crate::hollow::bracket()], 520, 0.15),
    ];
    let run = |threads: usize, mode: Mode, (bodies, count, fraction): &(Vec<UnitBody>, usize, f64)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = PackOptions::default().with_mode(mode);
        pool.install(|| {
            packed(bodies, *count, *fraction, &options)
                .unwrap()
                .particles()
                .to_vec()
        })
    };
    for kind in &kinds {
        for mode in [Mode::fast(), Mode::paper()] {
            assert_eq!(run(1, mode, kind), run(2, mode, kind), "{mode:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Few large particles in boxes of any proportions: fewer than three cells per axis, particles larger than half the
    /// box, overlaps with their own images.
    #[test]
    fn narrow_boxes_are_packed(sides in prop::array::uniform3(1.1..4.0_f64), count in 1_usize..6, mode in 0_usize..4, seed in 0_u64..1000) {
        let rods = [UnitBody::new(&Body::cuboid([0.3, 0.3, 1.2]).unwrap()), UnitBody::new(&Body::sphere(1.0).unwrap())];
        let period = PeriodicBox::new(Vector3::from(sides)).unwrap();
        let grains = mix(&vec![1.0; count], &[0.7, 0.3], seed).unwrap();
        let options = PackOptions::default().with_mode(short(MODES[mode]));
        let start = populate(&grains, &period, seed);
        match pack(&Arrangement::new(&rods[..], start, period).unwrap(), &options, &|_| ControlFlow::Continue(())) {
            Ok(packing) => {
                let spheres: Vec<Particle> = packing.particles().iter().filter(|p| p.shape == 1).copied().collect();
                if !spheres.is_empty() {
                    prop_assert!(crate::brute_force::sphere_overlaps(&spheres, &period).iter().all(|o| o.2 < 1e-9));
                }
            }
            // The box may be too small.
            Err(PackError::Unresolved(_) | PackError::Jammed(_) | PackError::TooDense { .. }) => {}
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        }
    }
}
