//! Conversions to the narrow numbers in which voxels, texels and windows are stored.

/// Most voxels of a box, and most samples of an exemplar: the largest number is kept free.
pub(crate) const MOST: usize = u32::MAX as usize;

/// Number of a voxel, texel, cell, round or node. All are fewer than [`MOST`]: `grow`, `grow_image` and
/// `synthesize_by_levels` refuse larger boxes and exemplars.
#[allow(clippy::cast_possible_truncation, reason = "callers check sizes against MOST")]
pub(crate) fn number(index: usize) -> u32 {
    debug_assert!(index < MOST);
    index as u32
}

/// Number of a plane or of a turn of a window: at most 13 planes and 8 turns.
#[allow(clippy::cast_possible_truncation, reason = "at most 13")]
pub(crate) fn small(index: usize) -> u8 {
    debug_assert!(index < 256);
    index as u8
}

/// The nearest number in single precision.
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to single precision is the purpose"
)]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// Index from 0 to `n` − 1 chosen by a number from 0 to 1.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and n")]
pub(crate) fn chosen(choice: f32, n: usize) -> usize {
    ((f64::from(choice) * n as f64) as usize).min(n.saturating_sub(1))
}
