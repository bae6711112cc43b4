//! Heeger-Bergen synthesis of images.

use ndarray::Array3;
use rayon::prelude::*;
use stereology_metrics::Progress;

use crate::bank::FilterBank;
use crate::canvas::{Canvas, match_bands};
use crate::exemplar::{Exemplar, Prepared};
use crate::filters::Directions;
use crate::plan::{Plan, root_mean_square, shaped, white_noise};
use crate::targets::{Analysis, Pooling};
use crate::{TextureError, TextureOptions, TextureReport, Watch};

/// Synthesises an image of any size that looks like the exemplar and is periodic without a seam.
///
/// White noise is matched to the distribution of colours of the exemplar and to the distributions of the bands of its
/// steerable pyramid, alternately; the colours are matched last. The edges of the exemplar are treated by its periodic
/// component. Three channels are decomposed into brightness and the principal axes of the residual colours
/// ([`crate::PrincipalColours::led_by`]). The mode of `options` is ignored. The same seed gives the same bits at any
/// number of threads.
///
/// Cost: two pyramids of the result per iteration and channel; 512 x 512 in colour takes about a second.
///
/// # Errors
///
/// [`TextureError`]: an exemplar or result under 8 pixels, NaN, too few pixels in the mask, a result beyond the memory
/// limit, cancellation.
///
/// # References
///
/// Heeger & Bergen 1995; Briand, Vacher, Galerne & Rabin, IPOL 2014 (edges).
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_image};
///
/// let speckle = Array3::from_shape_fn((32, 32, 3), |(y, x, c)| ((7 * y + 13 * x * x + c) % 11) as f32 / 11.0);
/// let texture = synthesize_image(
///     &Exemplar::new(speckle.view()), [40, 24], &TextureOptions::default(), &|_| ControlFlow::Continue(()),
/// )?;
/// assert_eq!(texture.dim(), (40, 24, 3));
/// assert!((texture.mean().unwrap() - speckle.mean().unwrap()).abs() < 0.01);
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_image(
    exemplar: &Exemplar<'_>,
    size: [usize; 2],
    options: &TextureOptions,
    progress: Progress<'_>,
) -> Result<Array3<f32>, TextureError> {
    synthesize_image_with_report(exemplar, size, options, &|done, _| progress(done)).map(|(image, _)| image)
}

/// [`synthesize_image`] with a report: levels used, convergence of the bands, findings.
///
/// # Errors
///
/// As [`synthesize_image`].
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_image_with_report};
///
/// let grey = Array3::from_elem((16, 16, 3), 0.5);
/// let (texture, report) = synthesize_image_with_report(
///     &Exemplar::new(grey.view()), [8, 8], &TextureOptions::default(), &|_, _| ControlFlow::Continue(()),
/// )?;
/// assert!(texture.iter().all(|v| (v - 0.5).abs() < 1e-6));
/// assert_eq!(report.findings[0].code, "constant-exemplar");
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_image_with_report(
    exemplar: &Exemplar<'_>,
    size: [usize; 2],
    options: &TextureOptions,
    watch: Watch<'_>,
) -> Result<(Array3<f32>, TextureReport), TextureError> {
    let plan = Plan::new(&[*exemplar], &size, options)?;
    let exemplar = Prepared::new(&[*exemplar], options.edges)?;
    let mut report = plan.report(&exemplar);
    let analysis = Analysis::new(&exemplar.views[0], plan.levels, options.orientations);
    report.findings.extend(analysis.findings.iter().cloned());
    let bank = FilterBank::new(&size, &[], plan.levels, &Directions::plane(options.orientations));
    let samples = size[0] * size[1];
    let count = exemplar.count();
    let targets: Vec<_> = (0..count)
        .map(|c| {
            exemplar
                .varies(c)
                .then(|| analysis.targets(&exemplar.views[0].components[c], Pooling::Apart))
        })
        .collect();
    let start = (0..count)
        .map(|c| {
            if exemplar.varies(c) {
                white_noise(samples, size[1], options.seed, c)
            } else {
                vec![0.0; samples]
            }
        })
        .collect();
    let mut canvas = Canvas::new(start, &exemplar, options.matching);
    let mut coefficients = vec![Vec::new(); count];
    for iteration in 0..options.iterations {
        canvas.match_channels();
        let errors: Vec<(f64, usize)> = canvas
            .components
            .par_iter_mut()
            .zip(&mut coefficients)
            .zip(&targets)
            .filter_map(|((field, coefficients), targets)| {
                Some(match_bands(
                    field,
                    &bank,
                    targets.as_ref()?,
                    options.matching,
                    0.0,
                    coefficients,
                ))
            })
            .collect();
        report.band_errors.push(root_mean_square(&errors));
        if watch((iteration + 1) as f64 / options.iterations as f64, &report).is_break() {
            return Err(TextureError::Cancelled);
        }
    }
    Ok((shaped((size[0], size[1], count), canvas.finish()), report))
}
