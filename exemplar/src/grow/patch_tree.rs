//! Windows of an exemplar that look like what is known of a window: a tree of patches.
#![allow(
    clippy::cast_possible_truncation,
    reason = "texels, voxels and cells are fewer than 2^32: `grow` refuses more"
)]

use ndarray::ArrayView3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How windows are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Every window of the exemplar is compared: the reference.
    Exact,
    /// Best-first in a tree of patches, so many leaves of up to 32 windows; and the windows that continue what the known neighbours were copied from.
    Tree {
        /// Leaves looked at.
        leaves: usize,
    },
}

impl Default for Search {
    /// 12 leaves: some 400 windows of 60,000.
    fn default() -> Self {
        Self::Tree { leaves: 12 }
    }
}

/// Windows of a leaf.
const LEAF: usize = 32;
/// Standard deviations about its mean within which all that is known is as near to a part of the tree. With 0, parts of mixed windows are passed over and what is rare in the exemplar dies out (soapstone of docs/grow.md, 20³ voxels:
/// deviation .82 of the exemplar's, the exact search .92); with .5 it is .91, and the squared difference the same.
const NODE_SPREAD: f32 = 0.5;

/// A pixel of a window that is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Which sample of the window: pixel × channels + channel.
    pub sample: usize,
    /// Its value.
    pub value: f32,
    /// Its weight; all sum to 1.
    pub weight: f32,
}

/// A window that was found: its distance and its middle texel, row × width + column.
pub(super) type Match = (f32, u32);

/// All whole windows of an exemplar, split in two over and over along the direction in which they differ most, down to leaves that are compared sample by sample, 32 windows at a time.
#[derive(Debug)]
pub(super) struct PatchTree<'a> {
    exemplar: ArrayView3<'a, f32>,
    reach: usize,
    /// Samples of a window.
    samples: usize,
    nodes: Vec<Node>,
    /// Mean window of each node, and how far its windows commonly are from it, sample by sample.
    means: Vec<[f32; 2]>,
    /// Samples of a leaf's windows, sample by sample.
    leaves: Vec<f32>,
    /// Middle texels of a leaf's windows; the last ones may repeat.
    texels: Vec<[u32; LEAF]>,
    /// Whole leaves' windows that are not repeats.
    filled: Vec<u8>,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Split { children: [u32; 2] },
    Leaf { leaf: u32 },
}

impl<'a> PatchTree<'a> {
    /// Windows of side 2 `reach` + 1, which must fit into the exemplar. Cost: N log N times the window, 50 ms for 256² texels and 5 × 5.
    pub(super) fn new(exemplar: ArrayView3<'a, f32>, reach: usize) -> Self {
        let (height, width, channels) = exemplar.dim();
        let side = 2 * reach + 1;
        let mut texels: Vec<u32> = (reach..height - reach)
            .flat_map(|y| (reach..width - reach).map(move |x| (y * width + x) as u32))
            .collect();
        let mut tree = Self {
            exemplar,
            reach,
            samples: side * side * channels,
            nodes: Vec::new(),
            means: Vec::new(),
            leaves: Vec::new(),
            texels: Vec::new(),
            filled: Vec::new(),
        };
        tree.grow(&mut texels);
        tree
    }

    /// Samples of the window about a texel.
    fn window(&self, texel: u32, out: &mut [f32]) {
        let (_, width, channels) = self.exemplar.dim();
        let (y, x) = (texel as usize / width - self.reach, texel as usize % width - self.reach);
        let side = 2 * self.reach + 1;
        for (i, v) in out.iter_mut().enumerate() {
            let pixel = i / channels;
            *v = self.exemplar[[y + pixel / side, x + pixel % side, i % channels]];
        }
    }

