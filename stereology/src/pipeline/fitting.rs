//! What all fits of one table of profiles have in common: size bins, threshold, capping angle, fractions of the types;
//! counts and kernels of any part of the profiles.

use std::borrow::Cow;

use crate::pipeline::section_model::reported;
use crate::pipeline::{
    Clusters, DensityError, DensityOptions, LargestParticle, LargestSize, MeasuredProfiles, ParticleTypes, Spacing,
    TypeFractions, UnfoldingBins, capping_angle, largest_particle, size_edges, type_fractions,
};
use stereology_kmatrix::Sizes;
use stereology_metrics::{Finding, Progress};
use stereology_unfold::{
    Bootstrap, CategoryModel, CategoryUnfolding, Fractions, Kernel, LikelyParameter, Method, ProfileCounts,
    UnfoldOptions, divided_edges, equal_edges, unfold, unfold_categories, with_cure,
};

/// Counted profiles of a category.
pub(crate) struct Group {
    pub(crate) category: u8,
    pub(crate) places: Vec<usize>,
}

/// Fits of one table of profiles.
pub(crate) struct Fitting<'a> {
    profiles: &'a MeasuredProfiles,
    /// The particle types with the fractions of the fit.
    pub(crate) types: Cow<'a, ParticleTypes>,
    sizes: Sizes,
    edges: Vec<f64>,
    threshold: f64,
    /// The largest size that particles may have.
    top: f64,
    angle: f64,
    bins: UnfoldingBins,
    /// The estimator, with the threshold of the fit.
    pub(crate) unfold: UnfoldOptions,
    pub(crate) clusters: Clusters,
    /// What was chosen or estimated before the fit.
    pub(crate) settled: Settled,
}

/// What was chosen or estimated from the profiles before the densities were fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settled {
    /// The largest particle size; `None` if the edges of the bins were given.
    pub largest: Option<LargestParticle>,
    /// The search for the capping angle (radians), if there was one.
    pub capping: Option<LikelyParameter>,
    /// The estimated fractions of the particle types, if they were unknown.
    pub fractions: Option<Fractions>,
    /// The requested number of bins, if it was reduced to the number of counted profiles.
    pub reduced_from: Option<usize>,
}

impl<'a> Fitting<'a> {
    pub(crate) fn new(
        profiles: &'a MeasuredProfiles,
        types: &'a ParticleTypes,
        options: &DensityOptions,
    ) -> Result<Self, DensityError> {
        let places = profiles.counted()?;
        let counted = places.len();
        let mut settled = Settled::default();
        let limit = options.unfold.min_size.unwrap_or(profiles.min_size);
        let edges = if let Some(edges) = &options.edges {
            edges.clone()
        } else {
            let observed = with_threshold(&options.unfold, limit);
            let largest = largest_particle(profiles, types, options.max_size, &observed)?;
            let size = largest.size;
            settled.largest = Some(largest);
            let edges = size_edges(profiles, size, options)?;
            let bins = edges.len() - 1;
            if options.spacing == Spacing::Equal && bins > counted {
                settled.reduced_from = Some(bins);
                equal_edges(edges[bins], counted)
            } else {
                edges
            }
        };
        let threshold = settled_threshold(&edges, limit);
        // Measured with an error, the largest profile is larger than the largest particle rather than smaller.
        let largest = settled.largest.as_ref().filter(|_| profiles.size_error <= 0.0);
        let top = largest_possible(&edges, largest);
        let unfold = with_threshold(&options.unfold, threshold);
        let (angle, capping) = capping_angle(profiles, types, options.capping, &edges, &unfold)?;
        settled.capping = capping;
        let mut types = Cow::Borrowed(types);
        if options.fractions == TypeFractions::Likelihood {
            let found = type_fractions(profiles, &types, &edges, &unfold)?;
            types = Cow::Owned(types.into_owned().with_shares(&found.fractions)?);
            settled.fractions = Some(found);
        }
        let clusters = Clusters::of(profiles, &places, options.unfold.bootstrap.as_ref());
        Ok(Self {
            bins: types
                .unfolding_bins(
                    &edges,
                    profiles.smallest(),
                    threshold,
                    top,
                    unfold.method,
                    options.sizes,
                )
                .with_size_error(profiles.size_error, profiles.smallest(), threshold),
            top,
            profiles,
            types,
            sizes: options.sizes,
            edges,
            threshold,
            angle,
            unfold: clusters.resampling.map_or(unfold, |resampling| UnfoldOptions {
                bootstrap: unfold.bootstrap.map(|of| Bootstrap { resampling, ..of }),
                ..unfold
            }),
            clusters,
            settled,
        })
    }

