//! Sizes that were measured with an error: what profiles of true sizes are measured as.

use crate::kernel::{Kernel, KernelError};
use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal};

/// True profile sizes are divided into bins of this fraction of the error, at most so many.
const PARTS: f64 = 4.0;
const MOST_BINS: f64 = 1_000.0;
/// Measured sizes lie within this number of standard deviations of the true ones.
const REACH: f64 = 4.0;

/// Standard deviation of the logarithm of a factor of mean 1 with this relative standard deviation.
fn spread(relative: f64) -> f64 {
    relative.powi(2).ln_1p().sqrt()
}

/// Edges of bins of true profile sizes up to `largest`, fine beside an error of this relative standard deviation. Sizes
/// below `smallest` are one bin.
///
/// ```
/// let edges = stereology_unfold::true_profile_edges(0.01, 1.0, 0.1);
/// assert!(edges[0] == 0.0 && edges[1] == 0.01 && edges[edges.len() - 1] == 1.0);
/// assert!(edges.windows(2).skip(1).all(|bin| bin[1] / bin[0] < 1.026));
/// ```
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // At most a thousand.
pub fn true_profile_edges(smallest: f64, largest: f64, relative: f64) -> Vec<f64> {
    let range = (largest / smallest).ln();
    let bins = (PARTS * range / spread(relative)).ceil().clamp(1.0, MOST_BINS) as usize;
    let inner = (0..bins).map(|k| smallest * (range * k as f64 / bins as f64).exp());
    std::iter::once(0.0).chain(inner).chain([largest]).collect()
}

/// Profile edges with bins beyond the last, up to four standard deviations of the error: profiles of the largest
/// particles may be measured there, and that none were is to be known to the fit.
///
/// ```
/// let edges = stereology_unfold::measured_edges(&[0.0, 0.5, 1.0], 0.1);
/// assert!(edges.len() == 7 && edges[..3] == [0.0, 0.5, 1.0] && edges[6] > 1.4);
/// ```
#[must_use]
pub fn measured_edges(edges: &[f64], relative: f64) -> Vec<f64> {
    let beyond = (1..=4).map(|k| 0.25 * REACH * f64::from(k) * spread(relative));
    let last = edges.last().copied().unwrap_or(0.0);
    edges.iter().copied().chain(beyond.map(|of| last * of.exp())).collect()
}

/// The kernel of profiles that are measured with an error, counted between `edges`, from the kernel of the true ones,
/// counted between `true_edges` ([`true_profile_edges`]).
///
/// Particles no larger than `threshold` are left out, as without an error.
///
/// # Formula
///
/// ```text
/// K'_ij = Σ_k P(a_i < m_k ε ≤ b_i) K_kj      ln ε normal with mean −s²/2 and variance s² = ln(1 + R²)
/// ```
///
/// with m_k the geometric middle of a bin of true sizes and R the relative standard deviation of the measured sizes.
/// Complexity: O(bins × true bins × sizes).
///
/// # Errors
///
/// [`KernelError::Shape`] if the kernel's rows are not the bins between `true_edges`.
///
/// # Examples
///
/// ```
/// use stereology_unfold::{SizeBins, capped_kernel, equal_edges, measured_edges, measured_kernel, true_profile_edges};
///
/// let spheres = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
/// let sizes = SizeBins::integrated(&equal_edges(1.0, 4))?;
/// let true_edges = true_profile_edges(0.01, 1.0, 0.1);
/// let exact = capped_kernel(&spheres, 1.0, 0.0, &true_edges, sizes, 0.52)?;
/// let measured = measured_kernel(&exact, &true_edges, &measured_edges(&equal_edges(1.0, 10), 0.1), 0.1, 0.0)?;
/// assert!(measured.matrix()[(10, 3)] > 0.01); // measured as larger than the largest particle
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn measured_kernel(
    kernel: &Kernel,
    true_edges: &[f64],
    edges: &[f64],
    relative: f64,
    threshold: f64,
) -> Result<Kernel, KernelError> {
    let exact = kernel.matrix();
    if exact.nrows() + 1 != true_edges.len() || edges.len() < 2 {
        return Err(KernelError::Shape {
            rows: exact.nrows(),
            columns: exact.ncols(),
            bins: true_edges.len().saturating_sub(1),
        });
    }
    let spread = spread(relative);
    let normal = Normal::standard();
    let below = |edge: f64, middle: f64| normal.cdf(((edge / middle).ln() + 0.5 * spread * spread) / spread);
    let error = DMatrix::from_fn(edges.len() - 1, exact.nrows(), |i, k| {
        let (from, to) = (true_edges[k], true_edges[k + 1]);
        let middle = if from > 0.0 { (from * to).sqrt() } else { 0.5 * to };
        below(edges[i + 1], middle) - below(edges[i], middle)
    });
    let mut matrix = error * exact;
    let sizes = kernel.sizes();
    for (j, upper) in sizes.edges()[1..].iter().enumerate() {
        if *upper <= threshold * (1.0 + 1e-12) {
            matrix.column_mut(j).fill(0.0);
        }
    }
    let measured = Kernel::new(matrix, sizes.clone(), kernel.unit_volume())?;
    match kernel.unit_surface() {
        Some(surface) => measured.with_unit_surface(surface),
        None => Ok(measured),
    }
}

