//! The choice of the estimator, and what is fitted to resampled counts for the intervals.

use crate::expectation_maximisation::maximise;
use crate::log_densities::{Effort, Penalty, Start, Workspace, climb, log_likelihood};
use crate::options::{Method, UnfoldOptions};
use crate::penalised::{SmoothFit, smooth};
use crate::population::Population;
use crate::problem::Problem;
use crate::spikes::{self, SpikeFit};
use crate::unfold_error::UnfoldError;
use crate::{inverse, nnls, sparse};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

/// Densities on the kept bins of the kernel, and how they were computed.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) population: Population,
    /// The estimator that was used.
    pub(crate) method: Method,
    /// What was below zero, by reported column.
    pub(crate) negative: Vec<(usize, f64)>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    /// The best penalty, and the size about which it is lighter.
    pub(crate) penalty: Option<(Penalty, Option<f64>)>,
    /// Parameters in effect.
    pub(crate) parameters: f64,
    /// ln evidence of the sparse estimate minus that of the smooth one, if both were computed.
    pub(crate) for_sparse: Option<f64>,
    /// ln evidence, where there is one; differences count.
    pub(crate) evidence: Option<f64>,
    /// What is fitted to resampled counts, with weights.
    pub(crate) again: Vec<(f64, Refit)>,
}

/// The estimator of the bootstrap: rougher than a smooth estimate, so that its own bias is small beside its spread.
#[derive(Clone, Debug)]
pub(crate) enum Refit {
    /// Penalised with this weight on the grid of this index, from this start.
    Smooth(usize, Penalty, Vec<f64>),
    /// Largest likelihood on all reported bins.
    Likelihood,
    /// The same number of spikes, from these.
    Spikes(SpikeFit),
    /// The estimator itself.
    Same(Method),
}

/// `auto` takes the sparse estimate if its evidence is e⁴ = 55 times that of the smooth one: strong, in the words of
/// Kass & Raftery (1995).
const STRONG: f64 = 4.0;
/// The weight of the penalty in the bootstrap is the best one over this.
const ROUGHER: f64 = 10.0;

/// Fits the counts of a problem.
pub(crate) fn estimate(problem: &Problem, counts: &[f64], options: &UnfoldOptions) -> Result<Fit, UnfoldError> {
    match options.method {
        Method::Auto => {
            let smooth = smooth_fit(problem, counts);
            let sparse = sparse_fit(problem, counts, Some(&smooth.0));
            let for_sparse = sparse.1 - smooth.1;
            let again = both(&smooth.0.again, &sparse.0.again, for_sparse);
            let fit = if for_sparse > STRONG { sparse.0 } else { smooth.0 };
            Ok(Fit {
                for_sparse: Some(for_sparse),
                again,
                ..fit
            })
        }
        Method::Penalised => Ok(smooth_fit(problem, counts).0),
        Method::Sparse => Ok(sparse_fit(problem, counts, None).0),
        method => plain_fit(problem, counts, method, options),
    }
}

/// The refits of both estimates, weighted by their evidence: where the counts hardly distinguish them, intervals
/// contain what either says.
fn both(smooth: &[(f64, Refit)], sparse: &[(f64, Refit)], for_sparse: f64) -> Vec<(f64, Refit)> {
    let sparse_share = 1.0 / (1.0 + (-for_sparse).exp());
    let mut all = Vec::new();
    for (refits, share) in [(smooth, 1.0 - sparse_share), (sparse, sparse_share)] {
        let whole: f64 = refits.iter().map(|(weight, _)| weight).sum();
        let weighted = refits
            .iter()
            .map(|(weight, refit)| (weight / whole * share, refit.clone()));
        all.extend(weighted.filter(|(weight, _)| *weight > NEGLIGIBLE));
    }
    all
}

/// Fits with a smaller weight than this are left out of the bootstrap.
const NEGLIGIBLE: f64 = 1e-3;

/// What the counts of the bootstrap are drawn from.
pub(crate) fn base(
    problem: &Problem,
    refit: &Refit,
    options: &UnfoldOptions,
    room: &mut Workspace,
    rng: &mut ChaCha8Rng,
) -> Result<Population, UnfoldError> {
    match refit {
        Refit::Spikes(fit) => Ok(Population::of_spikes(problem.columns.len(), fit.spikes.clone())),
        _ => again(problem, &problem.counts, refit, options, room, rng),
    }
}

