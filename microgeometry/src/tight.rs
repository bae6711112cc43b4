//! The default method of reconstruction: it looks ahead, so that labels fill their bins.

use std::ops::ControlFlow;

use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::bounds::{Limit, Region};
use crate::budget::{Levels, take_share};
use crate::conversions::single;
use crate::dual::{DualGraph, Link};
use crate::error::MicrogeometryError;
use crate::labelling::{Labelling, signed};
use crate::leftovers::bounds;
use stereology_metrics::Progress;

/// Refusals in a row after which no seed farther from its region is tried.
const REFUSALS: u32 = 32;
/// How often the candidates are sorted again.
const ROUNDS: u32 = 2;

/// Seeds are tried in order of slack + APART × distance to the own region + CHANCE × a random fraction of a bin, both
/// distances up to REACH bins.
///
/// For random fields on four meshes, the error of the distances measured afterwards is .26 to .5 bins with APART 0 and
/// .2 to .35 with .4; a reach of 6 bins makes one large clump (1 to 6 bins). CHANCE makes no difference between .1 and
/// 1, nor does APART once the interface has been moved.
const APART: f64 = 0.4;
const CHANCE: f64 = 0.3;
const REACH: f64 = 2.0;

pub(crate) struct Tight<'a> {
    pub(crate) graph: &'a DualGraph,
    pub(crate) weights: &'a [i64],
    /// Height of a level, and of a bin of the distribution.
    pub(crate) height: f64,
    pub(crate) bin: f64,
    pub(crate) tolerance: i64,
    pub(crate) seed: u64,
    /// The interface, if it is given.
    pub(crate) interface: Option<GivenInterface<'a>>,
    pub(crate) progress: Progress<'a>,
}

/// A given interface: labels take the signs of these distances to it.
#[derive(Clone, Copy)]
pub(crate) struct GivenInterface<'a> {
    /// Signed.
    pub(crate) distance: &'a [f64],
    /// Whether labels may be as long as the path to the nearest triangle of the other region, half an edge longer than
    /// the distance. Where triangles are as large as bins this is needed to fill the bins; where they are small it only
    /// costs time.
    pub(crate) across: bool,
}

/// Steps that may be spent on refused seeds per unlabelled triangle and level: tenths, without and with a given
/// interface. Ten times as many change the earth mover's distances by less than .01.
const PATIENCE: [u64; 2] = [10, 1];

/// How candidates are tried.
struct Pass {
    /// Weight that is tried at once at first.
    batch: i64,
    /// Refusals in a row after which no more are tried.
    refusals: u32,
    /// Whether levels below may use room left in this one.
    hand_down: bool,
}

/// The two regions, negative and positive, and the labels so far.
struct State<'a> {
    regions: [Region<'a>; 2],
    labelled: Vec<bool>,
    label: Vec<f64>,
}

