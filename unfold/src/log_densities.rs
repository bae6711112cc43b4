//! Fisher scoring for logarithms of densities: the likelihood of the counts, less a penalty on their roughness.

use crate::cholesky::{Symmetric, dot, dots};
use nalgebra::DMatrix;

/// Expected counts of one particle per unit volume in each node, column by column, with the rows each column touches.
#[derive(Clone, Debug)]
pub(crate) struct Design {
    rows: usize,
    entries: Vec<f64>,
    /// Rows of each column that are not zero: from, to.
    spans: Vec<(usize, usize)>,
}

impl Design {
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        let spans = matrix
            .column_iter()
            .map(|column| {
                let seen = |k: &f64| *k > 0.0;
                let from = column.iter().position(seen).unwrap_or(0);
                (from, column.iter().rposition(seen).map_or(from, |last| last + 1))
            })
            .collect();
        Self {
            rows: matrix.nrows(),
            entries: matrix.as_slice().to_vec(),
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

    /// Expected counts of a particle of each node.
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

/// Weight × the sum of squared differences of an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penalty {
    pub(crate) order: usize,
    pub(crate) weight: f64,
    /// Where the penalty gives way, as a share of the nodes.
    pub(crate) bend: Option<f64>,
}

/// At a bend the weight is 10³ times less.
const BEND_DEPTH: f64 = 3.0;
/// And returns to what it is elsewhere as a Gaussian with this standard deviation, a share of the nodes.
const BEND_WIDTH: f64 = 0.12;

impl Penalty {
    /// Nothing is penalised.
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

    /// The penalty of so many nodes.
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

    /// ln of the product of the positive eigenvalues of the penalty's matrix at weight 1: that of the differences' Gram matrix.
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

/// A penalty on the nodes of a fit: the weight of every difference.
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

    /// Takes the slope of half the penalty off `slope`.
    fn take_off(&self, theta: &[f64], slope: &mut [f64]) {
        for (start, (part, weight)) in theta.windows(self.stencil.len()).zip(&self.weights).enumerate() {
            let difference: f64 = part.iter().zip(&self.stencil).map(|(t, w)| t * w).sum();
            for (s, w) in slope[start..].iter_mut().zip(&self.stencil) {
                *s -= weight * difference * w;
            }
        }
    }

    /// Adds the penalty's matrix.
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

/// What scoring works on, kept between fits.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    expected: Vec<f64>,
    densities: Vec<f64>,
    /// K diag(n) / √μ, column by column, each from row 0 on and padded to whole fours with zeros.
    scaled: Vec<f64>,
    stride: usize,
    /// 1 / √μ and n / μ − 1.
    roots: Vec<(f64, f64)>,
    pub(crate) information: Symmetric,
}

impl Workspace {
    pub(crate) fn new(design: &Design) -> Self {
        let stride = design.rows.next_multiple_of(4);
        Self {
            expected: vec![0.0; design.rows],
            densities: vec![0.0; design.nodes()],
            scaled: vec![0.0; stride * design.nodes()],
            stride,
            roots: vec![(0.0, 0.0); design.rows],
            information: Symmetric::zeros(design.nodes()),
        }
    }
}

/// The place of the largest penalised likelihood.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Peak {
    /// ln of the density of each node.
    pub(crate) theta: Vec<f64>,
    /// Log-likelihood there.
    pub(crate) likelihood: f64,
    /// Log-likelihood less half the penalty.
    pub(crate) value: f64,
    /// ln of the determinant of the information with the penalty.
    pub(crate) log_determinant: f64,
    /// Steps.
    pub(crate) iterations: usize,
    /// Whether the last step promised less than was asked for.
    pub(crate) converged: bool,
}

