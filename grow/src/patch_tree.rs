//! A tree of the patches of an exemplar, which finds windows similar to the known part of a window.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use ndarray::ArrayView3;

use crate::numbers::number;
use crate::search::Search;

/// Most windows in a leaf.
const LEAF: usize = 32;
/// A window's rows are padded to a multiple of so many samples.
const LANES: usize = 4;
/// Standard deviations from the mean of a node within which a sample has no distance to it. With 0, nodes with
/// different windows are skipped and rare patterns of the exemplar die out (soapstone of docs/grow.md, 20³ voxels:
/// standard deviation .82 of the exemplar's, with the exact search .92); with .5 it is .91, at the same squared
/// difference.
const NODE_SPREAD: f32 = 0.5;

/// A known sample of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// Position in the window: pixel × channels + channel.
    pub(crate) sample: usize,
    /// Its value.
    pub(crate) value: f32,
    /// Its weight; the weights sum to 1.
    pub(crate) weight: f32,
}

/// A window found: its distance and its central texel, row × width + column.
pub(crate) type Match = (f32, u32);

/// All whole windows of an exemplar, split recursively in two along the direction of their largest variance. The
/// windows of a leaf are compared one by one, row by row, the row of largest weight first, until their distance is too
/// large.
#[derive(Debug)]
pub(crate) struct PatchTree<'a> {
    exemplar: ArrayView3<'a, f32>,
    reach: usize,
    /// Samples of a window, without and with the padding of its rows.
    samples: usize,
    padded: usize,
    /// The exemplar's samples, row by row, and a few zeros.
    plain: Vec<f32>,
    nodes: Vec<Node>,
    /// Mean window of each node, rows padded, followed by the tolerated deviations from it.
    means: Vec<f32>,
    /// Central texels of the windows, leaf by leaf.
    texels: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Split { children: [u32; 2] },
    Leaf { first: u32, last: u32 },
}

