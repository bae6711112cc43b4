//! Synthesis of volumes whose slices look like an image.

use ndarray::Array4;
use rayon::prelude::*;
use stereology_metrics::Progress;
use stereology_spectrum::{RealFft, frequency};

use crate::canvas::Canvas;
use crate::exemplar::{Exemplar, Prepared, View};
use crate::plan::{Plan, shaped, white_noise};
use crate::slice_matching::{Setup, match_slices, match_volume};
use crate::targets::{Analysis, BandTargets, Pooling};
use crate::{Mode, TextureError, TextureOptions, TextureReport, VolumeSpectrum, Watch, volume_spectrum};

/// Synthesises a volume whose slices look like the exemplar at its pixel scale, and that is periodic without a seam
/// along all three axes. See [`synthesize_volume_with_report`] for details.
///
/// # Errors
///
/// [`TextureError`]: an exemplar or result under 8 samples, NaN, too few pixels in the mask, a result beyond the memory
/// limit, cancellation.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_pyramid::{Exemplar, Mode, TextureOptions, synthesize_volume};
///
/// let speckle = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((7 * y + 13 * x * x) % 11) as f32 / 11.0 - 0.5);
/// let options = TextureOptions::default().with_mode(Mode::Spectrum).with_iterations(2);
/// let volume = synthesize_volume(&Exemplar::new(speckle.view()), [16, 20, 24], &options, &|_| ControlFlow::Continue(()))?;
/// assert_eq!(volume.dim(), (16, 20, 24, 1));
/// assert!((volume.mean().unwrap() - speckle.mean().unwrap()).abs() < 0.01);
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_volume(
    exemplar: &Exemplar<'_>,
    size: [usize; 3],
    options: &TextureOptions,
    progress: Progress<'_>,
) -> Result<Array4<f32>, TextureError> {
    synthesize_volume_with_report(exemplar, size, options, &|done, _| progress(done)).map(|(volume, _)| volume)
}

/// [`synthesize_volume`] with a report: levels used, convergence of the bands, findings.
///
/// `watch` receives the completed fraction and the report so far: every iteration appends one value to `slice_errors`.
///
/// The volume has axes (z, y, x, channel) and `size` (nz, ny, nx). Its channels have the distributions of the exemplar
/// (including the mean) up to the accuracy of the matching; which other statistics its slices share with the exemplar
/// depends on [`Mode`].
///
/// With a mask, only the statistics of its pixels count: the distribution of their values, the spectrum from pairs of
/// them, and the pyramid coefficients whose filter lies (nearly) inside the mask. If a level has too few of these,
/// those with the largest part inside are used, and the report contains a finding.
///
/// # Errors
///
/// As [`synthesize_volume`].
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, section 4.3; Heeger & Bergen 1995; slices: this crate.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_volume_with_report};
///
/// let speckle = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((7 * y + 13 * x * x) % 11) as f32 / 11.0 - 0.5);
/// let options = TextureOptions::default().with_iterations(3).with_levels(9);
/// let (_, report) = synthesize_volume_with_report(
///     &Exemplar::new(speckle.view()), [16, 16, 16], &options, &|_, _| ControlFlow::Continue(()),
/// )?;
/// assert!(report.final_error < report.slice_errors[0]);
/// assert_eq!((report.levels, report.findings[0].code), (2, "levels-reduced"));
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_volume_with_report(
    exemplar: &Exemplar<'_>,
    size: [usize; 3],
    options: &TextureOptions,
    watch: Watch<'_>,
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    synthesize(&[*exemplar], size, options, watch)
}

