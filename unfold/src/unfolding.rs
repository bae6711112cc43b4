//! From profiles per area to particles per volume: the result, its intervals and its checks.

use crate::bootstrap::{Deviation, Parts, Replicates, Source, parts, replicate};
use crate::estimate::{CrossCheck, Estimate, Interval};
use crate::estimator::{Fit, again, base, estimate, workspace};
use crate::findings::findings;
use crate::goodness::{missing_fines, p_value_of_model, poor_fit};
use crate::kernel::{Kernel, condition_number};
use crate::options::{Bootstrap, Method, UnfoldOptions};
use crate::point_kernel::PointKernel;
use crate::population::{Grouping, Population};
use crate::problem::Problem;
use crate::profile_counts::{ProfileCounts, mean_profile_area};
use crate::size_distribution::{Moments, SizeDistribution, Weighing, describe};
use crate::unfold_error::UnfoldError;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_metrics::{Finding, Progress};

/// The penalty of a smooth estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenaltyUsed {
    /// Order of the differences of highest evidence: 1, 2 or 3.
    pub order: usize,
    /// Its weight λ; depends on the number of bins of the kernel.
    pub weight: f64,
    /// Size about which it gives way, if it does: the distribution may bend there more sharply than elsewhere.
    pub bend: Option<f64>,
}

/// Particles per unit volume, by size, and everything needed to judge them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Unfolding {
    /// Edges of the size bins.
    pub edges: Vec<f64>,
    /// Particles per unit volume in each size bin; `None` where no profile above the threshold can come from. Of a bin
    /// the threshold falls in, if the kernel's bins have an edge there, only those above.
    pub number_density: Vec<Option<f64>>,
    /// Intervals of `number_density`, with a bootstrap.
    pub intervals: Option<Vec<Option<Interval>>>,
    /// Particles per unit volume in all bins that have a density.
    pub total: Estimate,
    /// Mean size of these particles; zero if there are none.
    pub mean_size: Estimate,
    /// Share of the volume in these particles, V_V.
    pub volume_fraction: Estimate,
    /// Surface of these particles per unit volume, S_V, if the kernel knows the body's surface.
    pub surface_density: Option<Estimate>,
    /// Means and percentiles by number and by volume, and the sieve curve.
    pub distribution: SizeDistribution,
    /// How many profiles were counted, above the threshold or not.
    pub profiles: usize,
    /// Edges of the profile bins.
    pub profile_edges: Vec<f64>,
    /// Profiles per unit area by profile bin, as observed (N_A), below the threshold too.
    pub observed: Vec<f64>,
    /// Profiles per unit area that the number densities would show: K N_V, below the threshold too.
    pub refolded: Vec<f64>,
    /// Eq. (1), N_A = H N_V: profiles above the threshold per unit area.
    pub profiles_per_area: CrossCheck,
    /// V_V = A_A: the area fraction of the profiles above the threshold, against the volume fraction; with a threshold,
    /// against what the densities would show above it.
    pub area_fraction: CrossCheck,
    /// Poisson deviance of the counts from the refolded ones above the threshold: near `degrees_of_freedom` for a good
    /// fit if bins hold five or more.
    pub deviance: f64,
    /// Profile bins less parameters in effect, not below zero.
    pub degrees_of_freedom: usize,
    /// Goodness of fit: the probability of counts as far from the refolded ones as these, or farther, if the model is
    /// right (Pearson's χ² over bins pooled to five expected profiles). Where it is below 0.001 and the distribution of
    /// largest likelihood on the bins of the kernel has a higher one, that one. `None` without a degree of freedom.
    pub p_value: Option<f64>,
    /// Condition number of the kernel of the reported bins.
    pub condition_number: f64,
    /// The threshold that was used: the lowest profile size of the fit.
    pub threshold: f64,
    /// The estimator that was used; never [`Method::Auto`].
    pub method: Method,
    /// ln evidence of the sparse estimate less that of the smooth one, if [`Method::Auto`] chose: sparse from 4 on.
    pub evidence_for_sparse: Option<f64>,
    /// ln evidence of the estimate: only differences count, between kernels on the same profile bins.
    pub evidence: Option<f64>,
    /// The penalty of a smooth estimate.
    pub penalty: Option<PenaltyUsed>,
    /// Size bins whose negative density was set to zero, from 0.
    pub clamped_bins: Vec<usize>,
    /// Steps of the estimator; zero for the paper's.
    pub iterations: usize,
    /// Warnings.
    pub findings: Vec<Finding>,
}

