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
/// A window's rows are padded to a multiple of so many samples.
const LANES: usize = 4;
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

/// All whole windows of an exemplar, split in two over and over along the direction in which they differ most, down to leaves whose windows are compared one by one, row by row, the heaviest row first, until they are too far.
#[derive(Debug)]
pub(super) struct PatchTree<'a> {
    exemplar: ArrayView3<'a, f32>,
    reach: usize,
    /// Samples of a window, without and with what pads its rows.
    samples: usize,
    padded: usize,
    /// The exemplar's samples, row by row, and a few zeros.
    plain: Vec<f32>,
    nodes: Vec<Node>,
    /// Mean window of each node, rows padded, and then how far its windows commonly are from it.
    means: Vec<f32>,
    /// Middle texels of the windows, leaf by leaf.
    texels: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Split { children: [u32; 2] },
    Leaf { first: u32, last: u32 },
}

impl<'a> PatchTree<'a> {
    /// Windows of side 2 `reach` + 1, which must fit into the exemplar. Cost: N log N times the window, 50 ms for 256² texels and 5 × 5.
    pub(super) fn new(exemplar: ArrayView3<'a, f32>, reach: usize) -> Self {
        let (height, width, channels) = exemplar.dim();
        let side = 2 * reach + 1;
        let mut texels: Vec<u32> = (reach..height - reach)
            .flat_map(|y| (reach..width - reach).map(move |x| (y * width + x) as u32))
            .collect();
        let row = side * channels;
        let mut tree = Self {
            exemplar,
            reach,
            samples: side * row,
            padded: side * row.next_multiple_of(LANES),
            plain: exemplar.iter().copied().chain([0.0; LANES]).collect(),
            nodes: Vec::new(),
            means: Vec::new(),
            texels: Vec::new(),
        };
        tree.grow(&mut texels);
        tree
    }

    /// Samples of a window's row.
    fn row(&self) -> usize {
        (2 * self.reach + 1) * self.exemplar.dim().2
    }

    /// Where the window about a texel begins.
    fn first(&self, texel: u32) -> usize {
        let (_, width, channels) = self.exemplar.dim();
        (texel as usize - self.reach * width - self.reach) * channels
    }

