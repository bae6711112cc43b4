//! The filters of the steerable pyramid, as functions of frequency.
//!
//! ```text
//! r = 2 |frequency in cycles per sample|              Nyquist is 1
//! H_c(r) = sin(π/2 (1 + clamp(log2(r/c), −1, 0)))     passes r ≥ c, nothing of r ≤ c/2
//! L_c(r) = cos(same)                                  L² + H² = 1
//! A_b(θ) = α cos^(K−1)(θ − πb/K) (−i)^(K−1),  α = 2^(K−1) (K−1)! / √(K (2K−2)!),  Σ_b |A_b|² = 1
//! ```

use std::f64::consts::{FRAC_PI_2, PI};

/// Part of the amplitude at radius `r` that passes above the cut `c`.
pub(crate) fn high_pass(r: f64, c: f64) -> f64 {
    if r >= c {
        1.0
    } else if r <= c / 2.0 {
        0.0
    } else {
        (FRAC_PI_2 * (1.0 + (r / c).log2())).sin()
    }
}

/// Part of the amplitude at radius `r` that passes below the cut `c`.
pub(crate) fn low_pass(r: f64, c: f64) -> f64 {
    if r >= c {
        0.0
    } else if r <= c / 2.0 {
        1.0
    } else {
        (FRAC_PI_2 * (1.0 + (r / c).log2())).cos()
    }
}

/// The real factor of the oriented filters of one pyramid.
#[derive(Clone, Debug)]
pub(crate) struct Orientations {
    directions: Vec<(f64, f64)>,
    power: i32,
    gain: f64,
}

impl Orientations {
    pub(crate) fn new(count: usize) -> Self {
        let k = count as f64;
        // α² = 2^(2K−2) ((K−1)!)² / (K (2K−2)!) = Π_{j<K} 4 j² / ((2j)(2j−1)) / K, a product that cannot overflow.
        let square: f64 = (1..count)
            .map(|j| 2.0 * j as f64 / (2.0 * j as f64 - 1.0))
            .product::<f64>()
            / k;
        Self {
            directions: (0..count).map(|b| (PI * b as f64 / k).sin_cos()).collect(),
            power: i32::try_from(count).unwrap_or(i32::MAX) - 1,
            gain: square.sqrt(),
        }
    }

    /// Whether the filters are imaginary and odd (even number of orientations) rather than real and even.
    pub(crate) fn quadrature(&self) -> bool {
        self.power % 2 == 1
    }

    /// `A_b` at a frequency, without its factor `i` if [`Self::quadrature`].
    pub(crate) fn amplitude(&self, b: usize, row_frequency: f64, column_frequency: f64) -> f64 {
        let length = row_frequency.hypot(column_frequency);
        if length == 0.0 {
            return 0.0;
        }
        let (sine, cosine) = self.directions[b];
        let along = (column_frequency * cosine + row_frequency * sine) / length;
        // (−i)^p = 1, −i, −1, i: minus one for p mod 4 of 1 and 2.
        let sign = if matches!(self.power % 4, 1 | 2) { -1.0 } else { 1.0 };
        sign * self.gain * along.powi(self.power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// What does not pass above passes below, in power; and the oriented filters share out all of it.
        #[test]
        fn filters_share_out_all_power(r in 0.0_f64..2.0, c in 0.01_f64..1.0, angle in 0.0_f64..6.3, count in 1_usize..12) {
            prop_assert!((high_pass(r, c).powi(2) + low_pass(r, c).powi(2) - 1.0).abs() < 1e-14);
            let orientations = Orientations::new(count);
            let power: f64 = (0..count).map(|b| orientations.amplitude(b, angle.sin(), angle.cos()).powi(2)).sum();
            prop_assert!((power - 1.0).abs() < 1e-12);
        }
    }
}
