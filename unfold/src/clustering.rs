//! Clustering of profiles on a photograph: does their number vary more than Poisson's, and by how much?
//!
//! Clusters are seen as power at long waves of the pattern of points. A Poisson pattern has power 1 on average at every
//! wave, particles that keep a distance less than 1.

use std::f64::consts::{PI, TAU};

use statrs::distribution::{ChiSquared, ContinuousCDF, Gamma};
use statrs::function::erf::erf;

/// How clustered the profiles of a photograph are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clustering {
    /// Variance of the number of profiles on such a photograph over its mean, if they are clustered; 1 for Poisson's.
    pub dispersion: f64,
    /// Probability of as much power at long waves if the profiles are not clustered.
    pub p_value: f64,
}

/// Below this number of points nothing can be said.
const FEWEST: usize = 30;
/// The number of waves, the longest that the window holds.
const WAVES: usize = 56;
/// The power is tested over as many of the longest waves, so that clusters of several widths are found.
const TESTED: [usize; 4] = [4, 10, 24, WAVES];
/// Orders of waves along one side.
const ORDERS: usize = 40;
/// Mean numbers of other members of a cluster on the section, a, and standard deviations of their distances from its
/// centre along each axis, as fractions of the root of the window's area: both in equal ratios.
const MEMBERS: (f64, f64, usize) = (0.1, 60.0, 24);
const WIDTHS: (f64, f64, usize) = (0.01, 0.35, 14);

/// Clustering of `points`, the centres of profiles of these `sizes`, on a photograph.
///
/// `None` for fewer than 30 points, or where the profiles are so large beside the photograph that its edge decides
/// which of them are seen: points closer to the edge than the radius that nine of ten profiles do not exceed are left
/// out, at most half of the area.
///
/// # Formula
///
/// ```text
/// I(k) = |Σ exp(i k x)|² / n           Bartlett's periodogram at the waves k of the window
/// S(k) = 1 + a exp(−k² s²)             its mean for clusters of standard deviation s (Thomas process)
/// D    = 1 + a q(W / s) q(H / s)       dispersion of the number in a window W × H
/// q(u) = erf(u / 2) − 2 (1 − exp(−u² / 4)) / (u √π)
/// ```
///
/// The p-value is the smallest over the sums of I at the 4, 10, 24 and 56 longest waves, each Gamma-distributed for a
/// Poisson pattern, times four. The dispersion is the mean of D over a and s, with Whittle's likelihood as weight.
/// Complexity: O(points × waves).
///
/// # References
///
/// Bartlett 1964; Whittle 1953; Thomas 1949.
///
/// # Examples
///
/// ```
/// use stereology_unfold::clustering;
///
/// // Points of a lattice keep their distance.
/// let lattice: Vec<[f64; 2]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20)]).collect();
/// assert!(clustering(&lattice, &[0.5; 400]).is_some_and(|of| of.p_value > 0.5));
/// // The same number in the four corners of the window.
/// let corners: Vec<[f64; 2]> = lattice.iter().map(|[x, y]| [x / 4.0 + 30.0 * (x % 2.0), y / 4.0 + 30.0 * (y % 2.0)]).collect();
/// assert!(clustering(&corners, &[0.1; 400]).is_some_and(|of| of.p_value < 1e-6 && of.dispersion > 5.0));
/// ```
#[must_use]
pub fn clustering(points: &[[f64; 2]], sizes: &[f64]) -> Option<Clustering> {
    let rim = 0.5 * quantile(sizes, 0.9)?;
    let whole = Rectangle::around(points)?;
    let inner = whole.inset(rim)?;
    if inner.area() < 0.5 * whole.area() {
        return None;
    }
    let kept: Vec<[f64; 2]> = points.iter().copied().filter(|point| inner.contains(point)).collect();
    if kept.len() < FEWEST {
        return None;
    }
    let waves = longest_waves(&inner.sides);
    let powers = powers(&kept, &inner, &waves);
    Some(Clustering {
        dispersion: dispersion(&powers, &waves, &whole.sides),
        p_value: p_value(&powers),
    })
}

