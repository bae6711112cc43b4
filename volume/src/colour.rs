//! Sums of colours, and their conversion to bytes.

use crate::narrow::byte;
use wide::{f32x4, f32x8, i16x8, u8x16};

/// Three channels and an unused fourth, computed together.
pub(crate) type Lanes = f32x4;

pub(crate) fn lanes([r, g, b]: [f32; 3]) -> Lanes {
    Lanes::new([r, g, b, 0.0])
}

pub(crate) fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The channels of four points of the same colour.
fn side_by_side([r, g, b]: [f32; 3]) -> [Lanes; 3] {
    [[r, g, b, r], [g, b, r, g], [b, r, g, b]].map(Lanes::new)
}

/// Gives all points of a row one colour.
pub(crate) fn fill_plain(colour: [f32; 3], row: &mut [f32]) {
    row.as_chunks_mut().0.fill(colour);
}

/// Adds a colour to the details of a row.
pub(crate) fn fill_with_detail(colour: [f32; 3], details: &[f32], row: &mut [f32]) {
    let colours = side_by_side(colour);
    let (fours, rest) = row.as_chunks_mut::<12>();
    let (details, details_of_rest) = details.as_chunks::<12>();
    for (four, details) in fours.iter_mut().zip(details) {
        for (k, colour) in colours.iter().enumerate() {
            let detail = Lanes::from(&details[4 * k..4 * k + 4]);
            four[4 * k..4 * k + 4].copy_from_slice((*colour + detail).as_array());
        }
    }
    for (one, detail) in rest.as_chunks_mut().0.iter_mut().zip(details_of_rest.as_chunks().0) {
        *one = add(colour, *detail);
    }
}

/// Added before truncation to a byte: the sum with a value of fraction one half rounds up to the next whole number;
/// with any smaller fraction it stays below.
const HALF: f32 = 0.5_f32.next_down();

/// Encoded values as bytes, halves rounded up, NaN as 0. Colours are clamped only here.
pub(crate) fn to_bytes(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|value| byte(value * 255.0 + HALF))
}

/// [`to_bytes`] of the channels of many points.
pub(crate) fn row_to_bytes(row: &[f32], bytes: &mut [u8]) {
    let clamped = |values: &[f32]| {
        let value = f32x8::from(values) * f32x8::splat(255.0) + f32x8::splat(HALF);
        // By comparison, so that NaN becomes 0.
        let value = value & value.simd_gt(f32x8::ZERO);
        i16x8::from_i32x8_saturate(value.fast_min(f32x8::splat(255.0)).fast_trunc_int())
    };
    let (many, rest) = row.as_chunks::<16>();
    let (bytes_of_many, bytes_of_rest) = bytes.as_chunks_mut::<16>();
    for (values, bytes) in many.iter().zip(bytes_of_many) {
        *bytes = u8x16::narrow_i16x8(clamped(&values[..8]), clamped(&values[8..])).to_array();
    }
    for (value, byte) in rest.iter().zip(bytes_of_rest) {
        [*byte, ..] = to_bytes([*value; 3]);
    }
}

#[cfg(test)]
mod tests {
    use super::{row_to_bytes, to_bytes};

    /// Bytes are rounded with halves up and clamped, at every half, next to it, outside the range and for NaN, one by
    /// one and many at a time.
    #[test]
    fn bytes_are_rounded_and_clamped() {
        let halves = (-4..=520).map(|i| i as f32 / 510.0);
        let beside = halves.flat_map(|v| [v.next_down(), v, v.next_up()]);
        let values: Vec<f32> = beside
            .chain([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e30])
            .collect();
        let mut bytes = vec![1; values.len()];
        row_to_bytes(&values, &mut bytes);
        for (value, byte) in values.into_iter().zip(bytes) {
            let expected = (value * 255.0 + 0.0).clamp(0.0, 255.0).round();
            let expected = super::byte(expected);
            assert_eq!(to_bytes([value; 3]), [expected; 3], "{value}");
            assert_eq!(byte, expected, "{value}");
        }
    }
}
