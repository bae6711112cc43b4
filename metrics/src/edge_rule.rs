//! Which profiles count at the edges of a sampling window, and how much.
//!
//! Large profiles are cut by the edge of a window more often than small ones. Counting all of them, clipped,
//! overestimates the number per area (by 38 % in a window three times as wide as the largest particle; N_V by 102 %);
//! leaving out those that touch the edge underestimates it (N_V by 20 %). The other rules are unbiased.

/// Smallest box around a profile, with sides parallel to those of the window; lengths.
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
    /// A profile wholly inside counts W H / ((W − w)(H − h)), where w and h are the sides of its box: the inverse of
    /// its chance to lie wholly inside (Miles 1974, Lantuéjoul 1980). The area is that of the window.
    MilesLantuejoul,
    /// Counting frame with forbidden lines (Gundersen 1977): a profile that touches the left or upper edge does not
    /// count, all others do, whole or clipped. Unbiased in number, but the sizes of clipped profiles must be those of
    /// the whole profile. The area is that of the window.
    CountingFrame,
    /// Associated point rule (Miles 1978): a profile counts if the upper left corner of its box lies in a frame inside
    /// the window, whose distance from the right and lower edges is the largest extent of a profile, so that every
    /// profile that counts is seen whole. The area is that of the frame.
    AssociatedPoint,
    /// Plus-sampling: a profile counts if the centre of its box lies inside; profiles must be known beyond the window.
    /// The area is that of the window.
    PlusSampling,
    /// Everything counts, clipped or not: biased, for comparison and for windows that cut no profile.
    All,
    /// Minus-sampling: what touches an edge does not count. Biased, for comparison.
    Inside,
}

impl EdgeRule {
    /// The rule's name in files and messages.
    ///
    /// ```
    /// assert_eq!(stereology_metrics::EdgeRule::CountingFrame.name(), "frame");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MilesLantuejoul => "miles-lantuejoul",
            Self::CountingFrame => "frame",
            Self::AssociatedPoint => "associated-point",
            Self::PlusSampling => "plus",
            Self::All => "all",
            Self::Inside => "inside",
        }
    }
}

/// What the profiles of a window count by a rule.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeWeights {
    /// The weight of each profile; 0: it does not count.
    pub weights: Vec<f64>,
    /// Area to which the weights belong: their sum over it is the number per area.
    pub area: f64,
    /// Whether the frame of [`EdgeRule::AssociatedPoint`] was limited to half of the window's width or height because a
    /// profile extends over more than that. Profiles this large may be undercounted.
    pub frame_limited: bool,
}

/// A rectangular window from (0, 0) to (width, height) in which profiles are counted.
///
/// # Examples
///
/// ```
/// use stereology_metrics::{BoundingBox, EdgeRule, SamplingWindow};
///
/// let inside = BoundingBox { left: 1.0, top: 1.0, right: 3.0, bottom: 3.0 };
/// let clipped = BoundingBox { left: 0.0, top: 1.0, right: 3.0, bottom: 3.0 };
/// let window = SamplingWindow::continuous(4.0, 4.0);
/// assert_eq!(window.weigh(&[inside, clipped], EdgeRule::MilesLantuejoul).weights, [4.0, 0.0]);
/// assert_eq!(window.weigh(&[inside, clipped], EdgeRule::All).weights, [1.0, 1.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplingWindow {
    width: f64,
    height: f64,
    /// Distance between the positions a box can have along an axis: 0 or a pixel.
    step: f64,
}

