//! The largest size, extrapolated from the largest profiles.

/// The largest particle, from the profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LargestSize {
    /// The estimate.
    pub value: f64,
    /// The largest profile, which is never larger than the largest particle.
    pub observed: f64,
    /// Standard error of the estimate, of its own order statistics.
    pub standard_error: f64,
}

/// Number of spacings that the extrapolation uses.
const SPACINGS: usize = 20;

/// The largest size: the largest profile, plus an estimate of the difference.
///
/// # Formula
///
/// Near the largest size D the fraction of profiles above D − ε grows as ε^α, with α = 1/2 if many particles are of
/// that size and 3/2 if sizes run out evenly below it. Then with d₁ ≥ d₂ ≥ … the expected gap of d₁ is α times that
/// between d₁ and d₂, and that to d_(k+1) is c_k times it,
///
/// ```text
/// D ≈ d₁ + (d₁ − d_(k+1)) / (c_k − 1),   c_k = Γ(k + 1 + β) / (Γ(k + 1) Γ(1 + β)),   β = 1 / α
/// ```
///
/// with k = 20 spacings, or a tenth of the profiles if they are fewer. α = 1 is taken (Robson & Whitlock 1964 for k =
/// 1), in the middle of what can be.
///
/// `None` without two different sizes that are finite and above zero. Takes a sort.
///
/// ```
/// use stereology_unfold::largest_size;
/// // Spheres of diameter 1 cut at even depths: short by little.
/// let cuts: Vec<f64> = (0..1000).map(|i| (1.0 - ((f64::from(i) + 0.5) / 1000.0).powi(2)).sqrt()).collect();
/// let found = largest_size(&cuts).ok_or("none")?;
/// assert!((found.value - 1.0).abs() < 1e-4);
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn largest_size(sizes: &[f64]) -> Option<LargestSize> {
    let mut sorted: Vec<f64> = sizes
        .iter()
        .copied()
        .filter(|size| size.is_finite() && *size > 0.0)
        .collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let spacings = SPACINGS.min(sorted.len() / 10).max(1);
    let (first, last) = (*sorted.first()?, *sorted.get(spacings)?);
    if first <= last {
        return None;
    }
    // α = 1: c_k = k + 1.
    let short = (first - last) / spacings as f64;
    Some(LargestSize {
        value: first + short,
        observed: first,
        standard_error: short * (1.0 + 1.0 / spacings as f64).sqrt(),
    })
}