/// Densities of resampled counts.
pub(crate) fn again(
    problem: &Problem,
    counts: &[f64],
    refit: &Refit,
    options: &UnfoldOptions,
    room: &mut Workspace,
    rng: &mut ChaCha8Rng,
) -> Result<Population, UnfoldError> {
    let spread = match refit {
        Refit::Smooth(grid, penalty, start) => {
            let grid = &problem.grids[*grid];
            let roughness = penalty.on(start.len());
            let start = Start::at(&grid.design, counts, start, room);
            let peak = climb(&grid.design, counts, &roughness, &start, Effort::BRIEF, room);
            grid.with_logarithms(&peak.theta)
        }
        Refit::Likelihood => problem.spread(&sparse::on_all(&problem.coarse, counts)),
        Refit::Spikes(fit) => {
            let points = problem.points.as_ref();
            let spikes = points.map(|kernel| fit.again(kernel, counts, rng)).unwrap_or_default();
            return Ok(Population::of_spikes(problem.columns.len(), spikes));
        }
        Refit::Same(method) => return Ok(plain_fit(problem, counts, *method, options)?.population),
    };
    Ok(Population::of_bins(spread))
}

/// The smooth estimates on all grids, averaged by their evidence, and the evidence of all.
fn smooth_fit(problem: &Problem, counts: &[f64]) -> (Fit, f64) {
    let found: Vec<SmoothFit> = problem.grids.iter().map(|grid| smooth(&grid.design, counts)).collect();
    let (best, evidence) = averaged(&found);
    let mut densities = vec![0.0; problem.columns.len()];
    let weights: Vec<f64> = (0..found.len())
        .map(|k| (log_weight(&found, k) - log_weight(&found, best)).exp())
        .collect();
    let whole: f64 = weights.iter().sum();
    for ((grid, of), weight) in problem.grids.iter().zip(&found).zip(&weights) {
        let of = grid.densities(&of.densities);
        densities
            .iter_mut()
            .zip(of)
            .for_each(|(sum, n)| *sum += weight / whole * n);
    }
    let refits = found.iter().zip(&weights).enumerate().map(|(grid, (of, weight))| {
        let (penalty, theta) = of.second_order.clone();
        let rougher = Penalty {
            weight: penalty.weight / ROUGHER,
            ..penalty
        };
        (*weight, Refit::Smooth(grid, rougher, theta))
    });
    let again = refits.collect();
    let bend = found[best]
        .penalty
        .bend
        .map(|fraction| problem.grids[best].size_at(fraction));
    let fit = Fit {
        population: Population::of_bins(densities),
        method: Method::Penalised,
        negative: Vec::new(),
        iterations: found.iter().map(|of| of.iterations).sum(),
        converged: true,
        penalty: Some((found[best].penalty, bend)),
        parameters: found[best].effective_parameters,
        for_sparse: None,
        evidence: Some(evidence),
        again,
    };
    (fit, evidence)
}

/// Prior weights of the linear, root and logarithmic grids. The evidence of a few hundred profiles hardly
/// distinguishes grids, and densities that are smooth on a linear grid do not decrease towards size zero as those of
/// materials do. The root grid lies between the others.
const PRIOR: [f64; 3] = [2.0, 1.0, 4.0];

/// Prior weight of a grid among so many; a fit may have a single one.
fn prior(grids: usize, grid: usize) -> f64 {
    if grids == PRIOR.len() { PRIOR[grid] } else { 1.0 }
}

/// ln of the weight of a grid among the fits on all grids.
fn log_weight(found: &[SmoothFit], grid: usize) -> f64 {
    found[grid].evidence + prior(found.len(), grid).ln()
}

/// Index of the fit of largest weight, and ln of the mean evidence.
fn averaged(found: &[SmoothFit]) -> (usize, f64) {
    let best = (0..found.len())
        .max_by(|&a, &b| log_weight(found, a).total_cmp(&log_weight(found, b)))
        .unwrap_or(0);
    let top = log_weight(found, best);
    let sum: f64 = (0..found.len()).map(|k| (log_weight(found, k) - top).exp()).sum();
    let priors: f64 = (0..found.len()).map(|k| prior(found.len(), k)).sum();
    (best, top + (sum / priors).ln())
}

