//! From measured profiles to particles per volume, colour category by colour category where size and colour go together.

use crate::pipeline::association::{Association, association};
use crate::pipeline::fitting::Fitting;
use crate::pipeline::{Capping, LargestSize, ParticleTypes, ParticleTypesError, Spacing, Warning};
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Kernel, Method, ProfilesError, UnfoldError, UnfoldOptions, Unfolding, divided_edges, unfold, unfold_with_progress,
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
    /// Types of the particles they are cuts of, from 0, one a profile; empty if it is not known.
    pub types: Vec<usize>,
    /// Area examined; length squared.
    pub area: f64,
    /// Profiles up to this size are lost.
    pub min_size: f64,
}

/// How to unfold them.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityOptions {
    /// Size bins between 0 and the largest size; 0: as many as the profiles bear ([`automatic_bins`](stereology_unfold::automatic_bins)).
    pub bins: usize,
    /// How they are spaced.
    pub spacing: Spacing,
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
            spacing: Spacing::Equal,
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
    /// Geometric bins of sizes that do not bear them.
    #[error(
        "bins of equal ratio need two or more of them, and sizes that differ (smallest {smallest}, largest {largest}): give both sizes, or take equal bins"
    )]
    Spacing {
        /// The smallest size.
        smallest: f64,
        /// The largest.
        largest: f64,
    },
    /// A type there is no body for, or a type without profiles.
    #[error("{0}")]
    Labels(String),
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
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
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
    let fitting = Fitting::new(profiles, types, options)?;
    let places = fitting.counted();
    let (counts, kernel) = fitting.part(&places, None)?;
    let mut all = unfold_with_progress(&counts, &kernel, &fitting.unfold, progress)?;
    all.findings = fitting.cured(&all.findings, &places, None);
    if let Some(edges) = fitting.histogram_edges() {
        all.rebin_profiles(&edges);
    }
    let profile_edges = all.profile_edges.clone();
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
        ..fitting.unfold
    };
    let weight_of = |group: &[usize]| group.iter().map(|&i| profiles.weights[i]).sum::<f64>();
    let whole = weight_of(&places);
    let by_category = groups
        .iter()
        .map(|group| {
            if association.together && !group.is_empty() {
                let (counts, kernel) = fitting.part(group, None)?;
                return Ok(unfold(&counts, &kernel, &without_intervals)?.number_density);
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
        .map_err(|error| DensityError::Unfold(UnfoldError::Reported(error)))
}

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
            .map(|finding| Warning::new(finding.code, finding.message.clone()))
            .collect()
    }
}
