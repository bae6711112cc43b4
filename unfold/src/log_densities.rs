//! Fisher scoring for log-densities: maximises the likelihood of the counts minus a penalty on roughness.

use crate::cholesky::{Symmetric, dot, products};
use nalgebra::DMatrix;

/// Expected counts for one particle per unit volume at each node: one column per node, with its range of nonzero rows.
#[derive(Clone, Debug)]
pub(crate) struct Design {
    rows: usize,
    entries: Vec<f64>,
    /// Range of nonzero rows of each column: start, end (exclusive).
    spans: Vec<(usize, usize)>,
    /// The same columns, interleaved in groups of four; the last group is padded with zeros.
    fours: Vec<[f64; 4]>,
    /// Range of nonzero rows of each group of four.
    four_spans: Vec<(usize, usize)>,
}

impl Design {
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        let spans: Vec<(usize, usize)> = matrix
            .column_iter()
            .map(|column| {
                let seen = |k: &f64| *k > 0.0;
                let from = column.iter().position(seen).unwrap_or(0);
                (from, column.iter().rposition(seen).map_or(from, |last| last + 1))
            })
            .collect();
        let (rows, columns) = matrix.shape();
        let of = |row: usize, column: usize| if column < columns { matrix[(row, column)] } else { 0.0 };
        let fours = (0..columns.div_ceil(4)).flat_map(|four| {
            let side_by_side = move |row: usize| [0, 1, 2, 3].map(|k| of(row, 4 * four + k));
            (0..rows).map(side_by_side)
        });
        Self {
            rows,
            entries: matrix.as_slice().to_vec(),
            fours: fours.collect(),
            four_spans: spans
                .chunks(4)
                .map(|of| {
                    let from = of.iter().map(|span| span.0).min().unwrap_or(0);
                    (from, of.iter().map(|span| span.1).max().unwrap_or(0).max(from))
                })
                .collect(),
            spans,
        }
    }

    pub(crate) fn nodes(&self) -> usize {
        self.spans.len()
    }

    /// First row and entries of a column.
    fn column(&self, node: usize) -> (usize, &[f64]) {
        let (from, to) = self.spans[node];
        (from, &self.entries[node * self.rows + from..node * self.rows + to])
    }

    /// Expected number of profiles for one particle per unit volume at this node.
    pub(crate) fn column_sum(&self, node: usize) -> f64 {
        self.column(node).1.iter().sum()
    }

    /// μ = K x.
    pub(crate) fn refold(&self, densities: &[f64], expected: &mut [f64]) {
        expected.fill(0.0);
        for (node, &density) in densities.iter().enumerate() {
            let (from, column) = self.column(node);
            for (mu, k) in expected[from..].iter_mut().zip(column) {
                *mu += k * density;
            }
        }
    }
}

/// Σ n ln μ − μ.
pub(crate) fn log_likelihood(counts: &[f64], expected: &[f64]) -> f64 {
    let term = |(&n, &mu): (&f64, &f64)| if n > 0.0 { n * mu.ln() - mu } else { -mu };
    counts.iter().zip(expected).map(term).sum()
}

/// A roughness penalty: weight × sum of squared differences of the given order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penalty {
    pub(crate) order: usize,
    pub(crate) weight: f64,
    /// Centre of the region with a weaker penalty, as a fraction of the range of nodes.
    pub(crate) bend: Option<f64>,
}

/// Decimal logarithm of the factor by which the weight is smaller at a bend.
const BEND_DEPTH: f64 = 3.0;
/// Standard deviation of the Gaussian by which the weight returns to its value elsewhere, as a fraction of the nodes.
const BEND_WIDTH: f64 = 0.12;

impl Penalty {
    /// No penalty.
    pub(crate) const NONE: Self = Self {
        order: 0,
        weight: 0.0,
        bend: None,
    };

    /// Coefficients of one difference: (−1)^(r − k) C(r, k).
    fn stencil(order: usize) -> Vec<f64> {
        (0..order).fold(vec![1.0], |weights, _| {
            let mut next = vec![0.0; weights.len() + 1];
            for (k, w) in weights.iter().enumerate() {
                next[k] -= w;
                next[k + 1] += w;
            }
            next
        })
    }

