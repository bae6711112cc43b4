//! Conversions to the narrow numbers in which places, pixels, voxels and values are stored.

/// Most pixels along each side of an exemplar. The layout of three such exemplars at any level has fewer than 2^31
/// places.
pub(crate) const MOST_SIDE: usize = 16_384;

/// Number of a voxel, pixel, place, node or bin. All are fewer than 2^31: `Domain` refuses larger solids, and
/// `Exemplar` sides of more than [`MOST_SIDE`] pixels.
#[inline]
#[allow(clippy::cast_possible_truncation, reason = "sizes are checked by the constructors")]
pub(crate) fn number(index: usize) -> u32 {
    debug_assert!(index < 1 << 31);
    index as u32
}

/// Number of a phase or exemplar: at most 16.
#[inline]
#[allow(clippy::cast_possible_truncation, reason = "at most 16")]
pub(crate) fn small(index: usize) -> u8 {
    debug_assert!(index < 256);
    index as u8
}

/// The nearest number in single precision.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to single precision is the purpose"
)]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}
