//! The number types of fields.

use rustfft::FftNum;
use rustfft::num_traits::Float;

/// `f32` or `f64`.
///
/// # Examples
///
/// ```
/// use stereology_spectrum::Real;
///
/// fn half<T: Real>() -> T {
///     T::from_f64_lossy(0.5)
/// }
/// assert_eq!(half::<f32>(), 0.5);
/// ```
pub trait Real: FftNum + Float {
    /// The nearest number to `value`.
    fn from_f64_lossy(value: f64) -> Self;
    /// The same number as `f64`.
    fn to_f64_exact(self) -> f64;
}

impl Real for f32 {
    #[allow(clippy::cast_possible_truncation, reason = "rounding to the nearest f32 is meant")]
    fn from_f64_lossy(value: f64) -> Self {
        value as Self
    }
    fn to_f64_exact(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn from_f64_lossy(value: f64) -> Self {
        value
    }
    fn to_f64_exact(self) -> f64 {
        self
    }
}
