//! A graph of patches of triangles, on which the position of the regions is found before the mesh itself is labelled.

use crate::conversions::index;
use crate::dual::{DualGraph, rounded_down};
use crate::leftovers::bounds;
use crate::wavefront::Wavefront;

const NONE: u32 = u32::MAX;

/// Patches of a surface and the graph between their centres.
pub(crate) struct Patches {
    pub(crate) graph: DualGraph,
    /// The triangle in the middle of each patch.
    centres: Vec<u32>,
    /// The patch of each triangle.
    patch: Vec<u32>,
}

impl Patches {
    /// Patches about centres that lie at least `radius` apart, every triangle with the nearest centre. Lengths are
    /// those of paths over the mesh from centre to centre, about a tenth too long.
    pub(crate) fn new(fine: &DualGraph, radius: f64) -> Self {
        let count = fine.len();
        // Centres: triangles not within the radius of an earlier centre.
        let mut reached = vec![f64::INFINITY; count];
        let mut centres: Vec<u32> = Vec::new();
        let mut front = Wavefront::new(0.5 * fine.mean_length());
        for t in 0..count {
            if reached[t] < f64::INFINITY {
                continue;
            }
            centres.push(index(t));
            reached[t] = 0.0;
            front.restart(0.0);
            front.push(0.0, index(t));
            while let Some((value, s)) = front.pop() {
                if -value > reached[s as usize] {
                    continue;
                }
                for link in fine.links(s as usize) {
                    let there = link.length() - value;
                    if there < radius && there < reached[link.to as usize] {
                        reached[link.to as usize] = there;
                        front.push(-there, link.to);
                    }
                }
            }
        }
        // Patches: the nearest centre.
        let mut distance = vec![f64::INFINITY; count];
        let mut patch = vec![NONE; count];
        front.restart(0.0);
        for (number, &t) in centres.iter().enumerate() {
            distance[t as usize] = 0.0;
            patch[t as usize] = index(number);
            front.push(0.0, t);
        }
        while let Some((value, s)) = front.pop() {
            if -value > distance[s as usize] {
                continue;
            }
            for link in fine.links(s as usize) {
                let there = link.length() - value;
                if there < distance[link.to as usize] {
                    distance[link.to as usize] = there;
                    patch[link.to as usize] = patch[s as usize];
                    front.push(-there, link.to);
                }
            }
        }
        let mut between: Vec<(u32, u32, f32)> = Vec::new();
        let mut areas = vec![0.0; centres.len()];
        for t in 0..count {
            areas[patch[t] as usize] += fine.areas()[t];
            for link in fine.links(t) {
                let (own, other) = (patch[t], patch[link.to as usize]);
                if own < other {
                    let length = rounded_down(distance[t] + link.length() + distance[link.to as usize]);
                    between.extend([(own, other, length), (other, own, length)]);
                }
            }
        }
        between.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
        between.dedup_by_key(|step| (step.0, step.1));
        Self {
            graph: DualGraph::between(areas, &between),
            centres,
            patch,
        }
    }

    /// Weights of the patches.
    pub(crate) fn weights(&self, of: &[i64]) -> Vec<i64> {
        let mut sums = vec![0; self.centres.len()];
        for (&patch, weight) in self.patch.iter().zip(of) {
            sums[patch as usize] += weight;
        }
        sums
    }

    /// Signed distances of the patches' centres carried over to all triangles: half way between the bounds that they
    /// impose.
    pub(crate) fn carried(&self, fine: &DualGraph, values: &[f64]) -> Vec<f64> {
        let mut known = vec![false; fine.len()];
        let mut labels = vec![0.0; fine.len()];
        for (&t, value) in self.centres.iter().zip(values) {
            known[t as usize] = true;
            labels[t as usize] = *value;
        }
        let (low, high) = bounds(fine, &known, &labels);
        low.iter().zip(high).map(|(low, high)| 0.5 * (low + high)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Patches;
    use crate::dual::{Adjacency, DualGraph, Metric};
    use stereology_shape::TriangleMesh;

    /// Patches cover the surface once, and paths from patch to patch are hardly longer than from triangle to triangle.
    #[test]
    fn patches_keep_areas_and_distances() {
        let fine = DualGraph::new(&TriangleMesh::icosphere(2.0, 5), Adjacency::Vertices, Metric::Isotropic).unwrap();
        let patches = Patches::new(&fine, 0.12);
        let areas = |graph: &DualGraph| graph.areas().iter().sum::<f64>();
        assert!((areas(&fine) - areas(&patches.graph)).abs() < 1e-9);
        assert!(patches.graph.len() < fine.len() / 10 && patches.graph.components().len() == 1);
        let (near, far) = (fine.distances(&[(0, 0.0)]), patches.graph.distances(&[(0, 0.0)]));
        for (patch, &t) in patches.centres.iter().enumerate() {
            let (true_one, found) = (near[t as usize], far[patch]);
            assert!(
                found >= true_one * (1.0 - 1e-6) && found <= 1.35 * true_one + 0.12,
                "{found} {true_one}"
            );
        }
    }
}
