//! The residual of the photograph, resynthesised in three dimensions: section 4.3.

use ndarray::{Array2, Array4, Axis};
use stereology_metrics::{Finding, Progress};
use stereology_pyramid::{Exemplar, TextureError, TextureOptions, TextureReport, synthesize_volume_with_report};
use stereology_segment::Segmentation;
use stereology_volume::Residual;

/// The residual volumes of binder and particles, and reports on their slices.
#[derive(Clone, Debug)]
pub struct FineDetails {
    /// The volumes.
    pub residual: Residual,
    /// Report on that of the binder; `None` if the photograph shows too little of it.
    pub binder: Option<TextureReport>,
    /// Report on that of the particles; `None` if they are too small.
    pub particles: Option<TextureReport>,
    /// Remarks.
    pub findings: Vec<Finding>,
}

/// Synthesises periodic residual volumes of `voxels`³ at the pixel scale of the photograph, one from the pixels of the
/// binder, one from those of all particles.
///
/// Binder and particles have volumes of their own because they look different; all particles share one because a single
/// profile is too small a sample (as the paper found). Pixels near a border are left out, because blur mixes both
/// there. So are pixels of the binder whose colour is nearer to a category of particles, and the pixels around them:
/// these are particles too small to be profiles, which would appear as specks. The period is `voxels` × `pixel`,
/// whatever the size of the photograph.
///
/// # Errors
///
/// [`TextureError`]: a volume too small or beyond memory, or a cancelled run.
///
/// # Examples
///
/// ```
/// use image::{Rgb, RgbImage};
/// use ndarray::Array2;
/// use std::ops::ControlFlow;
/// use stereology::pipeline::fine_details;
/// use stereology::pyramid::TextureOptions;
/// use stereology::segment::{SegmentOptions, Segmentation};
///
/// // A plain brick square in a speckled binder.
/// let brick = |x: usize, y: usize| (20..70).contains(&x) && (20..70).contains(&y);
/// let speck = |x: u32, y: u32| ((x * 7919 + y * 104_729) % 64) as u8;
/// let photo = RgbImage::from_fn(96, 96, |x, y| Rgb(if brick(x as usize, y as usize) { [120, 50, 30] } else { [180 + speck(x, y); 3] }));
/// let labels = Array2::from_shape_fn((96, 96), |(y, x)| u32::from(brick(x, y)));
/// let found = Segmentation::from_labels(&photo, labels, &SegmentOptions::default())?;
/// let details = fine_details(&found, &found.residual(), 16, 1.0, &TextureOptions::default(), &|_| ControlFlow::Continue(()))?;
/// let spread = |field: &ndarray::Array4<f32>| field.iter().map(|v| v * v).sum::<f32>() / field.len() as f32;
/// assert!(spread(&details.residual.binder) > 100.0 * spread(&details.residual.particles));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fine_details(
    segmentation: &Segmentation,
    residual: &ndarray::Array3<f32>,
    voxels: usize,
    pixel: f64,
    options: &TextureOptions,
    progress: Progress<'_>,
) -> Result<FineDetails, TextureError> {
    let inner = far_from(&borders(&segmentation.labels), BORDER);
    let labels = &segmentation.labels;
    let fines = missed_fines(segmentation);
    let count = |of: &dyn Fn(&u32, &bool) -> bool| {
        labels
            .iter()
            .zip(&fines)
            .filter(|(label, fine)| of(label, fine))
            .count() as f64
    };
    // If many pixels look like fines, binder and particles have common colours, and these pixels belong to the binder.
    let few_fines = count(&|_, fine| *fine) < MOST_FINES * count(&|label, _| *label == 0);
    let no_fines = if few_fines {
        far_from(&fines, BORDER)
    } else {
        Array2::from_elem(labels.dim(), true)
    };
    let binder_mask = Array2::from_shape_fn(labels.dim(), |p| labels[p] == 0 && inner[p] && no_fines[p]);
    let particle_mask = Array2::from_shape_fn(labels.dim(), |p| labels[p] > 0 && inner[p]);
    let mut findings = Vec::new();
    let mut part = |mask: &Array2<bool>, of: &str, from: f64, seed: u64| {
        let exemplar = Exemplar::new(residual.view()).with_mask(mask.view());
        let half = |done: f64, _: &TextureReport| progress(from + 0.5 * done);
        match synthesize_volume_with_report(&exemplar, [voxels; 3], &options.clone().with_seed(seed), &half) {
            Ok((volume, report)) => {
                for finding in &report.findings {
                    findings.push(Finding::new(finding.code, format!("{of}: {}", finding.message)));
                }
                Ok((volume, Some(report)))
            }
            Err(TextureError::MaskTooSmall { .. }) => {
                findings.push(Finding::new(
                    "no-texture",
                    format!(
                        "too few pixels of the photograph lie inside the {of} to measure its texture; it has a uniform colour"
                    ),
                ));
                Ok((Array4::zeros([voxels, voxels, voxels, 3]), None))
            }
            Err(error) => Err(error),
        }
    };
    let seed = options.seed.wrapping_mul(2);
    let (binder, binder_report) = part(&binder_mask, "binder", 0.0, seed)?;
    let (particles, particle_report) = part(&particle_mask, "particles", 0.5, seed.wrapping_add(1))?;
    Ok(FineDetails {
        residual: Residual {
            binder,
            particles,
            voxel: pixel,
        },
        binder: binder_report,
        particles: particle_report,
        findings,
    })
}

