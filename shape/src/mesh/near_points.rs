//! Clusters of points chained by steps shorter than a given length, in about n log n for any length.

use nalgebra::Point3;

use crate::mesh::index::index;

/// Points in a leaf of the tree; these are compared one by one.
const LEAF: usize = 8;

/// For each point the lowest index in its cluster, the points that can be reached from it by steps shorter than
/// `length`.
///
/// Two branches of a tree of boxes are compared only while their boxes do not decide whether their points are near, and
/// never once they are known to belong to one cluster. So a length that joins all points costs no more than one that
/// joins none.
pub(crate) fn clusters(points: &[Point3<f64>], length: f64) -> Vec<u32> {
    if points.is_empty() {
        return Vec::new();
    }
    let mut search = Search {
        points,
        length,
        order: (0..index(points.len())).collect(),
        branches: Vec::with_capacity(2 * points.len().div_ceil(LEAF)),
        first: (0..index(points.len())).collect(),
    };
    let all = search.grow(0, points.len());
    search.join_within(all);
    (0..index(points.len())).map(|i| search.root(i)).collect()
}

struct Branch {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Its points: `order[from..to]`.
    from: usize,
    to: usize,
    children: Option<[usize; 2]>,
    /// All its points are known to belong to one cluster.
    united: bool,
}

struct Search<'a> {
    points: &'a [Point3<f64>],
    length: f64,
    order: Vec<u32>,
    branches: Vec<Branch>,
    /// A point of the same cluster with an equal or lower index.
    first: Vec<u32>,
}

impl Search<'_> {
    /// Splits points into halves of equal number along their box's longest side, down to leaves.
    fn grow(&mut self, from: usize, to: usize) -> usize {
        let start = self.points[self.order[from] as usize];
        let (low, high) = self.order[from..to].iter().fold((start, start), |(low, high), &i| {
            let p = &self.points[i as usize];
            (low.inf(p), high.sup(p))
        });
        let place = self.branches.len();
        self.branches.push(Branch {
            low,
            high,
            from,
            to,
            children: None,
            united: to - from == 1,
        });
        if to - from > LEAF {
            let axis = (high - low).imax();
            let middle = (to - from) / 2;
            let points = self.points;
            self.order[from..to].select_nth_unstable_by(middle, |&a, &b| {
                let along = |i: u32| points[i as usize][axis];
                along(a).total_cmp(&along(b)).then(a.cmp(&b))
            });
            let below = self.grow(from, from + middle);
            let above = self.grow(from + middle, to);
            self.branches[place].children = Some([below, above]);
        }
        place
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.first[i as usize] != i {
            // Path halving.
            let next = self.first[self.first[i as usize] as usize];
            self.first[i as usize] = next;
            i = next;
        }
        i
    }

    fn unite(&mut self, i: u32, j: u32) {
        let (a, b) = (self.root(i), self.root(j));
        self.first[a.max(b) as usize] = a.min(b);
    }

    fn unite_all(&mut self, branch: usize) {
        let Branch { from, to, united, .. } = self.branches[branch];
        if !united {
            for k in from + 1..to {
                self.unite(self.order[from], self.order[k]);
            }
            self.branches[branch].united = true;
        }
    }

    /// Whether both branches are known to belong to the same cluster.
    fn are_one(&mut self, a: usize, b: usize) -> bool {
        self.branches[a].united && self.branches[b].united && {
            let (i, j) = (self.order[self.branches[a].from], self.order[self.branches[b].from]);
            self.root(i) == self.root(j)
        }
    }

    fn join_within(&mut self, branch: usize) {
        let Branch {
            low, high, children, ..
        } = self.branches[branch];
        if (high - low).norm() < self.length {
            return self.unite_all(branch);
        }
        if let Some([below, above]) = children {
            self.join_within(below);
            self.join_within(above);
            self.join(below, above);
            self.branches[branch].united = self.are_one(below, above);
        } else {
            self.compare(branch, branch);
        }
    }

    fn join(&mut self, a: usize, b: usize) {
        if self.are_one(a, b) {
            return;
        }
        let (p, q) = (&self.branches[a], &self.branches[b]);
        // Along each axis, the gap between the boxes.
        let gap = (q.low - p.high).sup(&(p.low - q.high)).map(|x| x.max(0.0));
        if gap.norm() >= self.length {
            return;
        }
        if (q.high - p.low).sup(&(p.high - q.low)).norm() < self.length {
            self.unite_all(a);
            self.unite_all(b);
            return self.unite(self.order[self.branches[a].from], self.order[self.branches[b].from]);
        }
        // Descend into the larger box.
        let opens_a =
            q.children.is_none() || (p.children.is_some() && (p.high - p.low).norm() >= (q.high - q.low).norm());
        let (opened, other) = if opens_a { (a, b) } else { (b, a) };
        match self.branches[opened].children {
            Some(children) => children.iter().for_each(|&child| self.join(child, other)),
            None => self.compare(a, b),
        }
    }

    /// Compares the points of two leaves, or of one.
    fn compare(&mut self, a: usize, b: usize) {
        for k in self.branches[a].from..self.branches[a].to {
            for l in self.branches[b].from..self.branches[b].to {
                let (i, j) = (self.order[k], self.order[l]);
                if (self.points[i as usize] - self.points[j as usize]).norm() < self.length {
                    self.unite(i, j);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::clusters;
    use nalgebra::Point3;
    use proptest::prelude::*;

    /// Compares every pair.
    fn brute_force(points: &[Point3<f64>], length: f64) -> Vec<u32> {
        let mut first: Vec<u32> = (0..u32::try_from(points.len()).unwrap()).collect();
        loop {
            let before = first.clone();
            for i in 0..points.len() {
                for j in 0..points.len() {
                    if (points[i] - points[j]).norm() < length {
                        first[i] = first[i].min(first[j]);
                    }
                }
            }
            if first == before {
                return first;
            }
        }
    }

    proptest! {
        /// Points on a grid, where many distances equal each other and the length, and points at random positions.
        #[test]
        fn clusters_are_those_of_all_pairs(
            points in prop::collection::vec(prop::array::uniform3(-8..8_i32), 1..120),
            jitter in prop_oneof![Just(0.0), 0.0..0.5_f64],
            length in prop_oneof![Just(1.0), Just(2.0_f64.sqrt()), 0.01..30.0_f64],
        ) {
            let points: Vec<Point3<f64>> = (0_u32..)
                .zip(points)
                .map(|(k, p)| Point3::from(p.map(f64::from)) + nalgebra::Vector3::new(0.3, 0.7, 0.9) * jitter * f64::from(k % 7))
                .collect();
            prop_assert_eq!(clusters(&points, length), brute_force(&points, length));
        }
    }

    /// 100,000 points at lengths that join nothing, sheets, and everything. There are 5,000,000,000 pairs.
    #[test]
    fn any_length_is_quick() {
        let points: Vec<Point3<f64>> = (0..100_000_u32)
            .map(|k| {
                Point3::new(
                    f64::from(k % 224),
                    f64::from(k / 224 % 224),
                    f64::from(k / 224 / 224 * 100),
                )
            })
            .collect();
        let count = |length: f64| {
            let first = clusters(&points, length);
            (0_u32..).zip(&first).filter(|(k, first)| k == *first).count()
        };
        assert_eq!(count(0.5), 100_000);
        assert_eq!(count(1.0), 100_000);
        assert_eq!((count(1.1), count(99.0), count(100.0)), (2, 2, 2));
        assert_eq!((count(100.5), count(150.0), count(1e6)), (1, 1, 1));
    }
}
