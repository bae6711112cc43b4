//! What a computation reports about itself and about its result.
//!
//! | question | items | feature |
//! |---|---|---|
//! | What should the reader of a result know? | [`Finding`] | |
//! | How far is a long computation, and should it go on? | [`Progress`] | |
//! | Are these edges of size bins valid? | [`check_edges`], [`EdgesError`] | |
//! | How different are two samples of a quantity? | [`wasserstein`], [`wasserstein_sorted`], [`wasserstein_of_bins`] | |
//! | Do several groups have the same distribution? | [`kruskal_wallis`] | `ranks` |
//! | How well do found labels match the true ones? | [`label_scores`] | `images` |
//! | How are the points of a phase arranged? | [`two_point`], [`lineal_path`], [`chord_lengths`], [`local_porosity`] | `images` |
//! | How much surface, and how many components and holes, has a phase? | [`planar_functionals`], [`spatial_functionals`] | `images` |
//! | What texture does an image have? | [`moments`], [`mean_gradient`], [`orientation_field`], [`fringes`], [`sliced_wasserstein`] | `images` |
//! | How similar are the slices of a solid to an exemplar? | [`compare`] | `images` |
//! | Are blocks of its slices distinguishable from blocks of the exemplar? | [`block_test`], [`classifier_test`] | `images` |
//! | How did a figure turn out? | [`Level`] | |
//! | Where does a synthesised solid come from? | [`copying`], [`seams`] | `images` |
//!
//! Every crate of the project describes remarks on its result as [`Finding`]s, accepts a [`Progress`] callback for long
//! work, and checks the edges of size bins with [`check_edges`], so that a program that combines several crates handles
//! one type of each. Both features are on by default; without them the crate needs `thiserror` alone.
//!
//! The measures do not depend on how a solid was made. Images are `ndarray` arrays (row, column, channel) with values
//! from 0 to 1, volumes (z, y, x, channel).
//!
//! # Examples
//!
//! ```
//! use stereology_metrics::{EdgesError, check_edges};
//!
//! assert_eq!(check_edges(&[0.0, 1.0, 2.0]), Ok(()));
//! assert_eq!(check_edges(&[0.0, 2.0, 2.0]), Err(EdgesError::NotIncreasing { index: 2 }));
//! ```
//!
//! The mean distance by which one sample must be moved to become another:
//!
//! ```
//! use stereology_metrics::wasserstein_sorted;
//!
//! assert_eq!(wasserstein_sorted(&[0.0, 1.0, 2.0], &[1.0, 2.0, 3.0]), 1.0);
//! ```

mod edge_rule;
mod edges;
mod finding;
mod level;
mod progress;
mod wasserstein;

pub use edge_rule::{BoundingBox, EdgeRule, EdgeWeights, SamplingWindow};
#[cfg(feature = "images")]
mod blocks;
#[cfg(feature = "images")]
mod comparison;
#[cfg(feature = "images")]
mod copying;
#[cfg(feature = "ranks")]
mod kruskal_wallis;
#[cfg(feature = "images")]
mod label_scores;
#[cfg(feature = "images")]
mod phase;
#[cfg(feature = "images")]
mod seams;
#[cfg(feature = "images")]
mod slices;
#[cfg(feature = "images")]
mod texture;

#[cfg(feature = "images")]
pub use blocks::{BlockSource, BlockTest, ClassifierTest, FeatureMeans, block_test, classifier_test};
#[cfg(feature = "images")]
pub use comparison::{
    Comparison, Curves, Figure, FringeBand, FringeFilter, MeasureError, MeasureOptions, check_images, compare,
};
#[cfg(feature = "images")]
pub use copying::{Copying, copying};
pub use edges::{EdgesError, check_edges};
pub use finding::Finding;
#[cfg(feature = "ranks")]
pub use kruskal_wallis::{KruskalWallis, kruskal_wallis};
#[cfg(feature = "images")]
pub use label_scores::{LabelMapsDiffer, LabelScores, label_scores};
pub use level::Level;
#[cfg(feature = "images")]
pub use phase::{
    Chords, PlanarFunctionals, SpatialFunctionals, chord_lengths, lineal_path, local_porosity, planar_functionals,
    radial_mean, spatial_functionals, two_point,
};
pub use progress::Progress;
#[cfg(feature = "images")]
pub use seams::{Seams, seams};
#[cfg(feature = "images")]
pub use slices::{Family, FamilyError, largest_rectangle, sections, sections_inside};
#[cfg(feature = "images")]
pub use texture::{
    Fringes, LevelCurve, Moments, OrientationField, Patches, fringes, grey, histogram, kl_divergence, level_curves,
    mean_gradient, moments, orientation_field, sliced_wasserstein,
};
pub use wasserstein::{wasserstein, wasserstein_of_bins, wasserstein_sorted};
