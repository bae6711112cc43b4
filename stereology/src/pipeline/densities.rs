//! From measured profiles to particles per volume, colour category by colour category where size and colour go together.

use crate::pipeline::association::{Association, association};
use crate::pipeline::{
    Capping, LargestSize, ParticleTypes, ParticleTypesError, Warning, capping_angle, largest_particle,
};
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Finding, Kernel, Method, ProfileCounts, ProfilesError, UnfoldError, UnfoldOptions, Unfolding, automatic_bins,
    divided_edges, equal_edges, unfold, unfold_with_progress,
};

/// What was measured on the photograph: one entry a profile in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredProfiles {
    /// Diameters of the circles of their areas; lengths.
    pub sizes: Vec<f64>,
    /// How much each counts: 0 outside the counting frame.
    pub weights: Vec<f64>,
    /// Colour categories, from 0.
    pub categories: Vec<u8>,
    /// Slices they are on, from 0, one a profile; empty if there is one slice, or it is not known.
    pub slices: Vec<usize>,
    /// Area examined; length squared.
    pub area: f64,
    /// Profiles up to this size are lost.
    pub min_size: f64,
}

/// How to unfold them.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityOptions {
    /// Size bins between 0 and the largest size; 0: as many as the profiles bear ([`automatic_bins`]).
    pub bins: usize,
    /// Edges of the size bins instead.
    pub edges: Option<Vec<f64>>,
    /// Largest particle size; by default that of the largest counted profile.
    pub max_size: LargestSize,
    /// Profiles lost at the rims of particles.
    pub capping: Capping,
    /// Where in a bin its particles' sizes lie.
    pub sizes: Sizes,
    /// The estimator, its threshold and intervals. Without a threshold that of the profiles is used.
    pub unfold: UnfoldOptions,
}

impl Default for DensityOptions {
    /// 16 bins (ten leave steps in the profile sizes of the sections), sizes spread over them, the default estimator without intervals.
    fn default() -> Self {
        Self {
            bins: 16,
            edges: None,
            max_size: LargestSize::Profile,
            capping: Capping::None,
            sizes: Sizes::Integrated,
            unfold: UnfoldOptions::default(),
        }
    }
}

/// Particles per volume, all together and by category.
#[derive(Clone, Debug)]
pub struct ParticleDensities {
    /// All particles together.
    pub all: Unfolding,
    /// Number density by category and size bin, to populate a solid with; `None` in bins wholly below the threshold. Category c is entry c.
    pub by_category: Vec<Vec<Option<f64>>>,
    /// Whether size and colour go together.
    pub association: Association,
    /// Where in a bin its particles' sizes lie.
    pub sizes: Sizes,
    /// Edges of the bins in which `all.observed` and `all.refolded` count profiles.
    pub profile_edges: Vec<f64>,
}

