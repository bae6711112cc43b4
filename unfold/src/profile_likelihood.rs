//! One parameter of the model by likelihood: the scale of eq. (7), the largest size, the capping angle.

use crate::estimator::evidence;
use crate::problem::Problem;
use crate::quantiles::normal_quantile;
use crate::{Interval, Kernel, KernelError, ProfileCounts, UnfoldError, UnfoldOptions};

/// A parameter of the kernel, as the counts have it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LikelyParameter {
    /// The value of highest evidence.
    pub value: f64,
    /// Where the evidence is within z² / 2 of the highest, within the range that was searched.
    pub interval: Interval,
    /// What was tried: values, rising, and ln evidence less the highest; −∞ where some profile cannot be.
    pub curve: Vec<(f64, f64)>,
    /// Whether the interval ends at an end of the range: the data do not bound the parameter there.
    pub unbounded: bool,
}

/// Values that are tried over the whole range before the search goes into detail.
const COARSE: usize = 24;
/// Values between the neighbours of the best.
const DETAIL: usize = 12;

/// Finds a parameter of the kernel by profile likelihood, the densities integrated out: for every value the evidence of
/// the smooth estimate.
///
/// `kernel_of` gives the kernel for a value, for the same profile bins throughout; fine bins, where profiles near the
/// largest size tell (they are counted in `counts`). It may refuse a value with an error, which ends the search.
/// `range` is searched in 24 steps and then around the best; `level` is the nominal coverage of the interval. Takes as
/// long as 37 fits and kernels.
///
/// For the scale s of eq. (7) with particles all alike, `kernel_of(s)` has the one size s; for the largest size it has
/// sizes spread up to s. That is not biased low as the largest profile is. Where the density falls to nothing before
/// the largest size, as for a single mode, no counts determine that size, and the result is `unbounded`; it does not
/// matter either. For the capping angle see [`capped_kernel`](crate::capped_kernel).
///
/// # Errors
///
/// [`UnfoldError::Range`] for a range that is none or in which no value can explain the profiles; errors of the kernels
/// and the fit.
///
/// # Examples
///
/// ```
/// use stereology_unfold::{ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, equal_edges, likely_parameter};
///
/// // Spheres of one size, cut at even depths: which size?
/// let profiles: Vec<f64> = (0..500).map(|i| 0.8 * (1.0 - ((f64::from(i) + 0.5) / 500.0_f64).powi(2)).sqrt()).collect();
/// let bins = equal_edges(1.2, 240);
/// let counts = ProfileCounts::from_sizes(&profiles, None, &bins, 100.0)?;
/// let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
/// let one_size = |size: f64| {
///     let sizes = SizeBins::upper_edge(&[0.0, size]).map_err(|_| stereology_unfold::KernelError::Volume(size))?;
///     capped_kernel(&law, 1.0, 0.0, &bins, sizes, 0.5)
/// };
/// let found = likely_parameter(&counts, &one_size, (0.6, 1.2), 0.9, &UnfoldOptions::default())?;
/// assert!((found.value - 0.8).abs() < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn likely_parameter(
    counts: &ProfileCounts,
    kernel_of: &dyn Fn(f64) -> Result<Kernel, KernelError>,
    range: (f64, f64),
    level: f64,
    options: &UnfoldOptions,
) -> Result<LikelyParameter, UnfoldError> {
    let (from, to) = range;
    let refused = UnfoldError::Range { from, to };
    if !(from.is_finite() && to.is_finite() && from < to && level > 0.0 && level < 1.0) {
        return Err(refused);
    }
    let ask = |value: f64| -> Result<(f64, f64), UnfoldError> {
        let kernel = kernel_of(value)?;
        match Problem::new(counts, &kernel, options) {
            Ok(problem) => Ok((value, evidence(&problem))),
            Err(UnfoldError::Unexplained { .. }) => Ok((value, f64::NEG_INFINITY)),
            Err(error) => Err(error),
        }
    };
    let between = |from: f64, to: f64, k: usize, of: usize| from + (to - from) * (k as f64 / of as f64);
    let mut curve = (0..=COARSE)
        .map(|k| ask(between(from, to, k, COARSE)))
        .collect::<Result<Vec<_>, _>>()?;
    let best = |curve: &[(f64, f64)]| {
        let places = 0..curve.len();
        places.max_by(|&i, &j| curve[i].1.total_cmp(&curve[j].1)).unwrap_or(0)
    };
    let top = best(&curve);
    if curve[top].1 == f64::NEG_INFINITY {
        return Err(refused);
    }
    let (left, right) = (curve[top.saturating_sub(1)].0, curve[(top + 1).min(COARSE)].0);
    for k in 1..DETAIL {
        let value = between(left, right, k, DETAIL);
        if curve.iter().all(|tried| (tried.0 - value).abs() > 1e-12 * (to - from)) {
            curve.push(ask(value)?);
        }
    }
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let top = best(&curve);
    let highest = curve[top].1;
    curve.iter_mut().for_each(|tried| tried.1 -= highest);
    let drop = 0.5 * normal_quantile(0.5 * (1.0 + level)).powi(2);
    let crossing = |inside: (f64, f64), outside: (f64, f64)| {
        if outside.1 == f64::NEG_INFINITY {
            return inside.0;
        }
        let share = (inside.1 + drop) / (inside.1 - outside.1);
        inside.0 + share.clamp(0.0, 1.0) * (outside.0 - inside.0)
    };
    let low = (0..top).rev().find(|&k| curve[k].1 < -drop);
    let high = (top + 1..curve.len()).find(|&k| curve[k].1 < -drop);
    Ok(LikelyParameter {
        value: curve[top].0,
        interval: Interval {
            lower: low.map_or(from, |k| crossing(curve[k + 1], curve[k])),
            upper: high.map_or(to, |k| crossing(curve[k - 1], curve[k])),
        },
        unbounded: low.is_none() || high.is_none(),
        curve,
    })
}