    /// The penalty on this many nodes.
    pub(crate) fn on(self, nodes: usize) -> Roughness {
        let weight = |difference: usize| {
            let Some(bend) = self.bend else { return self.weight };
            let middle = (difference as f64 + 0.5 * (self.order as f64 + 1.0)) / nodes as f64;
            let apart = (middle - bend) / BEND_WIDTH;
            self.weight * 10_f64.powf(-BEND_DEPTH * (-0.5 * apart * apart).exp())
        };
        let differences = if self.weight > 0.0 {
            nodes.saturating_sub(self.order)
        } else {
            0
        };
        Roughness {
            stencil: Self::stencil(self.order),
            weights: (0..differences).map(weight).collect(),
        }
    }

    /// ln of the product of the positive eigenvalues of the penalty's matrix at weight 1: that of the differences' Gram
    /// matrix.
    pub(crate) fn log_pseudo_determinant(nodes: usize, order: usize) -> f64 {
        let stencil = Self::stencil(order);
        let mut gram = Symmetric::zeros(nodes.saturating_sub(order));
        for i in 0..gram.size() {
            for j in i.saturating_sub(order)..=i {
                *gram.entry(i, j) = stencil[i - j..].iter().zip(&stencil).map(|(a, b)| a * b).sum();
            }
        }
        gram.factorise();
        gram.log_determinant()
    }
}

/// A penalty on the nodes of a fit, with the weight of every difference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Roughness {
    stencil: Vec<f64>,
    weights: Vec<f64>,
}

impl Roughness {
    /// Half the penalty of θ.
    fn half(&self, theta: &[f64]) -> f64 {
        let differences = theta.windows(self.stencil.len()).zip(&self.weights);
        let half = |(part, weight): (&[f64], &f64)| {
            let difference: f64 = part.iter().zip(&self.stencil).map(|(t, w)| t * w).sum();
            0.5 * weight * difference * difference
        };
        differences.map(half).sum()
    }

    /// Subtracts the gradient of half the penalty from `slope`.
    fn take_off(&self, theta: &[f64], slope: &mut [f64]) {
        for (start, (part, weight)) in theta.windows(self.stencil.len()).zip(&self.weights).enumerate() {
            let difference: f64 = part.iter().zip(&self.stencil).map(|(t, w)| t * w).sum();
            for (s, w) in slope[start..].iter_mut().zip(&self.stencil) {
                *s -= weight * difference * w;
            }
        }
    }

    /// Adds the matrix of the penalty.
    pub(crate) fn add_to(&self, matrix: &mut Symmetric) {
        for (start, weight) in self.weights.iter().enumerate() {
            for (a, wa) in self.stencil.iter().enumerate() {
                for (b, wb) in self.stencil[..=a].iter().enumerate() {
                    *matrix.entry(start + a, start + b) += weight * wa * wb;
                }
            }
        }
    }

    /// Σ ln of the weights.
    pub(crate) fn log_weights(&self) -> f64 {
        self.weights.iter().map(|weight| weight.ln()).sum()
    }
}

/// Buffers of the scoring, reused between fits.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    expected: Vec<f64>,
    densities: Vec<f64>,
    /// diag(1 / √μ) K diag(exp θ), columns interleaved in groups of four.
    scaled: Vec<[f64; 4]>,
    /// 1 / √μ and n / μ − 1.
    roots: Vec<(f64, f64)>,
    pub(crate) information: Symmetric,
}

impl Workspace {
    pub(crate) fn new(design: &Design) -> Self {
        Self {
            expected: vec![0.0; design.rows],
            densities: vec![0.0; design.nodes()],
            scaled: vec![[0.0; 4]; design.fours.len()],
            roots: vec![(0.0, 0.0); design.rows],
            information: Symmetric::zeros(design.nodes()),
        }
    }
}

