//! Number densities by category: one fit of all profiles, split by the labels of the profiles.
//!
//! Separate fits of the categories would each have to explain their own profile sizes. If the category follows the size
//! of the profile (blur, partial volume), no particle has such profiles, and the sum of the fits is too large, by 15 %
//! with three categories and 25 % with eight. Here categories are labels of the particles of one joint density, so
//! their densities sum to it by construction.

use crate::bootstrap::{Replicates, poisson};
use crate::estimate::{Estimate, Interval};
use crate::kernel::Kernel;
use crate::options::UnfoldOptions;
use crate::point_kernel::PointKernel;
use crate::population::{Grouping, Population};
use crate::profile_counts::ProfileCounts;
use crate::size_distribution::{Moments, Weighing};
use crate::unfold_error::UnfoldError;
use crate::unfolding::{Quantities, Unfolding, unfold_replicated};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use stereology_metrics::Progress;

/// How the fraction of a category depends on the size of the particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CategoryModel {
    /// Not at all: each category has its fraction of the profiles.
    Constant,
    /// Smoothly, estimated by [`category_fractions`].
    BySize,
}

/// All particles together, and each category.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CategoryUnfolding {
    /// All particles together: what [`unfold`](crate::unfold) gives for all profiles.
    pub all: Unfolding,
    /// Edges of the bins of the kernel, which are finer than the reported ones.
    pub fine_edges: Vec<f64>,
    /// Each category, in the order given.
    pub categories: Vec<CategoryDensity>,
}

/// The particles of a category.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CategoryDensity {
    /// Particles per unit volume in each reported bin; `None` where all particles together have no density.
    pub number_density: Vec<Option<f64>>,
    /// Intervals of `number_density`, with a bootstrap.
    pub intervals: Option<Vec<Option<Interval>>>,
    /// Particles per unit volume.
    pub total: Estimate,
    /// Mean size of these particles; zero if there are none.
    pub mean_size: Estimate,
    /// Fraction of the volume in these particles.
    pub volume_fraction: Estimate,
    /// Particles per unit volume in each bin of the kernel; zero where there is no density.
    pub fine: Vec<f64>,
}

/// Steps of expectation-maximisation for the estimate, and for each replicate, which begins at the estimate.
const STEPS: [usize; 2] = [1_000, 100];
/// The iteration ends when no fraction changes by more than this.
const SETTLED: f64 = 1e-5;
/// Pseudo-profiles of a bin that have the labels of the adjacent bins, over the number of bins: a fifth gives three in
/// sixteen bins. Three leave the sharp categories of a few hundred profiles sharp; thirty mix adjacent categories.
const SMOOTHING: f64 = 0.2;

/// Fractions p(category | size bin) from the labels of profiles.
///
/// # Formula
///
/// ```text
/// P(c | i) = Σ_j r_ij p(c | j)         r_ij = E_ij / Σ_j E_ij
/// p(c | j) ← (Σ_i n_ic r_ij p(c | j) / P(c | i) + κ m_jc) / normalisation
/// ```
///
/// with E_ij (`expected`) the expected number of profiles in profile bin i from particles in size bin j, n_ic
/// (`labelled[c][i]`) the profiles of category c, and m_jc the mean of p(c | ·) over the adjacent size bins. κ is a
/// fifth of the number of size bins. A size bin that no profile comes from has the fractions of its neighbours.
///
/// Entry `[j][c]` of the result; every row sums to 1. A category without profiles has zero in every bin. Complexity:
/// O(steps × rows × bins × categories).
///
/// # Examples
///
/// ```
/// use nalgebra::dmatrix;
/// use stereology_unfold::category_fractions;
///
/// // Each profile bin shows particles of one size bin, so the fractions are those of the profiles, slightly smoothed.
/// let fractions = category_fractions(&dmatrix![100.0, 0.0; 0.0, 100.0], &[vec![90.0, 20.0], vec![10.0, 80.0]]);
/// assert!((fractions[0][0] - 0.9).abs() < 0.01 && (fractions[1][0] - 0.2).abs() < 0.01);
/// ```
///
/// # References
///
/// Dempster, Laird & Rubin 1977; smoothing after Green 1990, with the adjacent bins as prior.
#[must_use]
pub fn category_fractions(expected: &DMatrix<f64>, labelled: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let start = constant(labelled, expected.ncols());
    maximise(expected, labelled, start, STEPS[0])
}

/// The same fractions in every bin: those of the profiles.
fn constant(labelled: &[Vec<f64>], bins: usize) -> Vec<Vec<f64>> {
    let sums: Vec<f64> = labelled.iter().map(|counts| counts.iter().sum()).collect();
    let whole: f64 = sums.iter().sum();
    let even = 1.0 / labelled.len().max(1) as f64;
    let fractions = sums.iter().map(|sum| if whole > 0.0 { sum / whole } else { even });
    vec![fractions.collect(); bins]
}

