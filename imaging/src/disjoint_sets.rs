//! Disjoint sets (union-find).

/// Disjoint sets of the numbers from 0 to below `n`, each with a representative, its root.
///
/// # Complexity
///
/// Paths are halved on every search, so that m operations on n numbers take O(m log n) at worst and close to O(m) in
/// practice.
///
/// # References
///
/// Tarjan & van Leeuwen 1984.
///
/// # Examples
///
/// ```
/// use stereology_imaging::DisjointSets;
///
/// let mut sets = DisjointSets::new(4);
/// sets.unite(3, 1);
/// assert_eq!([0, 1, 2, 3].map(|i| sets.root(i)), [0, 1, 2, 1]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Every number in a set of its own.
    #[must_use]
    pub fn new(n: u32) -> Self {
        Self {
            parent: (0..n).collect(),
        }
    }

    /// Adds the next number as a set of its own and returns it.
    ///
    /// # Panics
    ///
    /// Never below 2³² numbers, which would take 16 GiB.
    pub fn push(&mut self) -> u32 {
        let next = u32::try_from(self.parent.len()).expect("fewer than 2^32 numbers");
        self.parent.push(next);
        next
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty()
    }

    /// Root of the set of `i`.
    ///
    /// # Panics
    ///
    /// If `i` is not one of the numbers.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let above = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = above;
            i = above;
        }
        i
    }

    /// Makes one set of the sets of `a` and `b`, whose root is the smaller of their roots; returns that root.
    ///
    /// # Panics
    ///
    /// If `a` or `b` is not one of the numbers.
    pub fn unite(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a.min(b)
    }

    /// Makes one set of the sets of `kept` and `joined`, whose root is that of `kept`.
    ///
    /// # Panics
    ///
    /// If `kept` or `joined` is not one of the numbers.
    pub fn join(&mut self, kept: u32, joined: u32) {
        let (kept, joined) = (self.root(kept), self.root(joined));
        self.parent[joined as usize] = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::DisjointSets;
    use proptest::prelude::*;

    proptest! {
        /// Two numbers have the same root exactly if a chain of pairs leads from one to the other; the root is the
        /// smallest number of its set.
        #[test]
        fn roots_are_the_smallest_numbers_that_can_be_reached(pairs in prop::collection::vec((0_u32..30, 0_u32..30), 0..40)) {
            let mut sets = DisjointSets::new(30);
            pairs.iter().for_each(|&(a, b)| { sets.unite(a, b); });
            let mut smallest: Vec<u32> = (0..30).collect();
            for _ in 0..30 {
                for &(a, b) in &pairs {
                    let least = smallest[a as usize].min(smallest[b as usize]);
                    smallest[a as usize] = least;
                    smallest[b as usize] = least;
                }
            }
            for i in 0..30 {
                prop_assert_eq!(sets.root(i), smallest[i as usize]);
            }
        }

        /// `join` keeps the root it is given.
        #[test]
        fn joining_keeps_the_first_root(pairs in prop::collection::vec((0_u32..20, 0_u32..20), 0..30)) {
            let mut sets = DisjointSets::new(20);
            for (a, b) in pairs {
                let kept = sets.root(a);
                sets.join(a, b);
                prop_assert_eq!([sets.root(a), sets.root(b)], [kept; 2]);
            }
        }
    }
}