/// The maximum of the penalised likelihood.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Peak {
    /// ln of the density of each node.
    pub(crate) theta: Vec<f64>,
    /// Log-likelihood at the maximum.
    pub(crate) likelihood: f64,
    /// Log-likelihood minus half the penalty.
    pub(crate) value: f64,
    /// ln of the determinant of the information with the penalty.
    pub(crate) log_determinant: f64,
    /// Number of steps.
    pub(crate) iterations: usize,
    /// Whether the predicted gain of the last step was below the limit.
    pub(crate) converged: bool,
}

/// Ridge that keeps log-densities finite where neither counts nor neighbours constrain them: standard deviation 10³.
const RIDGE: f64 = 1e-6;
/// Largest change of a log-density in one step.
const LONGEST_STEP: f64 = 12.0;

/// Starting point of a fit, with the quantities that do not depend on the penalty; fits from the same point reuse it.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    theta: Vec<f64>,
    likelihood: f64,
    /// Gradient of the log-likelihood.
    slope: Vec<f64>,
    /// Fisher information without the penalty.
    information: Symmetric,
}

impl Start {
    pub(crate) fn at(design: &Design, counts: &[f64], theta: &[f64], room: &mut Workspace) -> Self {
        let likelihood = ascend(design, counts, theta, room);
        let mut slope = vec![0.0; theta.len()];
        score(design, counts, &mut slope, room);
        Self {
            theta: theta.to_vec(),
            likelihood,
            slope,
            information: room.information.clone(),
        }
    }
}

/// Maximises ℓ(θ) − penalty / 2, ℓ = Σ n ln μ − μ, μ = K exp θ, by Fisher scoring with step halving.
///
/// # Formula
///
/// ```text
/// (Wᵀ diag(1/μ) W + λ DᵀD) δ = Wᵀ (n/μ − 1) − λ DᵀD θ,   W = K diag(exp θ)
/// ```
///
/// A step takes nodes² × rows multiplications.
pub(crate) fn climb(
    design: &Design,
    counts: &[f64],
    penalty: &Roughness,
    start: &Start,
    effort: Effort,
    room: &mut Workspace,
) -> Peak {
    let mut theta = start.theta.clone();
    let mut slope = start.slope.clone();
    room.information.clone_from(&start.information);
    let mut step = vec![0.0; theta.len()];
    let mut trial = theta.clone();
    let mut likelihood = start.likelihood;
    let mut value = likelihood - penalty.half(&theta);
    let (mut iterations, mut log_determinant, mut converged) = (0, 0.0, false);
    while iterations < effort.most_steps && !converged {
        if iterations > 0 {
            // `room` holds the densities and expected counts of the last trial, which is the current θ.
            score(design, counts, &mut slope, room);
        }
        iterations += 1;
        penalty.take_off(&theta, &mut slope);
        penalty.add_to(&mut room.information);
        if !room.information.factorise() {
            // Without its determinant there is no evidence; a penalty this heavy leaves no digits of the information.
            (value, log_determinant) = (f64::NEG_INFINITY, 0.0);
            break;
        }
        log_determinant = room.information.log_determinant();
        step.copy_from_slice(&slope);
        room.information.solve(&mut step);
        let gain = dot(&slope, &step);
        converged = gain < effort.last_gain;
        let longest = step.iter().fold(0.0_f64, |longest, s| longest.max(s.abs()));
        let mut length = (LONGEST_STEP / longest).min(1.0);
        let risen = (0..12).any(|_| {
            for ((trial, t), s) in trial.iter_mut().zip(&theta).zip(&step) {
                *trial = t + length * s;
            }
            length *= 0.5;
            let trial_likelihood = ascend(design, counts, &trial, room);
            let trial_value = trial_likelihood - penalty.half(&trial);
            let risen = trial_value >= value;
            if risen {
                (likelihood, value) = (trial_likelihood, trial_value);
            }
            risen
        });
        if !risen {
            // No step increases the value beyond rounding errors: this is the maximum.
            converged = true;
            break;
        }
        theta.copy_from_slice(&trial);
        // The remaining gain is at most half of the gain that this step predicted.
        if value + gain - 0.5 * log_determinant < effort.hopeless {
            break;
        }
    }
    Peak {
        theta,
        likelihood,
        value,
        log_determinant,
        iterations,
        converged,
    }
}

