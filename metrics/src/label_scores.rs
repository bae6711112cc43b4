//! How well found labels match the true ones: average precision, area, count, sizes.

use std::collections::{BTreeMap, BTreeSet};

use ndarray::ArrayView2;

/// Smallest profile that counts, in truth and result, pixels.
const SMALLEST: usize = 20;

/// Scores of a label map against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelScores {
    /// Average precision at an intersection over union of at least one half: TP / (TP + FP + FN).
    pub ap50: f64,
    /// The same at three quarters.
    pub ap75: f64,
    /// Found area over true area, − 1.
    pub area: f64,
    /// Number of found profiles over that of true ones, − 1.
    pub count: f64,
    /// Kolmogorov-Smirnov distance of the sizes.
    pub sizes: f64,
}

/// Two label maps have different sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the true labels have {truth:?} pixels (rows, columns), the found ones {found:?}")]
pub struct LabelMapsDiffer {
    /// Rows and columns of the truth.
    pub truth: (usize, usize),
    /// Rows and columns of the found labels.
    pub found: (usize, usize),
}

/// Compares two label maps in which 0 is the binder; profiles of fewer than 20 pixels are left out of both.
///
/// Pairs of a true and a found profile are matched in the order of their intersection over union, the largest first.
/// Cost: linear in the pixels.
///
/// # Errors
///
/// [`LabelMapsDiffer`] if the maps have different sizes.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::label_scores;
///
/// let truth = Array2::from_shape_fn((10, 20), |(_, x)| if x % 10 < 5 { 1 + x as u32 / 10 } else { 0 });
/// let found = truth.mapv(|label| if label == 1 { 7 } else { 0 }); // one of two profiles
/// let scores = label_scores(truth.view(), found.view())?;
/// assert_eq!((scores.ap50, scores.area, scores.count), (0.5, -0.5, -0.5));
/// # Ok::<(), stereology_metrics::LabelMapsDiffer>(())
/// ```
pub fn label_scores(truth: ArrayView2<'_, u32>, found: ArrayView2<'_, u32>) -> Result<LabelScores, LabelMapsDiffer> {
    if truth.dim() != found.dim() {
        return Err(LabelMapsDiffer {
            truth: truth.dim(),
            found: found.dim(),
        });
    }
    let (truth_areas, found_areas) = (areas(truth), areas(found));
    let overlaps = overlaps(truth, found, &truth_areas, &found_areas);
    let precision = |least: f64| {
        let (mut truths, mut founds) = (BTreeSet::new(), BTreeSet::new());
        for &(_, t, f) in overlaps.iter().filter(|o| o.0 >= least) {
            if !truths.contains(&t) && !founds.contains(&f) {
                truths.insert(t);
                founds.insert(f);
            }
        }
        truths.len() as f64 / (truth_areas.len() + found_areas.len() - truths.len()).max(1) as f64
    };
    let total = |areas: &BTreeMap<u32, usize>| areas.values().sum::<usize>() as f64;
    Ok(LabelScores {
        ap50: precision(0.5),
        ap75: precision(0.75),
        area: total(&found_areas) / total(&truth_areas) - 1.0,
        count: found_areas.len() as f64 / truth_areas.len() as f64 - 1.0,
        sizes: kolmogorov_smirnov(&truth_areas, &found_areas),
    })
}

/// Intersection over union of all pairs of a true and a found profile that share pixels, largest first.
fn overlaps(
    truth: ArrayView2<'_, u32>,
    found: ArrayView2<'_, u32>,
    truth_areas: &BTreeMap<u32, usize>,
    found_areas: &BTreeMap<u32, usize>,
) -> Vec<(f64, u32, u32)> {
    let mut shared: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (&t, &f) in truth.iter().zip(found) {
        if truth_areas.contains_key(&t) && found_areas.contains_key(&f) {
            *shared.entry((t, f)).or_default() += 1;
        }
    }
    let mut overlaps: Vec<(f64, u32, u32)> = shared
        .iter()
        .map(|(&(t, f), &both)| (both as f64 / (truth_areas[&t] + found_areas[&f] - both) as f64, t, f))
        .collect();
    overlaps.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    overlaps
}

fn areas(labels: ArrayView2<'_, u32>) -> BTreeMap<u32, usize> {
    let mut areas = BTreeMap::new();
    labels
        .iter()
        .filter(|l| **l != 0)
        .for_each(|l| *areas.entry(*l).or_default() += 1);
    areas.retain(|_, area| *area >= SMALLEST);
    areas
}

/// Largest difference of the cumulative distributions; areas are in the order of sizes.
fn kolmogorov_smirnov(a: &BTreeMap<u32, usize>, b: &BTreeMap<u32, usize>) -> f64 {
    let sorted = |m: &BTreeMap<u32, usize>| {
        let mut v: Vec<usize> = m.values().copied().collect();
        v.sort_unstable();
        v
    };
    let (a, b) = (sorted(a), sorted(b));
    let fraction = |v: &[usize], x: usize| v.partition_point(|&w| w <= x) as f64 / v.len().max(1) as f64;
    a.iter()
        .chain(&b)
        .map(|&x| (fraction(&a, x) - fraction(&b, x)).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "fractions of small whole numbers")]
mod tests {
    use super::label_scores;
    use ndarray::Array2;
    use proptest::prelude::*;

    proptest! {
        /// Labels that differ from the truth by their numbers alone are perfect.
        #[test]
        fn numbers_do_not_count(cells in prop::collection::vec(0_u32..6, 24)) {
            let truth = Array2::from_shape_fn((24, 36), |(y, x)| cells[y / 6 * 6 + x / 6]);
            prop_assume!(truth.iter().any(|label| *label != 0));
            let scores = label_scores(truth.view(), truth.mapv(|label| label * 1000).view()).unwrap();
            prop_assert_eq!([scores.ap50, scores.ap75, scores.area, scores.count, scores.sizes], [1.0, 1.0, 0.0, 0.0, 0.0]);
        }
    }

    /// A profile found three fifths as large has an intersection over union of .6: right at one half, wrong at three
    /// quarters.
    #[test]
    fn precision_depends_on_the_overlap_demanded() {
        let truth = Array2::from_shape_fn((10, 20), |(_, x)| u32::from(x < 10));
        let found = Array2::from_shape_fn((10, 20), |(_, x)| u32::from(x < 6));
        let scores = label_scores(truth.view(), found.view()).unwrap();
        assert_eq!([scores.ap50, scores.ap75, scores.sizes], [1.0, 0.0, 1.0]);
        assert!((scores.area + 0.4).abs() < 1e-12);
        assert!(label_scores(truth.view(), Array2::zeros((10, 21)).view()).is_err());
    }
}
