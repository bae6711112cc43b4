//! The table of profiles that `stereology unfold` reads.
