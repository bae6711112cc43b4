//! Several particle types or categories whose profiles are told apart: eq. (9).

use crate::unfolding::{Sums, unfold_replicated};
use crate::{Estimate, Interval, Kernel, ProfileCounts, Progress, UnfoldError, UnfoldOptions, Unfolding};
use std::ops::ControlFlow;

/// Number densities of several types, each and together.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TypesUnfolding {
    /// Each type by itself, in the order given.
    pub types: Vec<Unfolding>,
    /// Particles of all types per unit volume in each size bin; `None` where no type has a density.
    pub number_density: Vec<Option<f64>>,
    /// Intervals of `number_density`, with a bootstrap.
    pub intervals: Option<Vec<Option<Interval>>>,
    /// Particles of all types per unit volume.
    pub total: Estimate,
    /// Mean size over all types.
    pub mean_size: Estimate,
    /// Share of the volume in particles of all types.
    pub volume_fraction: Estimate,
    /// Profiles per unit area by profile bin, all types.
    pub observed: Vec<f64>,
    /// Σ H_i K_i N_Vi, eq. (9).
    pub refolded: Vec<f64>,
}

/// Unfolds labelled profiles: counts and kernel of each type, on common edges.
///
/// Where it is known which type each profile belongs to, eq. (9) falls apart into one system a type; their sum, its intervals and the sum of the
/// refolded counts come out here. Types may share a kernel (colour categories of one body).
///
/// # Errors
///
/// As [`unfold`](crate::unfold), and [`UnfoldError::Bins`] if there is no type or edges differ.
pub fn unfold_types(types: &[(ProfileCounts, Kernel)], options: &UnfoldOptions) -> Result<TypesUnfolding, UnfoldError> {
    unfold_types_with_progress(types, options, &|_| ControlFlow::Continue(()))
}

/// [`unfold_types`] that tells how far it is and can be cancelled.
///
/// # Errors
///
/// As [`unfold_types`], and [`UnfoldError::Cancelled`].
pub fn unfold_types_with_progress(
    types: &[(ProfileCounts, Kernel)],
    options: &UnfoldOptions,
    progress: Progress<'_>,
) -> Result<TypesUnfolding, UnfoldError> {
    let (first_counts, first_kernel) = types.first().ok_or(UnfoldError::Bins { index: 0 })?;
    let differs = |(counts, kernel): &(ProfileCounts, Kernel)| {
        counts.edges() != first_counts.edges() || kernel.sizes().edges() != first_kernel.sizes().edges()
    };
    if let Some(index) = types.iter().position(differs) {
        return Err(UnfoldError::Bins { index });
    }
    let mut parts = Vec::with_capacity(types.len());
    for (index, (counts, kernel)) in types.iter().enumerate() {
        // Streams of different types are far apart: more replicates than 2^32 are never drawn.
        let stream = (index as u64) << 32;
        let share = |done: f64| progress((index as f64 + done) / types.len() as f64);
        parts.push(unfold_replicated(counts, kernel, options, stream, &share)?);
    }
    let bins = first_kernel.sizes().len();
    let columns: Vec<usize> = (0..bins).collect();
    let part_densities = |part: usize| -> Vec<f64> {
        parts[part]
            .0
            .number_density
            .iter()
            .map(|density| density.unwrap_or(0.0))
            .collect()
    };
    let add = |mut left: Vec<f64>, right: Vec<f64>| {
        left.iter_mut().zip(right).for_each(|(l, r)| *l += r);
        left
    };
    let sums = |densities: &dyn Fn(usize) -> Vec<f64>| {
        types
            .iter()
            .enumerate()
            .fold(Sums::default(), |all, (part, (_, kernel))| {
                let one = Sums::of(&densities(part), &columns, kernel);
                Sums {
                    total: all.total + one.total,
                    length: all.length + one.length,
                    volume: all.volume + one.volume,
                }
            })
    };
    // Replicates of the sum: the types' replicates, number by number; they are independent.
    let replicates = options.bootstrap.map(|bootstrap| bootstrap.replicates).unwrap_or(0);
    let drawn = |part: usize, number: usize| -> Vec<f64> {
        parts[part]
            .1
            .as_ref()
            .map_or_else(|| vec![0.0; bins], |replicates| replicates.densities[number].clone())
    };
    let interval = |quantity: &dyn Fn(usize) -> f64| {
        options.bootstrap.map(|bootstrap| {
            let densities = (0..replicates).map(|number| vec![quantity(number)]).collect();
            crate::bootstrap::Replicates {
                densities,
                level: bootstrap.level,
            }
            .interval(|value| value[0])
        })
    };
    let estimate = |f: fn(&Sums) -> f64| Estimate {
        value: f(&sums(&part_densities)),
        interval: interval(&|number| f(&sums(&|part| drawn(part, number)))),
    };
    let known: Vec<bool> = (0..bins)
        .map(|j| parts.iter().any(|(part, _)| part.number_density[j].is_some()))
        .collect();
    let total_densities = (0..types.len()).map(part_densities).fold(vec![0.0; bins], add);
    let bin_interval = |j: usize| {
        interval(&|number| (0..types.len()).map(|part| drawn(part, number)[j]).sum::<f64>()).filter(|_| known[j])
    };
    let profile_bins = first_counts.counts().len();
    let summed = |of: fn(&Unfolding) -> &Vec<f64>| {
        parts
            .iter()
            .fold(vec![0.0; profile_bins], |all, (part, _)| add(all, of(part).clone()))
    };
    Ok(TypesUnfolding {
        number_density: (0..bins).map(|j| known[j].then_some(total_densities[j])).collect(),
        intervals: options.bootstrap.map(|_| (0..bins).map(bin_interval).collect()),
        total: estimate(|sums| sums.total),
        mean_size: estimate(Sums::mean_size),
        volume_fraction: estimate(|sums| sums.volume),
        observed: summed(|part| &part.observed),
        refolded: summed(|part| &part.refolded),
        types: parts.into_iter().map(|(part, _)| part).collect(),
    })
}