/// Synthesises a volume whose slices look like one exemplar per axis, including its orientations. See
/// [`synthesize_volume_with_report`] for further details. The mode of `options` is ignored.
///
/// The first exemplar describes the slices normal to z (rows along y, columns along x), the second those normal to y
/// (rows along z, columns along x), the third those normal to x (rows along z, columns along y). With two exemplars,
/// the second is used for both y and x: a view from above and one from the side. With one, it is used for all three.
///
/// The colours of the volume have the distribution of those of all exemplars together. Where exemplars contradict each
/// other (a volume has one spectrum, and every wave of it appears on two or three of the axes), the result lies between
/// them, and the `band_errors` of the report stay high. The low-pass residual is matched only on the axes whose
/// exemplars vary most in it, because an image of a single layer does not reveal how much the layers differ.
///
/// # Errors
///
/// As [`synthesize_volume`]; [`TextureError::Exemplars`] for none or more than three, [`TextureError::ChannelsDiffer`].
///
/// # Examples
///
/// Layers in the view from the side, noise in the view from above:
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_pyramid::{Exemplar, TextureOptions, synthesize_oriented_volume};
///
/// let layers = Array3::from_shape_fn((32, 32, 1), |(z, x, _)| (z as f32 * 0.8).sin() + ((7 * z + 13 * x * x) % 11) as f32 / 40.0);
/// let above = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((7 * y * y + 13 * x) % 23) as f32 / 80.0);
/// let exemplars = [Exemplar::new(above.view()), Exemplar::new(layers.view())];
/// let options = TextureOptions::default();
/// let (volume, _) = synthesize_oriented_volume(&exemplars, [16; 3], &options, &|_, _| ControlFlow::Continue(()))?;
/// let step = |dz: usize, dx: usize| -> f32 {
///     volume.indexed_iter().map(|((z, y, x, c), v)| (v - volume[[(z + dz) % 16, y, (x + dx) % 16, c]]).abs()).sum()
/// };
/// assert!(step(1, 0) > 1.5 * step(0, 1), "values change faster across the layers than along them");
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_oriented_volume(
    exemplars: &[Exemplar<'_>],
    size: [usize; 3],
    options: &TextureOptions,
    watch: Watch<'_>,
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    if exemplars.is_empty() || exemplars.len() > 3 {
        return Err(TextureError::Exemplars { found: exemplars.len() });
    }
    synthesize(exemplars, size, &options.clone().with_mode(Mode::Oriented), watch)
}

fn synthesize(
    exemplars: &[Exemplar<'_>],
    size: [usize; 3],
    options: &TextureOptions,
    watch: Watch<'_>,
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    let plan = Plan::new(exemplars, &size, options)?;
    let prepared = Prepared::new(exemplars, options.edges)?;
    let mut report = plan.report(&prepared);
    let varying: Vec<usize> = (0..prepared.count()).filter(|&c| prepared.varies(c)).collect();
    let mut start = vec![vec![0.0; size.iter().product()]; prepared.count()];
    for &c in &varying {
        start[c] = white_noise(start[c].len(), size[1] * size[2], options.seed, c);
        if options.mode != Mode::Volume {
            impose_spectrum(&mut start[c], size, &volume_spectrum(&prepared.slice_spectrum(c)));
        }
    }
    let canvas = Canvas::new(start, &prepared, options.matching);
    let mut targets = |view: &View| targets_of(view, &varying, &plan, options, &mut report);
    let last = prepared.views.len() - 1;
    let targets = if options.mode == Mode::Oriented {
        // The slices normal to y are processed with rows along x, so this exemplar is transposed.
        let second = prepared.views[last.min(1)].transposed();
        without_layers([
            targets(&prepared.views[0]),
            targets(&second),
            targets(&prepared.views[last]),
        ])
        .into_iter()
        .collect()
    } else {
        vec![targets(&prepared.views[0])]
    };
    let setup = Setup {
        size,
        varying: &varying,
        variance_fractions: varying.iter().map(|&c| prepared.variance_fraction(c)).collect(),
        targets: [0, 1, 2].map(|axis: usize| targets[axis.min(targets.len() - 1)].as_slice()),
        options,
        levels: plan.levels,
        watch,
    };
    let canvas = match options.mode {
        Mode::Slices | Mode::Oriented => match_slices(canvas, &setup, &mut report)?,
        Mode::Spectrum | Mode::Volume => match_volume(canvas, &setup, &mut report)?,
    };
    let shape = (size[0], size[1], size[2], prepared.count());
    Ok((shaped(shape, canvas.finish()), report))
}

/// Removes the target of the low-pass residual on axes whose exemplars vary less in it than the largest (by more than a
/// fifth).
///
/// An image of a layered rock from above contains a single layer and does not reveal how much the layers differ.
fn without_layers(targets: [Vec<BandTargets>; 3]) -> [Vec<BandTargets>; 3] {
    let variance = |of: &Vec<BandTargets>| of.iter().map(BandTargets::low_variance).sum::<f64>();
    let most = targets.iter().map(variance).fold(0.0, f64::max);
    targets.map(|of| {
        if variance(&of) >= 0.8 * most {
            of
        } else {
            of.into_iter().map(BandTargets::without_low).collect()
        }
    })
}

/// The targets of the varying components of one exemplar; findings are appended to the report.
fn targets_of(
    view: &View,
    varying: &[usize],
    plan: &Plan,
    options: &TextureOptions,
    report: &mut TextureReport,
) -> Vec<BandTargets> {
    let (orientations, pooling) = match options.mode {
        Mode::Slices => (options.orientations, Pooling::Together),
        Mode::Oriented => (options.orientations, Pooling::Apart),
        Mode::Spectrum | Mode::Volume => (1, Pooling::Together),
    };
    let analysis = Analysis::new(view, plan.levels, orientations);
    for finding in &analysis.findings {
        if !report.findings.contains(finding) {
            report.findings.push(finding.clone());
        }
    }
    varying
        .iter()
        .map(|&c| analysis.targets(&view.components[c], pooling))
        .collect()
}

/// Gives noise the spectrum of a volume: phases are kept, amplitudes replaced.
fn impose_spectrum(field: &mut [f32], size: [usize; 3], wanted: &VolumeSpectrum) {
    let fft = RealFft::<f32>::new(&size).expect("sides of at least 8");
    let mut spectrum = vec![stereology_spectrum::Complex::new(0.0_f32, 0.0); fft.spectrum_shape().iter().product()];
    let mut work = fft.work();
    fft.forward_into(field, &mut spectrum, &mut work);
    let half = size[2] / 2 + 1;
    // The inverse below is not divided by the number of samples N: amplitude √(P N) / N.
    let scale = 1.0 / (field.len() as f64).sqrt();
    spectrum.par_chunks_mut(half).enumerate().for_each(|(row, bins)| {
        let across = frequency(row / size[1], size[0]).hypot(frequency(row % size[1], size[1]));
        for (x, bin) in bins.iter_mut().enumerate() {
            let radius = across.hypot(x as f64 / size[2] as f64);
            let length = bin.norm();
            #[allow(clippy::cast_possible_truncation, reason = "computed in f64, kept in f32")]
            let amplitude = (wanted.at(radius).sqrt() * scale) as f32;
            *bin = if length > 0.0 && radius > 0.0 {
                *bin * (amplitude / length)
            } else {
                *bin * 0.0
            };
        }
    });
    fft.inverse_into(&mut spectrum, field, &mut work);
}
