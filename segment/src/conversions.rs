//! Conversions to narrower numbers, each with the bound that makes it exact or the rounding it stands for.

/// Index of a pixel, label or basin in 32 bits.
///
/// Photos and label maps of more than 2³¹ pixels are refused before they are worked on, so every index fits; an array
/// beyond that, passed to a single step, gets `u32::MAX`, which stands for no pixel.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// A number rounded to single precision.
#[allow(clippy::cast_possible_truncation, reason = "rounds")]
pub(crate) fn single(v: f64) -> f32 {
    v as f32
}

/// Whole part of a number; 0 of negative numbers and of those that are not numbers, the largest index of those beyond
/// it.
#[allow(clippy::cast_possible_truncation, reason = "rounds towards 0 and saturates")]
pub(crate) fn whole_part(v: f64) -> usize {
    v as usize
}

/// Encoded value 0 to 1 as a level, rounded; values beyond are black and white.
#[allow(clippy::cast_possible_truncation, reason = "clamped to the range of u8")]
pub(crate) fn level(v: f64) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::{index, level, whole_part};

    /// Numbers beyond the range saturate instead of wrapping around.
    #[test]
    fn numbers_beyond_the_range_saturate() {
        assert_eq!([index(7), index(usize::MAX)], [7, u32::MAX]);
        assert_eq!([whole_part(2.9), whole_part(-3.0), whole_part(f64::NAN)], [2, 0, 0]);
        assert_eq!([level(-1.0), level(0.5), level(2.0)], [0, 128, 255]);
    }
}
