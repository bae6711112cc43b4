//! The law of profile sizes of a kind of particle.

use std::fmt;
use std::sync::Arc;

/// The profiles that a particle of size 1 shows: how many are no larger than x, per unit area at one particle per unit
/// volume. Particles of other sizes show the same in proportion.
#[derive(Clone)]
pub(crate) struct ProfileLaw(Arc<dyn Fn(f64) -> f64 + Send + Sync>);

impl ProfileLaw {
    pub(crate) fn new(up_to: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(up_to))
    }

    /// The law of several types with these fractions.
    pub(crate) fn mix(laws: Vec<Self>, fractions: Vec<f64>) -> Self {
        Self::new(move |x| laws.iter().zip(&fractions).map(|(law, p)| p * law.0(x)).sum())
    }

    /// Profiles no larger than `d` of a particle of this size.
    pub(crate) fn up_to(&self, d: f64, size: f64) -> f64 {
        size * self.0((d / size).min(1.0))
    }
}

impl fmt::Debug for ProfileLaw {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("ProfileLaw")
    }
}

impl PartialEq for ProfileLaw {
    /// Whether it is the same function, not whether it has the same values.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
