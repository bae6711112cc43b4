//! The histogram of distances in whole numbers: how much of the mesh each interval gets (section 4.3 and figure 9).

use crate::contact::ContactDistribution;
use crate::conversions::whole_weight;

/// Units of weight of a mean triangle, where triangles count by area: small enough that rounding does not matter, large
/// enough for a billion triangles.
pub(crate) const UNIT: i64 = 1 << 20;

/// Weights of the triangles.
pub(crate) fn area_weights(areas: &[f64]) -> Vec<i64> {
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    areas
        .iter()
        // A triangle without area still gets a label.
        .map(|area| whole_weight((area / mean * UNIT as f64).round()).max(1))
        .collect()
}

/// Room in each level of one region; level q holds distances in [q δ, (q+1) δ).
pub(crate) type Levels = Vec<i64>;

/// Levels of the negative and the positive region: the distribution, every bin divided into `parts` levels, in whole
/// numbers that sum to `total` (largest remainders).
pub(crate) fn levels(of: &ContactDistribution, parts: usize, total: i64) -> [Levels; 2] {
    let shares = [fine_shares(of.negative(), parts), fine_shares(of.positive(), parts)];
    let split = shares[0].len();
    let all: Vec<f64> = shares.concat();
    let mut whole = largest_remainders(&all, total);
    let positive = whole.split_off(split);
    [whole, positive]
}

/// Divides every bin into parts whose frequencies follow the slope to its neighbours and sum to the bin's.
fn fine_shares(shares: &[f64], parts: usize) -> Vec<f64> {
    let at = |k: isize| -> Option<f64> { usize::try_from(k).ok().and_then(|k| shares.get(k)).copied() };
    (0..shares.len())
        .flat_map(|k| {
            let (own, k) = (shares[k], k as isize);
            let up = at(k + 1).unwrap_or(0.0) - own;
            let down = at(k - 1).map_or(up, |before| own - before);
            // The gentler slope, none at an extremum, and never so steep that a part would be negative.
            let slope = if up * down <= 0.0 {
                0.0
            } else if up.abs() < down.abs() {
                up
            } else {
                down
            }
            .clamp(-2.0 * own, 2.0 * own);
            (0..parts).map(move |part| {
                let place = (part as f64 + 0.5) / parts as f64 - 0.5;
                (own + slope * place).max(0.0) / parts as f64
            })
        })
        .collect()
}

/// Whole numbers proportional to `shares` that sum to `total`: rounded down, with the remaining units added to the
/// largest remainders (ties: the first).
pub(crate) fn largest_remainders(shares: &[f64], total: i64) -> Vec<i64> {
    let sum: f64 = shares.iter().sum();
    if sum <= 0.0 {
        return vec![0; shares.len()];
    }
    let exact: Vec<f64> = shares.iter().map(|share| share / sum * total as f64).collect();
    let mut whole: Vec<i64> = exact.iter().map(|x| whole_weight(x.floor())).collect();
    let mut missing = total - whole.iter().sum::<i64>();
    let mut order: Vec<usize> = (0..shares.len()).collect();
    let remainder = |i: usize| exact[i] - exact[i].floor();
    order.sort_by(|&a, &b| remainder(b).total_cmp(&remainder(a)).then(a.cmp(&b)));
    // Rounding of the products may leave a few units either way.
    for &i in order.iter().cycle() {
        match missing.signum() {
            1 => whole[i] += 1,
            -1 if whole[i] > 0 => whole[i] -= 1,
            -1 => continue,
            _ => break,
        }
        missing -= missing.signum();
    }
    whole
}

/// Removes `part` from `rest`: the room of one component of the mesh. Proportional to what is left, so that the
/// components together get exactly everything.
pub(crate) fn take_share(rest: &mut [Levels; 2], part: i64) -> [Levels; 2] {
    let split = rest[0].len();
    let left: Vec<f64> = rest.iter().flatten().map(|&room| room as f64).collect();
    let mut taken = largest_remainders(&left, part);
    for (room, taken) in rest.iter_mut().flatten().zip(&mut taken) {
        // Remainders round up by less than one, and rooms are whole.
        *taken = (*taken).min(*room);
        *room -= *taken;
    }
    let positive = taken.split_off(split);
    [taken, positive]
}

#[cfg(test)]
mod tests {
    use super::{fine_shares, largest_remainders, levels, take_share};
    use crate::ContactDistribution;
    use proptest::prelude::*;

    proptest! {
        /// The histogram holds exactly as many labels as there are triangles, whatever the distribution, and the error
        /// of each bin is less than one.
        #[test]
        fn labels_sum_to_triangles(shares in prop::collection::vec(0.0..1.0_f64, 1..40), total in 2..100_000_i64) {
            prop_assume!(shares.iter().sum::<f64>() > 0.0);
            let whole = largest_remainders(&shares, total);
            prop_assert_eq!(whole.iter().sum::<i64>(), total);
            let sum: f64 = shares.iter().sum();
            for (share, whole) in shares.iter().zip(&whole) {
                prop_assert!((share / sum * total as f64 - *whole as f64).abs() < 1.0 + 1e-6);
            }
        }

        /// The parts of a bin sum to the bin.
        #[test]
        fn parts_sum_to_bins(shares in prop::collection::vec(0.0..1.0_f64, 1..20), parts in 1..9_usize) {
            let fine = fine_shares(&shares, parts);
            for (k, share) in shares.iter().enumerate() {
                let sum: f64 = fine[k * parts..(k + 1) * parts].iter().sum();
                prop_assert!((sum - share).abs() < 1e-12 && fine.iter().all(|f| *f >= 0.0));
            }
        }

        /// Components together get everything.
        #[test]
        fn components_together_get_everything(sizes in prop::collection::vec(1..2000_i64, 1..30)) {
            let of = ContactDistribution::new(1.0, vec![5.0, 3.0, 1.0], vec![4.0, 2.0]).unwrap();
            let total: i64 = sizes.iter().sum();
            let mut rest = levels(&of, 2, total);
            for &size in &sizes {
                let part = take_share(&mut rest, size);
                prop_assert_eq!(part.iter().flatten().sum::<i64>(), size);
            }
            prop_assert!(rest.iter().flatten().all(|room| *room == 0));
        }
    }
}
