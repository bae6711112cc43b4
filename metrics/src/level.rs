//! The level of a judgement.

/// How a check or a figure turned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum Level {
    /// Within its limit.
    Good,
    /// Beyond its limit; usable with care.
    Care,
    /// Far beyond its limit, or not a number.
    Bad,
}
