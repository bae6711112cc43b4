//! sRGB-encoded values and linear light (IEC 61966-2-1).

/// Linear light of an sRGB-encoded value / 255; 0 of negative values.
///
/// # Formula
///
/// ```text
/// c ≤ 0.04045: c / 12.92        else ((c + 0.055) / 1.055)^2.4
/// ```
///
/// # Examples
///
/// ```
/// use stereology_imaging::linear;
///
/// assert_eq!([linear(0.0), linear(1.0), linear(-0.1)], [0.0, 1.0, 0.0]);
/// assert!((linear(0.5) - 0.21404).abs() < 1e-5);
/// ```
#[must_use]
pub fn linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded.max(0.0) / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB-encoded value / 255 of linear light: the inverse of [`linear`] from 0 on.
///
/// # Examples
///
/// ```
/// use stereology_imaging::{encoded, linear};
///
/// assert!((encoded(linear(0.3)) - 0.3).abs() < 1e-6);
/// ```
#[must_use]
pub fn encoded(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB-encoded byte of linear light; values beyond 0 and 1 become black and white.
///
/// # Examples
///
/// ```
/// use stereology_imaging::encoded_byte;
///
/// assert_eq!([-0.2, 0.2159, 1.5].map(encoded_byte), [0, 128, 255]);
/// ```
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "clamped to the range of u8")]
pub fn encoded_byte(linear: f32) -> u8 {
    (255.0 * encoded(linear)).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::{encoded, encoded_byte, linear};

    /// Every byte comes back from linear light.
    #[test]
    fn bytes_survive_linear_light() {
        for byte in 0..=255_u8 {
            assert_eq!(encoded_byte(linear(f32::from(byte) / 255.0)), byte);
        }
    }

    /// Both branches of the standard meet to within its own rounding, and the functions increase.
    #[test]
    fn the_transfer_functions_increase() {
        for i in 0..4096_u16 {
            let [low, high] = [i, i + 1].map(|v| f32::from(v) / 4096.0);
            assert!(linear(low) < linear(high) && encoded(low) < encoded(high), "{low}");
        }
    }
}
