//! Random designs stay in their ranges and can be written and read.

use proptest::prelude::*;
use stereology_microgeometry::{Design, Direction, Exploration};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Every design is in its ranges, moves something, and comes back from its file.
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