    /// Counts of the profiles at `places`, and the kernel of one type, or of all types in their fractions.
    pub(crate) fn part(&self, places: &[usize], of: Option<usize>) -> Result<(ProfileCounts, Kernel), DensityError> {
        Ok((
            self.counts(places, &self.bins)?,
            self.kernel(of, &self.bins, &self.edges)?,
        ))
    }

    /// [`part`](Self::part) unfolded, with the densities split by the categories of `groups`.
    pub(crate) fn categories(
        &self,
        places: &[usize],
        groups: &[Group],
        of: Option<usize>,
        model: CategoryModel,
        progress: Progress<'_>,
    ) -> Result<CategoryUnfolding, DensityError> {
        let (counts, kernel) = self.part(places, of)?;
        let labelled = groups
            .iter()
            .map(|group| {
                let places = of.map_or_else(|| group.places.clone(), |kind| self.of_type(&group.places, kind));
                if places.is_empty() {
                    return Ok(counts.without_profiles());
                }
                self.counts(&places, &self.bins)
            })
            .collect::<Result<Vec<_>, DensityError>>()?;
        Ok(unfold_categories(
            &counts,
            &labelled,
            model,
            &kernel,
            &self.unfold,
            progress,
        )?)
    }

    /// Those of the profiles at `places` that are of a type.
    pub(crate) fn of_type(&self, places: &[usize], kind: usize) -> Vec<usize> {
        let of_type = |i: &usize| self.profiles.types[*i] == kind;
        places.iter().copied().filter(of_type).collect()
    }

    /// Whether any of the profiles at `places` is above the threshold.
    pub(crate) fn observed(&self, places: &[usize]) -> bool {
        let threshold = self.unfold.min_size.unwrap_or(0.0);
        places.iter().any(|&i| self.profiles.sizes[i] > threshold)
    }

    fn counts(&self, places: &[usize], bins: &UnfoldingBins) -> Result<ProfileCounts, DensityError> {
        let of = self.profiles;
        let sizes: Vec<f64> = places.iter().map(|&i| of.sizes[i]).collect();
        let weights: Vec<f64> = places.iter().map(|&i| of.weights[i]).collect();
        if let Some(tiling) = &self.clusters.tiling {
            let points: Vec<[f64; 2]> = places.iter().map(|&i| of.positions[i]).collect();
            let edges = &bins.profile_edges;
            return Ok(ProfileCounts::from_tiles(
                &sizes,
                Some(&weights),
                &points,
                tiling,
                edges,
                of.area,
            )?);
        }
        if of.slices.is_empty() {
            return Ok(ProfileCounts::from_sizes(
                &sizes,
                Some(&weights),
                &bins.profile_edges,
                of.area,
            )?);
        }
        let slices: Vec<usize> = places.iter().map(|&i| of.slices[i]).collect();
        let counts = ProfileCounts::from_slices(&sizes, Some(&weights), &slices, &bins.profile_edges, of.area)?;
        // A part may have no profiles on the last slices, which count nevertheless.
        Ok(counts.with_slices(of.slices.iter().max().map_or(0, |last| last + 1)))
    }

