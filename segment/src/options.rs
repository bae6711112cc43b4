//! What a segmentation may be told.

use crate::error::SegmentError;

/// What becomes of binder-coloured holes inside a profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Holes {
    /// They belong to the profile: inclusions, highlights, engraving.
    #[default]
    Fill,
    /// They are binder.
    Keep,
}

/// Which profiles count, and over what area: profiles at the photo's edge are seen in part and large ones meet it more often.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeRule {
    /// Unbiased counting frame (Gundersen 1977): a profile counts if the upper left corner of its bounding box lies in a frame from which every profile is seen whole. Weight 1 or 0; the area is the frame's.
    #[default]
    Frame,
    /// Every whole profile counts with the photo's area over the area in which a box of its extent fits (Miles 1974, Lantuéjoul 1980); the area is the photo's.
    MilesLantuejoul,
    /// Every profile counts once, even if cut; the area is the photo's. Biased; for photos without cut profiles.
    All,
}

/// How to segment. `Default` is what a photo of a cut stone needs.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SegmentOptions {
    /// Colour of the binder, sRGB / 255; found when `None`.
    pub binder: Option<[f64; 3]>,
    /// Least area of a profile in pixels; smaller ones are dropped, and unfolding is told so by [`crate::Segmentation::min_size`].
    pub min_area: usize,
    /// Number of colour categories; by silhouette when `None`.
    pub categories: Option<usize>,
    /// Holes in profiles.
    pub holes: Holes,
    /// Edge rule.
    pub edge_rule: EdgeRule,
    /// Distances to the binder, in its standard deviations, at which a region ends and which it must reach.
    pub thresholds: [f32; 2],
    /// Standard deviation of the smoothing before anything else, pixels.
    pub smoothing: f32,
    /// Seed of every random choice.
    pub seed: u64,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            binder: None,
            min_area: 20,
            categories: None,
            holes: Holes::Fill,
            edge_rule: EdgeRule::Frame,
            thresholds: [5.0, 9.0],
            smoothing: 1.0,
            seed: 0,
        }
    }
}

impl SegmentOptions {
    /// The binder's colour, sRGB / 255.
    #[must_use]
    pub const fn with_binder(mut self, colour: [f64; 3]) -> Self {
        self.binder = Some(colour);
        self
    }

    /// Least area of a profile, pixels.
    #[must_use]
    pub const fn with_min_area(mut self, pixels: usize) -> Self {
        self.min_area = pixels;
        self
    }

    /// Number of colour categories.
    #[must_use]
    pub const fn with_categories(mut self, count: usize) -> Self {
        self.categories = Some(count);
        self
    }

    /// What becomes of holes.
    #[must_use]
    pub const fn with_holes(mut self, holes: Holes) -> Self {
        self.holes = holes;
        self
    }

    /// Which profiles count.
    #[must_use]
    pub const fn with_edge_rule(mut self, rule: EdgeRule) -> Self {
        self.edge_rule = rule;
        self
    }

    /// Lower and upper threshold of the hysteresis, in standard deviations of the binder.
    #[must_use]
    pub const fn with_thresholds(mut self, low: f32, high: f32) -> Self {
        self.thresholds = [low, high];
        self
    }

    /// Standard deviation of the smoothing, pixels.
    #[must_use]
    pub const fn with_smoothing(mut self, sigma: f32) -> Self {
        self.smoothing = sigma;
        self
    }

    /// Seed of every random choice.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Whether every value is in range.
    pub(crate) fn check(&self) -> Result<(), SegmentError> {
        let refuse = |option, value, requirement| {
            Err(SegmentError::Option {
                option,
                value,
                requirement,
            })
        };
        if let Some(&c) = self.binder.iter().flatten().find(|c| !(0.0..=1.0).contains(*c)) {
            return refuse("binder", c, "a colour is three numbers from 0 to 1 (sRGB / 255)");
        }
        if self.categories.is_some_and(|k| k == 0 || k > 255) {
            return refuse(
                "categories",
                self.categories.unwrap_or(0) as f64,
                "must be from 1 to 255",
            );
        }
        let [low, high] = self.thresholds;
        if !(low > 0.0 && low <= high && high.is_finite()) {
            return refuse(
                "thresholds",
                f64::from(low),
                "the lower must be positive and at most the upper",
            );
        }
        if !(0.0..=20.0).contains(&self.smoothing) {
            return refuse("smoothing", f64::from(self.smoothing), "must be from 0 to 20 pixels");
        }
        Ok(())
    }
}
