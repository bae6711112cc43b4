//! From profiles per area to particles per volume: the fit, what it claims, and how far to trust it.

use crate::bootstrap::{Replicates, replicate};
use crate::expectation_maximisation::maximise;
use crate::finding::{Finding, few_profiles, oscillation};
use crate::kernel::condition_number;
use crate::{Bootstrap, Kernel, Method, ProfileCounts, UnfoldOptions, inverse, nnls};
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;

/// Called with the share done, from any thread; `Break` cancels.
pub type Progress<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);

/// Why counts cannot be unfolded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnfoldError {
    /// The kernel is for other profile bins.
    #[error("{counts} profile bins for a kernel of {rows} rows: build the kernel for the edges of the counts")]
    Rows {
        /// Bins of the counts.
        counts: usize,
        /// Rows of the kernel.
        rows: usize,
    },
    /// The inverse of a kernel that has none.
    #[error(
        "the paper's method needs as many profile bins as size bins, {rows} and {columns} are left: use equal edges, or nnls or em"
    )]
    NotSquare {
        /// Profile bins above the threshold.
        rows: usize,
        /// Size bins that show profiles above the threshold.
        columns: usize,
    },
    /// The kernel's inverse does not exist.
    #[error("the kernel is singular: merge size bins, or use nnls or em")]
    Singular,
    /// Profiles of a size that no particle can show.
    #[error("profile bin {} holds profiles, but no particle of the kernel shows any there: check the edges and the largest size", .bin + 1)]
    Unexplained {
        /// Profile bin, from 0.
        bin: usize,
    },
    /// The threshold is not a length, or leaves nothing.
    #[error("the threshold {0} leaves no profiles: it must be finite, not negative and below the largest profile")]
    Threshold(f64),
    /// A bootstrap that cannot be.
    #[error("a bootstrap needs 2 or more replicates and a level between 0 and 1, not {replicates} and {level}")]
    Bootstrap {
        /// Replicates asked for.
        replicates: usize,
        /// Level asked for.
        level: f64,
    },
    /// A tolerance that is not positive.
    #[error("the tolerance {0} must be positive")]
    Tolerance(f64),
    /// Several types on different bins, or no type.
    #[error(
        "type {index} has other bins than the first, or there is no type: several types are unfolded on common edges"
    )]
    Bins {
        /// Which, from 0.
        index: usize,
    },
    /// The caller broke off.
    #[error("cancelled")]
    Cancelled,
}

/// From where to where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A value with its interval, if a bootstrap was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Percentile interval of the bootstrap; see [`Bootstrap`] for what it is worth.
    pub interval: Option<Interval>,
}

/// Particles per unit volume, by size, and everything needed to judge them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Unfolding {
    /// Edges of the size bins.
    pub edges: Vec<f64>,
    /// Particles per unit volume in each size bin; `None` where no profile above the threshold can come from.
    pub number_density: Vec<Option<f64>>,
    /// Intervals of `number_density`, with a bootstrap.
    pub intervals: Option<Vec<Option<Interval>>>,
    /// Particles per unit volume in all bins that have a density.
    pub total: Estimate,
    /// Mean size of these particles; zero if there are none.
    pub mean_size: Estimate,
    /// Share of the volume in these particles.
    pub volume_fraction: Estimate,
    /// How many profiles were counted, above the threshold or not.
    pub profiles: usize,
    /// Profiles per unit area by profile bin, as observed (N_A), below the threshold too.
    pub observed: Vec<f64>,
    /// Profiles per unit area that the number densities would show: K N_V, below the threshold too.
    pub refolded: Vec<f64>,
    /// Poisson deviance of the counts from the refolded ones above the threshold: near `degrees_of_freedom` for a good fit.
    pub deviance: f64,
    /// Profile bins less size bins of the fit, not below zero.
    pub degrees_of_freedom: usize,
    /// Condition number of the kernel of the fit.
    pub condition_number: f64,
    /// The threshold that was used: the lowest profile size of the fit.
    pub threshold: f64,
    /// The estimator.
    pub method: Method,
    /// Size bins whose negative density was set to zero, from 0.
    pub clamped_bins: Vec<usize>,
    /// Steps of the estimator; zero for the paper's.
    pub iterations: usize,
    /// Warnings.
    pub findings: Vec<Finding>,
}

