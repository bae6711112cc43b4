//! Several types whose profiles cannot be distinguished, in unknown fractions, with one size distribution: eqs.
//! (10)-(12) where P(i) is sought as well.
//!
//! Often the counts cannot tell: a broad distribution of one type and a slightly different one of another show the same
//! profiles. Then the answer is that.

use crate::estimator::estimate;
use crate::kernel::condition_number;
use crate::problem::Problem;
use crate::profile_likelihood::likely_parameter;
use crate::{Interval, Kernel, ProfileCounts, UnfoldError, UnfoldOptions};
use nalgebra::DMatrix;

/// Fractions of types that share a size distribution.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fractions {
    /// Share of each type by number; they sum to 1.
    pub fractions: Vec<f64>,
    /// Interval of each, the others in proportion.
    pub intervals: Vec<Interval>,
    /// How alike the profiles of the types are at these fractions: the condition number of their profile densities,
    /// each over the root of the mean. 1 is wholly different; beyond some tens hardly any counts tell them apart.
    pub condition_number: f64,
}

/// An interval of a fraction that is wider than this says nothing: half of all there is.
const WIDEST: f64 = 0.5;
/// Rounds over the types; with two one is enough.
const ROUNDS: usize = 3;

/// Estimates the fractions of types, of which `kernels` are the kernels on common bins, from profiles that do not tell
/// their type.
///
/// The fraction of one type at a time, the others in proportion, is found by profile likelihood with the sizes
/// integrated out, and its interval at `level` with it. Then unfold with [`Kernel::mix`].
///
/// # Errors
///
/// [`UnfoldError::FractionsUnknowable`] if the interval of a fraction is wider than 0.5, so that the counts do not
/// tell; [`UnfoldError::Bins`] without two kernels; and as [`unfold`](crate::unfold).
///
/// # Examples
///
/// ```
/// use stereology_unfold::{ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, divided_edges, equal_edges, unknown_fractions};
///
/// // Bodies that nearly always show their largest section, and bodies that hardly ever do; a third of the first kind.
/// let edges = equal_edges(1.0, 5);
/// let bins = divided_edges(&edges, 50, 0.0);
/// let kernel = |law: &dyn Fn(f64) -> f64| {
///     let sizes = SizeBins::integrated(&divided_edges(&edges, 40, 0.0))?.reported_in(&edges)?;
///     Ok::<_, Box<dyn std::error::Error>>(capped_kernel(law, 1.0, 0.0, &bins, sizes, 0.5)?)
/// };
/// let kinds = [kernel(&|x| x.powi(40))?, kernel(&|x| 1.0 - (1.0 - x).powi(6))?];
/// let shown = kinds[0].matrix().column(30) * 1000.0 + kinds[1].matrix().column(30) * 2000.0;
/// let counts = ProfileCounts::from_counts(shown.as_slice(), &bins, 100.0)?;
/// let found = unknown_fractions(&counts, &kinds, 0.9, &UnfoldOptions::default())?;
/// assert!((found.fractions[0] - 1.0 / 3.0).abs() < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn unknown_fractions(
    counts: &ProfileCounts,
    kernels: &[Kernel],
    level: f64,
    options: &UnfoldOptions,
) -> Result<Fractions, UnfoldError> {
    let types = kernels.len();
    if types < 2 {
        return Err(UnfoldError::Bins { index: 0 });
    }
    let mut fractions = vec![1.0 / types as f64; types];
    let mut intervals = vec![Interval { lower: 0.0, upper: 1.0 }; types];
    // With two types one fraction gives the other.
    let asked = if types == 2 { 1 } else { types };
    for _ in 0..if types == 2 { 1 } else { ROUNDS } {
        for (of, interval) in intervals.iter_mut().enumerate().take(asked) {
            let current = fractions.clone();
            let with = |fraction: f64| with_fraction(&current, of, fraction);
            let found = likely_parameter(
                counts,
                &|fraction| Kernel::mix(kernels, &with(fraction)),
                (0.0, 1.0),
                level,
                options,
            )?;
            fractions = with(found.value);
            *interval = found.interval;
        }
    }
    if types == 2 {
        intervals[1] = Interval {
            lower: 1.0 - intervals[0].upper,
            upper: 1.0 - intervals[0].lower,
        };
    }
    let condition_number = likeness(counts, kernels, &fractions, options)?;
    if let Some(index) = intervals
        .iter()
        .position(|interval| interval.upper - interval.lower > WIDEST)
    {
        return Err(UnfoldError::FractionsUnknowable {
            index,
            lower: intervals[index].lower,
            upper: intervals[index].upper,
            condition_number,
        });
    }
    Ok(Fractions {
        fractions,
        intervals,
        condition_number,
    })
}

/// The fractions with that of one type as given and the others in proportion.
fn with_fraction(current: &[f64], of: usize, fraction: f64) -> Vec<f64> {
    let others: f64 = current.iter().sum::<f64>() - current[of];
    let share = |k: usize| {
        if k == of {
            fraction
        } else if others > 0.0 {
            (1.0 - fraction) * current[k] / others
        } else {
            (1.0 - fraction) / (current.len() - 1) as f64
        }
    };
    (0..current.len()).map(share).collect()
}

/// Condition number of the types' profile densities, each scaled by the root of the mean of its bin and to length 1.
fn likeness(
    counts: &ProfileCounts,
    kernels: &[Kernel],
    fractions: &[f64],
    options: &UnfoldOptions,
) -> Result<f64, UnfoldError> {
    let mixed = Kernel::mix(kernels, fractions)?;
    let problem = Problem::new(counts, &mixed, options)?;
    let fit = estimate(&problem, &problem.counts, options)?;
    let mean = problem.refold(&fit.population);
    let population = problem.widen(&fit.population, mixed.sizes().len());
    let wide = nalgebra::DVector::from_vec(population.in_bins(mixed.sizes()));
    let scale = counts.area() / counts.dispersion();
    let columns: Vec<_> = kernels
        .iter()
        .map(|kernel| {
            let shown = kernel.matrix() * &wide * scale;
            let scaled = nalgebra::DVector::from_fn(mean.len(), |i, _| {
                shown[problem.first_row + i] / mean[i].max(f64::MIN_POSITIVE).sqrt()
            });
            let length = scaled.norm();
            if length > 0.0 { scaled / length } else { scaled }
        })
        .collect();
    Ok(condition_number(&DMatrix::from_columns(&columns)))
}
