//! Random designs stay in their ranges and can be written and read.

use proptest::prelude::*;
use stereology_microgeometry::{Design, Direction, Exploration, ReconstructOptions};
use stereology_shape::TriangleMesh;

use crate::on;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Every design is in its ranges, displaces at least one region, and survives the round trip through its file.
    #[test]
    fn designs_stay_in_their_ranges(seed in any::<u32>(), number in 0..1000_u64) {
        let ranges = Exploration { units: [30.0, 50.0], shares: [0.2, 0.4], ..Exploration::default() };
        let design = ranges.design(u64::from(seed), number).unwrap();
        prop_assert!((30.0..=50.0).contains(&design.units));
        prop_assert!((0.2 - 1e-9..=0.4 + 1e-9).contains(&design.contact.positive_share()));
        prop_assert!(design.negative.direction != Direction::Still || design.positive.direction != Direction::Still);
        prop_assert!(design.seed > 0);
        prop_assert_eq!(Design::from_json(&design.to_json()).unwrap(), design.clone());
        let near = ranges.near(&design, 0.1, 5, number).unwrap();
        prop_assert!((near.units / design.units).ln().abs() <= 0.1 + 1e-12);
        prop_assert!(near.contact.earth_movers_distance(&design.contact) < 1.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Only distributions that a surface can have are drawn: densities decrease away from the interface, where they are
    /// the same for both regions.
    #[test]
    fn drawn_distributions_can_be_had(seed in any::<u32>(), number in 0..1000_u64) {
        let of = Exploration::default().design(u64::from(seed), number).unwrap().contact;
        for side in [of.negative(), of.positive()] {
            for pair in side.windows(2) {
                prop_assert!(pair[1] <= pair[0] * (1.0 + 1e-9) + 1e-12, "{side:?}");
            }
        }
        let (one, other) = (of.negative()[0], of.positive()[0]);
        prop_assert!((one / other).ln().abs() < 0.05, "{one} {other}");
    }
}

/// Surfaces can have these distributions: distances measured again follow them.
#[test]
fn drawn_distributions_are_measured_again() {
    let ball = TriangleMesh::icosphere(2.0, 5);
    let mut off: Vec<f64> = (0..6)
        .map(|number| {
            let design = Exploration {
                units: [30.0, 40.0],
                lengths: [1.0, 4.0],
                ..Exploration::default()
            }
            .design(3, number)
            .unwrap();
            let made = on(
                &ball,
                design.units,
                &design.contact,
                &ReconstructOptions::default().with_seed(design.seed),
            );
            assert!(made.emd_labels < 0.1, "{number}: {}", made.emd_labels);
            made.emd_measured.unwrap()
        })
        .collect();
    off.sort_by(f64::total_cmp);
    assert!(off[3] < 0.3 && off[5] < 0.6, "{off:?}");
}

#[test]
fn wrong_ranges_are_refused() {
    for wrong in [[0.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [1.0, f64::INFINITY]] {
        assert!(
            Exploration {
                units: wrong,
                ..Exploration::default()
            }
            .design(0, 0)
            .is_err()
        );
    }
    let design = Exploration::default().design(0, 0).unwrap();
    assert!(Exploration::default().near(&design, -1.0, 0, 0).is_err());
}