    fn kernel(&self, of: Option<usize>, bins: &UnfoldingBins, edges: &[f64]) -> Result<Kernel, DensityError> {
        let kernel = match of {
            None => self.types.capped_kernel(self.angle, bins, self.sizes)?,
            Some(index) => self.types.only(index).capped_kernel(self.angle, bins, self.sizes)?,
        };
        reported(kernel, edges)
    }

    /// Findings of [`part`](Self::part) in fewer equal bins.
    fn in_fewer(&self, bins: usize, places: &[usize], of: Option<usize>) -> Vec<Finding> {
        let edges = equal_edges(self.edges[self.edges.len() - 1], bins);
        let bins = self.types.unfolding_bins(
            &edges,
            self.profiles.smallest(),
            self.threshold,
            self.top,
            self.unfold.method,
            self.sizes,
        );
        let bins = bins.with_size_error(self.profiles.size_error, self.profiles.smallest(), self.threshold);
        let options = UnfoldOptions {
            bootstrap: None,
            ..self.unfold
        };
        let found = || {
            let kernel = self.kernel(of, &bins, &edges)?;
            Ok::<_, DensityError>(unfold(&self.counts(places, &bins)?, &kernel, &options)?.findings)
        };
        found().unwrap_or_default()
    }

    /// Findings of [`part`](Self::part) with the number of bins that avoids them.
    pub(crate) fn cured(&self, findings: &[Finding], places: &[usize], of: Option<usize>) -> Vec<Finding> {
        let in_fewer = |bins: usize| self.in_fewer(bins, places, of);
        let bins = self.edges.len() - 1;
        findings
            .iter()
            .map(|finding| with_cure(finding, bins, &in_fewer))
            .collect()
    }

    /// Edges for histograms of profiles: the reported bins in halves, with an edge at the threshold; finer bins would
    /// be too noisy with some hundred profiles. `None` where the fit has no finer bins.
    pub(crate) fn histogram_edges(&self) -> Option<Vec<f64>> {
        let finer = self.unfold.method != Method::Paper;
        finer.then(|| divided_edges(&self.edges, 2 * (self.edges.len() - 1), self.threshold))
    }
}

/// The options with this threshold (0: none).
fn with_threshold(options: &UnfoldOptions, threshold: f64) -> UnfoldOptions {
    UnfoldOptions {
        min_size: (threshold > 0.0).then_some(threshold),
        ..*options
    }
}

/// The largest size that particles may have: larger than the last edge if that is only the largest profile, which is
/// rarely one of the largest particle's largest profiles.
fn largest_possible(edges: &[f64], largest: Option<&LargestParticle>) -> f64 {
    let last = edges.last().copied().unwrap_or(0.0);
    let observed = largest.filter(|of| of.method == LargestSize::Profile && (of.size - last).abs() <= 1e-9 * last);
    observed.map_or(last, |of| BEYOND * of.size)
}

/// No particle is larger than this times the largest profile. For lognormal sizes of σ = 1 and 200 profiles a larger
/// factor changes the volume fraction by less than its standard error.
const BEYOND: f64 = 1.5;

/// The threshold, raised to the upper edge of its bin if that edge is less than [`OBSERVED`] times the threshold.
///
/// A section of a sphere of diameter D is larger than t with probability √(1 − (t / D)²). Where that is small, few
/// profiles constrain the density, which is then ill-determined.
fn settled_threshold(size_edges: &[f64], threshold: f64) -> f64 {
    let bin = size_edges
        .windows(2)
        .find(|bin| bin[0] < threshold && threshold < bin[1]);
    match bin {
        // Above the last edge there are no particles.
        Some(bin) if bin[1] < OBSERVED * threshold && Some(&bin[1]) != size_edges.last() => bin[1],
        _ => threshold,
    }
}

/// At 1.5 times the threshold three quarters of a sphere's profiles are observed.
const OBSERVED: f64 = 1.5;
