//! How to unfold: the method, the threshold, the intervals.

/// Estimators of the number density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Chosen from the data: [`Sparse`](Self::Sparse) if its evidence is 55 times that of
    /// [`Penalised`](Self::Penalised), else that.
    #[default]
    Auto,
    /// Penalised Poisson likelihood: the logarithm of the density is smooth on the bins of the kernel, but for a bend
    /// at one size if the counts tell of one; how smooth is for the counts to say. Wants bins finer than those reported
    /// ([`SizeBins::reported_in`](crate::SizeBins::reported_in)), forty or so, and as many profile bins or more.
    Penalised,
    /// Maximum of the Poisson likelihood with as few size bins as the counts bear: what EM tends to, less the bins that
    /// are not needed. For particles of a few sizes, each within a bin.
    Sparse,
    /// Maximum of the Poisson likelihood of the profile counts, by expectation-maximisation (Richardson-Lucy), run to
    /// convergence.
    Em,
    /// Expectation-maximisation with a little smoothing after every step ([`UnfoldOptions::smoothing`]).
    Ems,
    /// Non-negative least squares: the best fit of the profile densities without negative ones.
    Nnls,
    /// The paper's: N_V = K⁻¹ N_A by back-substitution (eqs. 4, 8), negative densities set to zero and reported. Needs
    /// as many profile bins as size bins. Its noise grows with the condition number: for anything but spheres take
    /// another method.
    Paper,
}

impl Method {
    /// The method's name in commands and files.
    ///
    /// ```
    /// assert_eq!(stereology_unfold::Method::Nnls.name(), "nnls");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Penalised => "penalised",
            Self::Sparse => "sparse",
            Self::Em => "em",
            Self::Ems => "ems",
            Self::Nnls => "nnls",
            Self::Paper => "paper",
        }
    }
}

/// What a bootstrap resamples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Resampling {
    /// Counts, Poisson's, with the means of the fit: right where profiles do not know of each other, as on slices
    /// farther apart than a particle is wide.
    #[default]
    Counts,
    /// Whole slices, with repetition: right where profiles of a slice go together (layers, clusters, the same particle
    /// on the next slice). Needs [`ProfileCounts::from_slices`](crate::ProfileCounts::from_slices), and eight slices or
    /// more to be worth it.
    Slices,
    /// Tiles of one photograph, with repetition: right where profiles are clustered
    /// ([`clustering`](crate::clustering)). Needs [`ProfileCounts::from_tiles`](crate::ProfileCounts::from_tiles).
    Blocks,
    /// Tiles where the counts have them, otherwise counts.
    Auto,
}

impl Resampling {
    /// The name in commands and files.
    ///
    /// ```
    /// assert_eq!(stereology_unfold::Resampling::Blocks.name(), "blocks");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Counts => "counts",
            Self::Slices => "slices",
            Self::Blocks => "blocks",
            Self::Auto => "auto",
        }
    }
}

/// Intervals from counts that are resampled and fitted again, corrected for the bias of the estimate.
///
/// A smooth estimate is biased towards smoothness, and its replicates would be so a second time. So what is drawn from
/// and fitted again is rougher: order 2 with a tenth of the weight. With g its value, b the mean of the replicates less
/// g, and σ their standard deviation, the interval is g − b ± z σ, for single bins g − b ± z √(σ² + b²), widened to
/// hold the estimate. Other methods are their own g; the interval of [`Method::Sparse`] is that of the likelihood on
/// all bins, so that removed bins have an upper end too.
///
/// Nominal 90 % on the paper's figure 7 covered 88 to 93 % (total, mean size, volume fraction) and 86 % or more (bins,
/// on average), with resampled counts or ten slices: the table is docs/figures/coverage.csv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bootstrap {
    /// Number of resamples.
    pub replicates: usize,
    /// Nominal coverage, between 0 and 1.
    pub level: f64,
    /// Seed; same seed, same intervals, at any number of threads.
    pub seed: u64,
    /// What is resampled.
    pub resampling: Resampling,
}

impl Default for Bootstrap {
    /// 200 replicates of the counts, 90 %, seed 0.
    fn default() -> Self {
        Self {
            replicates: 200,
            level: 0.9,
            seed: 0,
            resampling: Resampling::Counts,
        }
    }
}

/// Options of [`unfold`](crate::unfold).
///
/// ```
/// use stereology_unfold::{Bootstrap, Method, UnfoldOptions};
/// let options = UnfoldOptions::default().with_method(Method::Paper).with_bootstrap(Bootstrap::default());
/// assert_eq!(options.bootstrap.map(|b| b.replicates), Some(200));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnfoldOptions {
    /// The estimator.
    pub method: Method,
    /// Profiles up to this size are not counted on (missing fines): their bins are left out of the fit, not taken as
    /// empty.
    pub min_size: Option<f64>,
    /// Intervals, if any.
    pub bootstrap: Option<Bootstrap>,
    /// Share of each bin's density that `Ems` moves to each neighbour at every step; 0 to 0.25.
    pub smoothing: f64,
    /// `Em` stops when no densities could have a log-likelihood higher than the present by more than this.
    pub tolerance: f64,
    /// `Em` stops after this many steps in any case.
    pub max_iterations: usize,
}

impl Default for UnfoldOptions {
    /// `Auto`, no threshold, no intervals; `Em` within 0.01 of the largest log-likelihood, `Ems` with 0.02 to each
    /// neighbour.
    fn default() -> Self {
        Self {
            method: Method::Auto,
            smoothing: 0.02,
            min_size: None,
            bootstrap: None,
            tolerance: 0.01,
            max_iterations: 100_000,
        }
    }
}

impl UnfoldOptions {
    /// With this estimator.
    #[must_use]
    pub const fn with_method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Without the profiles up to this size.
    #[must_use]
    pub const fn with_min_size(mut self, min_size: f64) -> Self {
        self.min_size = Some(min_size);
        self
    }

    /// With intervals.
    #[must_use]
    pub const fn with_bootstrap(mut self, bootstrap: Bootstrap) -> Self {
        self.bootstrap = Some(bootstrap);
        self
    }

    /// With this smoothing of [`Method::Ems`].
    #[must_use]
    pub const fn with_smoothing(mut self, smoothing: f64) -> Self {
        self.smoothing = smoothing;
        self
    }

    /// With this tolerance of the log-likelihood.
    #[must_use]
    pub const fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }
}
