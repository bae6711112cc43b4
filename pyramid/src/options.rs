//! What a synthesis is given and what it says about itself.

use std::ops::ControlFlow;

use stereology_metrics::Finding;

/// How a volume is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Slices along all three axes and obliquely look like the exemplar: a start with the right spectrum, then the bands of
    /// every slice are matched, orientations pooled. The default.
    #[default]
    Slices,
    /// Slices look like the exemplar in each direction of theirs too, and each axis may have an exemplar of its own:
    /// [`synthesize_oriented_volume`](crate::synthesize_oriented_volume).
    Oriented,
    /// A start whose slices have the exemplar's spectrum, then 3D bands of matched shape and corrected variance. Twice
    /// the band error of [`Mode::Slices`] or more, several times as fast.
    Spectrum,
    /// Heeger & Bergen's method with three-dimensional bands, as Jagnow, Dorsey & Rushmeier 2004 use it: 3D bands get
    /// the histograms of the exemplar's 2D bands. Slices then miss the exemplar's band variances by 20 to 40 %.
    Volume,
}

/// Which cuts of a volume of [`Mode::Slices`] are made to look like the exemplar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cut {
    /// Cuts in all directions: rounds that match slices along the axes take turns with rounds that match planes normal to the
    /// face and space diagonals, and at the end the band variances of all are made right at once.
    #[default]
    All,
    /// Slices along the axes only. Oblique cuts miss the exemplar's band variances by up to 3 % and its bands' distributions
    /// by twice as much as the slices.
    Axes,
}

/// How histograms are matched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Matching {
    /// A table of 4096 bins: [`match_histogram_table`](crate::match_histogram_table).
    #[default]
    Table,
    /// Ranks: [`match_histogram`](crate::match_histogram).
    Exact,
}

/// How an exemplar's edges are kept out of its statistics. An exemplar that is simply repeated jumps at its edges, and the
/// jumps fill the axes of every band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Edges {
    /// The periodic component of the exemplar (Moisan 2011). Band variances come out 0 to 5 % low for 128 x 128 pixels.
    #[default]
    PeriodicComponent,
    /// The exemplar with its mirror images about it; the statistics are those of the exemplar's own quarter. Band variances
    /// come out 0 to 3 % low for 128 x 128 pixels, at four times the cost of the exemplar's statistics.
    Mirror,
    /// Nothing: right for exemplars that repeat without a seam.
    Wrap,
}

/// Options of [`synthesize_image`](crate::synthesize_image) and [`synthesize_volume`](crate::synthesize_volume).
///
/// # Examples
///
/// ```
/// use stereology_pyramid::{Mode, TextureOptions};
///
/// let options = TextureOptions::default().with_mode(Mode::Volume).with_seed(7);
/// assert_eq!((options.iterations, options.orientations), (5, 4));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TextureOptions {
    /// How a volume is made; images know one way only.
    pub mode: Mode,
    /// Rounds of matching, 5 by default. More than 10 change nothing that can be seen.
    pub iterations: usize,
    /// Levels of the pyramid; by default as many as leave the coarsest bands 16 samples along the shortest side of
    /// exemplar and result.
    pub levels: Option<usize>,
    /// Orientations of the 2D pyramid, 4 by default. The 3D bands of the other modes have none.
    pub orientations: usize,
    /// Which cuts [`Mode::Slices`] attends to.
    pub cuts: Cut,
    /// How histograms are matched.
    pub matching: Matching,
    /// How the exemplar's edges are kept out of its statistics.
    pub edges: Edges,
    /// Same seed, same bits.
    pub seed: u64,
    /// Bytes of memory that a synthesis may ask for, 4 GiB by default; beyond, it is refused before it starts.
    pub memory_limit: u64,
}

impl Default for TextureOptions {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            iterations: 5,
            levels: None,
            orientations: 4,
            cuts: Cut::default(),
            matching: Matching::default(),
            edges: Edges::default(),
            seed: 0,
            memory_limit: 4 << 30,
        }
    }
}

impl TextureOptions {
    /// With another [`Self::mode`].
    #[must_use]
    pub fn with_mode(mut self, mode: Mode) -> Self {
        self.mode = mode;
        self
    }

    /// With another number of [`Self::iterations`].
    #[must_use]
    pub fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// With a given number of [`Self::levels`].
    #[must_use]
    pub fn with_levels(mut self, levels: usize) -> Self {
        self.levels = Some(levels);
        self
    }

    /// With another number of [`Self::orientations`].
    #[must_use]
    pub fn with_orientations(mut self, orientations: usize) -> Self {
        self.orientations = orientations;
        self
    }

    /// With other [`Self::cuts`].
    #[must_use]
    pub fn with_cuts(mut self, cuts: Cut) -> Self {
        self.cuts = cuts;
        self
    }

    /// With another way of [`Self::matching`].
    #[must_use]
    pub fn with_matching(mut self, matching: Matching) -> Self {
        self.matching = matching;
        self
    }

    /// With another care of [`Self::edges`].
    #[must_use]
    pub fn with_edges(mut self, edges: Edges) -> Self {
        self.edges = edges;
        self
    }

