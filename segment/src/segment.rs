//! The steps from a photograph to its profiles.

use std::ops::ControlFlow;

use image::RgbImage;
use stereology_imaging::area_average_rgb;
use stereology_metrics::{Finding, Progress};

use crate::error::SegmentError;
use crate::files::photo::{MOST_PIXELS, SEGMENTING, encoded_image, too_large};
use crate::found::find;
use crate::ground::seen::Ground;
use crate::options::SegmentOptions;
use crate::quality::{binder_finding, count_findings};
use crate::segmentation::Segmentation;
use crate::working_scale::{WorkingScale, spread_of};

/// Finds the profiles of particles in a photo of a section.
///
/// The steps, each a public function: [`encoded_image`] and
/// [`gaussian_filter_rgb`](stereology_imaging::gaussian_filter_rgb); [`BinderModel`](crate::BinderModel), whose colour
/// and light are fitted robustly; [`hysteresis`](crate::hysteresis) of the distance to it,
/// [`fill_holes`](crate::fill_holes), [`open`](crate::open); [`half_contrast`](crate::half_contrast);
/// [`split_by_colour`](crate::split_by_colour), [`split_by_shape`](crate::split_by_shape); small profiles removed,
/// profiles at the edges weighted, colours grouped into categories.
///
/// # Errors
///
/// A photo that is too small, too large or of one colour, an option out of range, no particles, or cancelled. A photo
/// without a binder is not an error but the finding `no-binder`.
///
/// # Complexity
///
/// Nearly linear in pixels, but for the sorting of parts of different colours that touch; about 90 bytes per pixel.
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, sections 4.2 and 5.2.
///
/// # Examples
///
/// See the crate's first page.
pub fn segment(
    photo: &RgbImage,
    options: &SegmentOptions,
    progress: Progress<'_>,
) -> Result<Segmentation, SegmentError> {
    options.check()?;
    check_photo(photo)?;
    let report = |done| match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(SegmentError::Cancelled),
    };
    report(0.0)?;
    let image = encoded_image(photo);
    let spread = spread_of(&image);
    let scale = WorkingScale::of(image.dim(), spread);
    let (found, labels) = match scale {
        None => {
            let mut found = find(&image, spread, options, &report)?;
            let labels = std::mem::take(&mut found.labels);
            (found, labels)
        }
        Some(scale) => {
            let reduced = area_average_rgb(image.view(), scale.size);
            drop(image);
            let found = find(&reduced, spread / scale.factor, &scale.options(options), &report)?;
            let labels = scale.at_full_size(&found, options.smoothing);
            (found, labels)
        }
    };
    report(0.9)?;
    let mut out = Segmentation::measured(photo, labels, options).without_halos(options);
    if out.profiles.is_empty() {
        return Err(SegmentError::NoParticles {
            min_area: options.min_area,
        });
    }
    out.reject(&found.mask);
    out.renumber();
    let seen = &found.seen;
    out.findings
        .extend(binder_finding(seen.covered, seen.is_clear, out.area_fraction));
    if matches!(seen.ground, Ground::Densest) {
        out.findings.push(Finding::new("vague-binder", "binder and particle colours overlap: regions that differ clearly from the most common colour are outlined, and particles with colours of the binder are missed; look at the overlay, give the binder's colour, or import a label map"));
    }
    out.findings.extend(count_findings(found.by_threshold, found.by_rise));
    report(1.0)?;
    Ok(out)
}

/// Refuses photos without room for particles and a binder, with more pixels than labels can number, or of one colour.
fn check_photo(photo: &RgbImage) -> Result<(), SegmentError> {
    let (width, height) = photo.dimensions();
    if width < 16 || height < 16 {
        return Err(SegmentError::TooSmall { width, height });
    }
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(too_large([width, height], MOST_PIXELS, SEGMENTING));
    }
    let first = *photo.get_pixel(0, 0);
    if photo.pixels().all(|p| *p == first) {
        return Err(SegmentError::SingleColour { colour: first.0 });
    }
    Ok(())
}
