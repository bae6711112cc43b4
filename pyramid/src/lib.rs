//! Steerable pyramid, histogram matching, and Heeger-Bergen texture synthesis in 2D and 3D.
//!
//! From a photograph of a texture this crate synthesises a volume whose slices look like the photograph, at its pixel
//! scale, and that is periodic without a seam. A texture is described by the distribution of its values in every
//! channel, and of its sub-bands: the parts of the image at each scale and orientation.
//!
//! ```text
//! r = 2 |frequency|, Nyquist is 1;  H_c(r) = sin(π/2 (1 + clamp(log2(r/c), −1, 0))),  L_c = cos(same)
//! level l (0 the finest): bands H_{2^−(l+1)}(r) A_b(θ), then L_{2^−(l+1)}(r), then the spectrum on ceil(n/2) bins per axis
//! A_b(θ) = α cos^(K−1)(θ − πb/K) (−i)^(K−1),  Σ_b |A_b|² = 1;  reconstruction with the conjugate filters is exact
//! a value of rank i of n → the reference's quantile at (i + 1/2)/n          histogram matching
//! S2(κ) = ∫ S3(√(κ² + k_z²)) dk_z                                           spectrum of the slices of a volume
//! ```
//!
//! Matching 3D bands to the distributions of 2D bands ([`Mode::Volume`], the method of 1995 and 2004) gives slices that
//! are too smooth, because a slice contains every wave of the volume that crosses it: their band variances differ from
//! those of the photograph by 20 to 40 %, however many iterations are made. [`Mode::Spectrum`] first inverts the
//! relation between the spectra. [`Mode::Slices`], the default, then matches the bands of the slices and of oblique
//! planes themselves, keeps the power equal in all directions and the contrast of the slices similar, and finally
//! corrects the band variances of cuts in all directions at once. [`Mode::Oriented`] uses one exemplar per axis. The
//! table gives the root mean square of ln(band variance / that of the exemplar) and the mean Wasserstein distance of
//! bands (in standard deviations), over the slices and over the oblique cuts of 64³ in colour after 5 iterations, and
//! processor seconds at 128³ on a busy 2020s server core:
//!
//! | | granite, slices | oblique | terrazzo, slices | oblique | seconds |
//! |---|---|---|---|---|---|
//! | volume | .383 / .149 | .40 / .15 | .348 / .108 | .36 / .09 | 3.5 |
//! | spectrum | .011 / .012 | .021 / .016 | .031 / .023 | .020 / .022 | 3.6 |
//! | slices, [`Cut::Axes`] | .001 / .008 | .025 / .018 | .007 / .012 | .013 / .022 | 9.8 |
//! | slices | .001 / .009 | .002 / .010 | .002 / .010 | .003 / .012 | 13.7 |
//!
//! Except in `Oriented` the volume is isotropic: orientations are pooled. Like every Heeger-Bergen texture, the result
//! does not reproduce long edges or letters. Results have the same bits at any number of threads; between processor
//! types the last bits may differ.
//!
//! # Examples
//!
//! A solid texture from the masked part of a photograph, here the binder between dark discs:
//!
//! ```
//! use ndarray::{Array2, Array3};
//! use std::ops::ControlFlow;
//! use stereology_pyramid::{Exemplar, TextureOptions, synthesize_volume};
//!
//! let binder = Array2::from_shape_fn((64, 64), |(y, x)| (y as f32 % 32.0 - 16.0).hypot(x as f32 % 32.0 - 16.0) > 9.0);
//! let photo = Array3::from_shape_fn((64, 64, 3), |(y, x, c)| {
//!     if binder[[y, x]] { 0.5 + 0.01 * ((y * y + 7 * x + c) % 13) as f32 } else { 0.1 }
//! });
//! let exemplar = Exemplar::new(photo.view()).with_mask(binder.view());
//! let options = TextureOptions::default().with_iterations(2).with_seed(1);
//! let solid = synthesize_volume(&exemplar, [24, 24, 24], &options, &|_| ControlFlow::Continue(()))?;
//! assert!(solid.iter().all(|&v| v > 0.45), "the discs leave no trace");
//! # Ok::<(), stereology_pyramid::TextureError>(())
//! ```
//!
//! The energy of an image at each scale and orientation:
//!
//! ```
//! use ndarray::Array2;
//! use stereology_pyramid::SteerablePyramid;
//!
//! let image = Array2::from_shape_fn((100, 75), |(y, x)| ((3 * y + x * x) % 19) as f64);
//! let pyramid = SteerablePyramid::new([100, 75], 3, 4)?;
//! let bands = pyramid.build(image.view())?;
//! let energy: f64 = bands.summaries().iter().map(|band| band.mean_square).sum();
//! assert!((energy / image.mapv(|v| v * v).mean().unwrap() - 1.0).abs() < 1e-12);
//! # Ok::<(), stereology_pyramid::PyramidError>(())
//! ```

mod analytic;
mod bands;
mod bank;
mod canvas;
mod colour;
mod cuts;
mod exemplar;
mod fill;
mod filters;
mod isotropy;
mod matching;
mod oblique;
mod options;
mod plan;
mod pyramid_error;
mod reweight;
mod slice_matching;
mod slice_spectrum;
mod steerable;
mod targets;
mod texture_image;
mod texture_volume;
mod volume_pyramid;
mod wave_change;

pub use analytic::AnalyticBands;
pub use bands::{BandSummary, Bands};
pub use colour::PrincipalColours;
pub use cuts::{cut_band, cut_variances};
pub use exemplar::Exemplar;
pub use matching::{MatchError, Quantiles, match_histogram, match_histogram_table};
pub use options::{Cut, Edges, Matching, Mode, TextureError, TextureOptions, TextureReport, Watch};
pub use pyramid_error::PyramidError;
pub use slice_spectrum::{VolumeSpectrum, slice_spectrum, volume_spectrum};
pub use steerable::{Gain, SteerablePyramid};
pub use stereology_metrics::Finding;
pub use texture_image::{synthesize_image, synthesize_image_with_report};
pub use texture_volume::{synthesize_oriented_volume, synthesize_volume, synthesize_volume_with_report};
pub use volume_pyramid::{Axes, VolumeBands, VolumePyramid};
