//! Profiles at the edges of the picture: which count, and how much.
//!
//! Large profiles are cut by the edge more often than small ones. Counting all with their clipped areas gives too many (by 38 % of N_A and 102 % of N_V
//! in a window three times as wide as the largest particle), leaving out those that touch the edge too few (−20 % of N_V). Right are the weights of Miles &
//! Lantuéjoul, the counting frame of Gundersen, and plus-sampling by centres.

/// Smallest box around a profile, with sides along the picture's; lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBox {
    /// Left end.
    pub left: f64,
    /// Upper end.
    pub top: f64,
    /// Right end.
    pub right: f64,
    /// Lower end.
    pub bottom: f64,
}

/// Rules for profiles at the edges of a window from (0, 0) to (width, height).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EdgeRule {
    /// A profile wholly inside counts W H / ((W − w)(H − h)), w and h the sides of its box: the chance to lie wholly inside is made good. The area is
    /// that of the window.
    MilesLantuejoul,
    /// A profile that touches the left or upper edge does not count, all others do, whole or clipped: unbiased in number, but the sizes of clipped ones must
    /// be those of the whole profile. The area is that of the window.
    CountingFrame,
    /// A profile counts if the middle of its box lies inside; profiles must be known beyond the window. The area is that of the window.
    PlusSampling,
    /// Everything counts, clipped or not: biased, for comparison.
    All,
    /// What touches an edge does not count: biased, for comparison.
    Inside,
}

impl EdgeRule {
    /// The rule's name in commands and files.
    ///
    /// ```
    /// assert_eq!(stereology_unfold::EdgeRule::CountingFrame.name(), "frame");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MilesLantuejoul => "miles-lantuejoul",
            Self::CountingFrame => "frame",
            Self::PlusSampling => "plus",
            Self::All => "all",
            Self::Inside => "inside",
        }
    }
}

/// How much each profile counts in a window from (0, 0) to (`width`, `height`); 0 is not at all.
///
/// A profile as wide as the window or wider cannot lie wholly inside and never counts under [`EdgeRule::MilesLantuejoul`].
///
/// ```
/// use stereology_unfold::{BoundingBox, EdgeRule, edge_weights};
/// let inside = BoundingBox { left: 1.0, top: 1.0, right: 3.0, bottom: 3.0 };
/// let clipped = BoundingBox { left: 0.0, top: 1.0, right: 3.0, bottom: 3.0 };
/// assert_eq!(edge_weights(&[inside, clipped], 4.0, 4.0, EdgeRule::MilesLantuejoul), [4.0, 0.0]);
/// assert_eq!(edge_weights(&[inside, clipped], 4.0, 4.0, EdgeRule::All), [1.0, 1.0]);
/// ```
#[must_use]
pub fn edge_weights(profiles: &[BoundingBox], width: f64, height: f64, rule: EdgeRule) -> Vec<f64> {
    let weight = |of: &BoundingBox| {
        let inside = of.left > 0.0 && of.top > 0.0 && of.right < width && of.bottom < height;
        let met = of.right > 0.0 && of.bottom > 0.0 && of.left < width && of.top < height;
        let counts = |yes: bool| if yes { 1.0 } else { 0.0 };
        match rule {
            EdgeRule::MilesLantuejoul if inside => {
                width * height / ((width - of.right + of.left) * (height - of.bottom + of.top))
            }
            EdgeRule::MilesLantuejoul => 0.0,
            // The forbidden line is the left edge prolonged downwards and the upper edge prolonged to the right: what a box that meets the window can touch
            // of them lies left of the window or above it.
            EdgeRule::CountingFrame => counts(met && of.left > 0.0 && of.top > 0.0),
            EdgeRule::PlusSampling => {
                let (x, y) = (0.5 * (of.left + of.right), 0.5 * (of.top + of.bottom));
                counts((0.0..width).contains(&x) && (0.0..height).contains(&y))
            }
            EdgeRule::All => counts(met),
            EdgeRule::Inside => counts(inside),
        }
    };
    profiles.iter().map(weight).collect()
}
