//! Estimates whose particles have a few exact sizes: spikes of any size, with as few of them as the counts support.
//!
//! A spike has two parameters, its size and its density, each at the price of Schwarz's criterion, ½ ln n for n
//! profiles; and odds of two to one against every spike, as for bins. Spikes are added one by one where the score of
//! the likelihood is the most standard errors above zero, and all sizes and densities are fitted again.
//!
//! The largest spike often lies at the upper edge of the highest profiles: a size below cannot explain them, and any
//! larger size would show still larger profiles. With x particles of size s, profiles above d are Poisson with mean
//! μ(s) = x s [G(1) − G(d / s)], so that no profile above d has the probability e^−μ(s): the size is where μ = ln 2,
//! which is above the true one as often as below.

use crate::log_densities::log_likelihood;
use crate::point_kernel::PointKernel;
use crate::population::Spike;
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Spikes, and how well they explain the counts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SpikeFit {
    pub(crate) spikes: Vec<Spike>,
    /// The size of the largest profiles, if the largest spike lies there: then its size follows from their number.
    pub(crate) edge: Option<f64>,
    pub(crate) likelihood: f64,
    /// Log-likelihood less the prices of the spikes.
    pub(crate) evidence: f64,
    pub(crate) iterations: usize,
}

/// More spikes than this are no longer a few sizes.
const MOST: usize = 8;
/// The largest likelihood of any sizes is taken to be at most this much above that of any good fit, in natural
/// logarithms.
pub(crate) const REACHABLE: f64 = 10.0;
/// Most rounds of fitting sizes and densities in turn: after adding a spike, at the end, and in the bootstrap.
const ROUNDS: [usize; 3] = [15, 15, 2];
/// Rounds end when one raises the log-likelihood by less than this.
const SETTLED: f64 = 0.02;

/// Chooses the number of spikes and fits them. `fine` and `middles` are expected counts of bins and their middle sizes,
/// where new spikes are tried. More spikes are not tried when they could not reach the evidence `to_beat`
/// with a log-likelihood of `reachable`, or somewhat above that of fewer spikes.
pub(crate) fn choose(
    kernel: &PointKernel,
    counts: &[f64],
    fine: &DMatrix<f64>,
    middles: &[f64],
    to_beat: f64,
    reachable: f64,
) -> Option<SpikeFit> {
    let number = counts.iter().sum::<f64>().max(1.0);
    let price = number.ln() + 2_f64.ln();
    let highest = counts.iter().rposition(|&n| n > 0.0)?;
    let mut fit = Fitted::new(kernel, counts, highest);
    fit.least_largest = kernel.largest_profile();
    fit.add(kernel.edges()[highest + 1].min(kernel.largest()), number);
    let mut best: Option<SpikeFit> = None;
    for count in 1..=MOST {
        let reached = best.as_ref().map_or(f64::INFINITY, |best| best.likelihood + REACHABLE);
        if reached.max(reachable) - price * (count as f64) < to_beat {
            break;
        }
        if count > 1 {
            let Some((size, profiles)) = fit.missing(fine, middles) else {
                break;
            };
            fit.add(size, profiles);
        }
        fit.settle(ROUNDS[0]);
        let evidence = fit.likelihood() - price * count as f64;
        if best.as_ref().is_some_and(|best| evidence < best.evidence - price) {
            break;
        }
        if best.as_ref().is_none_or(|best| evidence > best.evidence) {
            best = Some(fit.result(evidence));
        }
    }
    let best = best?;
    let mut fit = Fitted::new(kernel, counts, highest);
    fit.least_largest = kernel.largest_profile();
    fit.spikes.clone_from(&best.spikes);
    fit.update();
    let (before, kept) = (best.likelihood, best.spikes.len());
    fit.settle(ROUNDS[1]);
    let mut found = fit.result(best.evidence + (fit.likelihood() - before).max(0.0));
    found.iterations = kept * ROUNDS[1];
    found.raise(kernel);
    Some(found)
}

impl SpikeFit {
    /// Moves the largest spike from the edge to its size.
    fn raise(&mut self, kernel: &PointKernel) {
        if let (Some(edge), Some(spike)) = (
            self.edge,
            self.spikes.iter_mut().max_by(|a, b| a.size.total_cmp(&b.size)),
        ) {
            *spike = at_same_profiles(*spike, size_above(kernel, edge, *spike, 2_f64.ln()));
        }
    }

