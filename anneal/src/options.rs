//! Options of packing.

use crate::proxies::Proxy;

/// How particles are moved apart, with the parameters of that method.
///
/// [`fast`](Self::fast), [`paper`](Self::paper), [`anneal`](Self::anneal) and [`sequential`](Self::sequential) have the
/// default parameters.
///
/// `swelling` multiplies sizes while particles move, so that overlaps at true size vanish in a finite number of
/// iterations; true sizes are certified. It lies between 1.0001 and 1.05. `None` takes a third of the room that is left
/// below random close packing: 1.02 in loose packings, 1.002 in dense ones.
///
/// # Examples
///
/// ```
/// use stereology_anneal::Mode;
///
/// assert_eq!(Mode::default(), Mode::fast());
/// let patient = Mode::Sequential { tries: 1_000_000 };
/// assert_ne!(patient, Mode::sequential());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Mode {
    /// Descent with momentum on the energy of overlaps; particles move and turn.
    Fast {
        /// Maximum number of iterations.
        iterations: usize,
        /// Factor on sizes while particles move.
        swelling: Option<f64>,
    },
    /// Jagnow, Dorsey & Rushmeier 2004, section 4.1: find all collisions, push positions apart, repeat. Orientations
    /// stay as they were drawn. Takes about ten times the iterations of [`Mode::Fast`].
    Paper {
        /// Maximum number of iterations.
        iterations: usize,
        /// Factor on sizes while particles move.
        swelling: Option<f64>,
    },
    /// Simulated annealing: single shifts, rotations, swaps and re-insertions by the Metropolis rule while the
    /// temperature falls, then a quench with the descent of [`Mode::Fast`]. Uses one core.
    Anneal {
        /// Maximum number of sweeps (at most 200) and iterations of the quench, together.
        iterations: usize,
        /// Factor on sizes while particles move.
        swelling: Option<f64>,
    },
    /// Random sequential addition (Jagnow, Dorsey & Rushmeier 2004, section 4.1, which dismisses it): one particle at a
    /// time, the largest first, at random positions until one is vacant. Jams at a volume fraction of about .35
    /// ([`PackError::Jammed`](crate::PackError::Jammed)). Uses one core.
    Sequential {
        /// Maximum number of random positions for one particle.
        tries: usize,
    },
}

/// Default limit of every mode.
///
/// [`Mode::Fast`] needs tens to hundreds of iterations and stops by itself when overlaps no longer shrink,
/// [`Mode::Paper`] about ten times as many. Where one position in 5,000 is vacant, so many tries find one with
/// probability .98.
const LIMIT: usize = 20_000;

impl Mode {
    /// [`Mode::Fast`] with at most 20,000 iterations and automatic swelling.
    #[must_use]
    pub const fn fast() -> Self {
        Self::Fast {
            iterations: LIMIT,
            swelling: None,
        }
    }

    /// [`Mode::Paper`] with at most 20,000 iterations and automatic swelling.
    #[must_use]
    pub const fn paper() -> Self {
        Self::Paper {
            iterations: LIMIT,
            swelling: None,
        }
    }

    /// [`Mode::Anneal`] with at most 20,000 sweeps and iterations and automatic swelling.
    #[must_use]
    pub const fn anneal() -> Self {
        Self::Anneal {
            iterations: LIMIT,
            swelling: None,
        }
    }

    /// [`Mode::Sequential`] with at most 20,000 tries per particle.
    #[must_use]
    pub const fn sequential() -> Self {
        Self::Sequential { tries: LIMIT }
    }

    /// The swelling that the caller chose.
    pub(crate) const fn swelling(&self) -> Option<f64> {
        match *self {
            Self::Fast { swelling, .. } | Self::Paper { swelling, .. } | Self::Anneal { swelling, .. } => swelling,
            Self::Sequential { .. } => None,
        }
    }
}

impl Default for Mode {
    fn default() -> Self {
        Self::fast()
    }
}

/// Options of [`pack`](crate::pack()).
///
/// # Examples
///
/// ```
/// use stereology_anneal::{Mode, PackOptions};
///
/// let options = PackOptions::default().with_mode(Mode::paper()).with_seed(7);
/// assert_eq!(options.seed, 7);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackOptions {
    /// How particles are moved apart.
    pub mode: Mode,
    /// What represents meshes while particles move.
    pub proxy: Proxy,
    /// Relative excess volume allowed to the convex parts of a body that is not convex: .005 to 1. Particles keep that
    /// much space around them free, and the cost grows with their number of parts.
    pub tolerance: f64,
    /// Seed of random moves: those of annealing and sequential addition, and the perturbation of particles that jam in
    /// [`Mode::Fast`].
    pub seed: u64,
}

impl Default for PackOptions {
    fn default() -> Self {
        Self {
            mode: Mode::fast(),
            proxy: Proxy::Parts,
            tolerance: 0.1,
            seed: 0,
        }
    }
}

impl PackOptions {
    /// Sets how particles are moved apart.
    #[must_use]
    pub const fn with_mode(mut self, mode: Mode) -> Self {
        self.mode = mode;
        self
    }

    /// Sets what represents meshes while particles move.
    #[must_use]
    pub const fn with_proxy(mut self, proxy: Proxy) -> Self {
        self.proxy = proxy;
        self
    }

    /// Sets the relative excess volume allowed to convex parts.
    #[must_use]
    pub const fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Sets the seed of random moves.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }
}
