//! k-means clustering of colours.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Points grouped by their nearest centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// Centre of each group: the mean of its points.
    pub centres: Vec<[f64; 3]>,
    /// Group of each point.
    pub assignment: Vec<usize>,
    /// Sum of squared distances to the centres.
    pub inertia: f64,
}

/// Most iterations: the centres settle long before.
const ROUNDS: usize = 60;

/// Lloyd's k-means from a k-means++ start (Arthur & Vassilvitskii 2007): the best of four starts, the same for the same
/// seed. Groups are numbered by decreasing number of points. There are fewer than `k` groups if there are fewer
/// distinct points.
///
/// # Complexity
///
/// Points × k × iterations (at most 60).
///
/// # Examples
///
/// ```
/// let points = [[0.0; 3], [0.1; 3], [0.2; 3], [5.0; 3], [5.1; 3]];
/// let clusters = stereology_segment::kmeans(&points, 2, 0);
/// assert_eq!(clusters.assignment, [0, 0, 0, 1, 1]);
/// ```
#[must_use]
pub fn kmeans(points: &[[f64; 3]], k: usize, seed: u64) -> Clusters {
    (0..4)
        .map(|start| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(start);
            lloyd(points, spread_start(points, k, &mut rng))
        })
        .min_by(|a, b| a.inertia.total_cmp(&b.inertia))
        .map_or(
            Clusters {
                centres: Vec::new(),
                assignment: Vec::new(),
                inertia: 0.0,
            },
            by_size,
        )
}

/// k-means++: each next centre is a point drawn in proportion to its squared distance to the centres so far.
fn spread_start(points: &[[f64; 3]], k: usize, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let mut centres: Vec<[f64; 3]> = Vec::new();
    let mut nearest = vec![1.0_f64; points.len()];
    while centres.len() < k {
        let total: f64 = nearest.iter().sum();
        if total.is_nan() || total <= 0.0 {
            break;
        }
        let mut left = rng.random::<f64>() * total;
        let chosen = nearest.iter().position(|d| {
            left -= d;
            left < 0.0
        });
        let Some(&centre) = chosen
            .or_else(|| nearest.iter().rposition(|d| *d > 0.0))
            .and_then(|i| points.get(i))
        else {
            break;
        };
        let first = centres.is_empty();
        centres.push(centre);
        for (d, p) in nearest.iter_mut().zip(points) {
            let new = squared_distance(p, &centre);
            *d = if first { new } else { d.min(new) };
        }
    }
    centres
}

fn lloyd(points: &[[f64; 3]], mut centres: Vec<[f64; 3]>) -> Clusters {
    let mut assignment = vec![usize::MAX; points.len()];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for (group, p) in assignment.iter_mut().zip(points) {
            let new = nearest_centre(p, &centres);
            changed |= new != *group;
            *group = new;
        }
        if !changed {
            break;
        }
        let mut sums = vec![([0.0; 3], 0.0); centres.len()];
        for (&group, p) in assignment.iter().zip(points) {
            (0..3).for_each(|c| sums[group].0[c] += p[c]);
            sums[group].1 += 1.0;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(sums) {
            if count > 0.0 {
                *centre = sum.map(|s| s / count);
            }
        }
    }
    let inertia = assignment
        .iter()
        .zip(points)
        .map(|(&g, p)| squared_distance(p, &centres[g]))
        .sum();
    Clusters {
        centres,
        assignment,
        inertia,
    }
}

/// Groups numbered by decreasing size, then by centre, so that numbers do not depend on the start.
fn by_size(clusters: Clusters) -> Clusters {
    let mut counts = vec![0_usize; clusters.centres.len()];
    clusters.assignment.iter().for_each(|&g| counts[g] += 1);
    let mut order: Vec<usize> = (0..counts.len()).filter(|&g| counts[g] > 0).collect();
    order.sort_by(|&a, &b| {
        counts[b].cmp(&counts[a]).then_with(|| {
            let pairs = clusters.centres[a].iter().zip(&clusters.centres[b]);
            pairs
                .map(|(x, y)| x.total_cmp(y))
                .find(|o| o.is_ne())
                .unwrap_or(std::cmp::Ordering::Equal)
        })
    });
    let mut rank = vec![0; counts.len()];
    order.iter().enumerate().for_each(|(new, &old)| rank[old] = new);
    Clusters {
        centres: order.iter().map(|&g| clusters.centres[g]).collect(),
        assignment: clusters.assignment.iter().map(|&g| rank[g]).collect(),
        inertia: clusters.inertia,
    }
}

/// Index of the centre nearest to a point; the first of equals.
fn nearest_centre(point: &[f64; 3], centres: &[[f64; 3]]) -> usize {
    let mut best = (0, f64::INFINITY);
    for (g, centre) in centres.iter().enumerate() {
        let d = squared_distance(point, centre);
        if d < best.1 {
            best = (g, d);
        }
    }
    best.0
}

pub(crate) fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
}

/// Mean silhouette of groups, from −1 to 1: how much nearer points are to their own group than to the next one
/// (Rousseeuw 1987). 0 for a single group. At most 400 points, evenly spaced in the list, are used.
///
/// # Examples
///
/// ```
/// let points = [[0.0; 3], [0.1; 3], [5.0; 3], [5.1; 3]];
/// assert!(stereology_segment::silhouette(&points, &[0, 0, 1, 1]) > 0.9);
/// assert!(stereology_segment::silhouette(&points, &[0, 1, 0, 1]) < 0.0);
/// ```
#[must_use]
pub fn silhouette(points: &[[f64; 3]], assignment: &[usize]) -> f64 {
    let step = points.len().div_ceil(400).max(1);
    let chosen: Vec<([f64; 3], usize)> = points
        .iter()
        .copied()
        .zip(assignment.iter().copied())
        .step_by(step)
        .collect();
    let groups = chosen.iter().map(|c| c.1 + 1).max().unwrap_or(0);
    let mut total = 0.0;
    for (p, own) in &chosen {
        let mut sums = vec![(0.0, 0_usize); groups];
        for (q, group) in &chosen {
            sums[*group].0 += squared_distance(p, q).sqrt();
            sums[*group].1 += 1;
        }
        if sums[*own].1 < 2 {
            continue; // A group of one has silhouette 0.
        }
        let inner = sums[*own].0 / (sums[*own].1 - 1) as f64;
        let others = sums.iter().enumerate().filter(|(g, s)| g != own && s.1 > 0);
        let outer = others.map(|(_, s)| s.0 / s.1 as f64).fold(f64::INFINITY, f64::min);
        if outer.is_finite() && outer.max(inner) > 0.0 {
            total += (outer - inner) / outer.max(inner);
        }
    }
    total / chosen.len().max(1) as f64
}