    /// With another [`Self::seed`].
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// With another [`Self::memory_limit`], in bytes.
    #[must_use]
    pub fn with_memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = bytes;
        self
    }
}

/// A texture cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TextureError {
    /// The exemplar is too small.
    #[error("the exemplar has {height} x {width} pixels: a texture needs at least 8 x 8")]
    ExemplarTooSmall {
        /// Rows.
        height: usize,
        /// Columns.
        width: usize,
    },
    /// The exemplar has no channels.
    #[error("the exemplar has no colour channels")]
    NoChannels,
    /// No exemplar, or more than one an axis.
    #[error("a volume is made from one to three exemplars, not {found}")]
    Exemplars {
        /// Exemplars given.
        found: usize,
    },
    /// Exemplars of one volume differ in their number of channels.
    #[error("all exemplars of a volume need as many colour channels: {expected} and {found} were given")]
    ChannelsDiffer {
        /// Channels of the first exemplar.
        expected: usize,
        /// Channels of another.
        found: usize,
    },
    /// A pixel that counts is NaN or infinite.
    #[error("the exemplar's pixel at row {row}, column {column} is NaN or infinite: mend it or mask it out")]
    NotFinite {
        /// Row.
        row: usize,
        /// Column.
        column: usize,
    },
    /// Mask and exemplar differ in shape.
    #[error("the mask has {mask:?} pixels (rows, columns), the exemplar {image:?}")]
    MaskShape {
        /// Rows and columns of the mask.
        mask: [usize; 2],
        /// Rows and columns of the exemplar.
        image: [usize; 2],
    },
    /// The mask leaves too little to take statistics from.
    #[error("the mask leaves {selected} pixels: statistics need at least {needed}")]
    MaskTooSmall {
        /// Pixels in the mask.
        selected: usize,
        /// Pixels needed.
        needed: usize,
    },
    /// The result is asked for too small.
    #[error("a texture of {shape:?} samples cannot be made: every side needs at least 8")]
    ResultTooSmall {
        /// Shape asked for.
        shape: Vec<usize>,
    },
    /// The synthesis would need more memory than allowed.
    #[error(
        "a texture of {shape:?} samples needs about {bytes} bytes of memory, the limit is {limit}: make it smaller or raise the limit"
    )]
    TooLarge {
        /// Shape asked for.
        shape: Vec<usize>,
        /// Bytes needed.
        bytes: u128,
        /// Bytes allowed.
        limit: u64,
    },
    /// No level, or no orientation or too many.
    #[error("a texture needs at least one level and 1 to 32 orientations, not {levels} and {orientations}")]
    Options {
        /// Levels asked for.
        levels: usize,
        /// Orientations asked for.
        orientations: usize,
    },
    /// The caller's progress function asked to stop.
    #[error("the synthesis was cancelled")]
    Cancelled,
}

/// Callback of a synthesis: receives the completed fraction, from 0 to 1, and the report so far; returns `Break` to cancel.
pub type Watch<'a> = &'a (dyn Fn(f64, &TextureReport) -> ControlFlow<()> + Sync);

/// What a synthesis did.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TextureReport {
    /// Levels of the pyramid that were used.
    pub levels: usize,
    /// Before each round of matching, how far the bands still were from their targets: root mean square over bands and
    /// colour components of ln(variance / target variance).
    pub band_errors: Vec<f64>,
    /// After each round, how far the bands of cuts are from the exemplar's, in every mode: root mean square of ln(variance /
    /// exemplar's) over bands (orientations of a level together) of the brightness, and planes normal to axes, face and space
    /// diagonals (axes only in [`Mode::Oriented`]). Empty for images.
    pub slice_errors: Vec<f64>,
    /// The same of the finished volume; zero for images.
    pub final_error: f64,
    /// Findings with the codes `levels-reduced`, `few-samples` and `constant-exemplar`.
    pub findings: Vec<Finding>,
}

impl TextureReport {
    /// Whether more rounds would change little: the last round left bands at most a fifth nearer to the exemplar's than the best
    /// of the rounds before, or within a hundredth.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array3;
    /// use std::ops::ControlFlow;
    /// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_volume_with_report};
    ///
    /// let speckle = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((7 * y + 13 * x * x) % 11) as f32 / 11.0 - 0.5);
    /// let settled = |rounds: usize| {
    ///     let options = TextureOptions::default().with_iterations(rounds);
    ///     let watch = |_: f64, _: &_| ControlFlow::Continue(());
    ///     synthesize_volume_with_report(&Exemplar::new(speckle.view()), [16; 3], &options, &watch).map(|made| made.1.has_settled())
    /// };
    /// assert!(!settled(1)? && settled(8)?);
    /// # Ok::<(), stereology_pyramid::TextureError>(())
    /// ```
    #[must_use]
    pub fn has_settled(&self) -> bool {
        let errors = if self.slice_errors.is_empty() {
            &self.band_errors
        } else {
            &self.slice_errors
        };
        let Some((last, before)) = errors.split_last() else {
            return false;
        };
        let best = before.iter().copied().fold(f64::INFINITY, f64::min);
        *last < 0.01 || (best.is_finite() && *last > 0.8 * best)
    }
}
