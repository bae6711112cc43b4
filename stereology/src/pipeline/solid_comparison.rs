//! Comparison of the slices of a solid with an exemplar, with threshold and band of the exemplar.

use ndarray::ArrayView3;
use stereology_imaging::otsu;
use stereology_metrics::{Comparison, FringeBand, MeasureError, MeasureOptions, Progress, check_images, compare, grey};
use stereology_spectrum::BandPass;

/// Options of [`compare_solid`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompareOptions {
    /// Seed of the random patches and directions.
    pub seed: u64,
    /// Patches drawn from each side; `None` takes the default of [`MeasureOptions`].
    pub patches: Option<usize>,
    /// Band of the fringes; `None` takes the strongest of the exemplar.
    pub band: Option<BandPass>,
}

/// Compares the slices of a solid with an exemplar by [`compare`]. The bright phase is what lies above Otsu's threshold
/// of the exemplar; fringes are followed in the band in which the exemplar's middle image is strongest, unless a band
/// is given.
///
/// # Errors
///
/// [`MeasureError`].
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{CompareOptions, compare_solid};
///
/// let fringes = |period: f32| Array3::from_shape_fn((64, 64, 1), move |(y, x, _)| 0.5 + 0.4 * ((y as f32 + (0.2 * x as f32).sin()) * std::f32::consts::TAU / period).sin());
/// let options = CompareOptions { patches: Some(500), ..CompareOptions::default() };
/// let found = compare_solid(&[fringes(8.0).view()], &[fringes(8.0).view()], &options, &|_| ControlFlow::Continue(()))?;
/// assert!((found.curves.period.unwrap() - 8.0).abs() < 0.5);
/// assert_eq!(found.s2.value, Some(0.0));
/// # Ok::<(), stereology::metrics::MeasureError>(())
/// ```
pub fn compare_solid(
    exemplar: &[ArrayView3<'_, f32>],
    slices: &[ArrayView3<'_, f32>],
    options: &CompareOptions,
    progress: Progress<'_>,
) -> Result<Comparison, MeasureError> {
    check_images(exemplar, slices)?;
    let filter_error = |error: stereology_spectrum::SpectrumError| MeasureError::Filter(error.to_string());
    let band = match options.band {
        Some(band) => band,
        // The middle image represents all.
        None => BandPass::of(&grey(exemplar[exemplar.len() / 2]).mapv(f64::from)).map_err(filter_error)?,
    };
    let fringes = FringeBand {
        period: band.period,
        direction: band.direction.map(|(angle, _)| angle.to_degrees()),
        filter: &|image| band.filter(&image.mapv(f64::from)).map_err(|error| error.to_string()),
    };
    let mut measure = MeasureOptions::new(otsu_threshold(exemplar)).with_seed(options.seed);
    if let Some(patches) = options.patches {
        measure = measure.with_patches(patches);
    }
    compare(exemplar, slices, Some(fringes), &measure, progress)
}

/// Otsu's threshold of all images together, among 256 levels of 0 to 1.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to 256 levels"
)]
fn otsu_threshold(images: &[ArrayView3<'_, f32>]) -> f32 {
    const LEVELS: usize = 256;
    let mut counts = [0_u64; LEVELS];
    for image in images {
        for value in grey(*image) {
            counts[(value * LEVELS as f32).floor().clamp(0.0, LEVELS as f32 - 1.0) as usize] += 1;
        }
    }
    // Level k holds the values from k to k + 1 over 256.
    otsu(&counts).map_or(0.5, |level| ((level + 0.5) / LEVELS as f64) as f32)
}
