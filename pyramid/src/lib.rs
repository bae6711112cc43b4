//! Steerable pyramid, histogram matching, and Heeger-Bergen texture synthesis in 2D and 3D.
mod bank;
mod canvas;
mod colour;
mod exemplar;
mod fill;
mod filters;
mod matching;
mod options;
mod plan;
mod slice_spectrum;
mod steerable;
mod texture_image;
mod texture_volume;

pub use colour::PrincipalColours;
pub use exemplar::Exemplar;
pub use matching::{MatchError, Quantiles, match_histogram, match_histogram_table};
pub use options::{Finding, Matching, Mode, TextureError, TextureOptions, TextureReport};
pub use slice_spectrum::{VolumeSpectrum, slice_spectrum, volume_spectrum};
pub use steerable::{BandSummary, Bands, PyramidError, SteerablePyramid};
pub use texture_image::{synthesize_image, synthesize_image_with_report};
pub use texture_volume::{synthesize_volume, synthesize_volume_with_report};
