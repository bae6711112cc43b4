//! The smooth estimate: logarithms of densities with a penalty on their roughness, how heavy is for the counts to say.
//!
//! The penalty of order r, λ/2 Σ (Δʳ θ)², is the logarithm of a Gaussian prior of θ; the evidence of λ and r is the
//! integral of likelihood times prior over θ, by Laplace's approximation
//!
//! ```text
//! ln p(n | λ, r) ≈ ℓ(θ̂) − λ/2 |Dθ̂|² + (m − r)/2 ln λ + ½ ln |DDᵀ| − ½ ln |I + λ DᵀD| − r ln(σ √m)
//! ```
//!
//! where the last term is the price of the r directions the penalty leaves free, polynomials below degree r, each with
//! a standard deviation of σ = 1 a node. Fits along λ = 10^k and at half decades about the best, for r = 1, 2, 3: the
//! logarithms of their densities are averaged with the evidence as weights (empirical Bayes with nothing chosen by
//! hand).
//!
//! No density need be equally smooth everywhere: where one population of particles gives way to another, ln(e^a + e^b)
//! bends within a few nodes, and where the smallest begin it falls away. A penalty light enough for the bend leaves
//! noise elsewhere, one heavy enough elsewhere fills the valley. So penalties of order 3 that give way at one place,
//! and are heavier elsewhere, are tried too, at places evenly spread, and averaged with the others: an evidence each,
//! as those. On 80 to 200 samples this took .008 to .012 from the L1 distance of the bimodal distribution of figure 7
//! and .015 from the lognormal one, and left the single mode as it was; widths of .08 to .15, depths of 10³ and 10⁴,
//! and five or nine places were alike.

use crate::log_densities::{Design, Effort, Peak, Penalty, Start, Workspace, climb};

/// Spread of the logarithm of densities along the polynomials a penalty leaves free.
const FREE_SPREAD: f64 = 1.0;
/// log of the heaviest weight, per order, for [`REFERENCE_NODES`] nodes: practically a polynomial.
const HEAVIEST: [f64; 3] = [5.0, 6.0, 7.0];
const REFERENCE_NODES: f64 = 40.0;
/// The first weight is so many times lighter.
const FIRST: f64 = 1e4;
/// Weights rise and fall by this factor.
const DECADE: f64 = 10.0;
const MOST_WEIGHTS: usize = 12;
/// The path ends where the evidence is lower than the best by this: 1/400 of its weight in the mean.
const ENOUGH: f64 = 6.0;

/// Places of a bend that are tried, evenly spread over the nodes.
const BENDS: usize = 5;
/// Penalties with a bend are so many times heavier elsewhere than the best without.
const HEAVIER: [f64; 2] = [10.0, 100.0];
/// On fewer nodes than this nothing can bend.
const LEAST_NODES_TO_BEND: usize = 16;

/// The fits of all orders and weights that were tried, and their mean.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SmoothFit {
    /// Densities of the nodes: their logarithms averaged by evidence.
    pub(crate) densities: Vec<f64>,
    /// ln of the evidence, averaged over the weights tried.
    pub(crate) evidence: f64,
    /// The single best penalty.
    pub(crate) penalty: Penalty,
    /// The best weight at order 2, where intervals are drawn, and the fit there.
    pub(crate) second_order: (Penalty, Vec<f64>),
    /// Trace of information over information with penalty, at the best: parameters in effect.
    pub(crate) effective_parameters: f64,
    pub(crate) iterations: usize,
}

/// Fits of one order and weight.
struct Step {
    penalty: Penalty,
    peak: Peak,
    evidence: f64,
}

/// Fits counts that are not all zero.
pub(crate) fn smooth(design: &Design, counts: &[f64]) -> SmoothFit {
    let nodes = design.nodes();
    let mut room = Workspace::new(design);
    let mut steps: Vec<Step> = Vec::new();
    for order in 1..=3.min(nodes.saturating_sub(1)).max(1) {
        steps.extend(path(design, counts, order, &mut room));
    }
    let top = steps.iter().map(|step| step.evidence).fold(f64::NEG_INFINITY, f64::max);
    let mut densities = vec![0.0; nodes];
    let mut whole = 0.0;
    for step in &steps {
        let weight = (step.evidence - top).exp();
        whole += weight;
        for (density, t) in densities.iter_mut().zip(&step.peak.theta) {
            *density += weight * t;
        }
    }
    densities
        .iter_mut()
        .for_each(|density| *density = (*density / whole).exp());
    let best = |order: Option<usize>| {
        steps
            .iter()
            .filter(|step| order.is_none_or(|order| step.penalty.order == order))
            .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    };
    let found = best(None).map(|step| (step.penalty, step.peak.theta.clone()));
    let (penalty, theta) = found.unwrap_or((Penalty::NONE, vec![0.0; nodes]));
    let second_order = best(Some(2)).map_or((penalty, theta.clone()), |step| (step.penalty, step.peak.theta.clone()));
    SmoothFit {
        densities,
        evidence: top + whole.ln() - (steps.len() as f64).ln(),
        effective_parameters: effective_parameters(design, counts, penalty, &theta, &mut room),
        penalty,
        second_order,
        iterations: steps.iter().map(|step| step.peak.iterations).sum(),
    }
}