/// Keeps logarithms of densities that no count and no neighbour holds from running away: a standard deviation of 10³.
const RIDGE: f64 = 1e-6;
/// No logarithm moves farther than this in a step.
const LONGEST_STEP: f64 = 3.0;

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
    start: &[f64],
    effort: Effort,
    room: &mut Workspace,
) -> Peak {
    let mut theta = start.to_vec();
    let mut step = vec![0.0; theta.len()];
    let mut trial = theta.clone();
    let (mut likelihood, mut value) = ascend(design, counts, penalty, &theta, room);
    let (mut iterations, mut log_determinant, mut converged) = (0, 0.0, false);
    while iterations < effort.most_steps && !converged {
        iterations += 1;
        score(design, counts, penalty, &theta, &mut step, room);
        if !room.information.factorise() {
            break;
        }
        log_determinant = room.information.log_determinant();
        trial.copy_from_slice(&step);
        room.information.solve(&mut step);
        let gain = dot(&trial, &step);
        converged = gain < effort.last_gain;
        let longest = step.iter().fold(0.0_f64, |longest, s| longest.max(s.abs()));
        let mut length = (LONGEST_STEP / longest).min(1.0);
        let risen = (0..12).any(|_| {
            for ((trial, t), s) in trial.iter_mut().zip(&theta).zip(&step) {
                *trial = t + length * s;
            }
            length *= 0.5;
            let (trial_likelihood, trial_value) = ascend(design, counts, penalty, &trial, room);
            let risen = trial_value >= value;
            if risen {
                (likelihood, value) = (trial_likelihood, trial_value);
            }
            risen
        });
        if !risen {
            // Rounding: nothing is higher than this.
            converged = true;
            break;
        }
        theta.copy_from_slice(&trial);
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

/// How far to climb.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// A step that promises less gain of the log-likelihood than this is the last; scoring converges quadratically, so what is left is far less.
    last_gain: f64,
    most_steps: usize,
}

impl Effort {
    /// To the top.
    pub(crate) const FULL: Self = Self {
        last_gain: 0.1,
        most_steps: 60,
    };
    /// As near as evidence and refits need: densities that run towards zero are left on their way.
    pub(crate) const BRIEF: Self = Self {
        last_gain: 1.0,
        most_steps: 8,
    };
    /// One step, for the information at the start.
    pub(crate) const STEP: Self = Self {
        last_gain: f64::INFINITY,
        most_steps: 1,
    };
}

/// Log-likelihood and penalised log-likelihood at θ, with densities and expected counts left in `room`.
fn ascend(design: &Design, counts: &[f64], penalty: &Roughness, theta: &[f64], room: &mut Workspace) -> (f64, f64) {
    for (density, t) in room.densities.iter_mut().zip(theta) {
        *density = t.exp();
    }
    design.refold(&room.densities, &mut room.expected);
    let likelihood = log_likelihood(counts, &room.expected);
    (likelihood, likelihood - penalty.half(theta))
}

/// Slope of the penalised likelihood into `slope`, information into `room`.
fn score(
    design: &Design,
    counts: &[f64],
    penalty: &Roughness,
    theta: &[f64],
    slope: &mut [f64],
    room: &mut Workspace,
) {
    let Workspace {
        expected,
        densities,
        scaled,
        stride,
        roots,
        information,
    } = room;
    // 1/√μ for the information, n/μ − 1 for the slope.
    for ((root, &mu), &n) in roots.iter_mut().zip(&*expected).zip(counts) {
        *root = if mu > 0.0 {
            (1.0 / mu.sqrt(), n / mu - 1.0)
        } else {
            (0.0, 0.0)
        };
    }
    for (node, slope) in slope.iter_mut().enumerate() {
        let (from, column) = design.column(node);
        let start = node * *stride + from;
        let scaled = &mut scaled[start..start + column.len()];
        let mut sum = 0.0;
        for ((scaled, k), (root, excess)) in scaled.iter_mut().zip(column).zip(&roots[from..]) {
            let weight = k * densities[node];
            *scaled = weight * root;
            sum += weight * excess;
        }
        *slope = sum;
    }
    let padded = |(from, to): (usize, usize)| (from / 4 * 4, to.next_multiple_of(4));
    let of = |node: usize, (from, to): (usize, usize)| &scaled[node * *stride + from..node * *stride + to];
    for i in 0..design.nodes() {
        let whole = padded(design.spans[i]);
        let shared = |j: usize| {
            let (from, to) = padded(design.spans[j]);
            let from = from.max(whole.0);
            (from, to.min(whole.1).max(from))
        };
        let mut j = 0;
        // Four at a time; what a column does not reach is zero.
        while j + 4 <= i + 1 {
            let spans = [j, j + 1, j + 2, j + 3].map(shared);
            let from = spans.iter().map(|span| span.0).min().unwrap_or(0);
            let to = spans.iter().map(|span| span.1).max().unwrap_or(0).max(from);
            let others = [j, j + 1, j + 2, j + 3].map(|j| of(j, (from, to)));
            for (k, sum) in dots(of(i, (from, to)), others).into_iter().enumerate() {
                *information.entry(i, j + k) = sum;
            }
            j += 4;
        }
        for j in j..=i {
            let span = shared(j);
            *information.entry(i, j) = dot(of(i, span), of(j, span));
        }
        *information.entry(i, i) += RIDGE;
    }
    penalty.take_off(theta, slope);
    penalty.add_to(information);
}
