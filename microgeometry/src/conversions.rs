//! Conversions to narrower numbers, each with the bound that makes it exact or the rounding it stands for.

/// Number of a triangle or vertex in 32 bits, as meshes number their vertices. A graph of more than 2²⁸ steps is
/// refused before triangles are numbered in it.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// Whole part of a number; 0 of negative numbers and of those that are not numbers, the largest index of those beyond
/// it.
#[allow(clippy::cast_possible_truncation, reason = "rounds towards 0 and saturates")]
pub(crate) fn whole_part(v: f64) -> usize {
    v as usize
}

/// Whole part of a weight or a number of labels, below 2⁵³.
#[allow(clippy::cast_possible_truncation, reason = "rounds towards 0 and saturates")]
pub(crate) fn whole_weight(v: f64) -> i64 {
    v as i64
}

/// A number rounded to single precision.
#[allow(clippy::cast_possible_truncation, reason = "rounds")]
pub(crate) fn single(v: f64) -> f32 {
    v as f32
}

#[cfg(test)]
mod tests {
    use super::{index, whole_part};

    /// Numbers beyond the range saturate instead of wrapping around.
    #[test]
    fn numbers_beyond_the_range_saturate() {
        assert_eq!([index(7), index(usize::MAX)], [7, u32::MAX]);
        assert_eq!([whole_part(2.9), whole_part(-3.0), whole_part(f64::NAN)], [2, 0, 0]);
    }
}