    /// Adds a node over these windows and everything below it; returns its number.
    fn grow(&mut self, texels: &mut [u32]) -> u32 {
        let node = self.nodes.len() as u32;
        let n = self.samples;
        // A hundred windows tell the mean and the direction well enough.
        let stride = texels.len().div_ceil(96).max(1);
        let mut some = Vec::new();
        let mut window = vec![0.0; n];
        for &texel in texels.iter().step_by(stride) {
            self.window(texel, &mut window);
            some.extend_from_slice(&window);
        }
        let count = (some.len() / n) as f32;
        let mut mean = vec![0.0; n];
        for window in some.chunks_exact(n) {
            mean.iter_mut().zip(window).for_each(|(m, v)| *m += v / count);
        }
        let mut spread = vec![0.0; n];
        for window in some.chunks_exact(n) {
            spread
                .iter_mut()
                .zip(window.iter().zip(&mean))
                .for_each(|(s, (v, m))| *s += (v - m) * (v - m) / count);
        }
        self.nodes.push(Node::Leaf { leaf: 0 });
        let commonly = if texels.len() <= LEAF { 0.0 } else { NODE_SPREAD };
        self.means
            .extend(mean.iter().zip(&spread).map(|(m, s)| [*m, commonly * s.sqrt()]));
        if texels.len() <= LEAF {
            let leaf = self.texels.len() as u32;
            let full: [u32; LEAF] = std::array::from_fn(|i| texels[i.min(texels.len() - 1)]);
            let start = self.leaves.len();
            self.leaves.resize(start + n * LEAF, 0.0);
            for (i, &texel) in full.iter().enumerate() {
                self.window(texel, &mut window);
                window
                    .iter()
                    .enumerate()
                    .for_each(|(k, v)| self.leaves[start + k * LEAF + i] = *v);
            }
            self.texels.push(full);
            self.filled.push(texels.len() as u8);
            self.nodes[node as usize] = Node::Leaf { leaf };
            return node;
        }
        let direction = principal(&some, &mean);
        let mut seen: Vec<(f32, u32)> = texels
            .iter()
            .map(|&texel| {
                self.window(texel, &mut window);
                (window.iter().zip(&direction).map(|(v, d)| v * d).sum(), texel)
            })
            .collect();
        let half = seen.len() / 2;
        seen.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        texels.iter_mut().zip(&seen).for_each(|(t, s)| *t = s.1);
        let (low, high) = texels.split_at_mut(half);
        // The order inside a half must not depend on how it was selected.
        low.sort_unstable();
        high.sort_unstable();
        let children = [self.grow(low), self.grow(high)];
        self.nodes[node as usize] = Node::Split { children };
        node
    }

    /// Windows whose distance to what is known is at most `1 + tolerance` times the least, sorted by texel, and the least distance; `more` are texels to look at besides, `salt` chooses among parts of the tree that are as near.
    pub(super) fn like(
        &self,
        known: &[Known],
        more: &[u32],
        search: Search,
        tolerance: f32,
        salt: u32,
        found: &mut Vec<Match>,
    ) -> f32 {
        found.clear();
        let mut best = f32::INFINITY;
        let factor = 1.0 + tolerance;
        for &texel in more {
            let distance = self.distance(known, texel);
            if distance <= factor * best {
                best = best.min(distance);
                found.push((distance, texel));
            }
        }
        match search {
            Search::Exact => (0..self.texels.len()).for_each(|leaf| self.look(leaf, known, factor, &mut best, found)),
            Search::Tree { leaves } => {
                let mut open = BinaryHeap::new();
                open.push(Open {
                    distance: 0.0,
                    tie: 0,
                    node: 0,
                });
                let mut seen = 0;
                while let Some(Open { node, .. }) = open.pop() {
                    if seen >= leaves.max(1) {
                        break;
                    }
                    match self.nodes[node as usize] {
                        Node::Leaf { leaf } => {
                            self.look(leaf as usize, known, factor, &mut best, found);
                            seen += 1;
                        }
                        Node::Split { children } => open.extend(children.map(|child| Open {
                            distance: self.distance_of_node(known, child),
                            tie: shuffled(child ^ salt),
                            node: child,
                        })),
                    }
                }
            }
        }
        found.retain(|(distance, _)| *distance <= factor * best);
        found.sort_unstable_by_key(|m| m.1);
        found.dedup_by_key(|m| m.1);
        best
    }

    /// Compares all windows of a leaf.
    fn look(&self, leaf: usize, known: &[Known], factor: f32, best: &mut f32, found: &mut Vec<Match>) {
        let samples = &self.leaves[leaf * self.samples * LEAF..(leaf + 1) * self.samples * LEAF];
        let mut sums = [0.0_f32; LEAF];
        for known in known {
            let of_all = &samples[known.sample * LEAF..(known.sample + 1) * LEAF];
            for (sum, value) in sums.iter_mut().zip(of_all) {
                let off = value - known.value;
                *sum += known.weight * off * off;
            }
        }
        let filled = usize::from(self.filled[leaf]);
        let least = sums.iter().fold(f32::INFINITY, |m, &v| m.min(v));
        *best = best.min(least);
        let most = factor * *best;
        if least <= most {
            let near = sums[..filled]
                .iter()
                .zip(&self.texels[leaf])
                .filter(|(d, _)| **d <= most);
            found.extend(near.map(|(d, texel)| (*d, *texel)));
        }
    }

    /// How far what is known is from where a node's windows commonly lie.
    fn distance_of_node(&self, known: &[Known], node: u32) -> f32 {
        let means = &self.means[node as usize * self.samples..(node as usize + 1) * self.samples];
        known
            .iter()
            .map(|k| {
                let [mean, spread] = means[k.sample];
                let beyond = ((mean - k.value).abs() - spread).max(0.0);
                k.weight * beyond * beyond
            })
            .sum()
    }