fn maximise(
    expected: &DMatrix<f64>,
    labelled: &[Vec<f64>],
    mut fractions: Vec<Vec<f64>>,
    steps: usize,
) -> Vec<Vec<f64>> {
    let (bins, categories) = (expected.ncols(), labelled.len());
    let smoothing = SMOOTHING * bins as f64;
    // Rows with profiles, each with the sizes of the particles that they may come from.
    let rows: Vec<(usize, Vec<f64>)> = (0..expected.nrows())
        .filter(|&i| labelled.iter().any(|counts| counts[i] > 0.0))
        .filter_map(|i| {
            let whole = expected.row(i).sum();
            (whole > 0.0).then(|| (i, expected.row(i).iter().map(|e| e / whole).collect()))
        })
        .collect();
    for _ in 0..steps {
        let mut sums = vec![vec![0.0; categories]; bins];
        let mut mixed = vec![0.0; categories];
        for (i, origin) in &rows {
            mixed.fill(0.0);
            for (r, of_bin) in origin.iter().zip(&fractions) {
                mixed.iter_mut().zip(of_bin).for_each(|(sum, p)| *sum += r * p);
            }
            for (ratio, counts) in mixed.iter_mut().zip(labelled) {
                *ratio = if *ratio > 0.0 { counts[*i] / *ratio } else { 0.0 };
            }
            for ((r, of_bin), sums) in origin.iter().zip(&fractions).zip(&mut sums) {
                if *r > 0.0 {
                    let terms = of_bin.iter().zip(&mixed);
                    sums.iter_mut()
                        .zip(terms)
                        .for_each(|(sum, (p, ratio))| *sum += r * p * ratio);
                }
            }
        }
        let mut moved = 0.0_f64;
        for (j, sums) in sums.iter_mut().enumerate() {
            let (left, right) = (&fractions[j.saturating_sub(1)], &fractions[(j + 1).min(bins - 1)]);
            for (sum, (a, b)) in sums.iter_mut().zip(left.iter().zip(right)) {
                *sum += smoothing * 0.5 * (a + b);
            }
            let whole: f64 = sums.iter().sum();
            for (sum, old) in sums.iter_mut().zip(&fractions[j]) {
                *sum = if whole > 0.0 { *sum / whole } else { *old };
                moved = moved.max((*sum - old).abs());
            }
        }
        fractions = sums;
        if moved < SETTLED {
            break;
        }
    }
    fractions
}

/// Unfolds all profiles together and splits the densities by category.
///
/// `labelled` holds the counts of each category, on the edges of `counts`. Every replicate of the bootstrap has labels
/// of its own, so that categories have intervals.
///
/// # Errors
///
/// As [`unfold`](crate::unfold), and [`UnfoldError::Bins`] if the edges of a category differ or there is no category.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use nalgebra::dmatrix;
/// use stereology_unfold::{CategoryModel, Kernel, ProfileCounts, SizeBins, UnfoldOptions, unfold_categories};
///
/// let edges = [0.0, 1.0, 2.0];
/// let kernel = Kernel::new(dmatrix![1.0, 0.27; 0.0, 1.73], SizeBins::upper_edge(&edges)?, 0.52)?;
/// let counts = |of: [f64; 2]| ProfileCounts::from_counts(&of, &edges, 100.0);
/// let (red, grey) = (counts([60.0, 5.0])?, counts([10.0, 50.0])?);
/// let found = unfold_categories(
///     &counts([70.0, 55.0])?, &[red, grey], CategoryModel::BySize, &kernel, &UnfoldOptions::default(), &|_| ControlFlow::Continue(()),
/// )?;
/// let sum: f64 = found.categories.iter().map(|of| of.total.value).sum();
/// assert!((sum / found.all.total.value - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn unfold_categories(
    counts: &ProfileCounts,
    labelled: &[ProfileCounts],
    model: CategoryModel,
    kernel: &Kernel,
    options: &UnfoldOptions,
    progress: Progress<'_>,
) -> Result<CategoryUnfolding, UnfoldError> {
    if let Some(index) = labelled.iter().position(|of| of.edges() != counts.edges()) {
        return Err(UnfoldError::Bins { index });
    }
    if labelled.is_empty() {
        return Err(UnfoldError::Bins { index: 0 });
    }
    let (all, densities, replicates) = unfold_replicated(counts, kernel, options, 0, progress)?;
    let labels = Labels::new(counts, labelled, model, kernel, all.threshold);
    let fractions = labels.fractions(&densities, &labels.counts, None);
    let by_replicate = replicates.as_ref().map(|of| labels.replicated(of, &fractions));
    let grouping = Grouping::new(kernel.sizes());
    let moments = Moments::new(kernel.sizes());
    let categories = (0..labelled.len())
        .map(|category| {
            let of_category = |densities: &Population, fractions: &[Vec<f64>]| {
                grouping.weighed(densities, |bin| fractions[bin][category])
            };
            let population = of_category(&densities, &fractions);
            let replicates = replicates
                .as_ref()
                .zip(by_replicate.as_ref())
                .map(|(of, fractions)| Replicates {
                    bases: of
                        .bases
                        .iter()
                        .zip(&fractions.bases)
                        .map(|(n, p)| of_category(n, p))
                        .collect(),
                    densities: of
                        .densities
                        .iter()
                        .zip(&fractions.densities)
                        .map(|(n, p)| of_category(n, p))
                        .collect(),
                    ..of.clone()
                });
            density(&all, &population, replicates.as_ref(), &grouping, &moments, kernel)
        })
        .collect();
    Ok(CategoryUnfolding {
        all,
        fine_edges: kernel.sizes().edges().to_vec(),
        categories,
    })
}

