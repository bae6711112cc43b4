//! The k pixels whose neighbourhoods are most similar to that of each pixel of an exemplar.

use rayon::prelude::*;

use crate::level::{Atlas, Level, NONE};
use crate::numbers::number;
use crate::principal::Projected;
use crate::window::Window;

/// Fraction of the variance of windows that their projection keeps, and most components.
const KEPT: f64 = 0.95;
const COMPONENTS: usize = 12;
/// Windows in a leaf of the tree, and leaves visited per query.
const LEAF: usize = 12;
const LEAVES: usize = 24;

/// The k most similar places of each place; [`NONE`] where there are fewer.
pub(crate) struct Similar {
    k: usize,
    places: Vec<u32>,
}

impl Similar {
    /// Finds them for all exemplars of a level. Places within half a window of each other are excluded, since their
    /// windows overlap.
    pub(crate) fn learn(level: &Level, atlas: &Atlas, window: &Window, k: usize) -> Self {
        let mut places = vec![NONE; level.pixel.len() * k];
        if k == 0 {
            return Self { k, places };
        }
        for (sheet, windows) in level.windows.iter().enumerate() {
            let projected = Projected::new(level, sheet, window, KEPT, COMPONENTS);
            let tree = Tree::new(&projected);
            let located: Vec<(usize, usize)> = windows
                .iter()
                .map(|&place| {
                    let (_, row, column) = atlas.locate(level.pixel[place as usize] as usize);
                    (row, column)
                })
                .collect();
            let near = window.half.div_ceil(2) * level.step;
            let found: Vec<Vec<u32>> = (0..windows.len())
                .into_par_iter()
                .map(|i| {
                    tree.nearest(&projected, i, k, |j, kept| {
                        let apart = |j: usize, i: usize| {
                            located[j].0.abs_diff(located[i].0) > near || located[j].1.abs_diff(located[i].1) > near
                        };
                        apart(j, i) && kept.iter().all(|&(_, other)| apart(j, other as usize))
                    })
                })
                .collect();
            for (&place, found) in windows.iter().zip(found) {
                let at = place as usize * k;
                for (slot, j) in places[at..at + k].iter_mut().zip(found) {
                    *slot = windows[j as usize];
                }
            }
        }
        Self { k, places }
    }

    /// Places similar to this one, the most similar first.
    #[inline]
    pub(crate) fn of(&self, place: usize) -> &[u32] {
        &self.places[place * self.k..(place + 1) * self.k]
    }
}

/// A k-d tree of projected windows.
struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

enum Node {
    Leaf { first: u32, last: u32 },
    Split { axis: u32, at: f32, left: u32, right: u32 },
}

impl Tree {
    fn new(projected: &Projected) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..number(projected.len())).collect(),
        };
        let n = tree.order.len();
        tree.grow(projected, 0, n);
        tree
    }

    fn grow(&mut self, projected: &Projected, first: usize, last: usize) -> u32 {
        let node = number(self.nodes.len());
        self.nodes.push(Node::Leaf {
            first: number(first),
            last: number(last),
        });
        if last - first <= LEAF {
            return node;
        }
        let members = &mut self.order[first..last];
        let spread = |axis: usize| {
            let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
            for &i in members.iter() {
                let v = f64::from(projected.point(i as usize)[axis]);
                sum += v;
                squares += v * v;
            }
            squares - sum * sum / members.len() as f64
        };
        let axis = (0..projected.dimensions)
            .map(|axis| (spread(axis), axis))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
            .map_or(0, |(_, axis)| axis);
        let value = |i: u32| projected.point(i as usize)[axis];
        let middle = members.len() / 2;
        members.select_nth_unstable_by(middle, |&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
        let at = value(members[middle]);
        let left = self.grow(projected, first, first + middle);
        let right = self.grow(projected, first + middle, last);
        self.nodes[node as usize] = Node::Split {
            axis: number(axis),
            at,
            left,
            right,
        };
        node
    }

    /// The `k` nearest windows to window `i` that `counts` accepts beside those already kept, in the [`LEAVES`] nearest
    /// leaves.
    fn nearest(
        &self,
        projected: &Projected,
        i: usize,
        k: usize,
        counts: impl Fn(usize, &[(f32, u32)]) -> bool,
    ) -> Vec<u32> {
        let query = projected.point(i);
        let mut seen: Vec<(f32, u32)> = Vec::new();
        // Open subtrees, with a lower bound of their distance.
        let mut open: Vec<(f32, u32)> = vec![(0.0, 0)];
        let mut leaves = 0;
        while leaves < LEAVES {
            let Some(best) =
                (0..open.len()).min_by(|&a, &b| open[a].0.total_cmp(&open[b].0).then(open[a].1.cmp(&open[b].1)))
            else {
                break;
            };
            let (bound, mut node) = open.swap_remove(best);
            loop {
                match self.nodes[node as usize] {
                    Node::Split { axis, at, left, right } => {
                        let beyond = query[axis as usize] - at;
                        let (near, far) = if beyond < 0.0 { (left, right) } else { (right, left) };
                        open.push((bound.max(beyond * beyond), far));
                        node = near;
                    }
                    Node::Leaf { first, last } => {
                        let members = &self.order[first as usize..last as usize];
                        seen.extend(members.iter().map(|&j| (projected.squared(query, j as usize), j)));
                        leaves += 1;
                        break;
                    }
                }
            }
        }
        seen.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut kept: Vec<(f32, u32)> = Vec::with_capacity(k);
        for &(distance, j) in &seen {
            if kept.len() == k {
                break;
            }
            if counts(j as usize, &kept) {
                kept.push((distance, j));
            }
        }
        kept.into_iter().map(|(_, j)| j).collect()
    }
}