    /// Spikes of counts resampled from these.
    ///
    /// A largest spike whose size follows from the largest profile gets a largest profile of its own: the profile d
    /// with μ(d) the logarithm of a uniform number.
    pub(crate) fn again(&self, kernel: &PointKernel, drawn: &[f64], rng: &mut ChaCha8Rng) -> Vec<Spike> {
        let mut counts = drawn.to_vec();
        let Some(mut highest) = counts.iter().rposition(|&n| n > 0.0) else {
            return Vec::new();
        };
        let top = (0..self.spikes.len()).max_by(|&a, &b| self.spikes[a].size.total_cmp(&self.spikes[b].size));
        let exact = self.edge.zip(top).map(|(edge, top)| {
            let row = kernel.edges().partition_point(|&of| of < edge * (1.0 - 1e-12)).max(1) - 1;
            let above: f64 = counts[(row + 1).min(counts.len())..].iter().sum();
            counts.truncate(row + 1);
            counts[row] += above;
            counts.resize(drawn.len(), 0.0);
            highest = row;
            top
        });
        let mut fit = Fitted::new(kernel, &counts, highest);
        fit.spikes.clone_from(&self.spikes);
        fit.update();
        for _ in 0..ROUNDS[2] {
            fit.round(exact);
        }
        let mut spikes = fit.spikes;
        if let Some(top) = exact {
            let wanted = -(1.0 - rng.random::<f64>()).ln();
            let profile = profile_below(kernel, self.spikes[top], wanted);
            spikes[top] = at_same_profiles(spikes[top], size_above(kernel, profile, spikes[top], 2_f64.ln()));
        }
        spikes
    }
}

/// The spike at another size, with the same number of profiles.
fn at_same_profiles(spike: Spike, size: f64) -> Spike {
    Spike {
        size,
        density: spike.density * spike.size / size,
    }
}

