//! Grey levels: their histogram, the divergence of two histograms, and their moments.

use ndarray::{Array2, ArrayView3, Axis};

/// Grey levels of an image (row, column, channel): the first channel, or .299 R + .587 G + .114 B of three or more.
///
/// ```
/// use ndarray::array;
/// use stereology_metrics::grey;
///
/// assert!((grey(array![[[0.0, 1.0, 0.0]]].view())[[0, 0]] - 0.587).abs() < 1e-6);
/// assert_eq!(grey(array![[[0.25]]].view())[[0, 0]], 0.25);
/// ```
#[must_use]
pub fn grey(image: ArrayView3<'_, f32>) -> Array2<f32> {
    match image.len_of(Axis(2)) {
        0 => Array2::zeros((image.dim().0, image.dim().1)),
        1 | 2 => image.index_axis(Axis(2), 0).to_owned(),
        _ => image.map_axis(Axis(2), |c| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]),
    }
}

/// Fractions of values in equal bins of 0 to 1; values outside count in the outermost bins. All zero without values.
///
/// ```
/// use stereology_metrics::histogram;
///
/// assert_eq!(histogram([0.1, 0.2, 0.6, 1.0], 2), [0.5, 0.5]);
/// ```
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the bins"
)]
pub fn histogram(values: impl IntoIterator<Item = f32>, bins: usize) -> Vec<f64> {
    let mut counts = vec![0_u64; bins];
    let mut total = 0_u64;
    for value in values {
        let bin = (value * bins as f32).floor().clamp(0.0, bins as f32 - 1.0);
        counts[bin as usize] += 1;
        total += 1;
    }
    counts.iter().map(|&n| n as f64 / total.max(1) as f64).collect()
}

/// Kullback-Leibler divergence of histogram `p` (the solid's) from `q` (the exemplar's), in nats; 0 if they are equal.
///
/// # Formula
///
/// ```text
/// KL(p || q) = Σ p ln(p / q)
/// 1e-6 is added to every bin of p and q before they are normalised, so that an empty bin gives a finite value
/// ```
///
/// # References
///
/// Urs et al. 2012, section 3.2.
///
/// # Examples
///
/// ```
/// use stereology_metrics::kl_divergence;
///
/// assert!((kl_divergence(&[0.5, 0.5], &[0.25, 0.75]) - 0.14384).abs() < 1e-5);
/// ```
#[must_use]
pub fn kl_divergence(p: &[f64], q: &[f64]) -> f64 {
    let raised = |h: &[f64]| {
        let total: f64 = h.iter().map(|v| v + 1e-6).sum();
        h.iter().map(|v| (v + 1e-6) / total).collect::<Vec<_>>()
    };
    raised(p).iter().zip(raised(q)).map(|(p, q)| p * (p / q).ln()).sum()
}

/// Mean, standard deviation and skewness of grey levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation (mean square, divided by the number of values).
    pub deviation: f64,
    /// Mean of ((value − mean) / deviation)³; 0 if the deviation is 0.
    pub skewness: f64,
}

/// Moments of the grey levels of an image; zero if it is empty.
///
/// ```
/// use ndarray::array;
/// use stereology_metrics::moments;
///
/// let of = moments(&array![[0.0, 0.0], [0.0, 1.0]]);
/// assert_eq!(of.mean, 0.25);
/// assert!((of.skewness - 2.0 / 3.0_f64.sqrt()).abs() < 1e-12); // (1 - 2p) / sqrt(p (1 - p))
/// ```
#[must_use]
pub fn moments(image: &Array2<f32>) -> Moments {
    let n = image.len().max(1) as f64;
    let mean = image.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
    let power = |p: i32| image.iter().map(|&v| (f64::from(v) - mean).powi(p)).sum::<f64>() / n;
    let deviation = power(2).sqrt();
    let skewness = if deviation > 1e-9 {
        power(3) / deviation.powi(3)
    } else {
        0.0
    };
    Moments {
        mean,
        deviation,
        skewness,
    }
}

#[cfg(test)]
mod tests {
    use super::kl_divergence;
    use proptest::prelude::*;

    proptest! {
        /// Gibbs' inequality: a divergence is never negative, and that of a histogram from itself is zero.
        #[test]
        fn divergence_is_not_negative(p in prop::collection::vec(0.0_f64..1.0, 8), q in prop::collection::vec(0.0_f64..1.0, 8)) {
            let of = |h: &[f64]| { let s: f64 = h.iter().sum::<f64>() + 1e-9; h.iter().map(|v| v / s).collect::<Vec<_>>() };
            prop_assert!(kl_divergence(&of(&p), &of(&q)) >= -1e-12);
            prop_assert!(kl_divergence(&of(&p), &of(&p)).abs() < 1e-15);
        }
    }
}
