//! Grey levels: histograms, how far apart two are, and their moments.

use ndarray::{Array2, ArrayView3, Axis};

/// Grey of a picture (row, column, channel): the first channel, or .299 R + .587 G + .114 B of three or more.
///
/// ```
/// use ndarray::array;
/// use stereology_exemplar::measure::grey;
///
/// assert!((grey(array![[[0.0, 1.0, 0.0]]].view())[[0, 0]] - 0.587).abs() < 1e-6);
/// assert_eq!(grey(array![[[0.25]]].view())[[0, 0]], 0.25);
/// ```
#[must_use]
pub fn grey(picture: ArrayView3<'_, f32>) -> Array2<f32> {
    match picture.len_of(Axis(2)) {
        0 => Array2::zeros((picture.dim().0, picture.dim().1)),
        1 | 2 => picture.index_axis(Axis(2), 0).to_owned(),
        _ => picture.map_axis(Axis(2), |c| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]),
    }
}

/// Shares of values in equal bins of 0 to 1; values beyond fall into the outermost bins. All zero without values.
///
/// ```
/// use stereology_exemplar::measure::histogram;
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

/// Kullback-Leibler divergence of histogram `p` (the solid's) from `q` (the exemplar's), in nats: 0 where they are alike.
///
/// # Formula
///
/// ```text
/// KL(p || q) = Σ p ln(p / q)        p and q raised by 1e-6 in every bin and normalised again, so that empty bins cost much but not everything
/// ```
///
/// # References
///
/// Urs et al. 2012, section 3.2.
///
/// # Examples
///
/// ```
/// use stereology_exemplar::measure::kl_divergence;
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
    /// Standard deviation, of all values (divided by their number).
    pub deviation: f64,
    /// Mean of ((value − mean) / deviation)³; 0 where there is no deviation.
    pub skewness: f64,
}

/// Moments of a picture; zero if it is empty.
///
/// ```
/// use ndarray::array;
/// use stereology_exemplar::measure::moments;
///
/// let of = moments(&array![[0.0, 0.0], [0.0, 1.0]]);
/// assert_eq!(of.mean, 0.25);
/// assert!((of.skewness - 2.0 / 3.0_f64.sqrt()).abs() < 1e-12); // (1 - 2p) / sqrt(p (1 - p))
/// ```
#[must_use]
pub fn moments(picture: &Array2<f32>) -> Moments {
    let n = picture.len().max(1) as f64;
    let mean = picture.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
    let power = |p: i32| picture.iter().map(|&v| (f64::from(v) - mean).powi(p)).sum::<f64>() / n;
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

/// The grey level that parts a picture into two phases with the least spread inside each (Otsu), among 256 levels of 0 to 1; pixels above it are the bright phase.
///
/// ```
/// use stereology_exemplar::measure::{histogram, otsu_threshold};
///
/// let level = otsu_threshold([0.1, 0.12, 0.8, 0.83]);
/// assert!(level > 0.12 && level < 0.8);
/// ```
#[must_use]
pub fn otsu_threshold(values: impl IntoIterator<Item = f32>) -> f32 {
    const LEVELS: usize = 256;
    let shares = histogram(values, LEVELS);
    let centre = |level: usize| (level as f64 + 0.5) / LEVELS as f64;
    let mean: f64 = shares
        .iter()
        .enumerate()
        .map(|(level, share)| share * centre(level))
        .sum();
    let (mut below, mut moment) = (0.0, 0.0);
    // Between two separated phases every level is as good: the middle of the best ones is taken.
    let (mut best, mut first, mut last) = (0.0, LEVELS / 2, LEVELS / 2);
    for (level, share) in shares.iter().enumerate() {
        below += share;
        moment += share * centre(level);
        let between = (mean * below - moment).powi(2) / (below * (1.0 - below)).max(1e-12);
        if between > best * (1.0 + 1e-9) {
            (best, first, last) = (between, level, level);
        } else if between > best * (1.0 - 1e-9) {
            last = level;
        }
    }
    ((first + last) as f32 / 2.0 + 1.0) / LEVELS as f32
}

#[cfg(test)]
mod tests {
    use super::kl_divergence;
    use proptest::prelude::*;

    proptest! {
        /// Gibbs: a divergence is never negative, and zero of a histogram from itself.
        #[test]
        fn divergence_is_a_distance_of_sorts(p in prop::collection::vec(0.0_f64..1.0, 8), q in prop::collection::vec(0.0_f64..1.0, 8)) {
            let of = |h: &[f64]| { let s: f64 = h.iter().sum::<f64>() + 1e-9; h.iter().map(|v| v / s).collect::<Vec<_>>() };
            prop_assert!(kl_divergence(&of(&p), &of(&q)) >= -1e-12);
            prop_assert!(kl_divergence(&of(&p), &of(&p)).abs() < 1e-15);
        }
    }
}