impl Unfolding {
    /// Values of the profile bins, `observed` or `refolded`, summed to the bins between `edges`, which should be edges
    /// of theirs too: a profile bin counts where its middle lies.
    #[must_use]
    pub fn profiles_in(&self, edges: &[f64], values: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; edges.len().saturating_sub(1)];
        for (bin, value) in self.profile_edges.windows(2).zip(values) {
            let middle = 0.5 * (bin[0] + bin[1]);
            let place = edges.partition_point(|&edge| edge < middle);
            if place > 0 && place < edges.len() {
                sums[place - 1] += value;
            }
        }
        sums
    }

    /// Sums the profile bins to those between `edges`, for histograms; the fit and its deviance stay what they are.
    pub fn rebin_profiles(&mut self, edges: &[f64]) {
        self.observed = self.profiles_in(edges, &self.observed);
        self.refolded = self.profiles_in(edges, &self.refolded);
        self.profile_edges = edges.to_vec();
    }
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
/// With a threshold ([`UnfoldOptions::min_size`]) the rows of the profile bins below it are left out of the fit, not
/// taken as empty; size bins that show nothing above it get `None`, and totals are over the rest: nothing is
/// extrapolated.
///
/// # Errors
///
/// [`UnfoldError`]: kernel and counts that do not fit, a kernel without inverse for [`Method::Paper`], profiles no
/// particle can show, a threshold that leaves nothing, a bad bootstrap or tolerance.
///
/// # Examples
///
/// ```
/// use nalgebra::DMatrix;
/// use stereology_unfold::{Kernel, Method, ProfileCounts, SizeBins, UnfoldOptions, equal_edges, unfold};
///
/// // Spheres: the fraction of profiles below the relative size x is 1 - sqrt(1 - x²).
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

/// [`unfold`] with progress of the bootstrap, and cancellation.
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
    unfold_replicated(counts, kernel, options, 0, progress).map(|(unfolding, ..)| unfolding)
}

/// An unfolding, its population on all bins of the kernel, and those of its bootstrap.
pub(crate) type Replicated = (Unfolding, Population, Option<Replicates>);

/// Unfolds, with the bootstrap drawn from streams beginning at `stream`.
pub(crate) fn unfold_replicated(
    counts: &ProfileCounts,
    kernel: &Kernel,
    options: &UnfoldOptions,
    stream: u64,
    progress: Progress<'_>,
) -> Result<Replicated, UnfoldError> {
    let problem = Problem::new(counts, kernel, options)?;
    let fit = estimate(&problem, &problem.counts, options)?;
    let bins = kernel.sizes().len();
    let replicates = match &options.bootstrap {
        None => None,
        Some(bootstrap) => {
            let parts = parts(bootstrap, counts, problem.first_row)?;
            Some(resampled(
                &problem,
                options,
                bootstrap,
                &fit,
                parts.as_ref(),
                stream,
                progress,
                bins,
            )?)
        }
    };
    let unfolding = result(&problem, counts, kernel, options, &fit, replicates.as_ref());
    Ok((unfolding, problem.widen(&fit.population, bins), replicates))
}

