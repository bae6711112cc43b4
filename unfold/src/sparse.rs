//! The sparse estimate: the largest likelihood with as few size bins as the counts support.
//!
//! Every bin is worth keeping only if it raises the log-likelihood by more than its price, ½ ln n + ln 2 for n
//! profiles: half of Schwarz's criterion, and odds of two to one against every bin. Bins are given up one by one, the
//! least significant first by Wald's statistic, and the best of the nested sets is taken. Its log-likelihood less the
//! prices stands for its evidence.

use crate::log_densities::{Design, Effort, Peak, Penalty, Start, Workspace, climb};
use crate::penalised::level;
use nalgebra::DMatrix;

/// Densities of the bins; those of removed bins are zero.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SparseFit {
    pub(crate) densities: Vec<f64>,
    /// How many bins were kept.
    pub(crate) kept: usize,
    /// Log-likelihood less the prices of the bins.
    pub(crate) evidence: f64,
    pub(crate) iterations: usize,
}

/// Chooses bins and fits them.
pub(crate) fn choose(matrix: &DMatrix<f64>, counts: &[f64]) -> SparseFit {
    let price = 0.5 * counts.iter().sum::<f64>().max(1.0).ln() + 2_f64.ln();
    let mut kept: Vec<usize> = (0..matrix.ncols()).collect();
    let mut start: Option<Vec<f64>> = None;
    let mut best: Option<SparseFit> = None;
    let mut iterations = 0;
    while !kept.is_empty() {
        let design = Design::new(&matrix.select_columns(&kept));
        let mut room = Workspace::new(&design);
        let from = start.unwrap_or_else(|| vec![level(&design, counts).ln(); kept.len()]);
        let begin = Start::at(&design, counts, &from, &mut room);
        let peak = climb(&design, counts, &Penalty::NONE.on(0), &begin, Effort::FULL, &mut room);
        iterations += peak.iterations;
        let evidence = peak.likelihood - price * kept.len() as f64;
        if best.as_ref().is_none_or(|best| evidence > best.evidence) {
            best = Some(fit(matrix.ncols(), &kept, &peak.theta, evidence));
        }
        let Some(leaving) = least_significant(matrix, counts, &kept, &peak, &room) else {
            break;
        };
        kept.remove(leaving);
        let mut theta = peak.theta;
        theta.remove(leaving);
        start = Some(theta);
    }
    let mut best = best.unwrap_or_else(|| fit(matrix.ncols(), &[], &[], f64::NEG_INFINITY));
    best.iterations = iterations;
    best
}

/// The densities of largest likelihood on all bins.
pub(crate) fn on_all(matrix: &DMatrix<f64>, counts: &[f64]) -> Vec<f64> {
    let design = Design::new(matrix);
    let mut room = Workspace::new(&design);
    let start = vec![level(&design, counts).ln(); matrix.ncols()];
    let start = Start::at(&design, counts, &start, &mut room);
    let peak = climb(&design, counts, &Penalty::NONE.on(0), &start, Effort::FULL, &mut room);
    peak.theta.iter().map(|t| t.exp()).collect()
}

fn fit(bins: usize, kept: &[usize], theta: &[f64], evidence: f64) -> SparseFit {
    let mut densities = vec![0.0; bins];
    for (&j, t) in kept.iter().zip(theta) {
        densities[j] = t.exp();
    }
    SparseFit {
        densities,
        kept: kept.len(),
        evidence,
        iterations: 0,
    }
}

/// The bin whose density is the fewest standard errors above zero, among those without which the counts can still be
/// explained.
fn least_significant(
    matrix: &DMatrix<f64>,
    counts: &[f64],
    kept: &[usize],
    peak: &Peak,
    room: &Workspace,
) -> Option<usize> {
    let needed = |leaving: usize| {
        (0..counts.len()).any(|i| {
            counts[i] > 0.0
                && kept
                    .iter()
                    .enumerate()
                    .all(|(k, &j)| k == leaving || matrix[(i, j)] <= 0.0)
        })
    };
    let mut least: Option<(usize, f64)> = None;
    for k in 0..peak.theta.len() {
        let mut column = vec![0.0; kept.len()];
        column[k] = 1.0;
        room.information.solve(&mut column);
        // Of the logarithm: 1 / its variance is the squared density over its own.
        let wald = 1.0 / column[k];
        if least.is_none_or(|(_, smallest)| wald < smallest) && !needed(k) {
            least = Some((k, wald));
        }
    }
    least.map(|(k, _)| k)
}
