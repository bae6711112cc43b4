//! How similar windows are searched for.

/// How similar windows are searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Every window of the exemplar is compared; this is the reference.
    Exact,
    /// Best-first search in a tree of patches with leaves of up to 32 windows, and the windows that continue those from
    /// which the known neighbours were copied.
    Tree {
        /// Leaves visited.
        leaves: usize,
    },
}

impl Default for Search {
    /// 12 leaves: about 400 windows of 60,000.
    fn default() -> Self {
        Self::Tree { leaves: 12 }
    }
}
