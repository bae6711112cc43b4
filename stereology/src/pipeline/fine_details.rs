//! The residual of the photograph, synthesised again in three dimensions: section 4.3.

use crate::pipeline::Warning;
use ndarray::{Array2, Array4};
use std::ops::ControlFlow;
use stereology_pyramid::{Exemplar, TextureError, TextureOptions, TextureReport, synthesize_volume_with_report};
use stereology_segment::Segmentation;
use stereology_volume::Residual;

/// The residual volumes of binder and particles, and how well their slices match the photograph.
#[derive(Clone, Debug)]
pub struct FineDetails {
    /// The volumes.
    pub residual: Residual,
    /// Report on the binder's; `None` if the photograph shows too little binder to tell.
    pub binder: Option<TextureReport>,
    /// Report on the particles'; `None` if they are too small to tell.
    pub particles: Option<TextureReport>,
    /// What to know.
    pub warnings: Vec<Warning>,
}

/// Synthesises tileable residual volumes of `voxels`³ at the photograph's pixel scale, one from the pixels of the binder, one from those of all particles.
///
/// The two are told apart because a particle's inside looks unlike the binder; particles are pooled because one profile alone is too small a sample (the
/// paper's own finding). Pixels next to a border belong to neither: blur mixes both there. The period is `voxels` × `pixel`, whatever the photograph's size.
///
/// # Errors
///
/// [`TextureError`]: a volume too small or beyond memory, or a cancelled run.
pub fn fine_details(
    segmentation: &Segmentation,
    residual: &ndarray::Array3<f32>,
    voxels: usize,
    pixel: f64,
    options: &TextureOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<FineDetails, TextureError> {
    let inner = inner_pixels(&segmentation.labels);
    let binder_mask = ndarray::Zip::from(&segmentation.labels)
        .and(&inner)
        .map_collect(|&label, &inner| inner && label == 0);
    let particle_mask = ndarray::Zip::from(&segmentation.labels)
        .and(&inner)
        .map_collect(|&label, &inner| inner && label > 0);
    let mut warnings = Vec::new();
    let mut part = |mask: &Array2<bool>, of: &str, from: f64, seed: u64| {
        let exemplar = Exemplar::new(residual.view()).with_mask(mask.view());
        let half = |done: f64| progress(from + 0.5 * done);
        match synthesize_volume_with_report(&exemplar, [voxels; 3], &options.clone().with_seed(seed), &half) {
            Ok((volume, report)) => {
                for finding in &report.findings {
                    warnings.push(Warning::new(finding.code, format!("{of}: {}", finding.message)));
                }
                Ok((volume, Some(report)))
            }
            Err(TextureError::MaskTooSmall { .. }) => {
                warnings.push(Warning::new("no-texture", format!("the photograph shows too few pixels inside the {of} to learn its texture from; it was left plain")));
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
        warnings,
    })
}

/// Pixels whose eight neighbours carry the same label.
fn inner_pixels(labels: &Array2<u32>) -> Array2<bool> {
    let (height, width) = labels.dim();
    Array2::from_shape_fn((height, width), |(y, x)| {
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.clone()
            .all(|v| (x.saturating_sub(1)..(x + 2).min(width)).all(|u| labels[[v, u]] == labels[[y, x]]))
    })
}
