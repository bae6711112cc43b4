//! Maximum of the Poisson likelihood of profile counts by expectation-maximisation (Richardson 1972, Lucy 1974), and
//! with smoothing after every step (EMS: Silverman, Jones, Wilson & Nychka 1990).

use nalgebra::DMatrix;

/// Where the iteration stopped.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Maximum {
    pub(crate) densities: Vec<f64>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

/// Maximises Σ n ln μ − μ with μ = K x over x ≥ 0.
///
/// # Formula
///
/// ```text
/// x_j ← x_j g_j,   g_j = Σ_i K_ij n_i / μ_i / Σ_i K_ij
/// ```
///
/// Every step raises the likelihood and keeps Σ μ = Σ n. By concavity the maximum is at most Σ n · (max g − 1) above
/// the present value, which gives the exit: that bound within `tolerance`, in units of log-likelihood.
///
/// With `smoothing` s above zero a step ends with x_j ← (1 − 2 s) x_j + s (x_(j−1) + x_(j+1)), the ends keeping what
/// would leave. That has no likelihood to climb: it ends where a step moves expected counts by less than `tolerance`
/// all together.
///
/// Columns of `kernel` must have positive sums, and rows with counts a positive entry.
pub(crate) fn maximise(
    kernel: &DMatrix<f64>,
    counts: &[f64],
    smoothing: f64,
    tolerance: f64,
    max_iterations: usize,
) -> Maximum {
    let (rows, columns) = kernel.shape();
    let sums: Vec<f64> = kernel.column_iter().map(|column| column.sum()).collect();
    let total: f64 = counts.iter().sum();
    let whole: f64 = sums.iter().sum();
    let mut densities = vec![total / whole; columns];
    let mut expected = vec![0.0; rows];
    let mut gains = vec![0.0; columns];
    for iteration in 0..max_iterations {
        refold(kernel, &densities, &mut expected);
        for (ratio, &count) in expected.iter_mut().zip(counts) {
            *ratio = if count > 0.0 { count / *ratio } else { 0.0 };
        }
        let mut largest = 0.0_f64;
        for (j, gain) in gains.iter_mut().enumerate() {
            let column = kernel.column(j);
            *gain = column.iter().zip(&expected).map(|(k, ratio)| k * ratio).sum::<f64>() / sums[j];
            largest = largest.max(*gain);
        }
        if smoothing <= 0.0 && total * (largest - 1.0) <= tolerance {
            return Maximum {
                densities,
                iterations: iteration,
                converged: true,
            };
        }
        if smoothing <= 0.0 {
            for (density, gain) in densities.iter_mut().zip(&gains) {
                *density *= gain;
            }
            continue;
        }
        let grown: Vec<f64> = densities.iter().zip(&gains).map(|(x, g)| x * g).collect();
        let mut moved = 0.0;
        for (j, density) in densities.iter_mut().enumerate() {
            let (left, right) = (grown[j.saturating_sub(1)], grown[(j + 1).min(columns - 1)]);
            let smoothed = (1.0 - 2.0 * smoothing) * grown[j] + smoothing * (left + right);
            moved += (smoothed - *density).abs() * sums[j];
            *density = smoothed;
        }
        if moved <= tolerance {
            return Maximum {
                densities,
                iterations: iteration + 1,
                converged: true,
            };
        }
    }
    Maximum {
        densities,
        iterations: max_iterations,
        converged: false,
    }
}

/// μ = K x.
fn refold(kernel: &DMatrix<f64>, densities: &[f64], expected: &mut [f64]) {
    expected.fill(0.0);
    for (column, &density) in kernel.column_iter().zip(densities) {
        for (mu, k) in expected.iter_mut().zip(column.iter()) {
            *mu += k * density;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{maximise, refold};
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    fn log_likelihood(kernel: &DMatrix<f64>, counts: &[f64], densities: &[f64]) -> f64 {
        let mut expected = vec![0.0; counts.len()];
        refold(kernel, densities, &mut expected);
        counts
            .iter()
            .zip(&expected)
            .map(|(n, mu)| if *n > 0.0 { n * mu.ln() - mu } else { -mu })
            .sum()
    }

    proptest! {
        /// The likelihood never falls, and the expected total is the observed one after every step.
        #[test]
        fn likelihood_rises_with_every_step(
            entries in prop::collection::vec(0.01..1.0_f64, 24),
            counts in prop::collection::vec(0_u32..50, 6),
        ) {
            prop_assume!(counts.iter().any(|&n| n > 0));
            let kernel = DMatrix::from_vec(6, 4, entries);
            let counts: Vec<f64> = counts.into_iter().map(f64::from).collect();
            let mut last = f64::NEG_INFINITY;
            for steps in 1..40 {
                let now = maximise(&kernel, &counts, 0.0, -1.0, steps).densities;
                let likelihood = log_likelihood(&kernel, &counts, &now);
                prop_assert!(likelihood >= last - 1e-9 * likelihood.abs());
                last = likelihood;
                let mut expected = vec![0.0; 6];
                refold(&kernel, &now, &mut expected);
                prop_assert!((expected.iter().sum::<f64>() - counts.iter().sum::<f64>()).abs() < 1e-9 * counts.iter().sum::<f64>());
            }
            // The bound at the exit is true: many more steps gain no more than the tolerance.
            let near = maximise(&kernel, &counts, 0.0, 1e-3, 100_000);
            let far = maximise(&kernel, &counts, 0.0, 1e-9, 20_000).densities;
            prop_assert!(!near.converged || log_likelihood(&kernel, &counts, &far) - log_likelihood(&kernel, &counts, &near.densities) <= 1e-3 + 1e-9);
        }
    }
}
