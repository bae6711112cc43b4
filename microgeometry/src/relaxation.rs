//! Moves the interface between the regions until distances to it, measured over the surface, have the required
//! distribution.
//!
//! Labels assigned from the farthest inwards never exceed the distance to the interface, but they may be shorter: where
//! regions around different seeds meet, and where small labels end up side by side. Distances measured again are then
//! longer than the labels. Here the interface itself is moved.
//!
//! ```text
//! y(x) = G⁻¹(F(x))               what the distance x should be: F the measured signed distances, G the required distribution
//! v(p) = mean of x − y(x)        over the points whose nearest point of the interface is p: how far it is to move towards the positive region
//! ```
//!
//! A motion by v changes all distances with foot p by −v, so this is steepest descent of Σ (x − y)² (the squared
//! Wasserstein-2 distance), with steps that would suffice if all these points agreed. Where the middle of a region is
//! much too far from the interface, an island of the other region is placed there.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::contact::ContactDistribution;
use crate::conversions::{index, whole_part};
use crate::dual::DualGraph;
use crate::wavefront::Wavefront;

const NONE: u32 = u32::MAX;

/// Signed distances to the interface, and the triangle beside the interface that each was measured from.
struct Feet {
    distance: Vec<f64>,
    foot: Vec<u32>,
    /// The triangles beside the interface.
    interface: Vec<u32>,
}

impl Feet {
    fn of(graph: &DualGraph, positive: &[bool]) -> Self {
        let mut made = Self {
            distance: vec![f64::INFINITY; graph.len()],
            foot: vec![NONE; graph.len()],
            interface: Vec::new(),
        };
        let mut front = Wavefront::new(0.5 * graph.mean_length());
        front.restart(0.0);
        for t in 0..graph.len() {
            let other = graph
                .links(t)
                .iter()
                .filter(|link| positive[link.to as usize] != positive[t]);
            let near = other.map(|link| 0.5 * link.length()).fold(f64::INFINITY, f64::min);
            if near.is_finite() {
                made.interface.push(index(t));
                made.distance[t] = near;
                made.foot[t] = index(t);
                front.push(-near, index(t));
            }
        }
        while let Some((value, t)) = front.pop() {
            let (here, foot) = (made.distance[t as usize], made.foot[t as usize]);
            if -value > here {
                continue;
            }
            for link in graph.links(t as usize) {
                let there = here + link.length();
                if there < made.distance[link.to as usize] {
                    made.distance[link.to as usize] = there;
                    made.foot[link.to as usize] = foot;
                    front.push(-there, link.to);
                }
            }
        }
        for (distance, positive) in made.distance.iter_mut().zip(positive) {
            if !positive {
                *distance = -*distance;
            }
        }
        made
    }
}

/// Cells per bin in which quantiles are counted, and most cells in total.
const CELLS: f64 = 16.0;
const MOST_CELLS: f64 = 1e6;

/// The map from signed distances to the required ones.
struct Quantiles {
    per_unit: f64,
    first: f64,
    at: Vec<f64>,
    /// How much too far from the interface, and how much too near, points are on average, bins.
    too_far: f64,
    too_near: f64,
}

impl Quantiles {
    fn new(distance: &[f64], weights: &[i64], of: &ContactDistribution) -> Self {
        let finite = || distance.iter().zip(weights).filter(|(x, _)| x.is_finite());
        let (low, high) = finite().fold((0.0_f64, 0.0_f64), |(l, h), (x, _)| (l.min(*x), h.max(*x)));
        let per_unit = (CELLS / of.bin_width()).min(MOST_CELLS / (high - low));
        let (below, above) = (
            whole_part((-low * per_unit).ceil()) + 1,
            whole_part((high * per_unit).ceil()) + 1,
        );
        let mut shares = vec![0.0; below + above];
        let first = -(below as f64);
        let mut total = 0.0;
        for (x, &weight) in finite() {
            shares[whole_part(x * per_unit - first)] += weight as f64;
            total += weight as f64;
        }
        // The required distribution, from its lowest bin to its highest.
        let bins: Vec<f64> = of.negative().iter().rev().chain(of.positive()).copied().collect();
        let lowest = -(of.negative().len() as f64);
        let (mut bin, mut under) = (0, 0.0);
        let mut wanted = |share: f64| -> f64 {
            while bin + 1 < bins.len() && under + bins[bin] < share {
                under += bins[bin];
                bin += 1;
            }
            let within = ((share - under) / bins[bin].max(1e-300)).clamp(0.0, 1.0);
            (lowest + bin as f64 + within) * of.bin_width()
        };
        let mut at = Vec::with_capacity(shares.len() + 1);
        let mut sum = 0.0;
        at.push(wanted(0.0));
        let (mut too_far, mut too_near) = (0.0, 0.0);
        for (k, share) in shares.iter().enumerate() {
            sum += share / total;
            at.push(wanted(sum.min(1.0)));
            let middle = (k as f64 + 0.5 + first) / per_unit;
            let wanted = 0.5 * (at[k] + at[k + 1]);
            let (near, far) = if middle < 0.0 {
                (middle, wanted)
            } else {
                (wanted, middle)
            };
            too_far += share / total * (far - near).max(0.0) / of.bin_width();
            too_near += share / total * (near - far).max(0.0) / of.bin_width();
        }
        Self {
            per_unit,
            first,
            at,
            too_far,
            too_near,
        }
    }

