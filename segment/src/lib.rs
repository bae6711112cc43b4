//! Profiles of particles from a photograph of a section: binder, labels, colours, residual.
//!
//! A cut stone shows particles in a binder. Unfolding needs the size of each sectioned particle, its profile; the solid
//! texture needs its colour, and the residual that remains when the mean colours are subtracted.
//!
//! ```text
//! photo / 255, smoothed → binder b(x, y), scatter Σ → z = √((p − b)ᵀ Σ⁻¹ (p − b)) → hysteresis at z = 5 / 9
//!       → outlines at half contrast: (p − b)·(c − b) ≥ ½ |c − b|²  → touching particles split: by colour, then by shape
//! photo / 255 = means + residual
//! ```
//!
//! The binder is found automatically: of the main colours, it is the one with the most pixels for its scatter, under
//! light that may vary across the photo as a quadratic surface. Particles may be lighter and darker than the binder in
//! the same photo, which no single threshold of grey levels can separate. Half contrast keeps areas unbiased: outlines
//! at the threshold itself would make every profile about a fifth too large.
//!
//! The page `docs/segment.md` of the project describes what was tried and rejected, and links to the measured accuracy.
//!
//! # A photo of discs
//!
//! ```
//! use std::ops::ControlFlow;
//! use stereology_segment::{SegmentOptions, segment};
//!
//! // Nine dark discs of radius 12 on a pale background with a little texture.
//! let photo = image::RgbImage::from_fn(150, 150, |x, y| {
//!     let from_centre = |v: u32| f64::from(v % 50) - 24.5;
//!     let inside = from_centre(x).hypot(from_centre(y)) < 12.0;
//!     let texture = (x * 7919 + y * 104_729) % 5;
//!     image::Rgb([if inside { 60 } else { 200 } + texture as u8; 3])
//! });
//! let segmentation = segment(&photo, &SegmentOptions::default(), &|_| ControlFlow::Continue(()))?;
//! assert_eq!(segmentation.profiles.len(), 9);
//! assert!(segmentation.profiles.iter().all(|p| (p.size - 24.0).abs() < 0.5));
//! # Ok::<(), stereology_segment::SegmentError>(())
//! ```
//!
//! # Labels of another tool
//!
//! ```
//! use stereology_segment::{EdgeRule, SegmentOptions, Segmentation};
//!
//! let photo = image::RgbImage::from_fn(30, 30, |x, y| image::Rgb([x as u8, y as u8, 0]));
//! let labels = ndarray::Array2::from_shape_fn((30, 30), |(y, x)| u32::from(y > 10 && x > 10));
//! let options = SegmentOptions::default().with_edge_rule(EdgeRule::All);
//! let segmentation = Segmentation::from_labels(&photo, labels, &options)?;
//! assert_eq!(segmentation.profiles[0].area, 361.0);
//! # Ok::<(), stereology_segment::SegmentError>(())
//! ```

mod conversions;
mod error;
mod files;
mod found;
mod ground;
mod labels;
mod options;
mod outlines;
mod quality;
mod segment;
mod segmentation;
mod working_scale;

pub use error::SegmentError;
pub use files::compression::Compression;
pub use files::decoding::DECODER_THREAD;
pub use files::label_map::{LabelFile, read_label_file, read_labels, read_labels_for, write_labels};
pub use files::photo::{
    Exif, GreyFile, PhotoFile, PhotoOptions, encoded_image, read_grey, read_photo, read_photo_with,
};
pub use ground::binder::BinderModel;
pub use ground::faint::faint_regions;
pub use ground::kmeans::{Clusters, kmeans, silhouette};
pub use ground::tones::{TwoTones, main_colours};
pub use labels::category::{Category, categorise, size_by_category};
pub use labels::outline::{Outline, Ring, fill_outlines, outlines};
pub use labels::profile::{Profile, Window};
pub use labels::profile_shape::ProfileShape;
pub use labels::split::{contrast_depth, split_by_colour, split_by_depth, split_by_shape};
pub use labels::watershed::{h_maxima, watershed};
pub use options::{BinderChoice, CategoryCount, Holes, SegmentOptions};
pub use outlines::cores::core_colours;
pub use outlines::half_contrast::half_contrast;
pub use outlines::regions::{fill_holes, hysteresis, open};
pub use segment::segment;
pub use segmentation::{Binder, Segmentation};
pub use stereology_metrics::{EdgeRule, Finding, KruskalWallis, Progress};