impl Tight<'_> {
    /// A label for every triangle, within all bounds.
    pub(crate) fn run(&self, mut rest: [Levels; 2]) -> Result<Labelling, MicrogeometryError> {
        let count = self.graph.len();
        let levels = rest[0].len().max(rest[1].len());
        let region = || Region::new(self.graph, self.weights, self.height, levels, self.tolerance);
        let mut state = State {
            regions: [region(), region()],
            labelled: vec![false; count],
            label: vec![0.0; count],
        };
        if let Some(GivenInterface { distance, across }) = self.interface {
            let ways = across.then(|| to_the_other_region(self.graph, distance));
            let longest = ways.as_deref().unwrap_or(distance);
            // A component without interface is labelled freely.
            for (t, x) in distance.iter().enumerate().filter(|(_, x)| x.is_finite()) {
                let own = usize::from(!x.is_sign_negative());
                state.regions[own].bound[t] = 0.0;
                state.regions[1 - own].bound[t] = -longest[t].abs();
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let dice: Vec<f32> = (0..count).map(|_| random.random()).collect();
        let mut rest_rooms = vec![[0_i64; 2]; self.graph.components().len()];
        let mut done = 0;
        for (number, piece) in self.graph.components().iter().enumerate() {
            let weight: i64 = piece.iter().map(|&t| self.weights[t as usize]).sum();
            let mut room = take_share(&mut rest, weight);
            room.iter_mut().for_each(|side| side.resize(levels, 0));
            state.regions.iter_mut().for_each(Region::clear_counts);
            rest_rooms[number] = self.piece(&mut state, piece, &mut room, &dice, &mut |share| {
                (self.progress)((done as f64 + share * piece.len() as f64) / count as f64)
            })?;
            done += piece.len();
        }
        let left = self.extend(&mut state, &rest_rooms);
        Ok(Labelling {
            labels: state.label,
            left_over: left as f64 / self.weights.iter().sum::<i64>() as f64,
        })
    }

    /// Labels a component down to the level next to the interface; returns the remaining room of the regions.
    fn piece(
        &self,
        state: &mut State<'_>,
        piece: &[u32],
        room: &mut [Levels; 2],
        dice: &[f32],
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<[i64; 2], MicrogeometryError> {
        let mut open: Vec<u32> = piece.to_vec();
        let levels = room[0].len();
        for level in (0..levels).rev() {
            if progress(1.0 - (level + 1) as f64 / levels as f64).is_break() {
                return Err(MicrogeometryError::Cancelled);
            }
            for side in [1, 0] {
                self.force(state, side, level, room);
                if level > 0 && room[side][level] > 0 {
                    self.seed(state, side, level, room, &open, dice);
                }
                // Labels that were not placed move one level nearer to the interface.
                if level > 0 && room[side][level] > 0 {
                    room[side][level - 1] += std::mem::take(&mut room[side][level]);
                }
            }
            open.retain(|&t| !state.labelled[t as usize]);
        }
        Ok([0, 1].map(|side| room[side].iter().sum()))
    }

    /// Triangles whose bound lies in the level get it as their label. That imposes no new bounds on others.
    fn force(&self, state: &mut State<'_>, side: usize, level: usize, room: &mut [Levels; 2]) {
        for t in state.regions[side].forced_into(level, &state.labelled) {
            let region = &mut state.regions[side];
            state.label[t as usize] = signed(side, region.bound[t as usize]);
            state.labelled[t as usize] = true;
            region.settle(t);
            // A triangle may be forced from both sides only at zero.
            state.regions[1 - side].settle(t);
            room[side][level] -= self.weights[t as usize];
        }
    }

    /// Assigns the level's remaining labels, at its inner edge, to triangles that may have them: first where the other
    /// region is just as far away as the label; when such seeds are refused too often, near the region's own labels,
    /// where few other triangles are newly bounded.
    fn seed(
        &self,
        state: &mut State<'_>,
        side: usize,
        level: usize,
        room: &mut [Levels; 2],
        open: &[u32],
        dice: &[f32],
    ) {
        let value = level as f64 * self.height;
        let turn = single(((2 * level + side) as f64 * 0.618_033_988_749_894_9).fract());
        let mut candidates: Vec<u64> = Vec::new();
        for &t in open {
            let i = t as usize;
            if state.labelled[i] || state.regions[side].bound[i] > value {
                continue;
            }
            // How much farther the other region is than necessary for the label, and the distance of the own region.
            let slack = -state.regions[1 - side].bound[i] - value;
            let apart = value - state.regions[side].bound[i];
            if slack >= 0.0 {
                let chance = f64::from((dice[i] + turn).fract());
                let cost =
                    slack.min(REACH * self.bin) + APART * apart.min(REACH * self.bin) + CHANCE * self.bin * chance;
                candidates.push(key(cost, t));
            }
        }
        let mut patience = PATIENCE[usize::from(self.interface.is_some())] * open.len() as u64 / 10;
        let batch = room[side][level];
        self.place(
            state,
            side,
            level,
            room,
            &mut candidates,
            &Pass {
                batch,
                refusals: u32::MAX,
                hand_down: false,
            },
            &mut patience,
        );
        // First within the room of every level; then levels below may use room that would be passed down anyway.
        for hand_down in [false, true] {
            for _ in 0..ROUNDS {
                if room[side][level] <= 0 {
                    return;
                }
                candidates.retain(|&candidate| !state.labelled[triangle(candidate) as usize]);
                for candidate in &mut candidates {
                    let t = triangle(*candidate);
                    let apart = value - state.regions[side].bound[t as usize];
                    *candidate = key(
                        apart + 1e-3 * self.bin * f64::from((dice[t as usize] + turn).fract()),
                        t,
                    );
                }
                let mut patience = PATIENCE[usize::from(self.interface.is_some())] * open.len() as u64 / 10;
                let pass = Pass {
                    batch: 1,
                    refusals: REFUSALS,
                    hand_down,
                };
                if !self.place(state, side, level, room, &mut candidates, &pass, &mut patience) {
                    break;
                }
            }
        }
    }

    /// Tries candidates in order until the level is full, `refusals` in a row are refused, or `patience` is spent;
    /// returns whether any was placed.
    #[allow(clippy::too_many_arguments, reason = "the state of one level")]
    fn place(
        &self,
        state: &mut State<'_>,
        side: usize,
        level: usize,
        room: &mut [Levels; 2],
        candidates: &mut [u64],
        pass: &Pass,
        patience: &mut u64,
    ) -> bool {
        let mut batch = pass.batch;
        let value = level as f64 * self.height;
        // Labels within their distances to a given interface cannot come too near to the other region.
        let floor = if self.interface.is_some_and(|interface| !interface.across) {
            0.0
        } else {
            -value - self.bin
        };
        let (mut sorted, mut next, mut refused, mut placed) = (0, 0, 0, false);
        let mut seeds: Vec<u32> = Vec::new();
        while room[side][level] > 0 && next < candidates.len() {
            seeds.clear();
            let mut weight = 0;
            let first = next;
            while next < candidates.len() && (weight < batch || seeds.is_empty()) {
                if next == sorted {
                    sorted = sort_some(candidates, sorted);
                }
                let t = triangle(candidates[next]);
                let of = self.weights[t as usize];
                next += 1;
                // Triangles too large for the room are skipped.
                if of > room[side][level] - weight + self.tolerance {
                    continue;
                }
                weight += of;
                seeds.push(t);
            }
            if seeds.is_empty() {
                break;
            }
            let region = &mut state.regions[side];
            region.work = 0;
            let limit = Limit {
                room: &room[side],
                below: if pass.hand_down { level } else { 0 },
                spare: room[side][level] - weight,
            };
            match region.spread(&seeds, value, floor, &mut state.labelled, &limit) {
                Ok(()) => {
                    for &t in &seeds {
                        state.label[t as usize] = signed(side, value);
                        state.regions[1 - side].settle(t);
                    }
                    room[side][level] -= weight;
                    batch = (2 * weight).min(room[side][level]);
                    (placed, refused) = (true, 0);
                }
                Err(_) => {
                    *patience = patience.saturating_sub(region.work);
                    if seeds.len() > 1 {
                        next = first;
                        batch = weight / 2;
                    } else {
                        refused += 1;
                        if refused >= pass.refusals {
                            break;
                        }
                    }
                    if *patience == 0 {
                        break;
                    }
                }
            }
        }
        placed
    }

    /// Assigns labels between the bounds to the remaining triangles: a mixture of two functions that obey all bounds
    /// obeys them too. The mixture is chosen so that both regions have their required sizes. Returns the weight of the
    /// triangles for which the histogram had no label.
    fn extend(&self, state: &mut State<'_>, rest_rooms: &[[i64; 2]]) -> i64 {
        let (lower, upper) = bounds(self.graph, &state.labelled, &state.label);
        // In the bins beside the interface, if the bounds allow it.
        let within = self.bin * (1.0 - 1e-9);
        let mut left = 0;
        for (piece, rest) in self.graph.components().iter().zip(rest_rooms) {
            let open: Vec<u32> = piece.iter().copied().filter(|&t| !state.labelled[t as usize]).collect();
            if open.is_empty() {
                continue;
            }
            let none = open.len() == piece.len();
            let allowed = |t: u32| {
                if none {
                    (0.0, 0.0)
                } else {
                    (lower[t as usize], upper[t as usize])
                }
            };
            if let Some(GivenInterface { distance, .. }) =
                self.interface.filter(|of| of.distance[piece[0] as usize].is_finite())
            {
                for &t in &open {
                    let x = distance[t as usize].clamp(-within, within);
                    let (low, high) = allowed(t);
                    state.label[t as usize] = x.max(low).min(high);
                }
                continue;
            }
            // The mixture (1 − m) low + m high of a triangle is positive for m above this.
            let turns = |t: u32| {
                let (low, high) = allowed(t);
                if low >= 0.0 {
                    0.0
                } else if high <= 0.0 {
                    1.0
                } else {
                    low / (low - high)
                }
            };
            let mut order: Vec<(f64, u32)> = open.iter().map(|&t| (turns(t), t)).collect();
            order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut weight = 0;
            let enough = order
                .iter()
                .take_while(|&&(_, t)| {
                    weight += self.weights[t as usize];
                    weight <= rest[1]
                })
                .count();
            let at = |i: usize| order.get(i).map(|of| of.0);
            let mix = match (enough.checked_sub(1).and_then(at), at(enough)) {
                (Some(before), Some(after)) => 0.5 * (before + after),
                (None, Some(after)) => 0.5 * after,
                (Some(before), None) => 0.5 * (before + 1.0),
                (None, None) => 0.5,
            };
            for &t in &open {
                let (low, high) = allowed(t);
                let mixed = ((1.0 - mix) * low + mix * high).clamp(-within, within);
                state.label[t as usize] = mixed.max(low).min(high);
            }
            let mut beside = [0, 0];
            for &t in &open {
                let (label, weight) = (state.label[t as usize], self.weights[t as usize]);
                if label.abs() < self.bin {
                    beside[usize::from(!label.is_sign_negative())] += weight;
                } else {
                    left += weight;
                }
            }
            // A triangle crossed by the interface is not a leftover.
            let border = open.iter().map(|&t| self.weights[t as usize]).max().unwrap_or_default();
            left += [0, 1]
                .map(|side| (beside[side] - rest[side].max(0) - border).max(0))
                .iter()
                .sum::<i64>();
        }
        left
    }
}

/// Distance of each triangle's centroid from the nearest one of the other region.
fn to_the_other_region(graph: &DualGraph, distance: &[f64]) -> Vec<f64> {
    let interface = (0..graph.len()).filter_map(|t| {
        let beyond = |link: &&Link| distance[link.to as usize].is_sign_negative() != distance[t].is_sign_negative();
        let near = graph
            .links(t)
            .iter()
            .filter(beyond)
            .map(|link| link.length())
            .reduce(f64::min)?;
        Some((t, near))
    });
    graph.distances(&interface.collect::<Vec<_>>())
}

/// A candidate as one integer: its cost, which is not negative, in the upper half and its number in the lower, so that
/// integers sort by cost, then number.
fn key(cost: f64, t: u32) -> u64 {
    u64::from(single(cost).to_bits()) << 32 | u64::from(t)
}

fn triangle(candidate: u64) -> u32 {
    // The lower half.
    u32::try_from(candidate & u64::from(u32::MAX)).unwrap_or(u32::MAX)
}

/// Sorts the next candidates behind the first `sorted`; returns how many are sorted now.
fn sort_some(candidates: &mut [u64], sorted: usize) -> usize {
    let rest = &mut candidates[sorted..];
    let some = rest.len().min(1024.max(sorted));
    if some < rest.len() {
        rest.select_nth_unstable(some);
    }
    rest[..some].sort_unstable();
    sorted + some
}
