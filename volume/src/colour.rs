//! Colours added up, and made bytes.

#![allow(clippy::cast_possible_truncation, reason = "clamped to the range of u8")]

use wide::f32x4;

/// Three channels and a fourth of no account, so that they are worked out at once.
pub(crate) type Lanes = f32x4;

pub(crate) fn lanes([r, g, b]: [f32; 3]) -> Lanes {
    Lanes::new([r, g, b, 0.0])
}

pub(crate) fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The only place where colours are clamped: encoded values to bytes, halves rounded up.
pub(crate) fn to_bytes(colour: Lanes) -> [u8; 3] {
    let value = colour * Lanes::splat(255.0);
    // By comparison, so that what is no number becomes 0.
    let value = value & value.simd_gt(Lanes::ZERO);
    let value = value.simd_lt(Lanes::splat(255.0)).select(value, Lanes::splat(255.0));
    let whole = Lanes::from_i32x4(value.fast_trunc_int());
    let up = Lanes::ONE & (value - whole).simd_ge(Lanes::splat(0.5));
    let [r, g, b, _] = (whole + up).fast_trunc_int().to_array();
    [r as u8, g as u8, b as u8]
}

#[cfg(test)]
mod tests {
    use super::{Lanes, to_bytes};

    /// Bytes are those of rounding halves up and clamping, at every half, beside it, beyond the ends and for what is no number.
    #[test]
    fn bytes_are_rounded_and_clamped() {
        let halves = (-4..=520).map(|i| i as f32 / 510.0);
        let beside = halves.flat_map(|v| [v.next_down(), v, v.next_up()]);
        for value in beside.chain([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e30]) {
            let expected = (value * 255.0 + 0.0).clamp(0.0, 255.0).round() as u8;
            assert_eq!(to_bytes(Lanes::splat(value)), [expected; 3], "{value}");
        }
    }
}
