//! An estimate, its interval, and the check of one number against another.

/// An interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A value with its interval, if a bootstrap was requested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Bias-corrected interval of the bootstrap; see [`Bootstrap`](crate::Bootstrap) for how and what it is worth.
    pub interval: Option<Interval>,
}

/// The same number computed in two ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossCheck {
    /// Counted on the sections.
    pub observed: f64,
    /// Computed from the densities.
    pub expected: f64,
}
