//! The filters of the steerable pyramid, as functions of frequency.
//!
//! ```text
//! r = 2 |frequency in cycles per sample|              Nyquist is 1
//! H_c(r) = sin(π/2 (1 + clamp(log2(r/c), −1, 0)))     passes r ≥ c, nothing of r ≤ c/2
//! L_c(r) = cos(same)                                  L² + H² = 1
//! A_b(θ) = α cos^(K−1)(θ − πb/K) (−i)^(K−1),  α = 2^(K−1) (K−1)! / √(K (2K−2)!),  Σ_b |A_b|² = 1      in the plane
//! A_b(u) = √((2p + 1)/n) (v_b · u)^p (−i)^p,  Σ_b |A_b|² = 1 for tight families of axes v_b             in space
//! ```

use std::f64::consts::{FRAC_PI_2, PI};

/// Fraction of the amplitude at radius `r` that passes above the cutoff `c`.
pub(crate) fn high_pass(r: f64, c: f64) -> f64 {
    if r >= c {
        1.0
    } else if r <= c / 2.0 {
        0.0
    } else {
        (FRAC_PI_2 * (1.0 + (r / c).log2())).sin()
    }
}

/// Fraction of the amplitude at radius `r` that passes below the cutoff `c`.
pub(crate) fn low_pass(r: f64, c: f64) -> f64 {
    if r >= c {
        0.0
    } else if r <= c / 2.0 {
        1.0
    } else {
        (FRAC_PI_2 * (1.0 + (r / c).log2())).cos()
    }
}

/// Radial response of a band of a pyramid: 0 is the high-pass, 1 to `levels` are the levels from the finest, larger
/// numbers the low-pass.
pub(crate) fn band_response(r: f64, band: usize, levels: usize) -> f64 {
    let cut = |level: usize| 0.5_f64.powi(i32::try_from(level).unwrap_or(i32::MAX) + 1);
    let below = |levels: usize| low_pass(r, 1.0) * (0..levels).map(|l| low_pass(r, cut(l))).product::<f64>();
    if band == 0 {
        high_pass(r, 1.0)
    } else if band > levels {
        below(levels)
    } else {
        below(band - 1) * high_pass(r, cut(band - 1))
    }
}

/// The directions of the oriented filters of one pyramid, and their power of the cosine.
#[derive(Clone, Debug)]
pub(crate) struct Directions {
    /// Unit vectors (z, y, x).
    vectors: Vec<[f64; 3]>,
    power: i32,
    gain: f64,
    partner: bool,
}

impl Directions {
    /// No direction: one filter that passes everything.
    pub(crate) fn none() -> Self {
        Self::plane(1)
    }

    /// `count` orientations of the plane of rows and columns.
    pub(crate) fn plane(count: usize) -> Self {
        let k = count as f64;
        // α² = 2^(2K−2) ((K−1)!)² / (K (2K−2)!) = Π_{j<K} 4 j² / ((2j)(2j−1)) / K, a product that cannot overflow.
        let square: f64 = (1..count)
            .map(|j| 2.0 * j as f64 / (2.0 * j as f64 - 1.0))
            .product::<f64>()
            / k;
        let at = |b: usize| (PI * b as f64 / k).sin_cos();
        Self {
            vectors: (0..count).map(|b| [0.0, at(b).0, at(b).1]).collect(),
            power: i32::try_from(count).unwrap_or(i32::MAX) - 1,
            gain: square.sqrt(),
            partner: false,
        }
    }

    /// A tight family of unit vectors: Σ_b (v_b · u)^2p = n / (2p + 1) for every unit vector u.
    pub(crate) fn space(vectors: Vec<[f64; 3]>, power: i32) -> Self {
        Self {
            gain: (f64::from(2 * power + 1) / vectors.len() as f64).sqrt(),
            vectors,
            power,
            partner: false,
        }
    }

    /// The filters in quadrature with these: `−i sgn(v · u)` times these filters.
    pub(crate) fn partner(&self) -> Self {
        Self {
            partner: true,
            ..self.clone()
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.vectors.len()
    }

    pub(crate) fn vectors(&self) -> &[[f64; 3]] {
        &self.vectors
    }

    pub(crate) fn power(&self) -> i32 {
        self.power
    }

    /// Amplitude of a wave along a filter's own direction, with the sign of `(−i)^p` but without its `i`.
    #[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
    pub(crate) fn signed_gain(&self) -> f32 {
        let sign = if matches!(self.power % 4, 1 | 2) { -1.0 } else { 1.0 };
        (sign * self.gain) as f32
    }

    /// Whether the filters are imaginary and odd rather than real and even.
    pub(crate) fn quadrature(&self) -> bool {
        (self.power % 2 == 1) != self.partner
    }

    /// `A_b` at a frequency (z, y, x), without its factor `i` if [`Self::quadrature`].
    pub(crate) fn amplitude(&self, b: usize, frequency: &[f64; 3]) -> f64 {
        let length = frequency.iter().map(|f| f * f).sum::<f64>().sqrt();
        if length == 0.0 {
            return 0.0;
        }
        let along = self.vectors[b].iter().zip(frequency).map(|(v, f)| v * f).sum::<f64>() / length;
        // (−i)^p = 1, −i, −1, i: minus one for p mod 4 of 1 and 2.
        let sign = if matches!(self.power % 4, 1 | 2) { -1.0 } else { 1.0 };
        let value = sign * self.gain * along.powi(self.power);
        if !self.partner || along == 0.0 {
            return if self.partner { 0.0 } else { value };
        }
        // −i sgn(along) times an even filter is −sgn(along) i; times an odd one, i value, it is sgn(along) value.
        if self.power % 2 == 1 {
            value * along.signum()
        } else {
            -value * along.signum()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The powers above and below a cutoff sum to one, and so do the powers of the oriented filters.
        #[test]
        fn filters_divide_all_power(r in 0.0_f64..2.0, c in 0.01_f64..1.0, angle in 0.0_f64..6.3, count in 1_usize..12) {
            prop_assert!((high_pass(r, c).powi(2) + low_pass(r, c).powi(2) - 1.0).abs() < 1e-14);
            let plane = Directions::plane(count);
            let power: f64 = (0..count).map(|b| plane.amplitude(b, &[0.0, angle.sin(), angle.cos()]).powi(2)).sum();
            prop_assert!((power - 1.0).abs() < 1e-12);
        }
    }
}