/// Fits from a middling weight up and down, each from where the last one ended, until the evidence is lost; then at
/// half steps about the best; then with bends.
fn path(design: &Design, counts: &[f64], order: usize, room: &mut Workspace) -> Vec<Step> {
    let nodes = design.nodes();
    let constant =
        0.5 * Penalty::log_pseudo_determinant(nodes, order) - order as f64 * (FREE_SPREAD * (nodes as f64).sqrt()).ln();
    // The same roughness in finer nodes: differences of order r shrink with r powers of the spacing.
    let finer = (2 * order - 1) as f64 * (nodes as f64 / REFERENCE_NODES).log10();
    let mut best_yet = f64::NEG_INFINITY;
    let mut step = |weight: f64, bend: Option<f64>, start: &Start, room: &mut Workspace| {
        let penalty = Penalty { order, weight, bend };
        let roughness = penalty.on(nodes);
        let beside = 0.5 * roughness.log_weights() + constant;
        let effort = Effort::BRIEF.unless_below(best_yet - ENOUGH - beside);
        let peak = climb(design, counts, &roughness, start, effort, room);
        let evidence = peak.value - 0.5 * peak.log_determinant + beside;
        best_yet = best_yet.max(evidence);
        Step {
            penalty,
            peak,
            evidence,
        }
    };
    let heaviest = 10_f64.powf(HEAVIEST[order - 1] + finer);
    let flat = Start::at(design, counts, &vec![level(design, counts).ln(); nodes], room);
    let mut steps = vec![step(heaviest / FIRST, None, &flat, room)];
    let mut best = 0;
    for factor in [DECADE, 1.0 / DECADE] {
        let mut last = 0;
        loop {
            let Step {
                penalty,
                peak,
                evidence,
            } = &steps[last];
            let weight = penalty.weight * factor;
            let lost = *evidence < steps[best].evidence - ENOUGH;
            if lost || weight > 1.001 * heaviest || steps.len() == MOST_WEIGHTS {
                break;
            }
            let start = Start::at(design, counts, &peak.theta, room);
            last = steps.len();
            steps.push(step(weight, None, &start, room));
            if steps[last].evidence > steps[best].evidence {
                best = last;
            }
        }
    }
    let start = Start::at(design, counts, &steps[best].peak.theta, room);
    let weight = steps[best].penalty.weight;
    for factor in [DECADE.sqrt(), 1.0 / DECADE.sqrt()] {
        steps.push(step(weight * factor, None, &start, room));
    }
    if order == 3 && nodes >= LEAST_NODES_TO_BEND {
        for place in 1..=BENDS {
            let bend = place as f64 / (BENDS as f64 + 1.0);
            for factor in HEAVIER {
                steps.push(step(weight * factor, Some(bend), &start, room));
            }
        }
    }
    steps
}

/// The density at which all nodes alike would show as many profiles as there are.
pub(crate) fn level(design: &Design, counts: &[f64]) -> f64 {
    let shown: f64 = (0..design.nodes()).map(|node| design.column_sum(node)).sum();
    counts.iter().sum::<f64>() / shown
}

/// tr (I + λP)⁻¹ I.
fn effective_parameters(design: &Design, counts: &[f64], penalty: Penalty, theta: &[f64], room: &mut Workspace) -> f64 {
    let nodes = design.nodes();
    // One more step leaves the factor of I + λP at θ in the workspace; I itself is that less λP.
    let roughness = penalty.on(nodes);
    let start = Start::at(design, counts, theta, room);
    let _ = climb(design, counts, &roughness, &start, Effort::STEP, room);
    let mut rough = crate::cholesky::Symmetric::zeros(nodes);
    roughness.add_to(&mut rough);
    let mut trace = nodes as f64;
    let mut column = vec![0.0; nodes];
    for i in 0..nodes {
        for (k, value) in column.iter_mut().enumerate() {
            *value = *rough.entry(i.max(k), i.min(k));
        }
        room.information.solve(&mut column);
        trace -= column[i];
    }
    trace
}