fn density(
    all: &Unfolding,
    population: &Population,
    replicates: Option<&Replicates>,
    grouping: &Grouping,
    moments: &Moments,
    kernel: &Kernel,
) -> CategoryDensity {
    let quantities = Quantities {
        densities: population,
        replicates,
    };
    let bins = || all.number_density.iter().enumerate();
    let number_density = bins().map(|(bin, known)| known.map(|_| grouping.sum(population, bin)));
    let intervals =
        bins().map(|(bin, known)| known.and_then(|_| quantities.bin(&|densities| grouping.sum(densities, bin))));
    CategoryDensity {
        number_density: number_density.collect(),
        intervals: replicates.map(|_| intervals.collect()),
        total: quantities.estimate(&Population::total),
        mean_size: quantities.estimate_up_to(moments.largest(), &|densities| {
            moments.mean(densities, Weighing::Number)
        }),
        volume_fraction: quantities.estimate(&|densities| kernel.unit_volume() * moments.sum(densities, 3)),
        fine: population.in_bins(kernel.sizes()),
    }
}

/// Labels of the profiles above the threshold, and what particles show there.
struct Labels<'a> {
    kernel: &'a Kernel,
    points: Option<PointKernel>,
    model: CategoryModel,
    /// Counts of each category above the threshold.
    counts: Vec<Vec<f64>>,
    first_row: usize,
    /// Area over dispersion: counts per profile per area.
    scale: f64,
}

/// Fractions for the fits of a bootstrap and for its replicates.
struct ReplicatedFractions {
    bases: Vec<Vec<Vec<f64>>>,
    densities: Vec<Vec<Vec<f64>>>,
}

impl<'a> Labels<'a> {
    fn new(
        counts: &ProfileCounts,
        labelled: &[ProfileCounts],
        model: CategoryModel,
        kernel: &'a Kernel,
        threshold: f64,
    ) -> Self {
        let edges = counts.edges();
        let first_row = edges.partition_point(|&edge| edge < threshold * (1.0 - 1e-12));
        let above = |of: &ProfileCounts| {
            of.counts()[first_row..]
                .iter()
                .map(|n| n / counts.dispersion())
                .collect()
        };
        Self {
            kernel,
            points: PointKernel::new(kernel, counts, first_row),
            model,
            counts: labelled.iter().map(above).collect(),
            first_row,
            scale: counts.area() / counts.dispersion(),
        }
    }

    /// Expected counts by profile bin above the threshold and reported size bin.
    fn expected(&self, population: &Population) -> DMatrix<f64> {
        let matrix = self.kernel.matrix();
        let grouping = Grouping::new(self.kernel.sizes());
        let mut expected = DMatrix::zeros(matrix.nrows() - self.first_row, grouping.bins());
        for (j, density) in population.spread.iter().enumerate() {
            let column = matrix.column(j);
            let above = column.rows(self.first_row, expected.nrows());
            expected
                .column_mut(grouping.of_bin(j))
                .axpy(density * self.scale, &above, 1.0);
        }
        for (spike, points) in population.spikes.iter().zip(std::iter::repeat(&self.points)) {
            let Some(points) = points else { continue };
            let column = nalgebra::DVector::from_vec(points.column(spike.size));
            expected
                .column_mut(grouping.of_size(spike.size))
                .axpy(spike.density, &column, 1.0);
        }
        expected
    }

    /// Fractions by reported bin, from labels of the profiles of these densities; from `start` on if it is known.
    fn fractions(&self, densities: &Population, labelled: &[Vec<f64>], start: Option<&[Vec<f64>]>) -> Vec<Vec<f64>> {
        let expected = self.expected(densities);
        match (self.model, start) {
            (CategoryModel::Constant, _) => constant(labelled, expected.ncols()),
            (CategoryModel::BySize, None) => category_fractions(&expected, labelled),
            (CategoryModel::BySize, Some(start)) => maximise(&expected, labelled, start.to_vec(), STEPS[1]),
        }
    }

