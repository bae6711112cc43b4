//! How a solid is made.

/// Which method makes the solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Ours: all voxels at once, every voxel an exemplar's pixel, colours, positions and neighbourhoods of the exemplar used
    /// evenly, and votes from ever nearer neighbours in the last half of the iterations. The default.
    #[default]
    Best,
    /// Wei & Levoy 2000: the mean of the best match in each view.
    WeiLevoy,
    /// Kopf et al. 2007: a mean weighted by similarity and by what the colour histogram lacks.
    Kopf,
    /// Chen & Wang 2010: an exemplar's pixel, chosen by position and index histograms.
    ChenWang,
}

/// In which order voxels learn of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Voxel by voxel along the scan, each seen by the next: urs-2012.
    Sequential,
    /// First all neighbourhoods are compared, then all voxels are written: Kopf et al. 2007.
    Batch,
}

/// How the exemplar's neighbourhood nearest to one of the solid is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Search {
    /// All of the exemplar's are compared: the reference, slow.
    Exact,
    /// Wei & Levoy's tree-structured vector quantisation: down a tree of means, to one leaf.
    Tsvq,
    /// Those that continue the neighbours' matches, and what is most like them: Ashikhmin 2001, Tong et al. 2002.
    #[default]
    KCoherence,
}

/// Slices of which directions look like the exemplars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Views {
    /// Constant y (the first exemplar) and constant x (the second): laminar materials.
    Two,
    /// Also constant z (the third): isotropic materials.
    Three,
}

impl Views {
    /// How many.
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
    /// Voxel by voxel, or all at once; by method if `None`.
    pub solver: Option<Solver>,
    /// Order of the voxels of the sequential solver.
    pub scan: crate::Scan,
    /// How neighbourhoods are found.
    pub search: Search,
    /// Directions of slices.
    pub views: Views,
    /// Levels, each half as fine as the one before; by the size of the exemplar's features if `None`.
    pub levels: Option<usize>,
    /// Side of the neighbourhood in pixels, odd.
    pub neighbourhood: usize,
    /// Neighbourhoods of what was visited before only (Wei & Levoy's L); sequential solver.
    pub causal: bool,
    /// Iterations a level.
    pub iterations: usize,
    /// Similar pixels kept for each pixel; by method if `None`.
    pub similar: Option<usize>,
    /// Seed of everything random.
    pub seed: u64,
}

impl Default for SolidOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            solver: None,
            scan: crate::Scan::default(),
            search: Search::default(),
            views: Views::Three,
            levels: None,
            neighbourhood: 7,
            causal: false,
            iterations: 10,
            similar: None,
            seed: 0,
        }
    }
}

impl SolidOptions {
    /// With another method.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// With a solver that is not the method's own.
    #[must_use]
    pub fn with_solver(mut self, solver: Solver) -> Self {
        self.solver = Some(solver);
        self
    }

    /// With another order of the voxels.
    #[must_use]
    pub fn with_scan(mut self, scan: crate::Scan) -> Self {
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

    /// With so many levels.
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

    /// With so many iterations a level.
    #[must_use]
    pub fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// With so many similar pixels for each pixel.
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

    /// The solver that will be used.
    #[must_use]
    pub fn solver(&self) -> Solver {
        self.solver.unwrap_or(match self.method {
            Method::Best => Solver::Batch,
            Method::WeiLevoy | Method::Kopf | Method::ChenWang => Solver::Sequential,
        })
    }
}