impl SamplingWindow {
    /// A window whose boxes may lie anywhere.
    #[must_use]
    pub fn continuous(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            step: 0.0,
        }
    }

    /// A window of whole pixels whose boxes end at the sides of pixels: one that lies wholly inside leaves a pixel free
    /// along every edge, and has W − 1 − w positions.
    #[must_use]
    pub fn pixels(width: usize, height: usize) -> Self {
        Self {
            width: width as f64,
            height: height as f64,
            step: 1.0,
        }
    }

    /// What each profile counts, and over which area.
    ///
    /// A profile as wide as the window or wider never lies wholly inside and never counts under
    /// [`EdgeRule::MilesLantuejoul`].
    #[must_use]
    pub fn weigh(&self, profiles: &[BoundingBox], rule: EdgeRule) -> EdgeWeights {
        let Self { width, height, step } = *self;
        let [right, lower] = self.frame(profiles);
        let is_inside = |of: &BoundingBox| of.left > 0.0 && of.top > 0.0 && of.right < width && of.bottom < height;
        let meets = |of: &BoundingBox| of.right > 0.0 && of.bottom > 0.0 && of.left < width && of.top < height;
        let weight = |of: &BoundingBox| {
            let counts = match rule {
                EdgeRule::MilesLantuejoul if is_inside(of) => {
                    let positions = (width - step - of.right + of.left) * (height - step - of.bottom + of.top);
                    return width * height / positions;
                }
                EdgeRule::MilesLantuejoul => false,
                // The forbidden lines are the left edge prolonged downwards and the upper edge prolonged to the right:
                // what a box that meets the window can touch of them lies left of the window or above it.
                EdgeRule::CountingFrame => meets(of) && of.left > 0.0 && of.top > 0.0,
                EdgeRule::AssociatedPoint => is_inside(of) && of.left < right.end && of.top < lower.end,
                EdgeRule::PlusSampling => {
                    let (x, y) = (0.5 * (of.left + of.right), 0.5 * (of.top + of.bottom));
                    (0.0..width).contains(&x) && (0.0..height).contains(&y)
                }
                EdgeRule::All => meets(of),
                EdgeRule::Inside => is_inside(of),
            };
            f64::from(u8::from(counts))
        };
        let by_point = rule == EdgeRule::AssociatedPoint;
        EdgeWeights {
            weights: profiles.iter().map(weight).collect(),
            area: if by_point {
                (right.end - step) * (lower.end - step)
            } else {
                width * height
            },
            frame_limited: by_point && (right.limited || lower.limited),
        }
    }

    /// Where the frame of the associated point rule ends along x and y: whatever starts before must end inside the
    /// window.
    fn frame(&self, profiles: &[BoundingBox]) -> [FrameEnd; 2] {
        let end = |side: f64, extent: &dyn Fn(&BoundingBox) -> f64| {
            let largest = profiles.iter().map(|of| extent(of) + self.step).fold(0.0, f64::max);
            let half = if self.step > 0.0 {
                (0.5 * side).floor()
            } else {
                0.5 * side
            };
            FrameEnd {
                end: side - largest.min(half),
                limited: largest > half,
            }
        };
        [
            end(self.width, &|of| of.right - of.left),
            end(self.height, &|of| of.bottom - of.top),
        ]
    }
}

#[derive(Clone, Copy)]
struct FrameEnd {
    end: f64,
    limited: bool,
}

#[cfg(test)]
mod tests {
    use super::{BoundingBox, EdgeRule, SamplingWindow};

    const UNBIASED: [EdgeRule; 3] = [
        EdgeRule::MilesLantuejoul,
        EdgeRule::AssociatedPoint,
        EdgeRule::CountingFrame,
    ];

    /// A box of each size at every place where it meets a window of pixels counts as if one lay at every pixel: the sum
    /// of the weights over the area is 1.
    #[test]
    fn each_size_is_counted_as_often_as_it_occurs() {
        let (width, height) = (23_usize, 17_usize);
        let window = SamplingWindow::pixels(width, height);
        for (w, h) in [(1, 1), (4, 2), (7, 6), (10, 7)] {
            let boxes: Vec<BoundingBox> = (-h..=17)
                .flat_map(|y| (-w..=23).map(move |x| (x, y)))
                .map(|(x, y)| BoundingBox {
                    left: f64::from(x),
                    top: f64::from(y),
                    right: f64::from(x + w),
                    bottom: f64::from(y + h),
                })
                .collect();
            for rule in [EdgeRule::MilesLantuejoul, EdgeRule::AssociatedPoint] {
                let of = window.weigh(&boxes, rule);
                let density = of.weights.iter().sum::<f64>() / of.area;
                assert!(
                    (density - 1.0).abs() < 1e-12 && !of.frame_limited,
                    "{rule:?} {w} x {h}: {density}"
                );
            }
        }
    }

    /// The same in a window of any sides, by the mid-point rule over a lattice of positions much finer than the box.
    #[test]
    fn boxes_anywhere_are_counted_as_often_as_they_occur() {
        let (width, height, w, h) = (5.0, 4.0, 1.3, 0.9);
        let step = 0.02;
        let boxes: Vec<BoundingBox> = (-75..260)
            .flat_map(|i| (-75..210).map(move |j| [i, j].map(|k| (f64::from(k) + 0.5) * step)))
            .map(|[left, top]| BoundingBox {
                left,
                top,
                right: left + w,
                bottom: top + h,
            })
            .collect();
        for rule in UNBIASED {
            let of = SamplingWindow::continuous(width, height).weigh(&boxes, rule);
            let density = of.weights.iter().sum::<f64>() * step * step / of.area;
            assert!((density - 1.0).abs() < 0.02, "{rule:?}: {density}");
        }
    }

    /// A profile over more than half the window limits the frame, and the result says so.
    #[test]
    fn a_profile_over_half_the_window_limits_the_frame() {
        let long = BoundingBox {
            left: 1.0,
            top: 1.0,
            right: 8.0,
            bottom: 3.0,
        };
        let of = SamplingWindow::pixels(11, 40).weigh(&[long], EdgeRule::AssociatedPoint);
        assert!(of.frame_limited && of.weights == [1.0]);
        assert!((of.area - 5.0 * 36.0).abs() < 1e-12);
    }
}
