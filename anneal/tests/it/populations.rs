//! Populations have the requested sizes, shapes and fractions.

use nalgebra::Vector3;
use proptest::prelude::*;
use stereology_anneal::{
    Grain, PopulationError, SizeDensities, SizeInBin, box_for_fraction, count_to_fill, counts_from_densities,
    grains_from_densities, lognormal_sizes, mix, populate, scale_to_fraction, total_volume,
};
use stereology_shape::{Body, PeriodicBox, UnitBody};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The volume fraction is the requested one, whether the box or the sizes are adjusted.
    #[test]
    fn fractions_are_exact(count in 1_usize..500, sigma in 0.0..1.0_f64, fraction in 0.01..0.7_f64, seed in 0_u64..100) {
        let bodies = [UnitBody::new(&Body::sphere(3.0).unwrap()), UnitBody::new(&Body::cuboid([1.0, 2.0, 3.0]).unwrap())];
        let mut grains = mix(&lognormal_sizes(count, sigma, seed).unwrap(), &[2.0, 1.0], seed).unwrap();
        let period = box_for_fraction(&bodies, &grains, fraction).unwrap();
        prop_assert!((total_volume(&bodies, &grains).unwrap() / period.volume() - fraction).abs() < 1e-12);
        prop_assert_eq!(count_to_fill(&bodies, &grains, &period, fraction).unwrap(), count);
        let other = PeriodicBox::new(Vector3::new(1.0, 2.0, 3.0)).unwrap();
        scale_to_fraction(&bodies, &mut grains, &other, fraction).unwrap();
        prop_assert!((total_volume(&bodies, &grains).unwrap() / 6.0 - fraction).abs() < 1e-12);
    }

    /// Rounding from the largest bin down: the number above any size differs from its expectation by at most a half.
    #[test]
    fn cumulative_counts_are_rounded(densities in prop::collection::vec(0.0..3.0_f64, 1..30), volume in 0.1..50.0_f64) {
        let counts = counts_from_densities(&densities, volume).unwrap();
        for bin in 0..counts.len() {
            let expected = densities[bin..].iter().sum::<f64>() * volume;
            let given = counts[bin..].iter().sum::<usize>() as f64;
            prop_assert!((expected - given).abs() <= 0.5 + 1e-9);
        }
    }

    /// Sizes lie in their bins; shapes and categories are kept.
    #[test]
    fn grains_lie_in_their_bins(densities in prop::collection::vec(0.0..3.0_f64, 1..10), seed in 0_u64..100) {
        let edges: Vec<f64> = (0..=densities.len()).map(|i| i as f64).collect();
        let of = [
            SizeDensities { shape: 1, category: 3, edges: &edges, number_density: &densities },
            SizeDensities { shape: 0, category: 2, edges: &edges, number_density: &densities },
        ];
        let counts = counts_from_densities(&densities, 20.0).unwrap();
        for size_in_bin in [SizeInBin::Spread, SizeInBin::UpperEdge] {
            let grains = grains_from_densities(&of, 20.0, size_in_bin, seed).unwrap();
            for kind in of {
                for (bin, count) in counts.iter().enumerate() {
                    let inside = |g: &&Grain| {
                        g.shape == kind.shape && g.category == kind.category && g.size > edges[bin] && g.size <= edges[bin + 1]
                    };
                    prop_assert_eq!(grains.iter().filter(inside).count(), *count);
                }
            }
        }
    }

    /// Number fractions of shapes are as exact as whole particles allow.
    #[test]
    fn shares_are_exact(count in 0_usize..300, shares in prop::collection::vec(0.0..1.0_f64, 1..5), seed in 0_u64..100) {
        let whole: f64 = shares.iter().sum();
        prop_assume!(whole > 0.1);
        let grains = mix(&vec![1.0; count], &shares, seed).unwrap();
        for (shape, share) in shares.iter().enumerate() {
            let given = grains.iter().filter(|g| g.shape == shape).count() as f64;
            prop_assert!((given - share / whole * count as f64).abs() < 1.0);
        }
    }
}

/// Positions are uniform: χ² of 8 octants over 80,000 grains; false-alarm rate 10⁻⁶ (χ²₇ > 40.5).
#[test]
fn positions_are_uniform() {
    let period = PeriodicBox::new(Vector3::new(1.0, 2.0, 3.0)).unwrap();
    let particles = populate(
        &[Grain {
            shape: 0,
            size: 0.1,
            category: 0,
        }; 80_000],
        &period,
        1,
    );
    let mut octants = [0.0; 8];
    for particle in particles {
        let half = particle
            .position
            .coords
            .component_div(&period.sides())
            .map(|x| usize::from(x >= 0.5));
        octants[half.x + 2 * half.y + 4 * half.z] += 1.0;
    }
    let chi_square: f64 = octants.iter().map(|n: &f64| (n - 10_000.0).powi(2) / 10_000.0).sum();
    assert!(chi_square < 40.5, "{octants:?}");
}

#[test]
fn impossible_populations_are_refused() {
    assert!(matches!(
        lognormal_sizes(3, f64::NAN, 0),
        Err(PopulationError::Sigma(_))
    ));
    assert!(matches!(
        mix(&[1.0, -1.0], &[1.0], 0),
        Err(PopulationError::Size { index: 1, .. })
    ));
    assert!(matches!(mix(&[1.0], &[0.0], 0), Err(PopulationError::Share { .. })));
    assert!(matches!(mix(&[1.0], &[], 0), Err(PopulationError::Share { .. })));
    let ball = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let grain = Grain {
        shape: 0,
        size: 1.0,
        category: 0,
    };
    assert!(matches!(
        box_for_fraction(&ball, &[grain], 1.0),
        Err(PopulationError::Fraction(_))
    ));
    assert!(matches!(
        box_for_fraction(&ball, &[], 0.5),
        Err(PopulationError::Nothing)
    ));
    assert!(matches!(
        box_for_fraction(&ball, &[Grain { shape: 1, ..grain }], 0.5),
        Err(PopulationError::Nothing)
    ));
    assert!(matches!(
        counts_from_densities(&[1e9], 1.0),
        Err(PopulationError::TooMany(_))
    ));
    assert!(matches!(
        counts_from_densities(&[1.0], -1.0),
        Err(PopulationError::Volume(_))
    ));
    let wrong = SizeDensities {
        shape: 0,
        category: 0,
        edges: &[0.0, 2.0, 1.0],
        number_density: &[1.0, 1.0],
    };
    assert!(matches!(
        grains_from_densities(&[wrong], 1.0, SizeInBin::Spread, 0),
        Err(PopulationError::Histogram { .. })
    ));
}