    /// Samples of the window about a texel.
    fn window(&self, texel: u32, out: &mut [f32]) {
        let (_, width, channels) = self.exemplar.dim();
        for (i, row) in out.chunks_exact_mut(self.row()).enumerate() {
            let from = self.first(texel) + i * width * channels;
            row.copy_from_slice(&self.plain[from..from + row.len()]);
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
        self.nodes.push(Node::Leaf { first: 0, last: 0 });
        let commonly = if texels.len() <= LEAF { 0.0 } else { NODE_SPREAD };
        let (start, row) = (self.means.len(), self.row());
        let wide = row.next_multiple_of(LANES);
        self.means.resize(start + 2 * self.padded, 0.0);
        for (sample, (mean, spread)) in mean.iter().zip(&spread).enumerate() {
            let at = start + sample / row * wide + sample % row;
            self.means[at] = *mean;
            self.means[at + self.padded] = commonly * spread.sqrt();
        }
        if texels.len() <= LEAF {
            let first = self.texels.len() as u32;
            self.texels.extend_from_slice(texels);
            self.nodes[node as usize] = Node::Leaf {
                first,
                last: self.texels.len() as u32,
            };
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
        let sought = Sought::new(known, self.row(), self.padded);
        self.look(more, &sought, factor, &mut best, found);
        match search {
            Search::Exact => self.look(&self.texels, &sought, factor, &mut best, found),
            Search::Tree { leaves } => {
                let mut open = BinaryHeap::new();
                let mut next = Some(0);
                for _ in 0..leaves.max(1) {
                    // From the nearest part that waits straight down to a leaf, always to the nearer half; the other waits.
                    let Some(mut node) = next.take().or_else(|| open.pop().map(|open: Open| open.node)) else {
                        break;
                    };
                    while let Node::Split { children } = self.nodes[node as usize] {
                        let [left, right] = children.map(|child| Open {
                            distance: self.distance_of_node(&sought, child),
                            tie: shuffled(child ^ salt),
                            node: child,
                        });
                        let (nearer, farther) = if left > right { (left, right) } else { (right, left) };
                        open.push(farther);
                        node = nearer.node;
                    }
                    if let Node::Leaf { first, last } = self.nodes[node as usize] {
                        let texels = &self.texels[first as usize..last as usize];
                        self.look(texels, &sought, factor, &mut best, found);
                    }
                }
            }
        }
        found.retain(|(distance, _)| *distance <= factor * best);
        found.sort_unstable_by_key(|m| m.1);
        found.dedup_by_key(|m| m.1);
        best
    }

    /// Compares the windows about these texels.
    fn look(&self, texels: &[u32], sought: &Sought, factor: f32, best: &mut f32, found: &mut Vec<Match>) {
        for &texel in texels {
            let distance = self.distance(sought, texel, factor * *best);
            if distance <= factor * *best {
                *best = best.min(distance);
                found.push((distance, texel));
            }
        }
    }

    /// How far what is known is from where a node's windows commonly lie.
    fn distance_of_node(&self, sought: &Sought, node: u32) -> f32 {
        let start = 2 * self.padded * node as usize;
        let (means, _) = self.means[start..start + self.padded].as_chunks::<LANES>();
        let (spreads, _) = self.means[start + self.padded..start + 2 * self.padded].as_chunks::<LANES>();
        let mut sums = [0.0_f32; LANES];
        for (row, wanted) in sought.rows() {
            let from = row * wanted.len();
            let theirs = means[from..].iter().zip(&spreads[from..]);
            for ((mean, spread), (value, weight)) in theirs.zip(wanted) {
                for lane in 0..LANES {
                    let beyond = ((mean[lane] - value[lane]).abs() - spread[lane]).max(0.0);
                    sums[lane] += weight[lane] * beyond * beyond;
                }
            }
        }
        sums.iter().sum()
    }

    /// Distance of the window about a texel whose window is whole; once it is more than `most`, something between that and the distance.
    fn distance(&self, sought: &Sought, texel: u32, most: f32) -> f32 {
        let (_, width, channels) = self.exemplar.dim();
        let first = self.first(texel);
        let mut sums = [0.0_f32; LANES];
        for (row, wanted) in sought.rows() {
            let from = first + row * width * channels;
            let (theirs, _) = self.plain[from..from + wanted.len() * LANES].as_chunks::<LANES>();
            for (theirs, (value, weight)) in theirs.iter().zip(wanted) {
                for lane in 0..LANES {
                    let off = theirs[lane] - value[lane];
                    sums[lane] += weight[lane] * off * off;
                }
            }
            let sum: f32 = sums.iter().sum();
            if sum > most {
                return sum;
            }
        }
        sums.iter().sum()
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

/// Values and weights of so many neighbouring samples.
type Lane = ([f32; LANES], [f32; LANES]);

/// What is known, row by row, the heaviest row first; weight 0 where nothing is.
struct Sought {
    lanes: Vec<Lane>,
    /// Rows of which something is known.
    rows: Vec<usize>,
    /// Lanes a row.
    across: usize,
}

impl Sought {
    /// `row` samples a row, `padded` in all.
    fn new(known: &[Known], row: usize, padded: usize) -> Self {
        let across = row.div_ceil(LANES);
        let mut lanes = vec![([0.0; LANES], [0.0; LANES]); padded / LANES];
        let mut weights = vec![0.0; padded / LANES / across];
        for k in known {
            let (line, column) = (k.sample / row, k.sample % row);
            let (values, of) = &mut lanes[line * across + column / LANES];
            values[column % LANES] = k.value;
            of[column % LANES] = k.weight;
            weights[line] += k.weight;
        }
        let mut rows: Vec<usize> = (0..weights.len()).filter(|&line| weights[line] > 0.0).collect();
        rows.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)));
        Self { lanes, rows, across }
    }

    fn rows(&self) -> impl Iterator<Item = (usize, &[Lane])> {
        self.rows
            .iter()
            .map(|&row| (row, &self.lanes[row * self.across..(row + 1) * self.across]))
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
    use super::{Known, PatchTree, Search, Sought};
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
                .map(|texel| tree.distance(&Sought::new(&known, 5, 40), texel as u32, f32::INFINITY))
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
