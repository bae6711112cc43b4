//! How well found labels match true ones: average precision, area, count, sizes.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use ndarray::Array2;

/// Pixels from which a profile counts, in truth and prediction.
const LEAST: usize = 20;

/// Scores of a label map against the truth.
pub struct Scores {
    /// TP / (TP + FP + FN) where a pair overlaps by at least half of its union.
    pub ap50: f64,
    /// The same at three quarters.
    pub ap75: f64,
    /// Area found over true area, − 1.
    pub area: f64,
    /// Profiles found over true ones, − 1.
    pub count: f64,
    /// Kolmogorov-Smirnov distance of the sizes.
    pub sizes: f64,
}

/// Compares labels, 0 the binder; profiles of fewer than 20 pixels are left out of both.
pub fn score(truth: &Array2<u32>, found: &Array2<u32>) -> Result<Scores> {
    ensure!(
        truth.dim() == found.dim(),
        "label maps of {:?} and {:?} pixels",
        truth.dim(),
        found.dim()
    );
    let (truth_areas, found_areas) = (areas(truth), areas(found));
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
    let precision = |least: f64| {
        let (mut truths, mut founds) = (Vec::new(), Vec::new());
        for &(_, t, f) in overlaps.iter().filter(|o| o.0 >= least) {
            if !truths.contains(&t) && !founds.contains(&f) {
                truths.push(t);
                founds.push(f);
            }
        }
        truths.len() as f64 / (truth_areas.len() + found_areas.len() - truths.len()).max(1) as f64
    };
    let total = |areas: &BTreeMap<u32, usize>| areas.values().sum::<usize>() as f64;
    Ok(Scores {
        ap50: precision(0.5),
        ap75: precision(0.75),
        area: total(&found_areas) / total(&truth_areas) - 1.0,
        count: found_areas.len() as f64 / truth_areas.len() as f64 - 1.0,
        sizes: distance(&truth_areas, &found_areas),
    })
}

fn areas(labels: &Array2<u32>) -> BTreeMap<u32, usize> {
    let mut areas = BTreeMap::new();
    labels
        .iter()
        .filter(|l| **l != 0)
        .for_each(|l| *areas.entry(*l).or_default() += 1);
    areas.retain(|_, area| *area >= LEAST);
    areas
}

/// Largest difference of the cumulative shares; areas order as sizes do.
fn distance(a: &BTreeMap<u32, usize>, b: &BTreeMap<u32, usize>) -> f64 {
    let sorted = |m: &BTreeMap<u32, usize>| {
        let mut v: Vec<usize> = m.values().copied().collect();
        v.sort_unstable();
        v
    };
    let (a, b) = (sorted(a), sorted(b));
    let share = |v: &[usize], x: usize| v.partition_point(|&w| w <= x) as f64 / v.len().max(1) as f64;
    a.iter()
        .chain(&b)
        .map(|&x| (share(&a, x) - share(&b, x)).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Itself: perfect. One of two profiles missing: half.
    #[test]
    fn perfect_and_half() {
        let truth = Array2::from_shape_fn((10, 20), |(_, x)| if x % 10 < 5 { 1 + x as u32 / 10 } else { 0 });
        let same = score(&truth, &truth).unwrap();
        assert!(same.ap75 == 1.0 && same.area == 0.0 && same.count == 0.0 && same.sizes == 0.0);
        let half = score(&truth, &truth.mapv(|l| l % 2)).unwrap();
        assert!(half.ap50 == 0.5 && half.area == -0.5 && half.count == -0.5);
    }
}
