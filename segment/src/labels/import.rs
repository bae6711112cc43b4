//! Segmentations from label maps of other tools.

use image::{Rgb, RgbImage};
use ndarray::Array2;
use stereology_imaging::connected_components;

use crate::error::SegmentError;
use crate::files::label_raster::dimensions;
use crate::files::photo::{MOST_PIXELS, SEGMENTING, too_large};
use crate::labels::profile::distinct;
use crate::labels::split::fill_label_holes;
use crate::options::{Holes, SegmentOptions};
use crate::outlines::regions::neighbours4;
use crate::segmentation::Segmentation;
use stereology_metrics::Finding;

/// Number of connected components beyond which a map of one or two numbers is a mask of classes.
const MANY: u32 = 6;
/// Values that a mask has inside.
const MASKS: [u32; 3] = [1, 255, 65_535];
/// The colour of everything where there is no photo.
const NO_COLOUR: [u8; 3] = [128; 3];

impl Segmentation {
    /// Profiles of a label map drawn by hand or made by another tool, axes (y, x), 0 the binder. Numbers are kept. A
    /// label is one profile even if it has several connected components; the finding `split-label` reports that. A
    /// binary mask is divided into its connected components (`mask-split`), and holes are filled (`holes-filled`)
    /// unless the options keep them.
    ///
    /// # Errors
    ///
    /// A map of another size than the photo, without labels, or of three classes instead of profiles; an option out of
    /// range.
    ///
    /// # Complexity
    ///
    /// Linear in pixels.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{EdgeRule, SegmentOptions, Segmentation};
    ///
    /// let photo = image::RgbImage::from_fn(40, 30, |x, _| image::Rgb([if x < 20 { 200 } else { 40 }; 3]));
    /// let labels = ndarray::Array2::from_shape_fn((30, 40), |(y, x)| if (5..15).contains(&y) && (22..32).contains(&x) { 7 } else { 0 });
    /// let segmentation = Segmentation::from_labels(&photo, labels, &SegmentOptions::default().with_edge_rule(EdgeRule::All))?;
    /// let profile = &segmentation.profiles[0];
    /// assert_eq!((profile.id, profile.area, profile.x, profile.y), (7, 100.0, 27.0, 10.0));
    /// assert_eq!(profile.colour, [40.0 / 255.0; 3]);
    /// # Ok::<(), stereology_segment::SegmentError>(())
    /// ```
    pub fn from_labels(photo: &RgbImage, labels: Array2<u32>, options: &SegmentOptions) -> Result<Self, SegmentError> {
        let (height, width) = labels.dim();
        let size = [photo.width() as usize, photo.height() as usize];
        if [width, height] != size {
            return Err(SegmentError::LabelSize {
                labels: [width, height],
                photo: size,
            });
        }
        Self::imported(photo, labels, options)
    }

    /// Profiles of a label map without a photo: their sizes and places, but no colours, as if all were grey.
    ///
    /// # Errors
    ///
    /// As [`from_labels`](Self::from_labels).
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{EdgeRule, SegmentOptions, Segmentation};
    ///
    /// let labels = ndarray::Array2::from_shape_fn((30, 30), |(y, x)| u32::from(y > 10 && x > 10));
    /// let options = SegmentOptions::default().with_edge_rule(EdgeRule::All);
    /// let segmentation = Segmentation::of_sizes(labels, &options)?;
    /// assert_eq!((segmentation.profiles[0].area, segmentation.has_colours), (361.0, false));
    /// # Ok::<(), stereology_segment::SegmentError>(())
    /// ```
    pub fn of_sizes(labels: Array2<u32>, options: &SegmentOptions) -> Result<Self, SegmentError> {
        let (width, height) = dimensions(labels.dim());
        let grey = RgbImage::from_pixel(width, height, Rgb(NO_COLOUR));
        let mut out = Self::imported(&grey, labels, options)?;
        out.has_colours = false;
        Ok(out)
    }