/// Profiles that cannot be unfolded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DensityError {
    /// No profile counts.
    #[error(
        "no profile counts: all {0} lie outside the counting frame or touch the edge; take a larger photograph or --edge-rule all"
    )]
    NoProfiles(usize),
    /// The profiles.
    #[error(transparent)]
    Profiles(#[from] ProfilesError),
    /// The types of particle.
    #[error(transparent)]
    Types(#[from] ParticleTypesError),
    /// The unfolding.
    #[error(transparent)]
    Unfold(#[from] UnfoldError),
}

/// Unfolds the profiles with the kernel of `types`.
///
/// Where sizes differ between colour categories (Kruskal-Wallis, p below 0.01) each category is unfolded by itself on common edges, section 4.2;
/// else all share one distribution and each category has its share of the profiles.
///
/// # Errors
///
/// [`DensityError`]: nothing to count, sizes beyond the largest, bad bins, a cancelled run.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, particle_densities};
///
/// // Cuts through spheres of diameter 10, at evenly spread depths: N_A = D N_V.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], slices: vec![], area: 1e5, min_size: 0.0, sizes };
/// let options = DensityOptions { bins: 5, ..DensityOptions::default() };
/// let found = particle_densities(&profiles, &ParticleTypes::parse(&["sphere"])?, &options, &|_| ControlFlow::Continue(()))?;
/// assert!((found.all.total.value / (300.0 / 1e5 / 10.0) - 1.0).abs() < 0.15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn particle_densities(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    options: &DensityOptions,
    progress: stereology_unfold::Progress<'_>,
) -> Result<ParticleDensities, DensityError> {
    let counted = |i: &usize| profiles.weights[*i] > 0.0;
    let places: Vec<usize> = (0..profiles.sizes.len()).filter(counted).collect();
    if places.is_empty() {
        return Err(DensityError::NoProfiles(profiles.sizes.len()));
    }
    let edges = match &options.edges {
        Some(edges) => edges.clone(),
        None => {
            let (largest, _) = largest_particle(profiles, types, options.max_size, &options.unfold)?;
            let counted: Vec<f64> = places.iter().map(|&i| profiles.sizes[i]).collect();
            let bins = match options.bins {
                0 => automatic_bins(&counted, largest, MOST_BINS),
                bins => bins,
            };
            equal_edges(largest, bins)
        }
    };
    let threshold = settled_threshold(&edges, options.unfold.min_size.unwrap_or(profiles.min_size));
    let unfolding = UnfoldOptions {
        min_size: (threshold > 0.0).then_some(threshold),
        ..options.unfold
    };
    let fit_bins = types.unfolding_bins(&edges, threshold, options.unfold.method, options.sizes);
    let (angle, _) = capping_angle(profiles, types, options.capping, &edges, &unfolding)?;
    let kernel = reported(types.capped_kernel(angle, &fit_bins, options.sizes)?, &edges)?;
    let unfold_these = |places: &[usize], options: &UnfoldOptions| {
        let sizes: Vec<f64> = places.iter().map(|&i| profiles.sizes[i]).collect();
        let weights: Vec<f64> = places.iter().map(|&i| profiles.weights[i]).collect();
        let counts = if profiles.slices.is_empty() {
            ProfileCounts::from_sizes(&sizes, Some(&weights), &fit_bins.profile_edges, profiles.area)?
        } else {
            let slices: Vec<usize> = places.iter().map(|&i| profiles.slices[i]).collect();
            ProfileCounts::from_slices(&sizes, Some(&weights), &slices, &fit_bins.profile_edges, profiles.area)?
        };
        Ok::<_, DensityError>(unfold_with_progress(&counts, &kernel, options, progress)?)
    };
    let mut all = unfold_these(&places, &unfolding)?;
    // What the findings would be in fewer bins, to name the number that cures them.
    let in_fewer = |bins: usize| -> Vec<Finding> {
        let edges = equal_edges(edges[edges.len() - 1], bins);
        let bins = types.unfolding_bins(&edges, threshold, unfolding.method, options.sizes);
        let found = || {
            let kernel = types.capped_kernel(angle, &bins, options.sizes)?;
            let sizes: Vec<f64> = places.iter().map(|&i| profiles.sizes[i]).collect();
            let weights: Vec<f64> = places.iter().map(|&i| profiles.weights[i]).collect();
            let counts = ProfileCounts::from_sizes(&sizes, Some(&weights), &bins.profile_edges, profiles.area)?;
            let options = UnfoldOptions {
                bootstrap: None,
                ..unfolding
            };
            Ok::<_, DensityError>(unfold(&counts, &reported(kernel, &edges)?, &options)?.findings)
        };
        found().unwrap_or_default()
    };
    let bins = edges.len() - 1;
    if unfolding.method != Method::Paper {
        all.rebin_profiles(&histogram_edges(&edges, threshold));
    }
    let profile_edges = all.profile_edges.clone();
    all.findings = all
        .findings
        .iter()
        .map(|finding| finding.with_cure(bins, &in_fewer))
        .collect();

    let of_category = |category: usize| -> Vec<usize> {
        places
            .iter()
            .copied()
            .filter(|&i| usize::from(profiles.categories[i]) == category)
            .collect()
    };
    let categories = places
        .iter()
        .map(|&i| usize::from(profiles.categories[i]) + 1)
        .max()
        .unwrap_or(1);
    let groups: Vec<Vec<usize>> = (0..categories).map(of_category).collect();
    let sizes_of = |group: &Vec<usize>| group.iter().map(|&i| profiles.sizes[i]).collect::<Vec<f64>>();
    let association = association(&groups.iter().map(sizes_of).collect::<Vec<_>>());
    let without_intervals = UnfoldOptions {
        bootstrap: None,
        ..unfolding
    };
    let weight_of = |group: &[usize]| group.iter().map(|&i| profiles.weights[i]).sum::<f64>();
    let whole = weight_of(&places);
    let by_category = groups
        .iter()
        .map(|group| {
            if association.together && !group.is_empty() {
                return Ok(unfold_these(group, &without_intervals)?.number_density);
            }
            let share = weight_of(group) / whole;
            Ok(all
                .number_density
                .iter()
                .map(|density| density.map(|n| n * share))
                .collect())
        })
        .collect::<Result<_, DensityError>>()?;
    Ok(ParticleDensities {
        all,
        by_category,
        association,
        sizes: options.sizes,
        profile_edges,
    })
}

/// The reported bins cut in halves, with an edge at the threshold: as fine as a histogram of some hundred profiles can be.
fn histogram_edges(edges: &[f64], threshold: f64) -> Vec<f64> {
    divided_edges(edges, 2 * (edges.len() - 1), threshold)
}

/// The bins of a fit: profile bins fine enough that hardly anything of the profiles is lost, size bins fine enough for a smooth density, both with an edge
/// at the threshold. The paper's inverse needs a square kernel, the particles' own bins; sizes all at their bins' upper edges have no finer ones.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfoldingBins {
    /// Edges of the profile bins.
    pub profile_edges: Vec<f64>,
    /// Edges of the size bins of the kernel; those of the reported bins are among them.
    pub size_edges: Vec<f64>,
}

