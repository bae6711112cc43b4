//! Options, errors and report of a synthesis.

use std::ops::ControlFlow;

use stereology_metrics::Finding;

/// Method of synthesis of a volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Slices along all three axes and oblique cuts look like the exemplar: from a start with the correct spectrum, the
    /// bands of all slices are matched with orientations pooled. The default.
    #[default]
    Slices,
    /// Slices also have the orientations of the exemplar, and each axis can have its own exemplar:
    /// [`synthesize_oriented_volume`](crate::synthesize_oriented_volume).
    Oriented,
    /// From a start whose slices have the spectrum of the exemplar, 3D bands are matched in shape with corrected
    /// variance. At least twice the band error of [`Mode::Slices`], and several times as fast.
    Spectrum,
    /// Heeger & Bergen's method with three-dimensional bands, as used by Jagnow, Dorsey & Rushmeier 2004: 3D bands are
    /// matched to the histograms of the 2D bands of the exemplar. The band variances of slices differ from those of the
    /// exemplar by 20 to 40 %.
    Volume,
}

/// The cuts of a volume that [`Mode::Slices`] matches to the exemplar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cut {
    /// Cuts in all directions: iterations that match slices along the axes alternate with iterations that match planes
    /// normal to the face and space diagonals; finally the band variances of all are corrected at once.
    #[default]
    All,
    /// Slices along the axes only. The band variances of oblique cuts differ from those of the exemplar by up to 3 %,
    /// and the distributions of their bands by twice as much as those of the slices.
    Axes,
}

/// Method of histogram matching.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Matching {
    /// A table of 4096 bins: [`match_histogram_table`](crate::match_histogram_table).
    #[default]
    Table,
    /// Ranks: [`match_histogram`](crate::match_histogram).
    Exact,
}

/// Treatment of the edges of the exemplar. A tiled exemplar jumps at its edges, and the jumps add power along the axes
/// of every band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Edges {
    /// The periodic component of the exemplar (Moisan 2011). Band variances are 0 to 5 % too low for 128 x 128 pixels.
    #[default]
    PeriodicComponent,
    /// The exemplar extended by its mirror images; statistics are those of the original quarter. Band variances are 0
    /// to 3 % too low for 128 x 128 pixels; the statistics of the exemplar cost four times as much.
    Mirror,
    /// No treatment: for exemplars that are periodic without a seam.
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
    /// Method of synthesis of a volume; ignored for images.
    pub mode: Mode,
    /// Number of iterations, 5 by default. More than 10 make no visible difference.
    pub iterations: usize,
    /// Levels of the pyramid; by default as many as leave the coarsest bands 16 samples along the shortest side of
    /// exemplar and result.
    pub levels: Option<usize>,
    /// Orientations of the 2D pyramid, 4 by default. The 3D bands of the other modes have none.
    pub orientations: usize,
    /// The cuts that [`Mode::Slices`] matches.
    pub cuts: Cut,
    /// Method of histogram matching.
    pub matching: Matching,
    /// Treatment of the edges of the exemplar.
    pub edges: Edges,
    /// Seed of the noise from which the synthesis starts.
    pub seed: u64,
    /// Limit of the memory of a synthesis in bytes, 4 GiB by default; a synthesis that needs more is refused before it
    /// starts.
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
    /// Sets [`Self::mode`].
    #[must_use]
    pub fn with_mode(mut self, mode: Mode) -> Self {
        self.mode = mode;
        self
    }

    /// Sets [`Self::iterations`].
    #[must_use]
    pub fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// Sets [`Self::levels`].
    #[must_use]
    pub fn with_levels(mut self, levels: usize) -> Self {
        self.levels = Some(levels);
        self
    }

    /// Sets [`Self::orientations`].
    #[must_use]
    pub fn with_orientations(mut self, orientations: usize) -> Self {
        self.orientations = orientations;
        self
    }

    /// Sets [`Self::cuts`].
    #[must_use]
    pub fn with_cuts(mut self, cuts: Cut) -> Self {
        self.cuts = cuts;
        self
    }

    /// Sets [`Self::matching`].
    #[must_use]
    pub fn with_matching(mut self, matching: Matching) -> Self {
        self.matching = matching;
        self
    }

    /// Sets [`Self::edges`].
    #[must_use]
    pub fn with_edges(mut self, edges: Edges) -> Self {
        self.edges = edges;
        self
    }

    /// Sets [`Self::seed`].
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Sets [`Self::memory_limit`], in bytes.
    #[must_use]
    pub fn with_memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = bytes;
        self
    }
}