    /// Profiles of a label map of the photo's size.
    fn imported(photo: &RgbImage, mut labels: Array2<u32>, options: &SegmentOptions) -> Result<Self, SegmentError> {
        options.check()?;
        if labels.len() as u64 > MOST_PIXELS {
            return Err(too_large([photo.width(), photo.height()], MOST_PIXELS, SEGMENTING));
        }
        let (components, count) = connected_components(labels.view(), |l| l != 0);
        if count == 0 {
            return Err(SegmentError::NoLabels);
        }
        let used = distinct(&labels);
        let mut findings = Vec::new();
        if let (&[value], true) = (used.as_slice(), count > 1)
            && (MASKS.contains(&value) || count > MANY)
        {
            labels = components;
            findings.push(Finding::new(
                "mask-split",
                format!("the label map has the single value {value} besides 0, a mask: each of its {count} connected components was taken as a profile, and particles that touch are one; export a label image if particles touch"),
            ));
        } else if is_mask(&labels, &components, count, &used) {
            return Err(SegmentError::ClassMask {
                values: used.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and "),
                components: count as usize,
            });
        } else {
            let split = split_labels(&labels, &components);
            if let Some(largest @ (255 | 65_535)) = split.last() {
                findings.push(Finding::new(
                    "clipped-labels",
                    format!("the largest label is exactly {largest} and has several connected components: the map may have been written with too few bits, and the profiles with larger numbers merged into one; export it as 32-bit TIFF"),
                ));
            }
            if let Some(first) = split.first() {
                findings.push(Finding::new(
                    "split-label",
                    format!("{} labels have more than one connected component (the first is {first}); each is counted as one profile of their total area", split.len()),
                ));
            }
        }
        if options.holes == Holes::Fill {
            let before = labels.iter().filter(|l| **l != 0).count();
            fill_label_holes(&mut labels);
            let filled = labels.iter().filter(|l| **l != 0).count() - before;
            if filled > 0 {
                findings.push(Finding::new(
                    "holes-filled",
                    format!(
                        "{filled} pixels in holes of single labels were added to them; keep holes if they are binder"
                    ),
                ));
            }
        }
        let given = distinct(&labels).len();
        let mut out = Self::measured(photo, labels, options);
        if out.profiles.is_empty() {
            return Err(SegmentError::NoParticles {
                min_area: options.min_area,
            });
        }
        if out.profiles.len() < given {
            findings.push(Finding::new(
                "small-labels",
                format!("{} of {given} labels have fewer than {} pixels and are left out; lower the minimum area to keep them", given - out.profiles.len(), options.min_area),
            ));
        }
        findings.append(&mut out.findings);
        out.findings = findings;
        Ok(out)
    }
}

/// Labels with several connected components, increasing.
fn split_labels(labels: &Array2<u32>, components: &Array2<u32>) -> Vec<u32> {
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    let mut last = (0, 0);
    for pair in labels.iter().copied().zip(components.iter().copied()) {
        if pair != last && pair.0 != 0 {
            pairs.push(pair);
        }
        last = pair;
    }
    pairs.sort_unstable();
    pairs.dedup();
    let mut split: Vec<u32> = pairs.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[0].0).collect();
    split.dedup();
    split
}

/// Whether a map holds classes (binder, inside, edge; or binder and particle) instead of a number for each profile: one
/// or two numbers with many components, or components of one number surrounded by the other.
fn is_mask(labels: &Array2<u32>, components: &Array2<u32>, count: u32, used: &[u32]) -> bool {
    if used.len() > 2 {
        return false;
    }
    if count > MANY {
        return true;
    }
    let &[inside, edge] = used else { return false };
    // For each component of either number: does anything but the other number touch it?
    [(inside, edge), (edge, inside)].into_iter().any(|(core, rim)| {
        let mut cores = 0;
        let mut bare = vec![false; count as usize + 1];
        let mut seen = vec![false; count as usize + 1];
        for ((y, x), _) in labels.indexed_iter().filter(|(_, l)| **l == core) {
            let component = components[[y, x]] as usize;
            cores += usize::from(!seen[component]);
            seen[component] = true;
            bare[component] |= neighbours4([y, x], labels.dim()).any(|q| labels[q] != core && labels[q] != rim);
        }
        let rimmed = seen.iter().zip(&bare).filter(|(s, b)| **s && !**b).count();
        cores >= 2 && 2 * rimmed > cores
    })
}