/// Stopping criteria of a fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// The first step with a predicted gain of the log-likelihood below this is the last. Scoring converges
    /// quadratically, so the remaining gain is far smaller.
    last_gain: f64,
    most_steps: usize,
    /// A fit is abandoned if its value minus half the log-determinant cannot reach this.
    hopeless: f64,
}

impl Effort {
    /// Iterate to the maximum.
    pub(crate) const FULL: Self = Self {
        last_gain: 0.1,
        most_steps: 60,
        hopeless: f64::NEG_INFINITY,
    };
    /// Accurate enough for evidence and refits: densities that tend to zero need not converge.
    pub(crate) const BRIEF: Self = Self {
        last_gain: 1.0,
        most_steps: 8,
        hopeless: f64::NEG_INFINITY,
    };
    /// One step, to obtain the information at the starting point.
    pub(crate) const STEP: Self = Self {
        last_gain: f64::INFINITY,
        most_steps: 1,
        hopeless: f64::NEG_INFINITY,
    };

    /// The same criteria, but the fit is abandoned if it cannot reach `hopeless`.
    pub(crate) const fn unless_below(mut self, hopeless: f64) -> Self {
        self.hopeless = hopeless;
        self
    }
}

/// Log-likelihood at θ; stores the densities and expected counts in `room`.
fn ascend(design: &Design, counts: &[f64], theta: &[f64], room: &mut Workspace) -> f64 {
    for (density, t) in room.densities.iter_mut().zip(theta) {
        *density = t.exp();
    }
    design.refold(&room.densities, &mut room.expected);
    log_likelihood(counts, &room.expected)
}

/// Writes the gradient of the log-likelihood into `slope` and the information into `room`, from the densities and
/// expected counts in `room`.
fn score(design: &Design, counts: &[f64], slope: &mut [f64], room: &mut Workspace) {
    let Workspace {
        expected,
        densities,
        scaled,
        roots,
        information,
    } = room;
    let (rows, nodes) = (design.rows, design.nodes());
    // 1/√μ for the information, n/μ − 1 for the gradient.
    for ((root, &mu), &n) in roots.iter_mut().zip(&*expected).zip(counts) {
        *root = if mu > 0.0 {
            (1.0 / mu.sqrt(), n / mu - 1.0)
        } else {
            (0.0, 0.0)
        };
    }
    for (four, &(from, to)) in design.four_spans.iter().enumerate() {
        let here = rows * four + from..rows * four + to;
        let first = 4 * four;
        let density = [0, 1, 2, 3].map(|k| densities.get(first + k).copied().unwrap_or(0.0));
        let mut sums = [0.0; 4];
        for ((scaled, kernel), (root, excess)) in scaled[here.clone()]
            .iter_mut()
            .zip(&design.fours[here])
            .zip(&roots[from..to])
        {
            for k in 0..4 {
                let weight = kernel[k] * density[k];
                scaled[k] = weight * root;
                sums[k] += weight * excess;
            }
        }
        slope[first..nodes.min(first + 4)]
            .iter_mut()
            .zip(sums)
            .for_each(|(slope, sum)| *slope = sum);
    }
    for (four, &(from_i, to_i)) in design.four_spans.iter().enumerate() {
        for (other, &(from_j, to_j)) in design.four_spans[..=four].iter().enumerate() {
            let from = from_i.max(from_j);
            let to = to_i.min(to_j).max(from);
            let of = |four: usize| &scaled[rows * four + from..rows * four + to];
            let block = products(of(other), of(four));
            for (p, row) in block.iter().enumerate() {
                for (q, value) in row.iter().enumerate() {
                    let (j, i) = (4 * other + p, 4 * four + q);
                    if j <= i && i < nodes {
                        *information.entry(i, j) = *value;
                    }
                }
            }
        }
    }
    for i in 0..nodes {
        *information.entry(i, i) += RIDGE;
    }
}