/// Unfolds profile counts with the kernel of their particles: eq. (2) or (5) solved for N_V.
///
/// # Formula
///
/// ```text
/// N_A = K N_V        K absolute: H K of the paper
/// V_V = v Σ N_V(j) ⟨D³⟩_j,   v the body's volume at size 1
/// ```
///
/// With a threshold ([`UnfoldOptions::min_size`]) the rows of the profile bins below it are left out of the fit, not taken as empty; size bins
/// that show nothing above it get `None`, and totals are over the rest: nothing is extrapolated.
///
/// # Errors
///
/// [`UnfoldError`]: kernel and counts that do not fit, a kernel without inverse for [`Method::Paper`], profiles no particle can show, a
/// threshold that leaves nothing, a bad bootstrap or tolerance.
///
/// # Examples
///
/// ```
/// use nalgebra::DMatrix;
/// use stereology_unfold::{Kernel, Method, ProfileCounts, SizeBins, UnfoldOptions, equal_edges, unfold};
///
/// // Spheres: the share of profiles below the relative size x is 1 - sqrt(1 - x²).
/// let f = |x: f64| if x < 1.0 { 1.0 - (1.0 - x * x).sqrt() } else { 1.0 };
/// let edges = equal_edges(2.0, 2);
/// let matrix = DMatrix::from_fn(2, 2, |i, j| edges[j + 1] * (f(edges[i + 1] / edges[j + 1]) - f(edges[i] / edges[j + 1])));
/// let spheres = Kernel::new(matrix, SizeBins::upper_edge(&edges)?, std::f64::consts::PI / 6.0)?;
///
/// // 100 profiles on an area of 50, all of the larger kind of sphere: N_A = D N_V, so N_V = 2 / 2.
/// let small = 100.0 * f(0.5);
/// let counts = ProfileCounts::from_counts(&[small, 100.0 - small], &edges, 50.0)?;
/// let found = unfold(&counts, &spheres, &UnfoldOptions::default().with_method(Method::Paper))?;
/// assert!((found.total.value - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn unfold(counts: &ProfileCounts, kernel: &Kernel, options: &UnfoldOptions) -> Result<Unfolding, UnfoldError> {
    unfold_with_progress(counts, kernel, options, &|_| ControlFlow::Continue(()))
}

/// [`unfold`] that tells how far its bootstrap is and can be cancelled.
///
/// # Errors
///
/// As [`unfold`], and [`UnfoldError::Cancelled`].
pub fn unfold_with_progress(
    counts: &ProfileCounts,
    kernel: &Kernel,
    options: &UnfoldOptions,
    progress: Progress<'_>,
) -> Result<Unfolding, UnfoldError> {
    unfold_replicated(counts, kernel, options, 0, progress).map(|(unfolding, _)| unfolding)
}

/// The unfolding and the densities of its bootstrap, drawn from streams beginning at `stream`.
pub(crate) fn unfold_replicated(
    counts: &ProfileCounts,
    kernel: &Kernel,
    options: &UnfoldOptions,
    stream: u64,
    progress: Progress<'_>,
) -> Result<(Unfolding, Option<Replicates>), UnfoldError> {
    let problem = Problem::new(counts, kernel, options)?;
    let fit = problem.fit(&problem.counts)?;
    let replicates = match &options.bootstrap {
        None => None,
        Some(bootstrap) => {
            let densities = replicate(
                bootstrap,
                stream,
                &problem.refold(&fit.densities),
                counts.dispersion(),
                progress,
                |drawn| problem.fit(drawn).map(|fit| fit.densities),
            )?;
            Some(Replicates {
                densities,
                level: bootstrap.level,
            })
        }
    };
    let unfolding = problem.describe(counts, kernel, &fit, replicates.as_ref());
    // Replicates of all size bins, for sums over types; bins without a density stay zero.
    let widened = replicates.map(|replicates| replicates.widened(&problem.columns, kernel.sizes().len()));
    Ok((unfolding, widened))
}

/// The part of counts and kernel above the threshold.
struct Problem<'a> {
    /// Expected counts of one particle per unit volume: kernel times area.
    matrix: DMatrix<f64>,
    counts: Vec<f64>,
    /// Index of each column among the size bins.
    columns: Vec<usize>,
    first_row: usize,
    threshold: f64,
    options: &'a UnfoldOptions,
}

