//! Queries of a prepared body: inside, nearest surface, chords, support.

pub(crate) mod chord;
pub(crate) mod convex;
pub(crate) mod elliptic;
pub(crate) mod inside;
pub(crate) mod nearest;