/// Counts drawn from each of the fits that the counts allow, in proportion to their weight, and fitted again.
#[allow(clippy::too_many_arguments, reason = "one call")]
fn resampled(
    problem: &Problem,
    options: &UnfoldOptions,
    bootstrap: &Bootstrap,
    fit: &Fit,
    parts: Option<&Parts>,
    stream: u64,
    progress: Progress<'_>,
    bins: usize,
) -> Result<Replicates, UnfoldError> {
    let mut room = workspace(problem);
    let mut rng = ChaCha8Rng::seed_from_u64(bootstrap.seed);
    rng.set_stream(BASES);
    let bases = fit
        .again
        .iter()
        .map(|(_, refit)| base(problem, refit, options, &mut room, &mut rng))
        .collect::<Result<Vec<_>, _>>()?;
    let expected: Vec<Vec<f64>> = bases.iter().map(|base| problem.refold(base)).collect();
    let whole: f64 = fit.again.iter().map(|(weight, _)| weight).sum();
    // Replicate k belongs to the fit in which the cumulative weight passes (k + 1/2) / B.
    let base_of: Vec<usize> = (0..bootstrap.replicates)
        .map(|k| {
            let place = whole * (k as f64 + 0.5) / bootstrap.replicates as f64;
            let mut below = 0.0;
            let passed = fit.again.iter().position(|(weight, _)| {
                below += weight;
                below > place
            });
            passed.unwrap_or(0)
        })
        .collect();
    let densities = replicate(
        bootstrap,
        stream,
        |task| parts.map_or(Source::Expected(&expected[base_of[task]]), Source::Parts),
        problem.columns.len(),
        progress,
        || workspace(problem),
        |task, drawn, room, rng| again(problem, drawn, &fit.again[base_of[task]].1, options, room, rng),
    )?;
    Ok(Replicates {
        bases: bases.iter().map(|base| problem.widen(base, bins)).collect(),
        base_of,
        densities: densities.iter().map(|one| problem.widen(one, bins)).collect(),
        bootstrap: *bootstrap,
        slices: parts.map(|parts| parts.number),
    })
}

/// First stream of random numbers that are drawn for the estimate itself.
const BASES: u64 = 1 << 61;

/// Quantities of densities on all bins of a kernel, with their intervals.
pub(crate) struct Quantities<'a> {
    pub(crate) densities: &'a Population,
    pub(crate) replicates: Option<&'a Replicates>,
}

impl Quantities<'_> {
    pub(crate) fn estimate(&self, quantity: &dyn Fn(&Population) -> f64) -> Estimate {
        self.estimate_up_to(f64::INFINITY, quantity)
    }

    /// Estimate of a quantity that cannot be larger than `most`: a fraction or a size.
    pub(crate) fn estimate_up_to(&self, most: f64, quantity: &dyn Fn(&Population) -> f64) -> Estimate {
        let value = quantity(self.densities);
        Estimate {
            value,
            interval: self
                .replicates
                .map(|replicates| replicates.interval(value, most, Deviation::Ratio, quantity)),
        }
    }

    pub(crate) fn bin(&self, quantity: &dyn Fn(&Population) -> f64) -> Option<Interval> {
        let value = quantity(self.densities);
        self.replicates
            .map(|replicates| replicates.interval(value, f64::INFINITY, Deviation::SpreadAndBias, quantity))
    }
}