#[cfg(test)]
mod tests {
    use super::{measured_edges, measured_kernel, true_profile_edges};
    use crate::{Kernel, SizeBins, capped_kernel, equal_edges};
    use proptest::prelude::*;

    fn spheres(edges: &[f64]) -> Kernel {
        let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
        let sizes = SizeBins::integrated(&equal_edges(1.0, 5)).unwrap();
        capped_kernel(&law, 1.0, 0.0, edges, sizes, 0.5).unwrap()
    }

    proptest! {
        /// No profile is lost, the mean measured size is the true one, and its square grows by 1 + R².
        #[test]
        fn errors_keep_numbers_and_mean_sizes(relative in 0.02..0.3_f64) {
            let true_edges = true_profile_edges(0.005, 1.0, relative);
            let exact = spheres(&true_edges);
            let edges = equal_edges(4.0, 1_600);
            let measured = measured_kernel(&exact, &true_edges, &edges, relative, 0.0).unwrap();
            let moment = |kernel: &Kernel, edges: &[f64], j: usize, power: i32| -> f64 {
                let bins = edges.windows(2).zip(kernel.matrix().column(j).iter().copied().collect::<Vec<_>>());
                bins.map(|(bin, n)| n * (0.5 * (bin[0] + bin[1])).powi(power)).sum()
            };
            for j in 0..5 {
                let of = |power| moment(&measured, &edges, j, power) / moment(&exact, &true_edges, j, power);
                prop_assert!((of(0) - 1.0).abs() < 1e-3 && (of(1) - 1.0).abs() < 5e-3, "{} {}", of(0), of(1));
                prop_assert!((of(2) - 1.0 - relative * relative).abs() < 0.01, "{}", of(2));
            }
        }

        /// A small error changes little.
        #[test]
        fn small_errors_change_little(bin in 0_usize..10) {
            let true_edges = true_profile_edges(0.005, 1.0, 1e-3);
            let edges = equal_edges(1.0, 10);
            let measured = measured_kernel(&spheres(&true_edges), &true_edges, &measured_edges(&edges, 1e-3), 1e-3, 0.0).unwrap();
            let exact = spheres(&edges);
            for j in 0..5 {
                prop_assert!((measured.matrix()[(bin, j)] - exact.matrix()[(bin, j)]).abs() < 0.01);
            }
        }
    }

    #[test]
    fn small_particles_are_left_out_and_shapes_are_checked() {
        let true_edges = true_profile_edges(0.01, 1.0, 0.1);
        let edges = equal_edges(1.0, 10);
        let measured = measured_kernel(&spheres(&true_edges), &true_edges, &edges, 0.1, 0.2).unwrap();
        assert!(measured.matrix().column(0).sum() <= 0.0 && measured.matrix().column(1).sum() > 0.1);
        assert!(measured_kernel(&spheres(&edges), &true_edges, &edges, 0.1, 0.2).is_err());
    }
}
