//! Lower and upper bounds that the labels assigned so far impose on the other triangles, propagated over the surface as
//! far as they matter.

use crate::budget::Levels;
use crate::conversions::{index, whole_part};
use crate::dual::DualGraph;
use crate::wavefront::Wavefront;

/// One region during labelling, as if it were the positive one: labels and bounds of the negative region have their
/// signs changed.
///
/// `bound[i]` = max over the region's labels of x − d, the least label that triangle i can have. An unlabelled triangle
/// with a bound in level q must get a label of level q or above: it is *forced*, and takes room in level q.
pub(crate) struct Region<'a> {
    graph: &'a DualGraph,
    weights: &'a [i64],
    /// Height of a level.
    height: f64,
    pub(crate) bound: Vec<f64>,
    /// Level + 1 in which the triangle is counted as forced; 0: none.
    counted: Vec<u32>,
    /// Weight forced into each level.
    forced: Vec<i64>,
    /// Triangles that were forced into each level; some have left it since.
    came: Vec<Vec<u32>>,
    /// By how much a level may be overfilled.
    tolerance: i64,
    front: Wavefront,
    undo: Vec<Change>,
    /// Steps examined since this was last set to zero.
    pub(crate) work: u64,
}

#[derive(Clone, Copy)]
struct Change {
    triangle: u32,
    counted: u32,
    bound: f64,
}

/// How much may be forced into each level.
pub(crate) struct Limit<'a> {
    pub(crate) room: &'a Levels,
    /// Levels below this one may use room left in the levels above them; 0: none may.
    pub(crate) below: usize,
    pub(crate) spare: i64,
}

/// Buckets at most half an edge wide, a whole number of them per level.
fn bucket(graph: &DualGraph, height: f64) -> f64 {
    height / (2.0 * height / graph.mean_length()).ceil().clamp(1.0, 512.0)
}

/// A region whose seeds would force more triangles into a level than it has room for.
pub(crate) struct Overfull;

impl<'a> Region<'a> {
    pub(crate) fn new(graph: &'a DualGraph, weights: &'a [i64], height: f64, levels: usize, tolerance: i64) -> Self {
        Self {
            graph,
            weights,
            height,
            bound: vec![f64::NEG_INFINITY; graph.len()],
            counted: vec![0; graph.len()],
            forced: vec![0; levels],
            came: vec![Vec::new(); levels],
            tolerance,
            front: Wavefront::new(bucket(graph, height)),
            undo: Vec::new(),
            work: 0,
        }
    }

    /// Clears the counts for the next component of the mesh.
    pub(crate) fn clear_counts(&mut self) {
        self.forced.fill(0);
        self.came.iter_mut().for_each(Vec::clear);
    }

    /// The unlabelled triangles that must be given a label of this level, most extreme first.
    pub(crate) fn forced_into(&mut self, level: usize, labelled: &[bool]) -> Vec<u32> {
        let mut come = std::mem::take(&mut self.came[level]);
        come.retain(|&t| !labelled[t as usize] && self.counted[t as usize] as usize == level + 1);
        let bound = &self.bound;
        come.sort_unstable_by(|&a, &b| bound[b as usize].total_cmp(&bound[a as usize]).then(a.cmp(&b)));
        come.dedup();
        come
    }

    /// Marks a triangle as labelled: it no longer counts as forced.
    pub(crate) fn settle(&mut self, t: u32) {
        let counted = std::mem::replace(&mut self.counted[t as usize], 0);
        if counted > 0 {
            self.forced[counted as usize - 1] -= self.weights[t as usize];
        }
    }

    /// Labels the triangles `seeds` with `value` and propagates the bounds that exceed `floor`. If that would force
    /// more into a level than `limit` allows, nothing changes and the result is [`Overfull`].
    pub(crate) fn spread(
        &mut self,
        seeds: &[u32],
        value: f64,
        floor: f64,
        labelled: &mut [bool],
        limit: &Limit<'_>,
    ) -> Result<(), Overfull> {
        self.front.restart(value);
        self.undo.clear();
        for &t in seeds {
            self.raise(t, value);
            self.settle(t);
            labelled[t as usize] = true;
        }
        while let Some((value, t)) = self.front.pop() {
            if value < self.bound[t as usize] {
                continue;
            }
            // Values arrive level by level: a triangle that leaves a level for a higher one does so before others
            // enter.
            if value >= 0.0 && !labelled[t as usize] {
                let level = whole_part(value / self.height);
                let counted = self.counted[t as usize] as usize;
                if counted != level + 1 {
                    let weight = self.weights[t as usize];
                    if counted > 0 {
                        self.forced[counted - 1] -= weight;
                    }
                    self.forced[level] += weight;
                    self.counted[t as usize] = index(level) + 1;
                    self.came[level].push(t);
                    if !self.fits(level, limit) {
                        return self.refuse(seeds, labelled);
                    }
                }
            }
            let links = self.graph.links(t as usize);
            self.work += links.len() as u64;
            for link in links {
                let there = value - link.length();
                if there > self.bound[link.to as usize] && there > floor {
                    self.raise(link.to, there);
                }
            }
        }
        if limit.below > 0 && (0..limit.below).any(|level| !self.fits(level, limit)) {
            return self.refuse(seeds, labelled);
        }
        Ok(())
    }

    /// Whether the level has room for what is forced into it, if necessary with the room left in the levels above.
    fn fits(&self, level: usize, limit: &Limit<'_>) -> bool {
        let over = |q: usize| self.forced[q] - limit.room[q];
        if over(level) <= self.tolerance {
            return true;
        }
        let handed: i64 = (level..limit.below).map(over).sum();
        limit.below > level && handed <= limit.spare + self.tolerance
    }

    fn refuse(&mut self, seeds: &[u32], labelled: &mut [bool]) -> Result<(), Overfull> {
        self.take_back();
        for &seed in seeds {
            labelled[seed as usize] = false;
        }
        Err(Overfull)
    }

    fn raise(&mut self, t: u32, value: f64) {
        if value > self.bound[t as usize] {
            self.undo.push(Change {
                triangle: t,
                counted: self.counted[t as usize],
                bound: self.bound[t as usize],
            });
            self.bound[t as usize] = value;
            self.front.push(value, t);
        }
    }

    fn take_back(&mut self) {
        while let Some(Change {
            triangle,
            counted,
            bound,
        }) = self.undo.pop()
        {
            let t = triangle as usize;
            let now = self.counted[t];
            if now != counted {
                let weight = self.weights[t];
                if now > 0 {
                    self.forced[now as usize - 1] -= weight;
                }
                if counted > 0 {
                    self.forced[counted as usize - 1] += weight;
                }
                self.counted[t] = counted;
            }
            self.bound[t] = bound;
        }
    }
}
