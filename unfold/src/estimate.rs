//! An estimate, its interval, and the check of one number against another.

/// From where to where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A value with its interval, if a bootstrap was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Bias-corrected interval of the bootstrap; see [`Bootstrap`](crate::Bootstrap) for how and what it is worth.
    pub interval: Option<Interval>,
}

/// Two ways to the same number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossCheck {
    /// As counted on the sections.
    pub observed: f64,
    /// As the densities have it.
    pub expected: f64,
}
