//! Segmentation options.

use stereology_metrics::EdgeRule;

use crate::error::SegmentError;
use crate::files::compression::Compression;

/// What to do with binder-coloured holes inside a profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Holes {
    /// They belong to the profile: inclusions, highlights, engraving.
    #[default]
    Fill,
    /// They are binder.
    Keep,
}

/// Where the binder's colour comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum BinderChoice {
    /// Found in the photo.
    #[default]
    Found,
    /// Given, sRGB / 255.
    Colour([f64; 3]),
    /// One of the photo's [`main_colours`](crate::main_colours), numbered from 0.
    MainColour(usize),
}

/// How many colour categories.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum CategoryCount {
    /// Groups of colours, up to 8, between which colours are rarer than in both by a binomial test; one if the colours
    /// form a continuum.
    #[default]
    Separated,
    /// The number from 2 to 8 with the best mean silhouette, one if that is below 0.5 (Rousseeuw 1987). It divides a
    /// continuum of colours into as many groups as it can.
    Silhouette,
    /// The first number from 1 to 8 whose gap statistic is at least that of the next number minus its standard error
    /// (Tibshirani, Walther & Hastie 2001).
    Gap,
    /// Given, 1 to 255.
    Given(usize),
}

/// How to segment. The default suits photos of cut stone.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SegmentOptions {
    /// Where the binder's colour comes from.
    pub binder: BinderChoice,
    /// Least area of a profile in pixels; smaller ones are removed, and [`crate::Segmentation::min_size`] passes the
    /// limit on to unfolding.
    pub min_area: usize,
    /// Number of colour categories.
    pub categories: CategoryCount,
    /// Holes in profiles.
    pub holes: Holes,
    /// Which profiles count at the photo's edges, and how much. Rules that need the whole size of profiles that the
    /// edge cuts are refused: the counting frame and plus-sampling.
    pub edge_rule: EdgeRule,
    /// Low and high hysteresis thresholds, in standard deviations of the binder colour.
    pub thresholds: [f32; 2],
    /// Minimum peak-to-saddle height for splitting touching particles, the h of h-maxima: pixels, and a fraction of the
    /// lower peak's depth; the larger counts.
    pub rise: [f32; 2],
    /// Standard deviation of the Gaussian filter applied first, pixels.
    pub smoothing: f32,
    /// How the photo was compressed, if it comes from a JPEG: differences of colour within its errors are not
    /// particles.
    pub compression: Option<Compression>,
    /// Seed of every random choice.
    pub seed: u64,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            binder: BinderChoice::Found,
            min_area: 20,
            categories: CategoryCount::Separated,
            holes: Holes::Fill,
            edge_rule: EdgeRule::AssociatedPoint,
            thresholds: [5.0, 9.0],
            rise: [0.7, 0.1],
            smoothing: 1.0,
            compression: None,
            seed: 0,
        }
    }
}

impl SegmentOptions {
    /// The binder's colour, sRGB / 255.
    #[must_use]
    pub const fn with_binder(mut self, colour: [f64; 3]) -> Self {
        self.binder = BinderChoice::Colour(colour);
        self
    }

    /// Least area of a profile, pixels.
    #[must_use]
    pub const fn with_min_area(mut self, pixels: usize) -> Self {
        self.min_area = pixels;
        self
    }

    /// The binder is the photo's main colour of this number, from 0.
    #[must_use]
    pub const fn with_main_colour(mut self, number: usize) -> Self {
        self.binder = BinderChoice::MainColour(number);
        self
    }

    /// Number of colour categories by silhouette.
    #[must_use]
    pub const fn with_silhouette(mut self) -> Self {
        self.categories = CategoryCount::Silhouette;
        self
    }

    /// Number of colour categories by the gap statistic.
    #[must_use]
    pub const fn with_gap(mut self) -> Self {
        self.categories = CategoryCount::Gap;
        self
    }

    /// Minimum peak-to-saddle height: pixels, and a fraction of the peak's depth.
    #[must_use]
    pub const fn with_rise(mut self, pixels: f32, fraction: f32) -> Self {
        self.rise = [pixels, fraction];
        self
    }

    /// Number of colour categories.
    #[must_use]
    pub const fn with_categories(mut self, count: usize) -> Self {
        self.categories = CategoryCount::Given(count);
        self
    }

    /// What to do with holes in profiles.
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

    /// Low and high hysteresis thresholds, in standard deviations of the binder colour.
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

    /// How the photo was compressed, as [`PhotoFile::compression`](crate::PhotoFile::compression) states it.
    #[must_use]
    pub const fn with_compression(mut self, compression: Option<Compression>) -> Self {
        self.compression = compression;
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
        if let BinderChoice::Colour(colour) = self.binder
            && let Some(&c) = colour.iter().find(|c| !(0.0..=1.0).contains(*c))
        {
            return refuse("binder", c, "a colour is three numbers from 0 to 1 (sRGB / 255)");
        }
        if let CategoryCount::Given(k) = self.categories
            && !(1..=255).contains(&k)
        {
            return refuse("categories", k as f64, "must be from 1 to 255");
        }
        if let Some(&r) = self.rise.iter().find(|r| !(r.is_finite() && **r >= 0.0)) {
            return refuse("rise", f64::from(r), "must be zero or more");
        }
        if let rule @ (EdgeRule::CountingFrame | EdgeRule::PlusSampling) = self.edge_rule {
            return Err(SegmentError::EdgeRule { rule: rule.name() });
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