/// Densities of the columns of a problem.
struct Fit {
    densities: Vec<f64>,
    /// What was below zero, by column.
    negative: Vec<(usize, f64)>,
    iterations: usize,
    converged: bool,
}

impl<'a> Problem<'a> {
    fn new(counts: &ProfileCounts, kernel: &Kernel, options: &'a UnfoldOptions) -> Result<Self, UnfoldError> {
        let matrix = kernel.matrix();
        if counts.counts().len() != matrix.nrows() {
            return Err(UnfoldError::Rows {
                counts: counts.counts().len(),
                rows: matrix.nrows(),
            });
        }
        if let Some(bootstrap @ Bootstrap { replicates, level, .. }) = options.bootstrap
            && (bootstrap.replicates < 2 || !(level > 0.0 && level < 1.0))
        {
            return Err(UnfoldError::Bootstrap { replicates, level });
        }
        if options.tolerance.is_nan() || options.tolerance <= 0.0 {
            return Err(UnfoldError::Tolerance(options.tolerance));
        }
        let asked = options.min_size.unwrap_or(0.0);
        if !(asked.is_finite() && asked >= 0.0) {
            return Err(UnfoldError::Threshold(asked));
        }
        let edges = counts.edges();
        // A threshold that is an edge but for rounding is that edge.
        let first_row = edges.partition_point(|&edge| edge < asked * (1.0 - 1e-12));
        let kept = counts.counts().get(first_row..).unwrap_or(&[]);
        if kept.iter().sum::<f64>() <= 0.0 {
            return Err(UnfoldError::Threshold(asked));
        }
        let rows = matrix.rows(first_row, kept.len());
        let columns: Vec<usize> = (0..matrix.ncols()).filter(|&j| rows.column(j).sum() > 0.0).collect();
        if let Some(bin) = (0..kept.len()).find(|&i| kept[i] > 0.0 && rows.row(i).sum() <= 0.0) {
            return Err(UnfoldError::Unexplained { bin: bin + first_row });
        }
        Ok(Self {
            matrix: rows.select_columns(&columns) * counts.area(),
            counts: kept.to_vec(),
            columns,
            first_row,
            threshold: edges[first_row],
            options,
        })
    }

    fn fit(&self, counts: &[f64]) -> Result<Fit, UnfoldError> {
        match self.options.method {
            Method::Paper => {
                let (rows, columns) = self.matrix.shape();
                if rows != columns {
                    return Err(UnfoldError::NotSquare { rows, columns });
                }
                let solution =
                    inverse::solve(&self.matrix, &DVector::from_column_slice(counts)).ok_or(UnfoldError::Singular)?;
                Ok(Fit {
                    densities: solution.iter().map(|density| density.max(0.0)).collect(),
                    negative: solution
                        .iter()
                        .copied()
                        .enumerate()
                        .filter(|(_, density)| *density < 0.0)
                        .collect(),
                    iterations: 0,
                    converged: true,
                })
            }
            Method::Nnls => {
                let found = nnls::minimise(&self.matrix, &DVector::from_column_slice(counts));
                let densities = found.solution.iter().copied().collect();
                Ok(Fit {
                    densities,
                    negative: Vec::new(),
                    iterations: found.iterations,
                    converged: found.converged,
                })
            }
            Method::Em => {
                let found = maximise(
                    &self.matrix,
                    counts,
                    self.options.tolerance,
                    self.options.max_iterations,
                );
                Ok(Fit {
                    densities: found.densities,
                    negative: Vec::new(),
                    iterations: found.iterations,
                    converged: found.converged,
                })
            }
        }
    }

    /// Expected counts.
    fn refold(&self, densities: &[f64]) -> Vec<f64> {
        (&self.matrix * DVector::from_column_slice(densities))
            .iter()
            .copied()
            .collect()
    }