/// Why a texture cannot be synthesised.
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
    /// No exemplar, or more than one per axis.
    #[error("a volume needs one to three exemplars, not {found}")]
    Exemplars {
        /// Number of exemplars.
        found: usize,
    },
    /// Exemplars of one volume differ in their number of channels.
    #[error("all exemplars of a volume need the same number of colour channels: {expected} and {found} were given")]
    ChannelsDiffer {
        /// Channels of the first exemplar.
        expected: usize,
        /// Channels of another.
        found: usize,
    },
    /// A pixel inside the mask is NaN or infinite.
    #[error("the pixel at row {row}, column {column} of the exemplar is NaN or infinite: replace it or mask it out")]
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
    /// The mask selects too few pixels.
    #[error("the mask selects {selected} pixels: statistics need at least {needed}")]
    MaskTooSmall {
        /// Pixels in the mask.
        selected: usize,
        /// Pixels required.
        needed: usize,
    },
    /// The requested result is too small.
    #[error("a texture of {shape:?} samples is too small: every side needs at least 8")]
    ResultTooSmall {
        /// Requested shape.
        shape: Vec<usize>,
    },
    /// The synthesis needs more memory than allowed.
    #[error(
        "a texture of {shape:?} samples needs about {bytes} bytes of memory, the limit is {limit}: reduce the size or raise the limit"
    )]
    TooLarge {
        /// Requested shape.
        shape: Vec<usize>,
        /// Bytes required.
        bytes: u128,
        /// Bytes allowed.
        limit: u64,
    },
    /// No level, no orientation, or too many orientations.
    #[error("a texture needs at least one level and 1 to 32 orientations, not {levels} and {orientations}")]
    Options {
        /// Requested levels.
        levels: usize,
        /// Requested orientations.
        orientations: usize,
    },
    /// The progress callback cancelled the work.
    #[error("the synthesis was cancelled")]
    Cancelled,
}

/// Callback of a synthesis: receives the completed fraction, from 0 to 1, and the report so far; returns `Break` to
/// cancel.
pub type Watch<'a> = &'a (dyn Fn(f64, &TextureReport) -> ControlFlow<()> + Sync);

/// Report of a synthesis.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TextureReport {
    /// Levels of the pyramid that were used.
    pub levels: usize,
    /// Error of the bands before each iteration: root mean square over bands and colour components of ln(variance /
    /// target variance).
    pub band_errors: Vec<f64>,
    /// Error of the bands of cuts after each iteration, in every mode: root mean square of ln(variance / that of the
    /// exemplar) over the bands (orientations of a level together) of the brightness, and over planes normal to axes,
    /// face and space diagonals (axes only in [`Mode::Oriented`]). Empty for images.
    pub slice_errors: Vec<f64>,
    /// The same for the finished volume; zero for images. Bands below one grey level of 8 bits are not errors.
    pub final_error: f64,
    /// Findings with the codes `levels-reduced`, `few-samples` and `constant-exemplar`.
    pub findings: Vec<Finding>,
}

impl TextureReport {
    /// A report without findings, for a texture that is read from a file.
    #[must_use]
    pub fn recorded(levels: usize, band_errors: Vec<f64>, slice_errors: Vec<f64>, final_error: f64) -> Self {
        Self {
            levels,
            band_errors,
            slice_errors,
            final_error,
            findings: Vec::new(),
        }
    }

    /// Whether more iterations would change little: the last error is below .01, or more than .8 times the smallest of
    /// the earlier errors.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array3;
    /// use std::ops::ControlFlow;
    /// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_volume_with_report};
    ///
    /// let speckle = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((7 * y + 13 * x * x) % 11) as f32 / 11.0 - 0.5);
    /// let settled = |iterations: usize| {
    ///     let options = TextureOptions::default().with_iterations(iterations);
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
