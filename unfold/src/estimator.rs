//! The choice of the estimator, and what is fitted to resampled counts for the intervals.

use crate::expectation_maximisation::maximise;
use crate::log_densities::{Effort, Penalty, Start, Workspace, climb};
use crate::options::{Method, UnfoldOptions};
use crate::penalised::{SmoothFit, smooth};
use crate::problem::Problem;
use crate::unfold_error::UnfoldError;
use crate::{inverse, nnls, sparse};
use nalgebra::{DMatrix, DVector};

/// Densities of the kept bins of the kernel, and how they were computed.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) densities: Vec<f64>,
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
    /// The estimator itself.
    Same(Method),
}

/// `auto` takes the sparse estimate if its evidence is e³ = 20 times that of the smooth one: strong, in the words of
/// Kass & Raftery (1995).
const STRONG: f64 = 3.0;
/// The weight of the penalty in the bootstrap is the best one over this.
const ROUGHER: f64 = 10.0;

/// Fits the counts of a problem.
pub(crate) fn estimate(problem: &Problem, counts: &[f64], options: &UnfoldOptions) -> Result<Fit, UnfoldError> {
    match options.method {
        Method::Auto => {
            let sparse = sparse_fit(problem, counts);
            let smooth = smooth_fit(problem, counts);
            let for_sparse = sparse.1 - smooth.1;
            let fit = if for_sparse > STRONG { sparse.0 } else { smooth.0 };
            Ok(Fit {
                for_sparse: Some(for_sparse),
                ..fit
            })
        }
        Method::Penalised => Ok(smooth_fit(problem, counts).0),
        Method::Sparse => Ok(sparse_fit(problem, counts).0),
        method => plain_fit(problem, counts, method, options),
    }
}

/// Densities of resampled counts.
pub(crate) fn again(
    problem: &Problem,
    counts: &[f64],
    refit: &Refit,
    options: &UnfoldOptions,
    room: &mut Workspace,
) -> Result<Vec<f64>, UnfoldError> {
    match refit {
        Refit::Smooth(grid, penalty, start) => {
            let grid = &problem.grids[*grid];
            let roughness = penalty.on(start.len());
            let start = Start::at(&grid.design, counts, start, room);
            let peak = climb(&grid.design, counts, &roughness, &start, Effort::BRIEF, room);
            Ok(grid.with_logarithms(&peak.theta))
        }
        Refit::Likelihood => Ok(problem.spread(&sparse::on_all(&problem.coarse, counts))),
        Refit::Same(method) => Ok(plain_fit(problem, counts, *method, options)?.densities),
    }
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
        densities,
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

/// Prior weight of the logarithmic grid, the last of three, over that of each other grid. The evidence of a few hundred
/// profiles hardly distinguishes grids, and densities that are smooth on a linear grid do not decrease towards size
/// zero as those of materials do.
const LOGARITHMIC: f64 = 4.0;

/// ln of the weight of a grid among the fits on all grids.
fn log_weight(found: &[SmoothFit], grid: usize) -> f64 {
    let is_logarithmic = found.len() > 1 && grid == found.len() - 1;
    found[grid].evidence + if is_logarithmic { LOGARITHMIC.ln() } else { 0.0 }
}

/// Index of the fit of largest weight, and ln of the mean evidence.
fn averaged(found: &[SmoothFit]) -> (usize, f64) {
    let best = (0..found.len())
        .max_by(|&a, &b| log_weight(found, a).total_cmp(&log_weight(found, b)))
        .unwrap_or(0);
    let top = log_weight(found, best);
    let sum: f64 = (0..found.len()).map(|k| (log_weight(found, k) - top).exp()).sum();
    let prior = found.len() as f64 - 1.0 + if found.len() > 1 { LOGARITHMIC } else { 1.0 };
    (best, top + (sum / prior).ln())
}

/// The fit and its evidence.
fn sparse_fit(problem: &Problem, counts: &[f64]) -> (Fit, f64) {
    let found = sparse::choose(&problem.coarse, counts);
    let fit = Fit {
        densities: problem.spread(&found.densities),
        method: Method::Sparse,
        negative: Vec::new(),
        iterations: found.iterations,
        converged: true,
        penalty: None,
        parameters: found.kept as f64,
        for_sparse: None,
        evidence: Some(found.evidence),
        again: vec![(1.0, Refit::Likelihood)],
    };
    (fit, found.evidence)
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
        densities: problem.spread(&densities),
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
        densities: grid.densities(&nodes),
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