/// A hundred profile bins or more lose nothing that shows in the densities.
const PROFILE_BINS: usize = 100;
/// More bins than this are not chosen automatically.
const MOST_BINS: usize = 50;
/// Forty size bins or more make the smooth estimate as smooth as can be seen.
const SIZE_BINS: usize = 40;

impl UnfoldingBins {
    /// Bins for densities in the bins between `edges`, from a threshold (0: none) on.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::UnfoldingBins, unfold::Method};
    /// let bins = UnfoldingBins::new(&[0.0, 0.5, 1.0], 0.0, Method::Auto, Sizes::Integrated);
    /// assert_eq!((bins.profile_edges.len(), bins.size_edges.len()), (101, 41));
    /// ```
    #[must_use]
    pub fn new(edges: &[f64], threshold: f64, method: Method, sizes: Sizes) -> Self {
        if method == Method::Paper {
            return Self {
                profile_edges: edges.to_vec(),
                size_edges: edges.to_vec(),
            };
        }
        Self {
            profile_edges: divided_edges(edges, PROFILE_BINS, threshold),
            size_edges: match sizes {
                Sizes::Integrated => divided_edges(edges, SIZE_BINS, threshold),
                Sizes::UpperEdge => edges.to_vec(),
            },
        }
    }
}

/// The highest profile bin is widened until it holds this share of the profiles of the largest particles. A body's largest section may hardly ever be met (for
/// a mesh: never, by any plane that was tried), and a profile there would not be explained, or count for far too many particles.
const TOP_SHARE: f64 = 0.01;

impl ParticleTypes {
    /// [`UnfoldingBins::new`] with the highest profile bin so wide that every type shows profiles in it.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::ParticleTypes, unfold::Method};
    /// let edges = [0.0, 0.5, 1.0];
    /// let top = |shape: &str| {
    ///     let bins = ParticleTypes::parse(&[shape])?.unfolding_bins(&edges, 0.0, Method::Auto, Sizes::Integrated);
    ///     Ok::<_, stereology::pipeline::ParticleTypesError>(bins.profile_edges[bins.profile_edges.len() - 2])
    /// };
    /// assert_eq!(top("sphere")?, 0.99);
    /// assert!(top("box:1,1,2")? < 0.99); // hardly ever cut through two opposite edges
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    #[must_use]
    pub fn unfolding_bins(&self, edges: &[f64], threshold: f64, method: Method, sizes: Sizes) -> UnfoldingBins {
        let mut bins = UnfoldingBins::new(edges, threshold, method, sizes);
        let (Some(&largest), false) = (edges.last(), method == Method::Paper) else {
            return bins;
        };
        let shown = |edge: f64| {
            let shares = self.types().iter().map(|of| 1.0 - of.law().cdf(edge / largest));
            shares.fold(1.0, f64::min) >= TOP_SHARE
        };
        let inner = bins.profile_edges.len() - 1;
        let kept = (1..inner).rev().find(|&k| shown(bins.profile_edges[k])).unwrap_or(0);
        bins.profile_edges.drain(kept + 1..inner);
        bins
    }
}

/// The kernel with its bins summed to those between `edges`.
pub(crate) fn reported(kernel: Kernel, edges: &[f64]) -> Result<Kernel, DensityError> {
    kernel
        .reported_in(edges)
        .map_err(|error| DensityError::Unfold(UnfoldError::Edges(error)))
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

impl ParticleDensities {
    /// Number density of a size bin, the categories added up; `None` below the threshold.
    #[must_use]
    pub fn combined(&self, bin: usize) -> Option<f64> {
        let known: Vec<f64> = self.by_category.iter().filter_map(|category| category[bin]).collect();
        (!known.is_empty()).then(|| known.iter().sum())
    }

    /// What a reader should know.
    #[must_use]
    pub fn warnings(&self) -> Vec<Warning> {
        self.all
            .findings
            .iter()
            .map(|finding| Warning::new(finding.code(), finding.to_string()))
            .collect()
    }
}