/// The sparse estimate of highest evidence, of spikes or of bins, and its evidence. Spikes that cannot compete with a
/// smooth estimate are not sought.
fn sparse_fit(problem: &Problem, counts: &[f64], smooth: Option<&Fit>) -> (Fit, f64) {
    let bins = sparse::choose(&problem.coarse, counts);
    let (to_beat, reachable) = smooth.map_or((f64::NEG_INFINITY, f64::INFINITY), |smooth| {
        let evidence = smooth.evidence.unwrap_or(f64::NEG_INFINITY) + STRONG;
        let reached = log_likelihood(counts, &problem.refold(&smooth.population));
        (evidence.max(bins.evidence), reached + spikes::REACHABLE)
    });
    let spikes = problem
        .points
        .as_ref()
        .and_then(|kernel| spikes::choose(kernel, counts, &problem.fine, &problem.middles, to_beat, reachable))
        .filter(|of| of.evidence > bins.evidence);
    let fit = |population: Population, parameters: usize, evidence: f64, iterations: usize, again: Refit| Fit {
        population,
        method: Method::Sparse,
        negative: Vec::new(),
        iterations,
        converged: true,
        penalty: None,
        parameters: parameters as f64,
        for_sparse: None,
        evidence: Some(evidence),
        again: vec![(1.0, again)],
    };
    match spikes {
        Some(found) => {
            let population = Population::of_spikes(problem.columns.len(), found.spikes.clone());
            let evidence = found.evidence;
            let parameters = 2 * found.spikes.len();
            (
                fit(population, parameters, evidence, found.iterations, Refit::Spikes(found)),
                evidence,
            )
        }
        None => {
            let population = Population::of_bins(problem.spread(&bins.densities));
            (
                fit(population, bins.kept, bins.evidence, bins.iterations, Refit::Likelihood),
                bins.evidence,
            )
        }
    }
}

fn plain_fit(problem: &Problem, counts: &[f64], method: Method, options: &UnfoldOptions) -> Result<Fit, UnfoldError> {
    let matrix = &problem.coarse;
    let (rows, columns) = matrix.shape();
    let (mut negative, mut iterations, mut converged) = (Vec::new(), 0, true);
    let densities: Vec<f64> = match method {
        Method::Paper => {
            if rows != columns {
                return Err(UnfoldError::NotSquare { rows, columns });
            }
            let solution = inverse::solve(matrix, &DVector::from_column_slice(counts)).ok_or(UnfoldError::Singular)?;
            let below = solution.iter().copied().enumerate();
            negative = below.filter(|(_, density)| *density < 0.0).collect();
            solution.iter().map(|density| density.max(0.0)).collect()
        }
        Method::Nnls => {
            let found = nnls::minimise(matrix, &DVector::from_column_slice(counts));
            (iterations, converged) = (found.iterations, found.converged);
            found.solution.iter().copied().collect()
        }
        Method::Em if problem.grids.len() > 1 => return Ok(em_on_pairs(problem, counts, options)),
        _ => {
            let smoothing = if method == Method::Ems { options.smoothing } else { 0.0 };
            let found = maximise(matrix, counts, smoothing, options.tolerance, options.max_iterations);
            (iterations, converged) = (found.iterations, found.converged);
            found.densities
        }
    };
    Ok(Fit {
        population: Population::of_bins(problem.spread(&densities)),
        method,
        negative,
        iterations,
        converged,
        penalty: None,
        parameters: columns as f64,
        for_sparse: None,
        evidence: None,
        again: vec![(1.0, Refit::Same(method))],
    })
}

/// Expectation-maximisation on pairs of nodes of the logarithmic grid: reported bins in which a wide distribution is
/// not uniform leave a bias that no number of profiles removes.
fn em_on_pairs(problem: &Problem, counts: &[f64], options: &UnfoldOptions) -> Fit {
    let grid = &problem.grids[problem.grids.len() - 1];
    let single = grid.matrix(&problem.fine);
    let pairs = single.ncols() / 2;
    let matrix = DMatrix::from_fn(single.nrows(), pairs, |i, k| {
        single[(i, 2 * k)] + single[(i, 2 * k + 1)]
    });
    let found = maximise(&matrix, counts, 0.0, options.tolerance, options.max_iterations);
    let nodes: Vec<f64> = found.densities.iter().flat_map(|density| [*density; 2]).collect();
    Fit {
        population: Population::of_bins(grid.densities(&nodes)),
        method: Method::Em,
        negative: Vec::new(),
        iterations: found.iterations,
        converged: found.converged,
        penalty: None,
        parameters: pairs as f64,
        for_sparse: None,
        evidence: None,
        again: vec![(1.0, Refit::Same(Method::Em))],
    }
}

/// Room for [`again`].
pub(crate) fn workspace(problem: &Problem) -> Workspace {
    // Several grids have the same number of nodes.
    Workspace::new(&problem.grids[0].design)
}

/// ln evidence of the smooth estimate: how well sizes and kernel suit the counts, whatever the densities.
pub(crate) fn evidence(problem: &Problem) -> f64 {
    let found: Vec<SmoothFit> = problem
        .grids
        .iter()
        .map(|grid| smooth(&grid.design, &problem.counts))
        .collect();
    averaged(&found).1
}
