//! Options of the synthesis.

use crate::error::SolidError;

use crate::scan::Scan;

/// The method of synthesis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// This crate's method and the default: all voxels are updated together, every voxel is a pixel of the exemplar,
    /// its colours, positions and neighbourhoods are used evenly, and votes come from nearer and nearer neighbours in
    /// the last half of the iterations.
    #[default]
    Best,
    /// Wei & Levoy 2000: the mean of the best match in each view.
    WeiLevoy,
    /// Kopf et al. 2007: a mean weighted by similarity and by the deficit of the colour histogram.
    Kopf,
    /// Chen & Wang 2010: an exemplar's pixel, chosen by position and index histograms.
    ChenWang,
}

/// The order in which voxels are updated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Voxel by voxel along the scan; each update is visible to the next: urs-2012.
    Sequential,
    /// All neighbourhoods are compared, then all voxels are written: Kopf et al. 2007.
    Batch,
}

/// How the neighbourhood of the exemplar that is most similar to one of the solid is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Search {
    /// All neighbourhoods of the exemplar are compared; slow, the reference.
    Exact,
    /// Wei & Levoy's tree-structured vector quantisation: down a tree of means to one leaf.
    Tsvq,
    /// The continuations of the neighbours' matches, and the neighbourhoods most similar to them: Ashikhmin 2001, Tong
    /// et al. 2002.
    #[default]
    KCoherence,
}

/// The directions of the slices that look like the exemplars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Views {
    /// Constant y (the first exemplar) and constant x (the second): laminar materials.
    Two,
    /// Also constant z (the third): isotropic materials.
    Three,
}

impl Views {
    /// Number of directions.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

/// Options of [`synthesize_solid`](crate::synthesize_solid).
///
/// # Examples
///
/// ```
/// use stereology_exemplar::{Method, SolidOptions, Solver};
///
/// let options = SolidOptions::default().with_method(Method::Kopf).with_seed(7);
/// assert_eq!((options.iterations, options.solver()), (10, Solver::Sequential));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolidOptions {
    /// The method.
    pub method: Method,
    /// The solver; by method if `None`.
    pub solver: Option<Solver>,
    /// Order of the voxels of the sequential solver.
    pub scan: Scan,
    /// How neighbourhoods are found.
    pub search: Search,
    /// Directions of slices.
    pub views: Views,
    /// Number of levels, each with half the resolution of the one before; by the size of the exemplar's features if
    /// `None`.
    pub levels: Option<usize>,
    /// Side of the neighbourhood in pixels, odd.
    pub neighbourhood: usize,
    /// Whether neighbourhoods contain only voxels visited before (Wei & Levoy's L shape); for the sequential solver.
    pub causal: bool,
    /// Iterations per level.
    pub iterations: usize,
    /// Similar pixels kept for each pixel; by method if `None`.
    pub similar: Option<usize>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Bytes that a synthesis may need; larger solids are refused.
    pub memory_limit: u64,
}

impl Default for SolidOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            solver: None,
            scan: Scan::default(),
            search: Search::default(),
            views: Views::Three,
            levels: None,
            neighbourhood: 7,
            causal: false,
            iterations: 10,
            similar: None,
            seed: 0,
            memory_limit: 4 << 30,
        }
    }
}

impl SolidOptions {
    /// Whether a solid of `size` (nz, ny, nx) with `channels` values per voxel (colours, or the number of phases) can
    /// be made within [`memory_limit`](Self::memory_limit).
    ///
    /// # Errors
    ///
    /// [`SolidError::Memory`].
    pub fn check_memory(&self, size: [usize; 3], channels: usize) -> Result<(), SolidError> {
        let voxels = size.iter().fold(1_u64, |all, &n| all.saturating_mul(n as u64));
        // The value and the sum of each channel; pixels, energies, tallies and the mask. Measured: 37 bytes of a voxel
        // with three colours.
        let bytes = voxels.saturating_mul(16 + 8 * channels as u64);
        if bytes <= self.memory_limit {
            return Ok(());
        }
        let limit = self.memory_limit;
        Err(SolidError::Memory { size, bytes, limit })
    }

    /// With another limit of memory, in bytes.
    #[must_use]
    pub fn with_memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = bytes;
        self
    }

    /// With another method.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// With another solver than the method's own.
    #[must_use]
    pub fn with_solver(mut self, solver: Solver) -> Self {
        self.solver = Some(solver);
        self
    }

    /// With another order of the voxels.
    #[must_use]
    pub fn with_scan(mut self, scan: Scan) -> Self {
        self.scan = scan;
        self
    }

    /// With another search.
    #[must_use]
    pub fn with_search(mut self, search: Search) -> Self {
        self.search = search;
        self
    }

    /// With slices of these directions.
    #[must_use]
    pub fn with_views(mut self, views: Views) -> Self {
        self.views = views;
        self
    }

    /// With `levels` levels.
    #[must_use]
    pub fn with_levels(mut self, levels: usize) -> Self {
        self.levels = Some(levels);
        self
    }

    /// With neighbourhoods of this side.
    #[must_use]
    pub fn with_neighbourhood(mut self, side: usize) -> Self {
        self.neighbourhood = side;
        self
    }

    /// With causal neighbourhoods.
    #[must_use]
    pub fn with_causal(mut self, causal: bool) -> Self {
        self.causal = causal;
        self
    }

    /// With `iterations` iterations per level.
    #[must_use]
    pub fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// With `similar` similar pixels kept for each pixel.
    #[must_use]
    pub fn with_similar(mut self, similar: usize) -> Self {
        self.similar = Some(similar);
        self
    }

    /// With another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The solver in effect.
    #[must_use]
    pub fn solver(&self) -> Solver {
        self.solver.unwrap_or(match self.method {
            Method::Best => Solver::Batch,
            Method::WeiLevoy | Method::Kopf | Method::ChenWang => Solver::Sequential,
        })
    }
}