    /// Fractions for every replicate, with labels drawn from the fit that the replicate was drawn from.
    fn replicated(&self, of: &Replicates, fractions: &[Vec<f64>]) -> ReplicatedFractions {
        let start = Some(fractions);
        let bases: Vec<Vec<Vec<f64>>> = of
            .bases
            .iter()
            .map(|base| self.fractions(base, &self.counts, start))
            .collect();
        let means: Vec<DMatrix<f64>> = of
            .bases
            .iter()
            .zip(&bases)
            .map(|(base, fractions)| {
                let categories = self.counts.len();
                let fractions = DMatrix::from_fn(fractions.len(), categories, |j, c| fractions[j][c]);
                self.expected(base) * fractions
            })
            .collect();
        let densities = of
            .densities
            .par_iter()
            .zip(&of.base_of)
            .enumerate()
            .map(|(task, (densities, &base))| {
                let mut rng = ChaCha8Rng::seed_from_u64(of.bootstrap.seed);
                rng.set_stream(STREAM + task as u64);
                let drawn: Vec<Vec<f64>> = means[base]
                    .column_iter()
                    .map(|means| means.iter().map(|&mean| poisson(mean, &mut rng)).collect())
                    .collect();
                self.fractions(densities, &drawn, Some(&bases[base]))
            })
            .collect();
        ReplicatedFractions { bases, densities }
    }
}

/// First stream of the random numbers of labels, far from those of counts.
const STREAM: u64 = 1 << 60;

#[cfg(test)]
mod tests {
    use super::category_fractions;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// Expected profiles of spheres of the sizes 1 to `bins`, `number` of each, per unit area, in bins of width 1.
    fn spheres(bins: usize, number: f64) -> DMatrix<f64> {
        let chord = |d: usize, x: usize| ((d * d - x * x) as f64).sqrt();
        DMatrix::from_fn(bins, bins, |i, j| {
            if i > j {
                0.0
            } else {
                number * (chord(j + 1, i) - chord(j + 1, i + 1))
            }
        })
    }

    proptest! {
        /// Labels that follow the size of the particle are found again from those of the profiles, without noise.
        #[test]
        fn labels_of_particles_are_recovered(
            corner in 0.2..0.8_f64, first in 0.05..0.95_f64, last in 0.05..0.95_f64, categories in 2_usize..5,
        ) {
            let bins = 12;
            let expected = spheres(bins, 1e6);
            let of = |j: usize| {
                let x = (j as f64 + 0.5) / bins as f64;
                first + (last - first) / (1.0 + (-(x - corner) * 12.0).exp())
            };
            // The remaining categories are alike.
            let fraction = |j: usize, c: usize| if c == 0 { of(j) } else { (1.0 - of(j)) / (categories - 1) as f64 };
            let labelled: Vec<Vec<f64>> = (0..categories)
                .map(|c| (0..bins).map(|i| (0..bins).map(|j| expected[(i, j)] * fraction(j, c)).sum()).collect())
                .collect();
            for (j, found) in category_fractions(&expected, &labelled).iter().enumerate() {
                for (c, p) in found.iter().enumerate() {
                    prop_assert!((p - fraction(j, c)).abs() < 0.01, "bin {j} category {c}: {p} for {}", fraction(j, c));
                }
            }
        }

        /// Whatever the labels, the fractions of a bin sum to one, and a category without profiles has none.
        #[test]
        fn fractions_sum_to_one(counts in prop::collection::vec(0_u8..40, 24), bins in 1_usize..8) {
            let expected = spheres(8, 1.0).columns(8 - bins, bins).into_owned();
            let mut labelled: Vec<Vec<f64>> = counts.chunks(8).map(|of| of.iter().map(|&n| f64::from(n)).collect()).collect();
            labelled.push(vec![0.0; 8]);
            prop_assume!(counts.iter().any(|&n| n > 0));
            for of_bin in category_fractions(&expected, &labelled) {
                prop_assert!((of_bin.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                prop_assert!(of_bin.iter().all(|p| *p >= 0.0) && of_bin[3] == 0.0);
            }
        }

        /// Labels that are independent of size give the same fractions in every bin.
        #[test]
        fn independent_labels_stay_so(share in 0.01..0.99_f64, number in 1.0..1e4_f64) {
            let expected = spheres(10, number);
            let rows: Vec<f64> = expected.row_iter().map(|row| row.sum()).collect();
            let labelled = [share, 1.0 - share].map(|p| rows.iter().map(|n| p * n).collect());
            for of_bin in category_fractions(&expected, &labelled) {
                prop_assert!((of_bin[0] - share).abs() < 1e-9);
            }
        }
    }
}
