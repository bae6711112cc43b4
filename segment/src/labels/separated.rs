//! How many colour categories there are: groups between which colours are rarer than in both.

use crate::ground::kmeans::{Clusters, kmeans};
use crate::ground::light::inverse_factor;

/// Groups looked for first.
const MOST: usize = 8;
/// Probability with which two groups without a gap are kept apart.
const FALSE_ALARM: f64 = 0.01;

/// Groups of colours that are separated by gaps; one if the colours form a continuum.
///
/// k-means gives eight groups; colours are scaled so that the mean covariance inside groups is isotropic, and grouped
/// again, because brightness often varies more inside a group than hue does. Of every two groups, the colours are
/// projected on the line between their centres, and counted in three bands of a third of the distance: around each
/// centre and around the middle. A density without a gap is nowhere between two places lower than at the lower of the
/// two, so that the middle count m of a continuum is at least as large as one of the others in expectation. Two groups
/// are separated if m is too small for that by a binomial test against both:
///
/// ```text
/// p = max over side counts n of P(X ≤ m),    X binomial of m + n draws with probability ½
/// ```
///
/// The two groups of largest p are merged until every p is below 0.01: seven colours on each side of an empty middle
/// are the fewest that are separated.
///
/// # Complexity
///
/// Colours times 8² groups times merges.
pub(crate) fn separated_groups(colours: &[[f64; 3]], seed: u64) -> Clusters {
    let count = MOST.min(colours.len().max(1));
    let first = kmeans(colours, count, seed);
    let colours = &whitened(colours, &first);
    let mut clusters = kmeans(colours, count, seed);
    while clusters.centres.len() > 1 {
        let groups = clusters.centres.len();
        let pairs = (0..groups).flat_map(|a| (a + 1..groups).map(move |b| (a, b)));
        let nearest = pairs
            .map(|(a, b)| (continuum_probability(colours, &clusters, a, b), a, b))
            .fold((0.0, 0, 0), |best, next| if next.0 > best.0 { next } else { best });
        let (probability, a, b) = nearest;
        if probability < FALSE_ALARM {
            break;
        }
        merge(colours, &mut clusters, a, b);
    }
    by_members(&mut clusters);
    clusters
}

/// Colours as multiples of the mean covariance inside groups, a Lab unit at least in every direction.
fn whitened(colours: &[[f64; 3]], clusters: &Clusters) -> Vec<[f64; 3]> {
    let mut covariance = [[0.0; 3]; 3];
    for (colour, group) in colours.iter().zip(&clusters.assignment) {
        let d: [f64; 3] = std::array::from_fn(|c| colour[c] - clusters.centres[*group][c]);
        for (row, a) in covariance.iter_mut().zip(d) {
            row.iter_mut()
                .zip(d)
                .for_each(|(v, b)| *v += a * b / colours.len() as f64);
        }
    }
    let w = inverse_factor(&covariance, 1.0);
    let scaled = |c: &[f64; 3]| w.map(|row| row.iter().zip(c).map(|(w, v)| w * v).sum::<f64>());
    colours.iter().map(scaled).collect()
}

/// Probability of so few colours in the middle between two groups if the density has no gap there.
fn continuum_probability(colours: &[[f64; 3]], clusters: &Clusters, a: usize, b: usize) -> f64 {
    let (from, to) = (clusters.centres[a], clusters.centres[b]);
    let along: [f64; 3] = std::array::from_fn(|c| to[c] - from[c]);
    let squared: f64 = along.iter().map(|d| d * d).sum();
    if squared <= 0.0 {
        return 1.0;
    }
    // Around the centres at 0 and 1, and around the middle between them.
    let mut counts = [0_usize; 3];
    for (colour, group) in colours.iter().zip(&clusters.assignment) {
        if *group == a || *group == b {
            let at = (0..3).map(|c| (colour[c] - from[c]) * along[c]).sum::<f64>() / squared;
            for (count, band) in counts.iter_mut().zip([0.0, 0.5, 1.0]) {
                *count += usize::from((at - band).abs() < 1.0 / 6.0);
            }
        }
    }
    let [left, middle, right] = counts;
    at_most(middle, middle + left).max(at_most(middle, middle + right))
}

/// P(X ≤ m) of a binomial X of n draws with probability ½.
fn at_most(m: usize, n: usize) -> f64 {
    let mut logarithm = -(n as f64) * std::f64::consts::LN_2;
    let mut sum = logarithm.exp();
    for k in 1..=m.min(n) {
        logarithm += ((n - k + 1) as f64 / k as f64).ln();
        sum += logarithm.exp();
    }
    sum.min(1.0)
}