/// The size at which so many profiles of a spike are expected above `profile`.
fn size_above(kernel: &PointKernel, profile: f64, spike: Spike, wanted: f64) -> f64 {
    let above = |size: f64| spike.density * spike.size / size * kernel.above(profile, size);
    let (mut low, mut high) = (profile, (2.0 * profile).min(kernel.largest()).max(profile));
    if above(high) <= wanted {
        return high;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if above(middle) > wanted {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

/// The profile size above which so many profiles of a spike are expected; zero if it shows fewer in all.
fn profile_below(kernel: &PointKernel, spike: Spike, wanted: f64) -> f64 {
    let (mut low, mut high) = (0.0, spike.size);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if spike.density * kernel.above(middle, spike.size) > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Spikes during a fit, with what they show.
struct Fitted<'a> {
    kernel: &'a PointKernel,
    counts: &'a [f64],
    /// The highest profile bin with counts.
    highest: usize,
    /// The largest spike is no smaller than this.
    least_largest: f64,
    spikes: Vec<Spike>,
    /// Expected counts of each spike.
    shown: Vec<Vec<f64>>,
    expected: Vec<f64>,
}

/// Steps of expectation-maximisation for the densities in a round.
const STEPS: usize = 12;
/// Golden section of a bracket.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
const SECTIONS: usize = 18;

impl<'a> Fitted<'a> {
    fn new(kernel: &'a PointKernel, counts: &'a [f64], highest: usize) -> Self {
        Self {
            kernel,
            counts,
            highest,
            least_largest: 0.0,
            spikes: Vec::new(),
            shown: Vec::new(),
            expected: vec![0.0; counts.len()],
        }
    }

    /// Adds a spike of this size that shows so many profiles.
    fn add(&mut self, size: f64, profiles: f64) {
        let whole: f64 = self.kernel.column(size).iter().sum();
        if whole > 0.0 {
            let density = profiles / whole;
            self.spikes.push(Spike { size, density });
        }
        self.update();
    }

    fn update(&mut self) {
        let show = |spike: &Spike| scaled(self.kernel.column(spike.size), spike.density);
        self.shown = self.spikes.iter().map(show).collect();
        self.sum();
    }

    fn sum(&mut self) {
        self.expected.fill(0.0);
        for shown in &self.shown {
            self.expected.iter_mut().zip(shown).for_each(|(sum, mu)| *sum += mu);
        }
    }

    fn likelihood(&self) -> f64 {
        let explained = self
            .counts
            .iter()
            .zip(&self.expected)
            .all(|(n, mu)| *n <= 0.0 || *mu > 0.0);
        if explained {
            log_likelihood(self.counts, &self.expected)
        } else {
            f64::NEG_INFINITY
        }
    }

    fn result(&self, evidence: f64) -> SpikeFit {
        let edge = self.kernel.edges()[self.highest + 1];
        let largest = self.spikes.iter().map(|of| of.size).fold(0.0, f64::max);
        SpikeFit {
            spikes: self.spikes.clone(),
            edge: (largest <= edge && largest > edge * (1.0 - AT_EDGE)).then_some(edge),
            likelihood: self.likelihood(),
            evidence,
            iterations: self.spikes.len(),
        }
    }

    /// The middle size of the bin whose density is the most standard errors above zero, and its profiles.
    fn missing(&self, fine: &DMatrix<f64>, middles: &[f64]) -> Option<(f64, f64)> {
        let mut best: Option<(f64, f64, f64)> = None;
        for (column, &middle) in fine.column_iter().zip(middles) {
            let (mut score, mut information) = (0.0, 0.0);
            for ((k, &n), &mu) in column.iter().zip(self.counts).zip(&self.expected) {
                if mu > 0.0 {
                    score += k * (n / mu - 1.0);
                    information += k * k / mu;
                } else {
                    score -= k;
                }
            }
            let significance = score / information.max(1e-300).sqrt();
            if score > 0.0 && best.is_none_or(|(most, ..)| significance > most) {
                best = Some((significance, middle, score / information * column.sum()));
            }
        }
        best.map(|(_, middle, profiles)| (middle, profiles))
    }

    /// Rounds until they hardly raise the likelihood.
    fn settle(&mut self, most: usize) {
        for _ in 0..most {
            let before = self.likelihood();
            self.round(None);
            if self.likelihood() - before < SETTLED {
                break;
            }
        }
    }

    /// Fits the densities at fixed sizes, then each size with its number of profiles fixed; the size of spike `fixed`
    /// stays.
    fn round(&mut self, fixed: Option<usize>) {
        self.densities();
        for k in 0..self.spikes.len() {
            if Some(k) != fixed {
                self.move_spike(k);
            }
        }
        self.densities();
    }

    /// Expectation-maximisation of the densities.
    fn densities(&mut self) {
        if self.likelihood() == f64::NEG_INFINITY {
            return;
        }
        for _ in 0..STEPS {
            let mut moved = 0.0_f64;
            let ratios: Vec<f64> = self
                .counts
                .iter()
                .zip(&self.expected)
                .map(|(n, mu)| if *mu > 0.0 { n / mu } else { 0.0 })
                .collect();
            for (spike, shown) in self.spikes.iter_mut().zip(&mut self.shown) {
                let whole: f64 = shown.iter().sum();
                if whole <= 0.0 {
                    // A spike that no count needed any more.
                    continue;
                }
                let gain = shown.iter().zip(&ratios).map(|(mu, ratio)| mu * ratio).sum::<f64>() / whole;
                moved = moved.max((gain - 1.0).abs());
                spike.density *= gain;
                shown.iter_mut().for_each(|mu| *mu *= gain);
            }
            self.sum();
            if moved < 1e-6 {
                break;
            }
        }
    }

    /// Moves a spike to the size of highest likelihood within two profile bins on either side.
    fn move_spike(&mut self, k: usize) {
        let spike = self.spikes[k];
        let others: Vec<f64> = self
            .expected
            .iter()
            .zip(&self.shown[k])
            .map(|(all, own)| (all - own).max(0.0))
            .collect();
        let profiles: f64 = self.shown[k].iter().sum();
        let mut trial = vec![0.0; others.len()];
        let apart = self.spikes.iter().enumerate().filter(|(other, _)| *other != k);
        let largest_other = apart.map(|(_, of)| of.size).fold(0.0, f64::max);
        let least = if largest_other < self.least_largest {
            self.least_largest
        } else {
            0.0
        };
        let mut value = |size: f64| {
            if size < least {
                return f64::NEG_INFINITY;
            }
            let column = self.kernel.column(size);
            let whole: f64 = column.iter().sum();
            if whole <= 0.0 {
                return f64::NEG_INFINITY;
            }
            let density = profiles / whole;
            for ((mu, own), other) in trial.iter_mut().zip(&column).zip(&others) {
                *mu = own * density + other;
            }
            if self.counts.iter().zip(&trial).any(|(n, mu)| *n > 0.0 && *mu <= 0.0) {
                return f64::NEG_INFINITY;
            }
            log_likelihood(self.counts, &trial)
        };
        let edges = self.kernel.edges();
        let row = edges.partition_point(|&edge| edge < spike.size * (1.0 - 1e-9));
        let around = &edges[row.saturating_sub(3)..(row + 3).min(edges.len())];
        let mut tried: Vec<f64> = around.to_vec();
        tried.extend(around.windows(2).map(|bin| 0.5 * (bin[0] + bin[1])));
        tried.push(spike.size);
        tried.retain(|&size| size > edges[0] && size <= self.kernel.largest());
        tried.sort_by(f64::total_cmp);
        tried.dedup();
        let values: Vec<f64> = tried.iter().map(|&size| value(size)).collect();
        let Some(top) = (0..tried.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])) else {
            return;
        };
        let (mut low, mut high) = (tried[top.saturating_sub(1)], tried[(top + 1).min(tried.len() - 1)]);
        let (mut best, mut most) = (tried[top], values[top]);
        let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut at_left, mut at_right) = (value(left), value(right));
        for _ in 0..SECTIONS {
            let (candidate, found) = if at_left > at_right {
                (left, at_left)
            } else {
                (right, at_right)
            };
            if found > most + 1e-6 {
                (best, most) = (candidate, found);
            }
            if at_left > at_right {
                high = right;
                (right, at_right) = (left, at_left);
                left = high - GOLDEN * (high - low);
                at_left = value(left);
            } else {
                low = left;
                (left, at_left) = (right, at_right);
                right = low + GOLDEN * (high - low);
                at_right = value(right);
            }
        }
        if most > f64::NEG_INFINITY {
            let column = self.kernel.column(best);
            let density = profiles / column.iter().sum::<f64>();
            self.spikes[k] = Spike { size: best, density };
            self.shown[k] = scaled(column, density);
            self.sum();
        }
    }
}

