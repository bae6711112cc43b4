//! What all fits of one table of profiles share: size bins, threshold, capping angle; counts and kernels of any part of the profiles.

use crate::pipeline::densities::reported;
use crate::pipeline::{
    DensityError, DensityOptions, MeasuredProfiles, ParticleTypes, UnfoldingBins, capping_angle, largest_particle,
    size_edges,
};
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Finding, Kernel, Method, ProfileCounts, UnfoldOptions, divided_edges, equal_edges, unfold, with_cure,
};

/// Fits of one table of profiles.
pub(crate) struct Fitting<'a> {
    profiles: &'a MeasuredProfiles,
    types: &'a ParticleTypes,
    sizes: Sizes,
    edges: Vec<f64>,
    threshold: f64,
    angle: f64,
    bins: UnfoldingBins,
    /// The estimator, with the threshold that is used.
    pub(crate) unfold: UnfoldOptions,
}

impl<'a> Fitting<'a> {
    pub(crate) fn new(
        profiles: &'a MeasuredProfiles,
        types: &'a ParticleTypes,
        options: &DensityOptions,
    ) -> Result<Self, DensityError> {
        if profiles.weights.iter().all(|weight| *weight <= 0.0) {
            return Err(DensityError::NoProfiles(profiles.sizes.len()));
        }
        let edges = match &options.edges {
            Some(edges) => edges.clone(),
            None => {
                let (largest, _) = largest_particle(profiles, types, options.max_size, &options.unfold)?;
                size_edges(profiles, largest, options)?
            }
        };
        let threshold = settled_threshold(&edges, options.unfold.min_size.unwrap_or(profiles.min_size));
        let unfold = UnfoldOptions {
            min_size: (threshold > 0.0).then_some(threshold),
            ..options.unfold
        };
        let (angle, _) = capping_angle(profiles, types, options.capping, &edges, &unfold)?;
        Ok(Self {
            bins: types.unfolding_bins(&edges, threshold, unfold.method, options.sizes),
            profiles,
            types,
            sizes: options.sizes,
            edges,
            threshold,
            angle,
            unfold,
        })
    }

    /// Profiles that count.
    pub(crate) fn counted(&self) -> Vec<usize> {
        (0..self.profiles.sizes.len())
            .filter(|&i| self.profiles.weights[i] > 0.0)
            .collect()
    }

    /// Counts of the profiles at `places`, and the kernel of a type, or of all in their shares.
    pub(crate) fn part(&self, places: &[usize], of: Option<usize>) -> Result<(ProfileCounts, Kernel), DensityError> {
        Ok((
            self.counts(places, &self.bins)?,
            self.kernel(of, &self.bins, &self.edges)?,
        ))
    }

    fn counts(&self, places: &[usize], bins: &UnfoldingBins) -> Result<ProfileCounts, DensityError> {
        let of = self.profiles;
        let sizes: Vec<f64> = places.iter().map(|&i| of.sizes[i]).collect();
        let weights: Vec<f64> = places.iter().map(|&i| of.weights[i]).collect();
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
        // A part may have nothing on the last slices; they are slices all the same.
        Ok(counts.with_slices(of.slices.iter().max().map_or(0, |last| last + 1)))
    }

    fn kernel(&self, of: Option<usize>, bins: &UnfoldingBins, edges: &[f64]) -> Result<Kernel, DensityError> {
        let kernel = match of {
            None => self.types.capped_kernel(self.angle, bins, self.sizes)?,
            Some(index) => self.types.only(index).capped_kernel(self.angle, bins, self.sizes)?,
        };
        reported(kernel, edges)
    }

    /// What [`part`](Self::part)'s findings would be in fewer equal bins.
    fn in_fewer(&self, bins: usize, places: &[usize], of: Option<usize>) -> Vec<Finding> {
        let edges = equal_edges(self.edges[self.edges.len() - 1], bins);
        let bins = self
            .types
            .unfolding_bins(&edges, self.threshold, self.unfold.method, self.sizes);
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

    /// Findings of [`part`](Self::part) that name the number of bins that cures them.
    pub(crate) fn cured(&self, findings: &[Finding], places: &[usize], of: Option<usize>) -> Vec<Finding> {
        let in_fewer = |bins: usize| self.in_fewer(bins, places, of);
        let bins = self.edges.len() - 1;
        findings
            .iter()
            .map(|finding| with_cure(finding, bins, &in_fewer))
            .collect()
    }

    /// Edges for histograms of profiles: the reported bins cut in halves, with an edge at the threshold, as fine as a histogram of some hundred profiles can
    /// be. `None` where the fit has no finer ones.
    pub(crate) fn histogram_edges(&self) -> Option<Vec<f64>> {
        let finer = self.unfold.method != Method::Paper;
        finer.then(|| divided_edges(&self.edges, 2 * (self.edges.len() - 1), self.threshold))
    }
}

/// The threshold, raised to the upper edge of its bin if that edge is less than [`SEEN`] times the threshold: a plane that cuts a sphere of diameter D shows it
/// above t with probability √(1 − (t / D)²), and where that is small hardly any profile tells of such particles and their density would be anything.
fn settled_threshold(size_edges: &[f64], threshold: f64) -> f64 {
    let bin = size_edges
        .windows(2)
        .find(|bin| bin[0] < threshold && threshold < bin[1]);
    match bin {
        // Above the last edge there is nothing.
        Some(bin) if bin[1] < SEEN * threshold && Some(&bin[1]) != size_edges.last() => bin[1],
        _ => threshold,
    }
}

/// At this many thresholds three quarters of a sphere's profiles are seen.
const SEEN: f64 = 1.5;
