//! Unfolding: from profiles per area to particles per volume.
//!
//! A random plane cuts large particles more often than small ones and shows each at any size up to its largest. With
//! profiles counted by size (N_A, per unit area) and a kernel K that says how often a particle of each size shows as a
//! profile of each size,
//!
//! ```text
//! N_A = K N_V          K absolute, a length: the paper's H K
//! ```
//!
//! is solved for the particles N_V per unit volume. Kernels are taken as given: from `stereology-kmatrix`, or made by
//! hand as below. Results are absolute, never only a normalised histogram, and carry what is needed to judge them:
//! refolded counts, deviance, condition number, clamped bins, bias-corrected intervals, cross-checks, and [`Finding`]s
//! for the symptoms the paper names. What is not known is sought in the counts too: the largest size, a capping angle
//! ([`likely_parameter`]), fractions of types ([`unknown_fractions`]); the result states when the counts do not
//! determine them.
//!
//! # Spheres, by hand
//!
//! ```
//! use stereology_unfold::{Bootstrap, ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, divided_edges, equal_edges, unfold};
//!
//! // Reported in five bins, fitted on forty, with profiles counted in a hundred.
//! let edges = equal_edges(1.0, 5);
//! let bins = SizeBins::integrated(&divided_edges(&edges, 40, 0.0))?.reported_in(&edges)?;
//! let profile_edges = divided_edges(&edges, 100, 0.0);
//! // The fraction of a sphere's profiles below x diameters; its mean caliper is its diameter; nothing is lost at the rim.
//! let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
//! let spheres = capped_kernel(&law, 1.0, 0.0, &profile_edges, bins, std::f64::consts::PI / 6.0)?;
//!
//! let diameters = [0.31, 0.42, 0.55, 0.58, 0.66, 0.71, 0.74, 0.78, 0.79, 0.80];
//! let counts = ProfileCounts::from_sizes(&diameters, None, &profile_edges, 25.0)?;
//! let found = unfold(&counts, &spheres, &UnfoldOptions::default().with_bootstrap(Bootstrap::default()))?;
//! assert!(found.volume_fraction.value > 0.1 && found.volume_fraction.value < 0.3);
//! let interval = found.total.interval.ok_or("no interval")?;
//! assert!(interval.lower <= found.total.value && found.total.value <= interval.upper);
//! for finding in &found.findings {
//!     println!("{}: {}", finding.code, finding.message);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The paper's estimator, with missing fines left out and an interval
//!
//! ```
//! # use nalgebra::DMatrix;
//! # use stereology_unfold::{Bootstrap, Kernel, Method, ProfileCounts, SizeBins, UnfoldOptions, equal_edges, unfold};
//! # let edges = equal_edges(1.0, 5);
//! # let share = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
//! # let matrix = DMatrix::from_fn(5, 5, |i, j| edges[j + 1] * (share(edges[i + 1] / edges[j + 1]) - share(edges[i] / edges[j + 1])));
//! # let spheres = Kernel::new(matrix, SizeBins::upper_edge(&edges)?, std::f64::consts::PI / 6.0)?;
//! let counts = ProfileCounts::from_counts(&[0.0, 31.0, 64.0, 90.0, 75.0], &edges, 25.0)?;
//! let options = UnfoldOptions::default().with_method(Method::Paper).with_min_size(0.2).with_bootstrap(Bootstrap::default());
//! let found = unfold(&counts, &spheres, &options)?;
//! assert_eq!(found.number_density[0], None); // entirely below the threshold: no density
//! let interval = found.total.interval.ok_or("no interval")?;
//! assert!(interval.lower < found.total.value && found.total.value < interval.upper);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Which method
//!
//! | [`Method`] | what | when |
//! |---|---|---|
//! | [`Method::Auto`] | the smooth or the sparse estimate, by their evidence | the default; wants some 40 size bins and 100 profile bins in the kernel |
//! | [`Method::Penalised`] | penalised likelihood, smooth as the counts say | broad distributions of sizes |
//! | [`Method::Sparse`] | likelihood on as few bins as the counts support | particles of a few sizes |
//! | [`Method::Em`] | maximum of the Poisson likelihood, converged | any distribution, with its noise |
//! | [`Method::Ems`] | EM with smoothing after every step | for comparison with other programs |
//! | [`Method::Nnls`] | non-negative least squares | for comparison with other programs |
//! | [`Method::Paper`] | K⁻¹, negative densities set to zero | to repeat the paper; noise grows with the condition number (spheres 14, slender spheroids 1500) |
//!
//! Left-closed bins and histograms scaled to 1 were rejected: both are wrong by construction (the first by up to 1.6 %,
//! the second by whatever the total is wrong).

mod bootstrap;
mod capping;
mod category_labels;
mod cholesky;
mod clustering;
mod estimate;
mod estimator;
mod expectation_maximisation;
mod findings;
mod goodness;
mod grid;
mod inverse;
mod kernel;
mod largest_size;
mod log_densities;
mod nnls;
mod options;
mod particle_types;
mod penalised;
mod point_kernel;
mod population;
mod problem;
mod profile_counts;
mod profile_findings;
mod profile_law;
mod profile_likelihood;
mod quantiles;
mod size_bins;
mod size_distribution;
mod size_error;
mod sparse;
mod spikes;
mod tiling;
mod unfold_error;
mod unfolding;
mod unknown_fractions;

pub use capping::capped_kernel;
pub use category_labels::{CategoryDensity, CategoryModel, CategoryUnfolding, category_fractions, unfold_categories};
pub use clustering::{Clustering, clustering, clustering_of_slices};
pub use estimate::{CrossCheck, Estimate, Interval};
pub use findings::with_cure;
pub use grid::{fitting_edges, fitting_profile_edges, smallest_size};
pub use kernel::{Kernel, KernelError, mix_kernels};
pub use largest_size::{LargestSize, largest_size};
pub use options::{Bootstrap, Method, Resampling, UnfoldOptions};
pub use particle_types::{TypesUnfolding, unfold_types, unfold_types_with_progress};
pub use profile_counts::{ProfileCounts, ProfilesError};
pub use profile_findings::profile_findings;
pub use profile_likelihood::{LikelyParameter, likely_parameter};
pub use size_bins::{
    ReportedEdgesError, SizeBins, automatic_bins, divided_edges, equal_edges, geometric_edges, phi_edges,
};
pub use size_distribution::{Percentiles, SHARES, SizeDistribution};
pub use size_error::{measured_edges, measured_kernel, true_profile_edges};
pub use stereology_metrics::{BoundingBox, EdgeRule, EdgeWeights, EdgesError, Finding, Progress, SamplingWindow};
pub use tiling::Tiling;
pub use unfold_error::UnfoldError;
pub use unfolding::{PenaltyUsed, Unfolding, unfold, unfold_with_progress};
pub use unknown_fractions::{Fractions, unknown_fractions};