impl<'a> PatchTree<'a> {
    /// The tree of the windows of side 2 `reach` + 1, which must fit into the exemplar. Cost: N log N times the samples
    /// of a window; 50 ms for 256² texels and 5 × 5.
    pub(crate) fn new(exemplar: ArrayView3<'a, f32>, reach: usize) -> Self {
        let (height, width, channels) = exemplar.dim();
        let side = 2 * reach + 1;
        let mut texels: Vec<u32> = (reach..height - reach)
            .flat_map(|y| (reach..width - reach).map(move |x| number(y * width + x)))
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

    /// First sample of the window about a texel.
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

    /// Adds a node with these windows and its descendants; returns its number.
    fn grow(&mut self, texels: &mut [u32]) -> u32 {
        let node = number(self.nodes.len());
        let n = self.samples;
        // About a hundred windows determine the mean and the direction well enough.
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
        let tolerated = if texels.len() <= LEAF { 0.0 } else { NODE_SPREAD };
        let (start, row) = (self.means.len(), self.row());
        let wide = row.next_multiple_of(LANES);
        self.means.resize(start + 2 * self.padded, 0.0);
        for (sample, (mean, spread)) in mean.iter().zip(&spread).enumerate() {
            let at = start + sample / row * wide + sample % row;
            self.means[at] = *mean;
            self.means[at + self.padded] = tolerated * spread.sqrt();
        }
        if texels.len() <= LEAF {
            let first = number(self.texels.len());
            self.texels.extend_from_slice(texels);
            self.nodes[node as usize] = Node::Leaf {
                first,
                last: number(self.texels.len()),
            };
            return node;
        }
        let direction = principal(&some, &mean);
        let mut projected: Vec<(f32, u32)> = texels
            .iter()
            .map(|&texel| {
                self.window(texel, &mut window);
                (window.iter().zip(&direction).map(|(v, d)| v * d).sum(), texel)
            })
            .collect();
        let half = projected.len() / 2;
        projected.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        texels.iter_mut().zip(&projected).for_each(|(t, s)| *t = s.1);
        let (low, high) = texels.split_at_mut(half);
        // The order within a half must not depend on the selection algorithm.
        low.sort_unstable();
        high.sort_unstable();
        let children = [self.grow(low), self.grow(high)];
        self.nodes[node as usize] = Node::Split { children };
        node
    }

    /// Writes to `found` the windows whose distance to the known samples is at most `1 + tolerance` times the least,
    /// sorted by texel, and returns the least distance. The windows about the texels `more` are compared too; `salt`
    /// chooses among nodes at equal distance.
    pub(crate) fn similar(
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
        self.compare(more, &sought, factor, &mut best, found);
        match search {
            Search::Exact => self.compare(&self.texels, &sought, factor, &mut best, found),
            Search::Tree { leaves } => {
                let mut open = BinaryHeap::new();
                let mut next = Some(0);
                for _ in 0..leaves.max(1) {
                    // From the nearest open node down to a leaf, always to the nearer child; the other child stays
                    // open.
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
                        self.compare(texels, &sought, factor, &mut best, found);
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
    fn compare(&self, texels: &[u32], sought: &Sought, factor: f32, best: &mut f32, found: &mut Vec<Match>) {
        for &texel in texels {
            let distance = self.distance(sought, texel, factor * *best);
            if distance <= factor * *best {
                *best = best.min(distance);
                found.push((distance, texel));
            }
        }
    }

    /// Distance of the known samples from the tolerated range of a node's windows.
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

    /// Distance of the whole window about a texel; if it is larger than `most`, some number between `most` and the
    /// distance.
    fn distance(&self, sought: &Sought, texel: u32, most: f32) -> f32 {
        let (_, width, channels) = self.exemplar.dim();
        let first = self.first(texel);
        let mut sums = [0.0_f32; LANES];
        for (row, wanted) in sought.rows() {
            let from = first + row * width * channels;
            let (theirs, _) = self.plain[from..from + wanted.len() * LANES].as_chunks::<LANES>();
            for (theirs, (value, weight)) in theirs.iter().zip(wanted) {
                for lane in 0..LANES {
                    let difference = theirs[lane] - value[lane];
                    sums[lane] += weight[lane] * difference * difference;
                }
            }
            let sum: f32 = sums.iter().sum();
            if sum > most {
                return sum;
            }
        }
        sums.iter().sum()
    }

    /// The texel `(row, column)` steps away from another, if the window about it lies inside the exemplar.
    pub(crate) fn beside(&self, texel: u32, row: isize, column: isize) -> Option<u32> {
        let (height, width, _) = self.exemplar.dim();
        let y = (texel as usize / width).checked_add_signed(row)?;
        let x = (texel as usize % width).checked_add_signed(column)?;
        let whole = (self.reach..height - self.reach).contains(&y) && (self.reach..width - self.reach).contains(&x);
        whole.then_some(number(y * width + x))
    }
}

/// Values and weights of neighbouring samples.
type Lane = ([f32; LANES], [f32; LANES]);

/// The known samples, row by row; unknown samples have weight 0.
struct Sought {
    lanes: Vec<Lane>,
    /// Rows with known samples, the row of largest weight first.
    rows: Vec<usize>,
    /// Lanes per row.
    across: usize,
}

impl Sought {
    /// `row` samples per row, `padded` in all.
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

/// A pseudo-random function of a number.
fn shuffled(number: u32) -> u32 {
    let mixed = (number ^ (number >> 16)).wrapping_mul(0x7feb_352d);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x846c_a68b);
    mixed ^ (mixed >> 16)
}

/// Direction of the largest variance of the windows, by a few power iterations.
fn principal(windows: &[f32], mean: &[f32]) -> Vec<f32> {
    let n = mean.len();
    // A fixed start that is unlikely to be orthogonal to the result.
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

/// An open node; the nearest comes first.
#[derive(Clone, Copy, Debug)]
struct Open {
    distance: f32,
    /// Random, so that each of several equally near nodes can come first: common patterns of the exemplar must not hide
    /// rare ones.
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
    use super::{Known, PatchTree, Sought};
    use crate::numbers::number;
    use crate::search::Search;
    use ndarray::Array3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn texture(seed: u64) -> Array3<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise = Array3::from_shape_fn((52, 42, 1), |_| rng.random::<f32>());
        Array3::from_shape_fn((50, 40, 1), |(y, x, _)| {
            (0..9).map(|k| noise[[y + k / 3, x + k % 3, 0]]).sum::<f32>() / 9.0
        })
    }

    /// The exact search finds the least distance of all windows; the tree finds one of them, at nearly that distance.
    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        let (exemplar, other) = (texture(1), texture(2));
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
                .map(|texel| tree.distance(&Sought::new(&known, 5, 40), number(texel), f32::INFINITY))
                .fold(f32::INFINITY, f32::min);
            let exact = tree.similar(&known, &[], Search::Exact, 0.1, 0, &mut found);
            assert!((exact - brute).abs() <= 1e-6 * (1.0 + brute), "{exact} {brute}");
            assert!(!found.is_empty() && found.iter().all(|(d, _)| *d <= 1.1 * exact + 1e-9));
            let quick = tree.similar(&known, &[], Search::Tree { leaves: 12 }, 0.1, 7, &mut found);
            assert!(quick >= exact - 1e-7);
            exact_sum += f64::from(exact);
            tree_sum += f64::from(quick);
        }
        assert!(tree_sum < 1.1 * exact_sum, "{tree_sum} {exact_sum}");
    }
}