    /// Distance of the window about a texel whose window is whole.
    fn distance(&self, known: &[Known], texel: u32) -> f32 {
        let (_, width, channels) = self.exemplar.dim();
        let (y, x) = (texel as usize / width - self.reach, texel as usize % width - self.reach);
        let side = 2 * self.reach + 1;
        known
            .iter()
            .map(|k| {
                let pixel = k.sample / channels;
                let value = self.exemplar[[y + pixel / side, x + pixel % side, k.sample % channels]];
                k.weight * (value - k.value).powi(2)
            })
            .sum()
    }

    /// The texel `(row, column)` steps away from another, if the window about it is whole.
    pub(super) fn beside(&self, texel: u32, row: isize, column: isize) -> Option<u32> {
        let (height, width, _) = self.exemplar.dim();
        let y = (texel as usize / width).checked_add_signed(row)?;
        let x = (texel as usize % width).checked_add_signed(column)?;
        let whole = (self.reach..height - self.reach).contains(&y) && (self.reach..width - self.reach).contains(&x);
        whole.then_some((y * width + x) as u32)
    }
}

/// A number that looks random.
fn shuffled(number: u32) -> u32 {
    let mixed = (number ^ (number >> 16)).wrapping_mul(0x7feb_352d);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x846c_a68b);
    mixed ^ (mixed >> 16)
}

/// Direction in which windows differ most, by a few rounds of power iteration.
fn principal(windows: &[f32], mean: &[f32]) -> Vec<f32> {
    let n = mean.len();
    // A start that is orthogonal to nothing in particular, and the same everywhere.
    let mut direction: Vec<f32> = (0..n).map(|i| 1.0 + 0.37 * ((i * 7919) % 13) as f32 / 13.0).collect();
    for _ in 0..4 {
        let mut next = vec![0.0; n];
        for window in windows.chunks_exact(n) {
            let along: f32 = window
                .iter()
                .zip(mean)
                .zip(&direction)
                .map(|((v, m), d)| (v - m) * d)
                .sum();
            next.iter_mut()
                .zip(window)
                .zip(mean)
                .for_each(|((s, v), m)| *s += along * (v - m));
        }
        let length = next.iter().map(|v| v * v).sum::<f32>().sqrt();
        if length <= 0.0 {
            break;
        }
        next.iter_mut().for_each(|v| *v /= length);
        direction = next;
    }
    direction
}

/// A part of the tree that waits; the nearest comes first, of equals the first.
#[derive(Clone, Copy, Debug)]
struct Open {
    distance: f32,
    /// Random, so that of parts that are as near each has its chance: what is common in the exemplar must not hide what is rare.
    tie: u32,
    node: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .distance
            .total_cmp(&self.distance)
            .then(other.tie.cmp(&self.tie))
            .then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

#[cfg(test)]
mod tests {
    use super::{Known, PatchTree, Search};
    use ndarray::Array3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn picture(seed: u64) -> Array3<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise = Array3::from_shape_fn((52, 42, 1), |_| rng.random::<f32>());
        Array3::from_shape_fn((50, 40, 1), |(y, x, _)| {
            (0..9).map(|k| noise[[y + k / 3, x + k % 3, 0]]).sum::<f32>() / 9.0
        })
    }

    /// The exact search is the least over all windows; the tree's result is one of them, and nearly as near.
    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        let (exemplar, other) = (picture(1), picture(2));
        let tree = PatchTree::new(exemplar.view(), 2);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut found, mut exact_sum, mut tree_sum) = (Vec::new(), 0.0, 0.0);
        for _ in 0..300 {
            let (y, x) = (rng.random_range(2..48), rng.random_range(2..38));
            let known: Vec<Known> = (0..25)
                .filter(|pixel| *pixel != 12 && rng.random::<f64>() < 0.6)
                .map(|sample| Known {
                    sample,
                    value: other[[y + sample / 5 - 2, x + sample % 5 - 2, 0]],
                    weight: 0.07,
                })
                .collect();
            let brute = (2..48)
                .flat_map(|y| (2..38).map(move |x| y * 40 + x))
                .map(|texel| tree.distance(&known, texel as u32))
                .fold(f32::INFINITY, f32::min);
            let exact = tree.like(&known, &[], Search::Exact, 0.1, 0, &mut found);
            assert!((exact - brute).abs() <= 1e-6 * (1.0 + brute), "{exact} {brute}");
            assert!(!found.is_empty() && found.iter().all(|(d, _)| *d <= 1.1 * exact + 1e-9));
            let quick = tree.like(&known, &[], Search::Tree { leaves: 12 }, 0.1, 7, &mut found);
            assert!(quick >= exact - 1e-7);
            exact_sum += f64::from(exact);
            tree_sum += f64::from(quick);
        }
        assert!(tree_sum < 1.1 * exact_sum, "{tree_sum} {exact_sum}");
    }
}
