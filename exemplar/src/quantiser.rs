//! Tree-structured vector quantisation: a binary tree of mean windows.

use crate::level::Level;
use crate::numbers::single;
use crate::window::{Window, weighted_distance};

/// Windows in a leaf, and iterations of two-means per split.
const LEAF: usize = 8;
const ITERATIONS: usize = 6;

/// The tree of one exemplar's windows.
pub(crate) struct Quantiser {
    nodes: Vec<Node>,
    /// Places of the windows, leaf by leaf.
    places: Vec<u32>,
    /// Mean windows of the nodes, one after the other.
    means: Vec<f32>,
    length: usize,
}

enum Node {
    Leaf { first: usize, last: usize },
    Split { left: usize, right: usize },
}

impl Quantiser {
    /// Splits the windows about `places` recursively in two by two-means until the parts are small.
    ///
    /// # References
    ///
    /// Wei & Levoy 2000, section 4; Gersho & Gray 1992.
    pub(crate) fn new(level: &Level, places: &[u32], window: &Window) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            places: places.to_vec(),
            means: Vec::new(),
            length: window.len(),
        };
        let n = places.len();
        tree.grow(level, window, 0, n);
        tree
    }

    fn grow(&mut self, level: &Level, window: &Window, first: usize, last: usize) -> usize {
        let node = self.nodes.len();
        let mean = mean(level, window, &self.places[first..last]);
        self.means.extend_from_slice(&mean);
        self.nodes.push(Node::Leaf { first, last });
        if last - first <= LEAF {
            return node;
        }
        // The two means start at the window farthest from the mean, and at the window farthest from that one.
        let members = self.places[first..last].to_vec();
        let mut buffer = vec![0.0; self.length];
        let mut farthest = |from: &[f32]| {
            let mut best = (f32::NEG_INFINITY, members[0]);
            for &place in &members {
                window.copy(level, place as usize, &mut buffer);
                let distance = weighted_distance(from, &buffer, &window.weights);
                if distance > best.0 {
                    best = (distance, place);
                }
            }
            let mut found = vec![0.0; from.len()];
            window.copy(level, best.1 as usize, &mut found);
            found
        };
        let one = farthest(&mean);
        let mut means = [farthest(&one), one];
        let mut parts = [Vec::new(), Vec::new()];
        for _ in 0..ITERATIONS {
            parts = [Vec::new(), Vec::new()];
            for &place in &members {
                window.copy(level, place as usize, &mut buffer);
                let [a, b] = [0, 1].map(|i: usize| weighted_distance(&means[i], &buffer, &window.weights));
                parts[usize::from(b < a)].push(place);
            }
            if parts.iter().any(Vec::is_empty) {
                break;
            }
            means = [0, 1].map(|i: usize| self::mean(level, window, &parts[i]));
        }
        if parts.iter().any(Vec::is_empty) {
            // All windows are equal.
            return node;
        }
        let middle = first + parts[0].len();
        self.places[first..middle].copy_from_slice(&parts[0]);
        self.places[middle..last].copy_from_slice(&parts[1]);
        let left = self.grow(level, window, first, middle);
        let right = self.grow(level, window, middle, last);
        self.nodes[node] = Node::Split { left, right };
        node
    }

    /// The places of the leaf that is reached by descending to the nearer mean.
    pub(crate) fn leaf(&self, window: &[f32], weights: &[f32]) -> &[u32] {
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Leaf { first, last } => return &self.places[first..last.min(first + 4 * LEAF)],
                Node::Split { left, right } => {
                    let to = |node: usize| {
                        weighted_distance(
                            window,
                            &self.means[node * self.length..(node + 1) * self.length],
                            weights,
                        )
                    };
                    node = if to(right) < to(left) { right } else { left };
                }
            }
        }
    }
}

fn mean(level: &Level, window: &Window, places: &[u32]) -> Vec<f32> {
    let mut sum = vec![0.0_f64; window.len()];
    let mut buffer = vec![0.0; window.len()];
    for &place in places {
        window.copy(level, place as usize, &mut buffer);
        sum.iter_mut().zip(&buffer).for_each(|(s, &v)| *s += f64::from(v));
    }
    sum.into_iter().map(|s| single(s / places.len() as f64)).collect()
}
