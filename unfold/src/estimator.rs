//! Which estimator answers, how `auto` chooses, and what is fitted again for the intervals.

use crate::expectation_maximisation::maximise;
use crate::log_densities::{Effort, Penalty, Start, Workspace, climb};
use crate::options::{Method, UnfoldOptions};
use crate::penalised::smooth;
use crate::problem::Problem;
use crate::unfold_error::UnfoldError;
use crate::{inverse, nnls, sparse};
use nalgebra::DVector;

/// Densities of the kept bins of the kernel, and how they came about.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) densities: Vec<f64>,
    /// The estimator that was used.
    pub(crate) method: Method,
    /// What was below zero, by reported column.
    pub(crate) negative: Vec<(usize, f64)>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    /// The best penalty.
    pub(crate) penalty: Option<Penalty>,
    /// Parameters in effect.
    pub(crate) parameters: f64,
    /// ln evidence of the sparse estimate less that of the smooth one, where both were asked.
    pub(crate) for_sparse: Option<f64>,
    /// ln evidence, where there is one; differences count.
    pub(crate) evidence: Option<f64>,
    /// What is fitted to counts drawn again.
    pub(crate) again: Refit,
}

/// The estimator of the bootstrap: rougher than a smooth estimate, so that its own bias is small beside its spread.
#[derive(Clone, Debug)]
pub(crate) enum Refit {
    /// Penalised at this weight, from this start.
    Smooth(Penalty, Vec<f64>),
    /// Largest likelihood on all reported bins.
    Likelihood,
    /// The estimator itself.
    Same(Method),
}

/// `auto` takes the sparse estimate if its evidence is e³ = 20 times that of the smooth one: strong, in the words of Kass & Raftery (1995).
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

/// Densities of counts drawn again.
pub(crate) fn again(
    problem: &Problem,
    counts: &[f64],
    refit: &Refit,
    options: &UnfoldOptions,
    room: &mut Workspace,
) -> Result<Vec<f64>, UnfoldError> {
    match refit {
        Refit::Smooth(penalty, start) => {
            let roughness = penalty.on(start.len());
            let start = Start::at(&problem.design, counts, start, room);
            let peak = climb(&problem.design, counts, &roughness, &start, Effort::BRIEF, room);
            Ok(problem.with_logarithms(&peak.theta))
        }
        Refit::Likelihood => Ok(problem.spread(&sparse::on_all(&problem.coarse, counts))),
        Refit::Same(method) => Ok(plain_fit(problem, counts, *method, options)?.densities),
    }
}

/// The fit and its evidence.
fn smooth_fit(problem: &Problem, counts: &[f64]) -> (Fit, f64) {
    let found = smooth(&problem.design, counts);
    let (penalty, theta) = found.second_order;
    let rougher = Penalty {
        weight: penalty.weight / ROUGHER,
        ..penalty
    };
    let densities = found
        .densities
        .iter()
        .zip(&problem.widths)
        .map(|(n, w)| n * w)
        .collect();
    let fit = Fit {
        densities,
        method: Method::Penalised,
        negative: Vec::new(),
        iterations: found.iterations,
        converged: true,
        penalty: Some(found.penalty),
        parameters: found.effective_parameters,
        for_sparse: None,
        evidence: Some(found.evidence),
        again: Refit::Smooth(rougher, theta),
    };
    (fit, found.evidence)
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
        again: Refit::Likelihood,
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
        again: Refit::Same(method),
    })
}

/// Room for [`again`].
pub(crate) fn workspace(problem: &Problem) -> Workspace {
    Workspace::new(&problem.design)
}

/// ln evidence of the smooth estimate: how well sizes and kernel suit the counts, whatever the densities.
pub(crate) fn evidence(problem: &Problem) -> f64 {
    smooth(&problem.design, &problem.counts).evidence
}