/// Clustering of profiles between slices of equal area, from the number of profiles on each.
///
/// `None` for fewer than two slices, or fewer than five profiles per slice on average.
///
/// # Formula
///
/// ```text
/// X² = Σ (n − m)² / m,  m the mean;  D = X² / (S − 1);  p = P(χ²_{S−1} > X²)
/// ```
///
/// ```
/// use stereology_unfold::clustering_of_slices;
/// assert!(clustering_of_slices(&[20.0, 24.0, 18.0]).is_some_and(|of| of.p_value > 0.5));
/// assert!(clustering_of_slices(&[2.0, 40.0, 18.0]).is_some_and(|of| of.p_value < 1e-6));
/// ```
#[must_use]
pub fn clustering_of_slices(counts: &[f64]) -> Option<Clustering> {
    let slices = counts.len() as f64;
    let mean = counts.iter().sum::<f64>() / slices;
    if counts.len() < 2 || mean < FEWEST_PER_SLICE {
        return None;
    }
    let statistic: f64 = counts.iter().map(|n| (n - mean).powi(2) / mean).sum();
    Some(Clustering {
        dispersion: statistic / (slices - 1.0),
        p_value: ChiSquared::new(slices - 1.0).map_or(1.0, |law| law.sf(statistic)),
    })
}

/// The dispersion index follows the χ² distribution from here on.
const FEWEST_PER_SLICE: f64 = 5.0;

fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // An index.
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).copied().filter(|value| value.is_finite())
}

/// A rectangle with sides along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) corner: [f64; 2],
    pub(crate) sides: [f64; 2],
}

impl Rectangle {
    /// The smallest around all points; `None` if it has no area.
    pub(crate) fn around(points: &[[f64; 2]]) -> Option<Self> {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for point in points {
            for (of, value) in range.iter_mut().zip(point) {
                *of = [of[0].min(*value), of[1].max(*value)];
            }
        }
        Self {
            corner: range.map(|of| of[0]),
            sides: range.map(|of| of[1] - of[0]),
        }
        .checked()
    }

    fn checked(self) -> Option<Self> {
        let is_length = |side: &f64| side.is_finite() && *side > 0.0;
        self.sides.iter().all(is_length).then_some(self)
    }

    fn inset(self, rim: f64) -> Option<Self> {
        Self {
            corner: self.corner.map(|value| value + rim),
            sides: self.sides.map(|side| side - 2.0 * rim),
        }
        .checked()
    }

    fn area(&self) -> f64 {
        self.sides[0] * self.sides[1]
    }

    fn contains(&self, point: &[f64; 2]) -> bool {
        (0..2).all(|axis| (0.0..=self.sides[axis]).contains(&(point[axis] - self.corner[axis])))
    }
}

/// A wave with whole numbers of periods along both sides of a window, and the square of its wave number.
#[derive(Clone, Copy, Debug)]
struct Wave {
    orders: [i32; 2],
    squared: f64,
}

/// The longest waves of a window, without those that differ only in their sign.
fn longest_waves(sides: &[f64; 2]) -> Vec<Wave> {
    let most = i32::try_from(ORDERS).unwrap_or(i32::MAX);
    let orders = (0..=most).flat_map(|i| (-most..=most).map(move |j| [i, j]));
    let mut waves: Vec<Wave> = orders
        .filter(|[i, j]| *i > 0 || *j > 0)
        .map(|orders| Wave {
            orders,
            squared: (0..2)
                .map(|axis| (TAU * f64::from(orders[axis]) / sides[axis]).powi(2))
                .sum(),
        })
        .collect();
    waves.sort_by(|a, b| a.squared.total_cmp(&b.squared).then(a.orders.cmp(&b.orders)));
    waves.truncate(WAVES);
    waves
}

/// Bartlett's periodogram.
fn powers(points: &[[f64; 2]], window: &Rectangle, waves: &[Wave]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); waves.len()];
    let highest = |axis: usize| {
        waves
            .iter()
            .map(|wave| wave.orders[axis].unsigned_abs())
            .max()
            .unwrap_or(0)
    };
    let most = [highest(0), highest(1)];
    // exp(i k x) of all orders along an axis, by multiplication.
    let mut turns = [Vec::new(), Vec::new()];
    for point in points {
        for axis in 0..2 {
            let (sine, cosine) = (TAU * (point[axis] - window.corner[axis]) / window.sides[axis]).sin_cos();
            turns[axis].clear();
            let mut turn = (1.0, 0.0);
            for _ in 0..=most[axis] {
                turns[axis].push(turn);
                turn = product(turn, (cosine, sine));
            }
        }
        for (sum, wave) in sums.iter_mut().zip(waves) {
            let [i, j] = wave.orders.map(|order| order.unsigned_abs() as usize);
            let along = turns[1][j];
            let along = if wave.orders[1] < 0 { (along.0, -along.1) } else { along };
            let of = product(turns[0][i], along);
            *sum = (sum.0 + of.0, sum.1 + of.1);
        }
    }
    let n = points.len() as f64;
    sums.into_iter().map(|(re, im)| (re * re + im * im) / n).collect()
}

