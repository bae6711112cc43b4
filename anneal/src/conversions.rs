//! Conversions between kinds of numbers, each with its bound.

/// Index of a particle, image or cell in compact form. At most 10⁸ particles are accepted
/// ([`ArrangementError::TooMany`](stereology_shape::ArrangementError::TooMany)); images and cells are held in memory
/// and fewer than 2³².
#[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 of each")]
pub(crate) fn compact(index: usize) -> u32 {
    index as u32
}

/// Largest whole number not above `x`, which is a position in cells, periods or planes; out of range it saturates.
#[allow(clippy::cast_possible_truncation, reason = "the floor is meant")]
pub(crate) fn floor(x: f64) -> i64 {
    x.floor() as i64
}

/// Whole part of a count or bin number `x` ≥ 0; out of range it saturates.
#[allow(clippy::cast_possible_truncation, reason = "the whole part is meant")]
pub(crate) fn truncated(x: f64) -> usize {
    x as usize
}

/// Index of a cell or image from a number that is not negative.
#[allow(
    clippy::cast_possible_truncation,
    reason = "cells and images are fewer than 2^40 and held in memory"
)]
pub(crate) fn index(number: i64) -> usize {
    number as usize
}
