use proptest::prelude::*;
use stereology_pyramid::{MatchError, Quantiles, match_histogram, match_histogram_table};

fn values(n: std::ops::Range<usize>) -> impl Strategy<Value = Vec<f32>> {
    prop::collection::vec(-100.0_f32..100.0, n)
}

proptest! {
    /// With as many values as the reference, matching permutes the reference and keeps the order of the values; a
    /// second matching changes nothing.
    #[test]
    fn matching_is_exact_and_idempotent(before in values(1..200), seed in 0_u64..1000) {
        let reference: Vec<f32> = (0..before.len()).map(|i| ((i as u64 * 7919 + seed) % 613) as f32).collect();
        let quantiles = Quantiles::new(reference).unwrap();
        let mut matched = before.clone();
        match_histogram(&mut matched, &quantiles).unwrap();
        let mut sorted = matched.clone();
        sorted.sort_by(f32::total_cmp);
        prop_assert_eq!(sorted.as_slice(), quantiles.sorted());
        for i in 0..before.len() {
            for j in 0..i {
                prop_assert!((before[i] < before[j]) <= (matched[i] <= matched[j]));
            }
        }
        let once = matched.clone();
        match_histogram(&mut matched, &quantiles).unwrap();
        prop_assert_eq!(once, matched);
    }

    /// The table gives the exact result within the width of a bin.
    #[test]
    fn the_table_is_close_to_the_exact_result(before in values(500..900), reference in values(300..600)) {
        let quantiles = Quantiles::new(reference).unwrap();
        let (mut exact, mut table) = (before.clone(), before);
        match_histogram(&mut exact, &quantiles).unwrap();
        match_histogram_table(&mut table, &quantiles).unwrap();
        let mean = exact.iter().zip(&table).map(|(a, b)| (a - b).abs()).sum::<f32>() / exact.len() as f32;
        prop_assert!(mean < 0.2, "mean difference {mean} of a range of 200");
    }
}

/// Exact matching ranks equal values by position, the table keeps them equal; NaN is refused.
#[test]
fn ties_constants_and_nan() {
    let quantiles = Quantiles::new(vec![1.0, 2.0, 3.0]).unwrap();
    let mut ties = [-0.0, 0.0, 0.0];
    match_histogram(&mut ties, &quantiles).unwrap();
    assert_eq!(ties, [1.0, 2.0, 3.0]);
    let mut ties = [7.0; 3];
    match_histogram_table(&mut ties, &quantiles).unwrap();
    assert_eq!(ties, [2.0; 3]);
    let mut bad = [1.0, f32::NAN];
    assert_eq!(
        match_histogram(&mut bad, &quantiles),
        Err(MatchError::NotFinite { index: 1 })
    );
    assert_eq!(
        match_histogram_table(&mut bad, &quantiles),
        Err(MatchError::NotFinite { index: 1 })
    );
    assert_eq!(Quantiles::new(vec![]), Err(MatchError::Empty));
    assert_eq!(
        Quantiles::new(vec![f32::INFINITY]),
        Err(MatchError::NotFinite { index: 0 })
    );
}
