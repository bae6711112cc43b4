//! Several particle types or categories with labelled profiles: eq. (9).

use crate::bootstrap::Replicates;
use crate::population::{Grouping, Population};
use crate::size_bins::SizeBins;
use crate::size_distribution::{Moments, SizeDistribution, Weighing, describe};
use crate::unfolding::{Quantities, Replicated, unfold_replicated};
use crate::{Bootstrap, Estimate, Interval, Kernel, ProfileCounts, Resampling, UnfoldError, UnfoldOptions, Unfolding};
use std::ops::ControlFlow;
use stereology_metrics::Progress;

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
    /// Surface of particles of all types per unit volume, if all kernels know their body's.
    pub surface_density: Option<Estimate>,
    /// Means, percentiles and the sieve curve of all types.
    pub distribution: SizeDistribution,
    /// Profiles per unit area by profile bin, all types.
    pub observed: Vec<f64>,
    /// Σ H_i K_i N_Vi, eq. (9).
    pub refolded: Vec<f64>,
}

impl TypesUnfolding {
    /// Sums the profile bins of every type and of their sum to those between `edges`, as [`Unfolding::rebin_profiles`].
    pub fn rebin_profiles(&mut self, edges: &[f64]) {
        if let Some(first) = self.types.first() {
            self.observed = first.profiles_in(edges, &self.observed);
            self.refolded = first.profiles_in(edges, &self.refolded);
        }
        self.types.iter_mut().for_each(|of| of.rebin_profiles(edges));
    }

    /// All types as one unfolding, eq. (9): densities, totals and intervals are those of the sum. Method, penalty,
    /// evidence and threshold are those of the first type; deviance and degrees of freedom are summed; findings stay
    /// with their types.
    #[must_use]
    pub fn summed(&self) -> Unfolding {
        let mut sum = self.types[0].clone();
        sum.number_density.clone_from(&self.number_density);
        sum.intervals.clone_from(&self.intervals);
        (sum.total, sum.mean_size, sum.volume_fraction) = (self.total, self.mean_size, self.volume_fraction);
        (sum.surface_density, sum.distribution) = (self.surface_density, self.distribution.clone());
        sum.observed.clone_from(&self.observed);
        sum.refolded.clone_from(&self.refolded);
        sum.findings.clear();
        for part in &self.types[1..] {
            sum.profiles += part.profiles;
            for (sum, part) in [
                (&mut sum.profiles_per_area, part.profiles_per_area),
                (&mut sum.area_fraction, part.area_fraction),
            ] {
                sum.observed += part.observed;
                sum.expected += part.expected;
            }
            sum.deviance += part.deviance;
            sum.degrees_of_freedom += part.degrees_of_freedom;
            sum.p_value = [sum.p_value, part.p_value].into_iter().flatten().reduce(f64::min);
            sum.condition_number = sum.condition_number.max(part.condition_number);
            sum.clamped_bins.extend(&part.clamped_bins);
        }
        // The smallest of several p-values, corrected for their number.
        sum.p_value = sum.p_value.map(|p| (p * self.types.len() as f64).min(1.0));
        sum
    }
}

/// Unfolds labelled profiles: counts and kernel of each type, on common edges.
///
/// Where it is known which type each profile belongs to, eq. (9) falls apart into one system a type; their sum, its
/// intervals and the sum of the refolded counts come out here. Types may share a kernel (colour categories of one
/// body).
///
/// # Errors
///
/// As [`unfold`](crate::unfold), and [`UnfoldError::Bins`] if there is no type or edges differ.
pub fn unfold_types(types: &[(ProfileCounts, Kernel)], options: &UnfoldOptions) -> Result<TypesUnfolding, UnfoldError> {
    unfold_types_with_progress(types, options, &|_| ControlFlow::Continue(()))
}