    fn of(&self, x: f64) -> f64 {
        let place = (x * self.per_unit - self.first).clamp(0.0, self.at.len() as f64 - 1.001);
        let cell = whole_part(place);
        self.at[cell] + (self.at[cell + 1] - self.at[cell]) * (place - cell as f64)
    }
}

/// How an interface is moved.
#[derive(Clone, Copy)]
pub(crate) struct Moves {
    /// Number of iterations.
    pub(crate) sweeps: usize,
    /// Random variation of the place where a triangle changes sides, in mean steps of the graph, so that motions
    /// shorter than a triangle take place on some triangles.
    pub(crate) noise: f64,
    pub(crate) seed: u64,
}

/// Factor of the motions over those that would suffice if all points of a foot agreed.
const STRIDE: f64 = 1.5;
/// Distances are aimed a fifth longer than required, at most a fifth of a bin, because labels can be shorter than
/// distances, not longer.
const LIFT: f64 = 0.2;
/// Weight of distances that are too short.
const TOO_NEAR: f64 = 3.0;

/// Signed distances to the best interface found by moving that of `labels`; infinite if there is none.
pub(crate) fn relaxed(
    graph: &DualGraph,
    weights: &[i64],
    of: &ContactDistribution,
    labels: &[f64],
    moves: Moves,
) -> Vec<f64> {
    let bin = of.bin_width();
    let noise = moves.noise * graph.mean_length();
    let mut random = ChaCha8Rng::seed_from_u64(moves.seed);
    // A stream of its own, independent of the choice of seeds.
    random.set_stream(1);
    let mut positive: Vec<bool> = labels.iter().map(|x| x.is_sign_positive()).collect();
    let mut best = (f64::INFINITY, vec![f64::INFINITY; graph.len()]);
    for sweep in 0..=moves.sweeps {
        let feet = Feet::of(graph, &positive);
        if feet.interface.is_empty() {
            break;
        }
        let wanted = Quantiles::new(&feet.distance, weights, of);
        if sweep < moves.sweeps {
            let speed = speeds(graph, weights, &feet, &wanted, bin);
            for (side, (&x, &foot)) in positive.iter_mut().zip(feet.distance.iter().zip(&feet.foot)) {
                if foot != NONE && x.abs() < bin {
                    *side = x > speed[foot as usize] + noise * (random.random::<f64>() - 0.5);
                }
            }
            islands(graph, &feet, &wanted, bin, &mut positive);
        }
        let cost = wanted.too_far + TOO_NEAR * wanted.too_near;
        if cost < best.0 {
            best = (cost, feet.distance);
        }
    }
    best.1
}

/// By how much the interface must move at each triangle beside it, towards the positive region.
fn speeds(graph: &DualGraph, weights: &[i64], feet: &Feet, wanted: &Quantiles, bin: f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); graph.len()];
    for (t, &foot) in feet.foot.iter().enumerate() {
        if foot != NONE {
            let (x, weight) = (feet.distance[t], weights[t] as f64);
            let y = wanted.of(x);
            let lifted = y + (LIFT * y).clamp(-LIFT * bin, LIFT * bin);
            let (sum, of) = &mut sums[foot as usize];
            *sum += weight * (x - lifted);
            *of += weight;
        }
    }
    let mut speed = vec![0.0; graph.len()];
    for &t in &feet.interface {
        // With the adjacent triangles on both sides of the interface, which move together.
        let (mut sum, mut of) = sums[t as usize];
        for link in graph.links(t as usize) {
            sum += sums[link.to as usize].0;
            of += sums[link.to as usize].1;
        }
        speed[t as usize] = (STRIDE * sum / of.max(1.0)).clamp(-bin, bin);
    }
    speed
}

/// Islands of the other region where the middle of a region lies too far from the interface.
fn islands(graph: &DualGraph, feet: &Feet, wanted: &Quantiles, bin: f64, positive: &mut [bool]) {
    let deep = |t: usize| {
        let x = feet.distance[t];
        if x.is_finite() {
            x.signum() * (x - wanted.of(x))
        } else {
            0.0
        }
    };
    let mut near: Vec<u32> = Vec::new();
    for t in 0..graph.len() {
        let x = feet.distance[t];
        if deep(t) < (0.5 * x.abs()).max(1.5 * bin) || (x > 0.0) != positive[t] {
            continue;
        }
        let highest = graph.links(t).iter().all(|link| {
            let y = feet.distance[link.to as usize];
            y.abs() < x.abs() || (y.abs() <= x.abs() && link.to > index(t))
        });
        if !highest {
            continue;
        }
        near.clear();
        near.push(index(t));
        near.extend(graph.links(t).iter().map(|link| link.to));
        for &s in &near {
            positive[s as usize] = x < 0.0;
        }
    }
}