/// The largest spike lies at the edge of the highest profiles if it is no farther below than this fraction.
const AT_EDGE: f64 = 1e-9;

fn scaled(mut values: Vec<f64>, factor: f64) -> Vec<f64> {
    values.iter_mut().for_each(|value| *value *= factor);
    values
}

#[cfg(test)]
mod tests {
    use super::{SpikeFit, choose, size_above};
    use crate::point_kernel::PointKernel;
    use crate::population::Spike;
    use crate::{Kernel, ProfileCounts, SizeBins, capped_kernel, equal_edges};
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const AREA: f64 = 1e3;

    fn spheres(edges: &[f64]) -> Kernel {
        let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
        let sizes = SizeBins::integrated(edges).unwrap();
        let kernel = capped_kernel(&law, 1.0, 0.0, edges, sizes, 0.5).unwrap();
        kernel.with_profile_law(law)
    }

    fn points(edges: &[f64], counts: &[f64]) -> PointKernel {
        let counts = ProfileCounts::from_counts(counts, edges, AREA).unwrap();
        PointKernel::new(&spheres(edges), &counts, 0).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Two sizes are recovered from their expected counts, within a profile bin.
        #[test]
        fn exact_counts_give_exact_sizes(small in 0.2..0.5_f64, large in 0.6..0.95_f64, share in 0.3..0.8_f64) {
            let edges = equal_edges(1.0, 60);
            let kernel = points(&edges, &[1.0; 60]);
            let (of_small, of_large) = (kernel.column(small), kernel.column(large));
            let counts: Vec<f64> = of_small.iter().zip(&of_large).map(|(a, b)| share * a + (1.0 - share) * b).collect();
            let fine = spheres(&edges).matrix() * AREA;
            let middles: Vec<f64> = edges.windows(2).map(|bin| 0.5 * (bin[0] + bin[1])).collect();
            let found = choose(&kernel, &counts, &fine, &middles, f64::NEG_INFINITY, f64::INFINITY).unwrap();
            let mut spikes = found.spikes;
            spikes.sort_by(|a, b| a.size.total_cmp(&b.size));
            prop_assert_eq!(spikes.len(), 2);
            for (spike, (size, density)) in spikes.iter().zip([(small, share), (large, 1.0 - share)]) {
                prop_assert!((spike.size - size).abs() < 1.0 / 60.0, "{} for {size}", spike.size);
                prop_assert!((spike.density / density - 1.0).abs() < 0.1, "{} for {density}", spike.density);
            }
        }
    }

    /// Resamples without any of a spike's profiles leave it without density, not without a value.
    #[test]
    fn spikes_without_counts_have_no_density() {
        let edges = equal_edges(1.0, 40);
        let kernel = points(&edges, &[1.0; 40]);
        let fit = SpikeFit {
            spikes: vec![
                Spike {
                    size: 0.2,
                    density: 1e-4,
                },
                Spike {
                    size: 0.9,
                    density: 1.0,
                },
            ],
            edge: None,
            likelihood: 0.0,
            evidence: 0.0,
            iterations: 0,
        };
        let mut counts = vec![0.0; 40];
        counts[30..36].fill(5.0);
        let spikes = fit.again(&kernel, &counts, &mut ChaCha8Rng::seed_from_u64(1));
        assert!(
            spikes
                .iter()
                .all(|spike| spike.density >= 0.0 && spike.density.is_finite())
        );
    }

    /// A sphere of diameter D shows D profiles per unit area, √(D² − d²) of them above d.
    #[test]
    fn profiles_of_a_sphere() {
        let kernel = points(&equal_edges(1.0, 20), &[1.0; 20]);
        assert_relative_eq!(
            kernel.column(0.73).iter().sum::<f64>(),
            0.73 * AREA,
            max_relative = 1e-9
        );
        let spike = Spike {
            size: 0.5,
            density: 1.0,
        };
        let size = size_above(&kernel, 0.5, spike, 3.0);
        let above = AREA * 0.5 * (1.0 - (0.5 / size).powi(2)).sqrt();
        assert_relative_eq!(above, 3.0, max_relative = 1e-6);
    }
}
