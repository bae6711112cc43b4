//! Conversions to narrower numbers, with the bound that makes each safe.

/// A colour as solids keep it: single precision of a value from 0 to 1.
#[allow(clippy::cast_possible_truncation, reason = "rounding to single precision is meant")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// A whole number of pixels between two limits; `most` is at most 65,535.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between the limits, which are small and not negative"
)]
pub(crate) fn pixels_between(value: f64, least: f64, most: f64) -> u32 {
    value.round().clamp(least.max(0.0), most.min(65_535.0)) as u32
}

/// The smallest whole number at or above a value, between two limits.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative; a float converts to the nearest whole number in range"
)]
pub(crate) fn count_between(value: f64, least: usize, most: usize) -> usize {
    (value.ceil() as usize).clamp(least, most)
}