/// [`unfold_types`] with progress and cancellation.
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
    let sizes = first_kernel.sizes();
    let differs =
        |(counts, kernel): &(ProfileCounts, Kernel)| counts.edges() != first_counts.edges() || kernel.sizes() != sizes;
    if let Some(index) = types.iter().position(differs) {
        return Err(UnfoldError::Bins { index });
    }
    let mut parts = Vec::with_capacity(types.len());
    for (index, (counts, kernel)) in types.iter().enumerate() {
        // Streams of different types are far apart: more replicates than 2^32 are never drawn. Slices and tiles are the
        // same for all types.
        let has_parts = options.bootstrap.is_some_and(|of| of.resampling != Resampling::Counts);
        let stream = if has_parts { 0 } else { (index as u64) << 32 };
        let share = |done: f64| progress((index as f64 + done) / types.len() as f64);
        parts.push(unfold_replicated(counts, kernel, options, stream, &share)?);
    }
    // Densities of all types one behind the other, and so their replicates.
    let densities = one_behind_the_other(parts.iter().map(|part| &part.1), sizes);
    let replicates = options.bootstrap.map(|bootstrap| joined(&bootstrap, &parts, sizes));
    let quantities = Quantities {
        densities: &densities,
        replicates: replicates.as_ref(),
    };
    let bins = sizes.len();
    let volumes: Vec<f64> = types.iter().map(|(_, kernel)| kernel.unit_volume()).collect();
    let by_number = |all: &Population| weighed(all, &vec![1.0; volumes.len()], bins);
    let by_volume = |all: &Population| weighed(all, &volumes, bins);
    let moments = Moments::new(sizes);
    let grouping = Grouping::new(sizes);
    let reported = sizes.reported_edges().len() - 1;
    let known: Vec<bool> = (0..reported)
        .map(|j| parts.iter().any(|part| part.0.number_density[j].is_some()))
        .collect();
    let of_bin = |all: &Population, j: usize| grouping.sum(&by_number(all), j);
    let profile_bins = first_counts.counts().len();
    let summed = |of: fn(&Unfolding) -> &Vec<f64>| {
        let mut sum = vec![0.0; profile_bins];
        for part in &parts {
            sum.iter_mut().zip(of(&part.0)).for_each(|(sum, value)| *sum += value);
        }
        sum
    };
    let surfaces: Option<Vec<f64>> = types.iter().map(|(_, kernel)| kernel.unit_surface()).collect();
    Ok(TypesUnfolding {
        number_density: (0..reported).map(|j| known[j].then(|| of_bin(&densities, j))).collect(),
        intervals: replicates.as_ref().map(|_| {
            let interval = |j: usize| quantities.bin(&|all| of_bin(all, j)).filter(|_| known[j]);
            (0..reported).map(interval).collect()
        }),
        total: quantities.estimate(&Population::total),
        mean_size: quantities.estimate_up_to(moments.largest(), &|all| {
            moments.mean(&by_number(all), Weighing::Number)
        }),
        volume_fraction: quantities.estimate(&|all| moments.sum(&by_volume(all), 3)),
        surface_density: surfaces
            .map(|surfaces| quantities.estimate(&|all| moments.sum(&weighed(all, &surfaces, bins), 2))),
        distribution: describe(&moments, sizes.reported_edges(), |weighing, most, quantity| {
            quantities.estimate_up_to(most, &|all| match weighing {
                Weighing::Number => quantity(&by_number(all)),
                Weighing::Volume => quantity(&by_volume(all)),
            })
        }),
        observed: summed(|part| &part.observed),
        refolded: summed(|part| &part.refolded),
        types: parts.into_iter().map(|part| part.0).collect(),
    })
}

/// Σ over types of weight × density, by bin of the kernel.
fn weighed(all: &Population, weights: &[f64], bins: usize) -> Population {
    let mut sum = vec![0.0; bins];
    for (type_densities, weight) in all.spread.chunks(bins).zip(weights) {
        sum.iter_mut()
            .zip(type_densities)
            .for_each(|(sum, n)| *sum += weight * n);
    }
    Population::of_bins(sum)
}

/// Densities of several populations on the bins of a kernel; those of single sizes are in the bins of their sizes.
fn one_behind_the_other<'a>(populations: impl Iterator<Item = &'a Population>, sizes: &SizeBins) -> Population {
    Population::of_bins(populations.flat_map(|of| of.in_bins(sizes)).collect())
}

/// Replicates of all types, number by number.
fn joined(bootstrap: &Bootstrap, parts: &[Replicated], sizes: &SizeBins) -> Replicates {
    let replicates: Vec<&Replicates> = parts.iter().filter_map(|part| part.2.as_ref()).collect();
    let numbers = 0..bootstrap.replicates;
    Replicates {
        bases: numbers
            .clone()
            .map(|number| one_behind_the_other(replicates.iter().map(|of| &of.bases[of.base_of[number]]), sizes))
            .collect(),
        base_of: numbers.clone().collect(),
        densities: numbers
            .map(|number| one_behind_the_other(replicates.iter().map(|of| &of.densities[number]), sizes))
            .collect(),
        bootstrap: *bootstrap,
        slices: replicates.iter().filter_map(|of| of.slices).min(),
    }
}