/// Product of complex numbers.
fn product(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn p_value(powers: &[f64]) -> f64 {
    let tail = |&waves: &usize| {
        let sum: f64 = powers[..waves.min(powers.len())].iter().sum();
        Gamma::new(waves as f64, 1.0).map_or(1.0, |law| law.sf(sum))
    };
    (TESTED.len() as f64 * TESTED.iter().map(tail).fold(1.0, f64::min)).min(1.0)
}

/// The mean of the dispersion over clusters of all sizes and widths, weighed by Whittle's likelihood.
fn dispersion(powers: &[f64], waves: &[Wave], sides: &[f64; 2]) -> f64 {
    let unit = (sides[0] * sides[1]).sqrt();
    let mut models = Vec::with_capacity(MEMBERS.2 * WIDTHS.2);
    for members in ratios(MEMBERS) {
        for width in ratios(WIDTHS).map(|width| width * unit) {
            let likelihood: f64 = powers
                .iter()
                .zip(waves)
                .map(|(power, wave)| {
                    let mean = 1.0 + members * (-wave.squared * width * width).exp();
                    -mean.ln() - power / mean
                })
                .sum();
            let within: f64 = sides.iter().map(|side| pairs_within(side / width)).product();
            models.push((likelihood, 1.0 + members * within));
        }
    }
    let best = models.iter().map(|of| of.0).fold(f64::NEG_INFINITY, f64::max);
    let weighed = models.iter().map(|of| ((of.0 - best).exp(), of.1));
    let (weights, sum) = weighed.fold((0.0, 0.0), |sums, (weight, of)| (sums.0 + weight, sums.1 + weight * of));
    sum / weights
}

fn ratios((from, to, count): (f64, f64, usize)) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| from * (to / from).powf(k as f64 / (count - 1) as f64))
}

/// The share of a cluster's pairs that lie within a side of a window, for a side of `length` standard deviations.
fn pairs_within(length: f64) -> f64 {
    erf(0.5 * length) - 2.0 * (1.0 - (-0.25 * length * length).exp()) / (length * PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::{Clustering, clustering, pairs_within};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Without clusters 400 patterns raise no p-value below 10^-6, and one in ten or fewer is below .1 (55 or more of
    /// 400 with a chance of 10^-2 each would be above 10^-6 for .1).
    #[test]
    fn points_without_clusters_are_not_clustered() {
        let mut below = 0;
        for seed in 0..400 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let points: Vec<[f64; 2]> = (0..150).map(|_| [3.0 * rng.random::<f64>(), rng.random()]).collect();
            let p = clustering(&points, &vec![0.02; 150]).unwrap().p_value;
            assert!(p > 1e-6);
            below += u32::from(p < 0.1);
        }
        assert!(below <= 72, "{below} of 400"); // more than that once in 10^6 at p = .1
    }

    /// Neither translation, scale nor the order of the points matters.
    #[test]
    fn similar_patterns_are_equally_clustered() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let points: Vec<[f64; 2]> = (0..200).map(|_| [rng.random::<f64>().powi(2), rng.random()]).collect();
        let Clustering { dispersion, p_value } = clustering(&points, &[0.01; 200]).unwrap();
        let moved: Vec<[f64; 2]> = points
            .iter()
            .rev()
            .map(|[x, y]| [8.0 * x - 64.0, 8.0 * y + 16.0])
            .collect();
        let of = clustering(&moved, &[0.08; 200]).unwrap();
        assert!((of.dispersion / dispersion - 1.0).abs() < 1e-6 && (of.p_value / p_value - 1.0).abs() < 1e-3);
    }

    #[test]
    fn what_cannot_be_judged_is_not() {
        assert_eq!(clustering(&[[0.0, 1.0]; 100], &[0.1; 100]), None);
        assert_eq!(clustering(&[], &[]), None);
        let points: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k % 10), f64::from(k / 10)]).collect();
        assert_eq!(clustering(&points, &[5.0; 100]), None);
        assert_eq!(clustering(&points[..20], &[0.1; 20]), None);
    }

    /// In a wide window nearly all pairs of a cluster lie within it, in a narrow one nearly none.
    #[test]
    fn windows_hold_shares_of_pairs() {
        assert!(pairs_within(100.0) > 0.98 && pairs_within(0.1) < 0.06);
        assert!((0..50).map(|k| pairs_within(0.1 * f64::from(k + 1))).is_sorted());
    }
}
