//! The resolution at which a photograph is segmented: that of its point spread.

use ndarray::{Array2, Slice};
use stereology_imaging::point_spread;

use crate::conversions::{single, whole_part};
use crate::found::Found;
use crate::ground::enlarged::enlarged;
use crate::labels::nearest::nearest_labels;
use crate::options::SegmentOptions;
use crate::outlines::half_contrast::{SHARP, half_contrast};

/// Point spread, pixels, from which a photo is reduced: above that of sharp photos.
const BLURRED: f32 = 1.35;
/// Point spread of the reduced photo, pixels. By the sampling theorem a Gaussian of one pixel loses 0.7 % of its
/// contrast at the finest waves of the reduced grid, and less at others.
const REDUCED: f32 = 1.0;
/// Least width and height of a reduced photo, pixels.
const LEAST_SIDE: f64 = 64.0;
/// Side of the middle of a photo from which its point spread is measured, pixels.
const MIDDLE: usize = 1000;
/// Iterations of refining enlarged outlines, which are at most a pixel of the reduced photo away.
const ITERATIONS: usize = 2;
/// A label whose area changes by more than this fraction while it is refined keeps its enlarged outline.
const CHANGED: f64 = 0.3;

/// A size smaller than the photo's own, at which its point spread is that of a sharp photo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorkingScale {
    /// Height and width of the reduced photo.
    pub(crate) size: (usize, usize),
    /// Pixels of the photo per pixel of the reduced photo.
    pub(crate) factor: f32,
    full: (usize, usize),
}

impl WorkingScale {
    /// The scale for a photo with this point spread, in pixels; `None` if it is sharp.
    pub(crate) fn of((height, width): (usize, usize), spread: f32) -> Option<Self> {
        let most = height.min(width) as f64 / LEAST_SIDE;
        let factor = f64::from(spread / REDUCED).min(most);
        (spread > BLURRED && factor > 1.0).then(|| Self {
            size: (
                whole_part((height as f64 / factor).round()),
                whole_part((width as f64 / factor).round()),
            ),
            factor: single(factor),
            full: (height, width),
        })
    }

    /// Options at this scale. Smoothing stays as it is, in pixels of the reduced photo; the least rise is that of a
    /// photo with the point spread of a sharp one.
    pub(crate) fn options(&self, options: &SegmentOptions) -> SegmentOptions {
        let area = options.min_area as f64 / f64::from(self.factor).powi(2);
        let [pixels, fraction] = options.rise;
        options
            .clone()
            .with_min_area(whole_part(area.round()))
            .with_rise(pixels * SHARP / REDUCED, fraction)
    }

    /// Labels at the photo's own size: enlarged, their outlines then moved to half contrast between pixels of the
    /// reduced photo. `smoothing` is that of the reduced photo, pixels.
    pub(crate) fn at_full_size(&self, found: &Found, smoothing: f32) -> Array2<u32> {
        let cell = [
            self.full.0 as f32 / self.size.0 as f32,
            self.full.1 as f32 / self.size.1 as f32,
        ];
        let of = |i: usize, side: f32, n: usize| whole_part(f64::from((i as f32 + 0.5) / side)).min(n - 1);
        let coarse = Array2::from_shape_fn(self.full, |(y, x)| {
            found.labels[[of(y, cell[0], self.size.0), of(x, cell[1], self.size.1)]]
        });
        let deviation = enlarged(&found.seen.deviation, self.full, cell);
        let mut mask = coarse.mapv(|l| l != 0);
        for _ in 0..ITERATIONS {
            mask = half_contrast(&deviation, &mask, self.factor * smoothing.hypot(REDUCED));
        }
        let mut labels = nearest_labels(&coarse, &mask);
        let (before, after) = (areas(&coarse), areas(&labels));
        let is_kept = |label: u32| {
            let [old, new] = [&before, &after].map(|areas| areas.get(label as usize).copied().unwrap_or(0) as f64);
            (new - old).abs() > CHANGED * old
        };
        labels.zip_mut_with(&coarse, |new, &old| {
            if is_kept(old) {
                *new = old;
            } else if is_kept(*new) {
                *new = 0;
            }
        });
        labels
    }
}

/// Pixels of every label.
fn areas(labels: &Array2<u32>) -> Vec<usize> {
    let mut areas = vec![0; labels.iter().copied().max().unwrap_or(0) as usize + 1];
    labels.iter().filter(|l| **l != 0).for_each(|&l| areas[l as usize] += 1);
    areas
}

/// Point spread of a photo, pixels: that of its middle, or of the whole if the middle has no edges.
pub(crate) fn spread_of(image: &Array2<[f32; 3]>) -> f32 {
    let middle = image.slice_each_axis(|axis| {
        let side = axis.len.min(MIDDLE);
        let first = (axis.len - side) / 2;
        Slice::from(first..first + side)
    });
    point_spread(middle)
        .or_else(|| point_spread(image.view()))
        .unwrap_or(SHARP)
}