/// Largest fraction of the binder's pixels that can be missed fines.
const MOST_FINES: f64 = 0.05;
/// Reach of blur from a border, in pixels.
const BORDER: usize = 2;

/// Pixels that touch another label.
fn borders(labels: &Array2<u32>) -> Array2<bool> {
    let (height, width) = labels.dim();
    Array2::from_shape_fn((height, width), |(y, x)| {
        let other = |v: usize, u: usize| labels[[v, u]] != labels[[y, x]];
        (x + 1 < width && other(y, x + 1))
            || (x > 0 && other(y, x - 1))
            || (y + 1 < height && other(y + 1, x))
            || (y > 0 && other(y - 1, x))
    })
}

/// Pixels of the binder that are nearer in colour to a category of particles.
fn missed_fines(segmentation: &Segmentation) -> Array2<bool> {
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    let photo = segmentation.photo();
    let binder = segmentation.binder.colour;
    Array2::from_shape_fn(segmentation.labels.dim(), |(y, x)| {
        #[allow(clippy::cast_possible_truncation, reason = "the sides of an image are u32")]
        let pixel = photo.get_pixel(x as u32, y as u32).0.map(|c| f64::from(c) / 255.0);
        let own = distance(pixel, binder);
        segmentation.labels[[y, x]] == 0
            && segmentation
                .categories
                .iter()
                .any(|of| distance(pixel, of.colour) < own)
    })
}

/// Pixels with no marked pixel within `reach` rows and columns.
fn far_from(marked: &Array2<bool>, reach: usize) -> Array2<bool> {
    let spread = |marked: &Array2<bool>, axis: Axis| {
        let mut near = marked.clone();
        for (lane, mut out) in marked.lanes(axis).into_iter().zip(near.lanes_mut(axis)) {
            for (i, _) in lane.iter().enumerate().filter(|(_, marked)| **marked) {
                (i.saturating_sub(reach)..(i + reach + 1).min(lane.len())).for_each(|k| out[k] = true);
            }
        }
        near
    };
    spread(&spread(marked, Axis(0)), Axis(1)).mapv(|near| !near)
}

#[cfg(test)]
mod tests {
    use super::{borders, far_from};
    use ndarray::Array2;
    use proptest::prelude::*;

    proptest! {
        /// The far pixels are those outside the union of the squares around the marked ones.
        #[test]
        fn far_is_outside_every_square(marks in prop::collection::vec((0_usize..20, 0_usize..30), 0..6), reach in 0_usize..5) {
            let mut marked = Array2::from_elem((20, 30), false);
            marks.iter().for_each(|&(y, x)| marked[[y, x]] = true);
            for ((y, x), &far) in far_from(&marked, reach).indexed_iter() {
                prop_assert_eq!(far, marks.iter().all(|&(v, u)| y.abs_diff(v) > reach || x.abs_diff(u) > reach));
            }
        }
    }

    /// The border of a square of side 10 has 36 pixels inside and 40 outside.
    #[test]
    fn a_border_has_two_sides() {
        let labels = Array2::from_shape_fn((30, 30), |(y, x)| {
            u32::from((10..20).contains(&y) && (10..20).contains(&x))
        });
        assert_eq!(borders(&labels).iter().filter(|&&b| b).count(), 76);
    }
}
