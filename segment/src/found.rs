//! The steps from an image to labels, at the image's own resolution.

use ndarray::Array2;
use stereology_imaging::{gaussian_filter_rgb, lab_image};

use crate::error::SegmentError;
use crate::ground::seen::{Seen, chosen_binder};
use crate::labels::flecks::remove_flecks;
use crate::labels::split::{basins_of, fill_label_holes, required_rise, split_by_colour};
use crate::options::{Holes, SegmentOptions};
use crate::quality::{counts_by_rise, counts_by_threshold};

/// Labels of an image, and what they were found from.
pub(crate) struct Found {
    /// Profile of every pixel, 0 outside.
    pub(crate) labels: Array2<u32>,
    /// What differs from the ground: profiles, and what was left out of them.
    pub(crate) mask: Array2<bool>,
    pub(crate) seen: Seen,
    /// Numbers of profiles with other thresholds and other rises.
    pub(crate) by_threshold: [usize; 3],
    pub(crate) by_rise: [usize; 3],
}

/// Finds the profiles of an image, sRGB / 255, whose point spread is `spread` pixels.
pub(crate) fn find(
    image: &Array2<[f32; 3]>,
    spread: f32,
    options: &SegmentOptions,
    report: &dyn Fn(f64) -> Result<(), SegmentError>,
) -> Result<Found, SegmentError> {
    let colours = gaussian_filter_rgb(image.view(), options.smoothing);
    report(0.15)?;
    let binder = chosen_binder(&colours, options)?;
    report(0.3)?;
    let mut seen = Seen::new(image, &colours, binder, spread, options);
    let regions = seen.regions();
    report(0.4)?;
    let mask = seen.outlined(regions, &colours, spread, options);
    report(0.6)?;
    let parts = split_by_colour(&lab_image(colours.view()), &mask, options.seed);
    report(0.75)?;
    let basins = basins_of(&parts, &seen.depth(&parts));
    let mut labels = basins.divided(required_rise(parts.dim(), options.rise));
    let by_rise = counts_by_rise(&basins, parts.dim(), options);
    drop((basins, parts));
    let [_, high] = seen.thresholds;
    remove_flecks(&mut labels, &seen.distance, &seen.deviation, high, options.min_area);
    if options.holes == Holes::Fill {
        fill_label_holes(&mut labels);
    }
    let by_threshold = counts_by_threshold(&seen.distance, &seen.deviation, seen.thresholds, options);
    Ok(Found {
        labels,
        mask,
        seen,
        by_threshold,
        by_rise,
    })
}