    fn describe(
        &self,
        counts: &ProfileCounts,
        kernel: &Kernel,
        fit: &Fit,
        replicates: Option<&Replicates>,
    ) -> Unfolding {
        let sizes = kernel.sizes();
        let mut number_density = vec![None; sizes.len()];
        for (&j, &density) in self.columns.iter().zip(&fit.densities) {
            number_density[j] = Some(density);
        }
        let sum = |densities: &[f64]| Sums::of(densities, &self.columns, kernel);
        let (rows, columns) = self.matrix.shape();
        let mut densities = DVector::zeros(sizes.len());
        for (&j, &density) in self.columns.iter().zip(&fit.densities) {
            densities[j] = density;
        }
        let estimate = |f: fn(&Sums) -> f64| Estimate {
            value: f(&sum(&fit.densities)),
            interval: replicates.map(|replicates| replicates.interval(|densities| f(&sum(densities)))),
        };
        let intervals = replicates.map(|replicates| {
            let mut intervals = vec![None; sizes.len()];
            for (k, &j) in self.columns.iter().enumerate() {
                intervals[j] = Some(replicates.interval(|densities| densities[k]));
            }
            intervals
        });
        Unfolding {
            edges: sizes.edges().to_vec(),
            number_density,
            intervals,
            total: estimate(|sums| sums.total),
            mean_size: estimate(Sums::mean_size),
            volume_fraction: estimate(|sums| sums.volume),
            profiles: counts.profiles(),
            observed: counts.per_area(),
            refolded: (kernel.matrix() * densities).iter().copied().collect(),
            deviance: deviance(&self.counts, &self.refold(&fit.densities)) / counts.dispersion(),
            degrees_of_freedom: rows.saturating_sub(columns),
            condition_number: condition_number(&self.matrix),
            threshold: self.threshold,
            method: self.options.method,
            clamped_bins: fit.negative.iter().map(|&(k, _)| self.columns[k]).collect(),
            iterations: fit.iterations,
            findings: self.findings(counts, kernel, fit),
        }
    }

    fn findings(&self, counts: &ProfileCounts, kernel: &Kernel, fit: &Fit) -> Vec<Finding> {
        let mut findings = Vec::new();
        if !fit.negative.is_empty() {
            findings.push(Finding::NegativeBins {
                bins: fit.negative.iter().map(|&(k, _)| self.columns[k]).collect(),
                share: -fit.negative.iter().map(|&(_, density)| density).sum::<f64>()
                    / fit.densities.iter().sum::<f64>(),
            });
        }
        let above: Vec<f64> = kernel
            .sizes()
            .edges()
            .iter()
            .copied()
            .filter(|&edge| edge >= self.threshold)
            .collect();
        if above.len() > 1 {
            findings.extend(few_profiles(&above, |x| cumulative(counts, self.first_row, x)));
        }
        findings.extend(oscillation(&fit.densities));
        if let Some(asked) = self.options.min_size
            && self.threshold > asked * (1.0 + 1e-9)
        {
            findings.push(Finding::ThresholdMoved {
                asked,
                used: self.threshold,
            });
        }
        if !fit.converged {
            findings.push(Finding::NotConverged {
                iterations: fit.iterations,
            });
        }
        findings
    }
}

/// Profiles up to size `x` from a row on, spread evenly inside their bins.
fn cumulative(counts: &ProfileCounts, first_row: usize, x: f64) -> f64 {
    counts
        .edges()
        .windows(2)
        .zip(counts.counts())
        .skip(first_row)
        .map(|(bin, count)| count * ((x - bin[0]) / (bin[1] - bin[0])).clamp(0.0, 1.0))
        .sum()
}

/// 2 Σ n ln(n / μ) − n + μ. Bins with counts and no expectation would make it infinite.
fn deviance(counts: &[f64], expected: &[f64]) -> f64 {
    let term = |n: f64, mu: f64| if n > 0.0 { n * (n / mu).ln() - n + mu } else { mu };
    2.0 * counts.iter().zip(expected).map(|(&n, &mu)| term(n, mu)).sum::<f64>()
}

/// Sums over the particles of all bins.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    pub(crate) total: f64,
    pub(crate) length: f64,
    pub(crate) volume: f64,
}

impl Sums {
    pub(crate) fn of(densities: &[f64], columns: &[usize], kernel: &Kernel) -> Self {
        let (means, cubes) = (kernel.sizes().mean_sizes(), kernel.sizes().mean_cubes());
        let mut sums = Self::default();
        for (&j, &density) in columns.iter().zip(densities) {
            sums.total += density;
            sums.length += density * means[j];
            sums.volume += density * cubes[j] * kernel.unit_volume();
        }
        sums
    }

    pub(crate) fn mean_size(&self) -> f64 {
        if self.total > 0.0 {
            self.length / self.total
        } else {
            0.0
        }
    }
}