/// Makes group `b` a part of group `a`.
fn merge(colours: &[[f64; 3]], clusters: &mut Clusters, a: usize, b: usize) {
    for group in &mut clusters.assignment {
        match (*group).cmp(&b) {
            std::cmp::Ordering::Equal => *group = a,
            std::cmp::Ordering::Greater => *group -= 1,
            std::cmp::Ordering::Less => {}
        }
    }
    clusters.centres.remove(b);
    let members = || colours.iter().zip(&clusters.assignment).filter(|(_, g)| **g == a);
    let count = members().count().max(1) as f64;
    clusters.centres[a] = std::array::from_fn(|c| members().map(|(colour, _)| colour[c]).sum::<f64>() / count);
    clusters.inertia = colours
        .iter()
        .zip(&clusters.assignment)
        .map(|(colour, g)| {
            (0..3)
                .map(|c| (colour[c] - clusters.centres[*g][c]).powi(2))
                .sum::<f64>()
        })
        .sum();
}

/// Numbers groups by decreasing number of members.
fn by_members(clusters: &mut Clusters) {
    let members = |g: usize| clusters.assignment.iter().filter(|a| **a == g).count();
    let mut order: Vec<usize> = (0..clusters.centres.len()).collect();
    order.sort_by_key(|&g| std::cmp::Reverse(members(g))); // stable
    clusters.centres = order.iter().map(|&g| clusters.centres[g]).collect();
    let mut new = vec![0; order.len()];
    (0..).zip(&order).for_each(|(n, &g)| new[g] = n);
    clusters.assignment.iter_mut().for_each(|g| *g = new[*g]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn drawn(seed: u64, n: usize, colour: impl Fn(&mut ChaCha8Rng, usize) -> [f64; 3]) -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|i| colour(&mut rng, i)).collect()
    }

    /// Sum of uniform numbers: a bell of standard deviation 1.
    fn bell(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Greys without a gap are one category, whether their density is flat, bell-shaped or skewed. Two groups remain in
    /// one set of a hundred, so that ten or more of 120 sets have a probability below 1e-6.
    #[test]
    fn a_continuum_is_one_category() {
        let mut several = 0;
        for (seed, n) in (0..).zip([30, 120, 400, 50].repeat(10)) {
            let flat = drawn(seed, n, |rng, _| [100.0 * rng.random::<f64>(), 0.0, 0.0]);
            let normal = drawn(seed + 100, n, |rng, _| [50.0 + 12.0 * bell(rng), 3.0 * bell(rng), 0.0]);
            let skewed = drawn(seed + 200, n, |rng, _| {
                [-15.0 * (1.0 - rng.random::<f64>()).ln(), bell(rng), bell(rng)]
            });
            for colours in [flat, normal, skewed] {
                several += usize::from(separated_groups(&colours, seed).centres.len() > 1);
            }
        }
        assert!(several < 10, "{several} of 120");
    }

    /// Groups with gaps are found, each complete: two to six, of 25 colours or more.
    #[test]
    fn gaps_separate() {
        let centres = [
            [30.0, 0.0, 0.0],
            [75.0, 5.0, 5.0],
            [50.0, 50.0, 30.0],
            [55.0, -40.0, 20.0],
            [40.0, 10.0, -50.0],
            [80.0, -5.0, 60.0],
        ];
        for groups in 2..=6 {
            for seed in 0..10 {
                let colours = drawn(seed, 40 * groups, |rng, i| {
                    centres[i % groups].map(|c| c + 4.0 * bell(rng))
                });
                let found = separated_groups(&colours, seed);
                assert_eq!(found.centres.len(), groups, "seed {seed}");
                assert!(
                    found
                        .assignment
                        .iter()
                        .enumerate()
                        .all(|(i, g)| *g == found.assignment[i % groups])
                );
            }
        }
    }

    #[test]
    fn tail_of_the_binomial_distribution() {
        assert!((at_most(0, 9) - 1.0 / 512.0).abs() < 1e-12);
        assert!((at_most(2, 4) - 11.0 / 16.0).abs() < 1e-12);
        assert!((at_most(7, 7) - 1.0).abs() < 1e-12);
        assert!(at_most(400, 2000) < 1e-100 && at_most(1000, 2000) > 0.5);
    }
}