fn result(
    problem: &Problem,
    counts: &ProfileCounts,
    kernel: &Kernel,
    options: &UnfoldOptions,
    fit: &Fit,
    replicates: Option<&Replicates>,
) -> Unfolding {
    let sizes = kernel.sizes();
    let moments = Moments::new(sizes);
    let densities = problem.widen(&fit.population, sizes.len());
    let quantities = Quantities {
        densities: &densities,
        replicates,
    };
    let estimate = |quantity: &dyn Fn(&Population) -> f64| quantities.estimate(quantity);
    let grouping = Grouping::new(sizes);
    let mut number_density = vec![None; grouping.bins()];
    let mut intervals = vec![None; grouping.bins()];
    for &bin in &problem.reported {
        number_density[bin] = Some(grouping.sum(&densities, bin));
        intervals[bin] = quantities.bin(&|densities| grouping.sum(densities, bin));
    }
    let coarse: Vec<f64> = number_density.iter().copied().flatten().collect();
    let refolded = refolded(counts, kernel, &densities);
    // Not cut at 1: a fraction above 1 says that area, sizes or shape are wrong.
    let volume_fraction = quantities.estimate(&|densities| kernel.unit_volume() * moments.sum(densities, 3));
    let rows = problem.counts.len();
    let expected = problem.refold(&fit.population);
    let p_value = p_value_of_model(&problem.fine, &problem.counts, &expected, fit.parameters);
    let mut findings = findings(problem, counts, kernel, options, fit, &coarse);
    findings.extend(poor_fit(p_value));
    findings.extend(missing_fines(&problem.counts, &expected, |row| {
        counts.edges()[problem.first_row + row]
    }));
    Unfolding {
        edges: sizes.reported_edges().to_vec(),
        intervals: replicates.map(|_| intervals),
        total: estimate(&Population::total),
        mean_size: quantities.estimate_up_to(moments.largest(), &|densities| {
            moments.mean(densities, Weighing::Number)
        }),
        surface_density: kernel
            .unit_surface()
            .map(|surface| estimate(&|densities| surface * moments.sum(densities, 2))),
        distribution: describe(&moments, sizes.reported_edges(), |_, most, quantity| {
            quantities.estimate_up_to(most, quantity)
        }),
        profiles: counts.profiles(),
        profile_edges: counts.edges().to_vec(),
        observed: counts.per_area(),
        profiles_per_area: CrossCheck {
            observed: counts.per_area()[problem.first_row..].iter().sum(),
            expected: refolded[problem.first_row..].iter().sum(),
        },
        area_fraction: CrossCheck {
            observed: counts.area_fractions()[problem.first_row..].iter().sum(),
            expected: if problem.first_row == 0 {
                volume_fraction.value
            } else {
                let bins = counts.edges().windows(2).zip(&refolded).skip(problem.first_row);
                bins.map(|(bin, n)| n * mean_profile_area(bin)).sum()
            },
        },
        volume_fraction,
        deviance: deviance(&problem.counts, &expected),
        p_value,
        degrees_of_freedom: degrees_of_freedom(rows, fit.parameters),
        condition_number: condition_number(&problem.coarse),
        threshold: problem.threshold,
        method: fit.method,
        evidence_for_sparse: fit.for_sparse,
        evidence: fit.evidence,
        penalty: fit.penalty.map(|(penalty, bend)| PenaltyUsed {
            order: penalty.order,
            weight: penalty.weight,
            bend,
        }),
        clamped_bins: fit.negative.iter().map(|&(k, _)| problem.reported[k]).collect(),
        iterations: fit.iterations,
        findings,
        number_density,
        refolded,
    }
}

/// Profiles per unit area by profile bin, below the threshold too.
fn refolded(counts: &ProfileCounts, kernel: &Kernel, population: &Population) -> Vec<f64> {
    let mut refolded = kernel.matrix() * nalgebra::DVector::from_column_slice(&population.spread);
    if let Some(points) = PointKernel::new(kernel, counts, 0) {
        for spike in &population.spikes {
            let column = nalgebra::DVector::from_vec(points.column(spike.size));
            refolded.axpy(spike.density * counts.dispersion() / counts.area(), &column, 1.0);
        }
    }
    refolded.iter().copied().collect()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Between zero and the number of rows.
fn degrees_of_freedom(rows: usize, parameters: f64) -> usize {
    (rows as f64 - parameters).round().max(0.0) as usize
}

/// 2 Σ n ln(n / μ) − n + μ. Bins with counts and no expectation would make it infinite.
fn deviance(counts: &[f64], expected: &[f64]) -> f64 {
    let term = |n: f64, mu: f64| if n > 0.0 { n * (n / mu).ln() - n + mu } else { mu };
    2.0 * counts.iter().zip(expected).map(|(&n, &mu)| term(n, mu)).sum::<f64>()
}
