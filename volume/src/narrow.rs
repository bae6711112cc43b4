//! Conversions to narrower numbers, each with the range in which it is exact.

/// A particle, cell or point by its number, in 32 bits. An arrangement has at most 10⁸ particles and its search grid at
/// most 512³ cells; rows of 2³² and more points do not fit into memory, so saturation does not occur.
#[inline]
pub(crate) fn number(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// The whole part of a number that is not negative; numbers outside 0..2⁶⁴ saturate, NaN becomes 0.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the whole part is meant"
)]
pub(crate) fn whole(x: f64) -> usize {
    x as usize
}

/// The whole part of a number that is not negative, in 32 bits: faster than [`whole`]. Others saturate, NaN becomes 0.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the whole part is meant"
)]
pub(crate) fn whole_u32(x: f64) -> u32 {
    x as u32
}

/// The whole number below; numbers outside ±2⁶³ saturate, NaN becomes 0.
#[inline]
#[allow(clippy::cast_possible_truncation, reason = "the whole number below is meant")]
pub(crate) fn floor(x: f64) -> i64 {
    x.floor() as i64
}

/// The remainder of a whole number by a positive one: a place in a period.
#[inline]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and n")]
pub(crate) fn modulo(i: i64, n: usize) -> usize {
    i.rem_euclid(n as i64) as usize
}

/// In single precision, rounded to nearest.
#[inline]
#[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
pub(crate) fn single(x: f64) -> f32 {
    x as f32
}

/// The whole part of a number from 0 to 255; others saturate, NaN becomes 0.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the whole part is meant"
)]
pub(crate) fn byte(x: f32) -> u8 {
    x as u8
}
