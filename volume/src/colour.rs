//! Colours added up, and made bytes.

#![allow(clippy::cast_possible_truncation, reason = "clamped to the range of u8")]

pub(crate) fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The only place where colours are clamped: encoded values to bytes.
pub(crate) fn to_bytes(colour: [f32; 3]) -> [u8; 3] {
    // Added to 2^23 a number is rounded, halves to even ones, and stands in the last bits: quicker than `round` and a cast.
    const WHOLE: f32 = 8_388_608.0;
    colour.map(|value| {
        let value = value * 255.0;
        let value = if value > 0.0 { value } else { 0.0 };
        let value = if value < 255.0 { value } else { 255.0 };
        let rounded = value + WHOLE;
        rounded.to_bits() as u8 + u8::from(value - (rounded - WHOLE) >= 0.5)
    })
}

#[cfg(test)]
mod tests {
    use super::to_bytes;

    /// Bytes are those of rounding halves up and clamping, at every half, beside it, beyond the ends and for what is no number.
    #[test]
    fn bytes_are_rounded_and_clamped() {
        let halves = (-4..=520).map(|i| i as f32 / 510.0);
        let beside = halves.flat_map(|v| [v.next_down(), v, v.next_up()]);
        for value in beside.chain([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e30]) {
            let expected = (value * 255.0 + 0.0).clamp(0.0, 255.0).round() as u8;
            assert_eq!(to_bytes([value; 3]), [expected; 3], "{value}");
        }
    }
}
