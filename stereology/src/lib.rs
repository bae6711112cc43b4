//! From a photograph of a cut through a material to the solid it came from.
//!
//! Classical stereology turns a photograph of particles in a binder (terrazzo, concrete, igneous rock, foam) into a
//! solid: profiles are segmented, their sizes are unfolded to particles per volume, such particles are packed into a
//! periodic box, coloured, and given the fine residual texture of the photograph (Jagnow, Dorsey & Rushmeier 2004).
//! Each step is a crate of its own, re-exported here behind a feature of the same name:
//!
//! | module | question |
//! |---|---|
//! | [`shape`] | What are the volume, width and sections of this particle? |
//! | [`grid`] | How do I write arrays to files that other programs read? |
//! | [`spectrum`] | Which frequencies does a field contain? |
//! | [`imaging`] | Which pixels are connected, how far is each from the next region, what is its colour in Lab? |
//! | [`kmatrix`] | What profile sizes does a random section through a body give? |
//! | [`unfold`] | How many particles per volume gave these profiles per area? |
//! | [`segment`] | Where are the profiles in a photograph? |
//! | [`anneal`] | How can particles be packed without overlap, and what proves it? |
//! | [`pyramid`] | What texture looks like this one? |
//! | [`volume`] | What is the colour at this point of the solid? |
//! | [`render`] | What does the solid look like? |
//! | [`metrics`] | How similar are two samples, label maps or textures? |
//! | [`exemplar`] | Which solid has slices like this image? |
//! | [`grow`] | Which stone fills a mesh and agrees with measurements? |
//! | [`microgeometry`] | Which relief on this mesh has the contact distribution of that picture? |
//!
//! The feature `pipeline` (default) adds [`pipeline`], which combines them, and [`files`], which reads and writes their
//! results.
//!
//! # Examples
//!
//! How many spheres per volume gave these profiles?
//!
//! ```
//! use stereology::pipeline::ParticleTypes;
//! use stereology::kmatrix::Sizes;
//! use stereology::unfold::{ProfileCounts, UnfoldOptions, equal_edges, unfold};
//!
//! let edges = equal_edges(1.0, 5);
//! let kernel = ParticleTypes::parse(&["sphere"])?.kernel(&edges, &edges, Sizes::Integrated)?;
//! let sizes = [0.31, 0.42, 0.55, 0.58, 0.66, 0.71, 0.74, 0.78, 0.79, 0.80];
//! let counts = ProfileCounts::from_sizes(&sizes, None, &edges, 25.0)?;
//! let densities = unfold(&counts, &kernel, &UnfoldOptions::default())?;
//! assert!((densities.total.value - 0.55).abs() < 0.15); // 10 / 25 profiles per area over a mean diameter of about .75
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "pipeline")]
pub mod files;
#[cfg(feature = "pipeline")]
pub mod pipeline;
#[cfg(feature = "pipeline")]
pub mod renderings;
#[cfg(feature = "pipeline")]
pub mod sample;

#[cfg(feature = "anneal")]
pub use stereology_anneal as anneal;
#[cfg(feature = "exemplar")]
pub use stereology_exemplar as exemplar;
#[cfg(feature = "grid")]
pub use stereology_grid as grid;
#[cfg(feature = "grow")]
pub use stereology_grow as grow;
#[cfg(feature = "imaging")]
pub use stereology_imaging as imaging;
#[cfg(feature = "kmatrix")]
pub use stereology_kmatrix as kmatrix;
#[cfg(feature = "metrics")]
pub use stereology_metrics as metrics;
#[cfg(feature = "microgeometry")]
pub use stereology_microgeometry as microgeometry;
#[cfg(feature = "pyramid")]
pub use stereology_pyramid as pyramid;
#[cfg(feature = "render")]
pub use stereology_render as render;
#[cfg(feature = "segment")]
pub use stereology_segment as segment;
#[cfg(feature = "shape")]
pub use stereology_shape as shape;
#[cfg(feature = "spectrum")]
pub use stereology_spectrum as spectrum;
#[cfg(feature = "unfold")]
pub use stereology_unfold as unfold;
#[cfg(feature = "volume")]
pub use stereology_volume as volume;
