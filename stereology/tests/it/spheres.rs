//! Analytic spheres through the composed rooms.

use std::ops::ControlFlow;

use nalgebra::Vector3;
use proptest::prelude::*;
use stereology::anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate};
use stereology::kmatrix::Sizes;
use stereology::pipeline::{DensityOptions, Extent, MeasuredProfiles, ParticleTypes, population, unfold_profiles};
use stereology::shape::Arrangement;
use stereology::unfold::{Method, ProfileCounts, UnfoldOptions, equal_edges, unfold};
use stereology::volume::{Axis, Solid};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Spheres packed, cut, and unfolded give their own number density: N_A = D N_V. With some thousand profiles of a
    /// packing, whose counts vary less than Poisson's, 15 % is more than five standard errors.
    #[test]
    fn packed_spheres_are_counted_from_their_sections(seed in 0_u64..1000, fraction in 0.1..0.45_f64) {
        let types = ParticleTypes::parse(&["sphere"]).unwrap();
        let bodies = types.unit_bodies();
        let grains = mix(&lognormal_sizes(600, 0.25, seed).unwrap(), &[1.0], seed).unwrap();
        let period = box_for_fraction(&bodies, &grains, fraction).unwrap();
        let packing = pack(&Arrangement::new(bodies, populate(&grains, &period, seed), period).unwrap(), &PackOptions::default(), &|_| ControlFlow::Continue(())).unwrap();
        let number_density = 600.0 / period.volume();
        let solid = Solid::new(packing.arrangement().clone(), vec![[0.5; 3]; 600], [0.2; 3], None).unwrap();
        let side = period.sides().x;
        let planes = 12;
        let sizes: Vec<f64> = [Axis::X, Axis::Y, Axis::Z]
            .into_iter()
            .flat_map(|axis| (0..planes).map(move |i| (axis, (f64::from(i) + 0.5) / f64::from(planes) * side)))
            .flat_map(|(axis, depth)| solid.section_profiles(axis, depth))
            .map(|(_, area)| (4.0 * area / std::f64::consts::PI).sqrt())
            .collect();
        let count = sizes.len();
        let profiles = MeasuredProfiles {
            weights: vec![1.0; count],
            categories: vec![0; count],
            area: 3.0 * f64::from(planes) * side * side,
            sizes,
            ..MeasuredProfiles::default()
        };
        let found = unfold_profiles(&profiles, &types, &DensityOptions::default(), &|_| ControlFlow::Continue(())).unwrap();
        prop_assert!((found.all.total.value / number_density - 1.0).abs() < 0.15, "{} {number_density}", found.all.total.value);
        prop_assert!((found.all.volume_fraction.value / fraction - 1.0).abs() < 0.15, "{} {fraction}", found.all.volume_fraction.value);
    }

    /// Exact counts of ellipsoids unfold to their densities, by least squares and by the paper's inverse.
    #[test]
    fn exact_counts_of_ellipsoids_give_exact_densities(
        truth in prop::collection::vec(0.05..1.0_f64, 2..8),
        middle in 0.5..1.0_f64,
        least in 0.4..1.0_f64,
    ) {
        let types = ParticleTypes::parse(&[&format!("ellipsoid:1,{middle},{}", least * middle)]).unwrap();
        let edges = equal_edges(1.0, truth.len());
        for sizes in [Sizes::UpperEdge, Sizes::Integrated] {
            let kernel = types.kernel(&edges, &edges, sizes).unwrap();
            let counts = kernel.matrix() * nalgebra::DVector::from_column_slice(&truth) * 1e4;
            let counts = ProfileCounts::from_counts(counts.as_slice(), &edges, 1e4).unwrap();
            for method in [Method::Paper, Method::Nnls] {
                let found = unfold(&counts, &kernel, &UnfoldOptions::default().with_method(method)).unwrap();
                for (found, truth) in found.number_density.iter().zip(&truth) {
                    prop_assert!((found.unwrap() - truth).abs() < 1e-6, "{found:?} not {truth}");
                }
            }
        }
    }

    /// Whatever the bins, method and threshold, the particles drawn fill the box to the fraction asked for, exactly.
    #[test]
    fn a_population_fills_its_fraction(
        sizes in prop::collection::vec(2.0..30.0_f64, 50..200),
        fraction in 0.05..0.5_f64,
        upper in any::<bool>(),
        min_size in 0.0..8.0_f64,
    ) {
        let types = ParticleTypes::parse(&["sphere", "box:1,1,2"]).unwrap();
        let count = sizes.len();
        let categories = (0..count).map(|i| (i % 3) as u8).collect();
        let profiles = MeasuredProfiles { weights: vec![1.0; count], categories, area: 500.0 * 500.0, min_size, sizes, ..MeasuredProfiles::default() };
        let options = DensityOptions {
            sizes: if upper { Sizes::UpperEdge } else { Sizes::Integrated },
            unfold: UnfoldOptions::default().with_method(Method::Nnls),
            ..DensityOptions::default()
        };
        let found = unfold_profiles(&profiles, &types, &options, &|_| ControlFlow::Continue(())).unwrap();
        let drawn = population(&found, &types, fraction, Extent::Count(800), 20.0, 1).unwrap();
        let volume: f64 = drawn.grains.iter().map(|grain| types.unit_bodies()[grain.shape].volume() * grain.size.powi(3)).sum();
        prop_assert!((volume / drawn.period.volume() - fraction).abs() < 1e-9);
        prop_assert!((drawn.period.sides() / 20.0 - (drawn.period.sides() / 20.0).map(f64::round)).norm() < 1e-9);
        prop_assert_eq!(drawn.period.sides(), Vector3::repeat(drawn.period.sides().x));
    }
}

/// The largest section of a mesh is hardly ever met, and still the largest profile, whose size is taken for it, is
/// explained.
#[test]
fn largest_profiles_of_meshes_are_explained() {
    let types = ParticleTypes::parse(&["rock:1", "box:1,1,2"]).unwrap();
    let count = 300;
    let sizes: Vec<f64> = (0..count)
        .map(|i| 3.0 + 20.0 * f64::from(i) / f64::from(count))
        .collect();
    let profiles = MeasuredProfiles {
        weights: vec![1.0; sizes.len()],
        categories: vec![0; sizes.len()],
        area: 1e5,
        sizes,
        ..MeasuredProfiles::default()
    };
    for bins in [5, 16, 60] {
        let options = DensityOptions {
            bins,
            ..DensityOptions::default()
        };
        let found = unfold_profiles(&profiles, &types, &options, &|_| ControlFlow::Continue(())).unwrap();
        assert!(found.all.total.value > 0.0);
    }
}
