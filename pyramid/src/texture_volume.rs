//! Synthesis of volumes whose slices look like an image.

use std::ops::ControlFlow;

use ndarray::Array4;
use rayon::prelude::*;
use stereology_spectrum::{RealFft, frequency};

use crate::bank::FilterBank;
use crate::canvas::{Canvas, band_mean_squares, match_bands};
use crate::exemplar::{Analysis, BandTargets, Exemplar, Pooling, Prepared};
use crate::plan::{Plan, root_mean_square, shaped, white_noise};
use crate::{Mode, TextureError, TextureOptions, TextureReport, VolumeSpectrum, volume_spectrum};

/// A volume whose slices look like the exemplar at the exemplar's pixel scale, and that repeats without a seam along all
/// three axes. See [`synthesize_volume_with_report`], of which this is the volume.
///
/// # Errors
///
/// [`TextureError`]: an exemplar or result under 8 samples, NaN, too little in the mask, a result beyond the memory limit,
/// a progress function that says break.
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
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Array4<f32>, TextureError> {
    synthesize_volume_with_report(exemplar, size, options, progress).map(|(volume, _)| volume)
}

/// As [`synthesize_volume`], with a report of what was done: levels used, how the bands converged, what to know.
///
/// The volume is (z, y, x, channel) of `size` (nz, ny, nx). Its channels have the exemplar's distributions (mean included)
/// exactly up to the matching; what else its slices share with the exemplar depends on [`Mode`].
///
/// With a mask, only its pixels' statistics count: the distribution of their values, the spectrum from pairs of them, and
/// those pyramid coefficients whose filter lies (nearly) inside the mask; if a level has too few of these, those that lie
/// most inside, and the report says so.
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
///     &Exemplar::new(speckle.view()), [16, 16, 16], &options, &|_| ControlFlow::Continue(()),
/// )?;
/// assert!(report.band_errors[2] < report.band_errors[0]);
/// assert_eq!((report.levels, report.findings[0].code), (2, "levels-reduced"));
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_volume_with_report(
    exemplar: &Exemplar<'_>,
    size: [usize; 3],
    options: &TextureOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    let plan = Plan::new(exemplar, &size, options)?;
    let exemplar = Prepared::new(exemplar)?;
    let mut report = plan.report(&exemplar);
    let orientations = if options.mode == Mode::Slices {
        options.orientations
    } else {
        1
    };
    let analysis = Analysis::new(&exemplar, plan.levels, orientations);
    report.findings.extend(analysis.findings.iter().cloned());
    let varying: Vec<usize> = (0..exemplar.components.len()).filter(|&c| exemplar.varies(c)).collect();
    let mut start = vec![vec![0.0; size.iter().product()]; exemplar.components.len()];
    for &c in &varying {
        start[c] = white_noise(start[c].len(), size[1] * size[2], options.seed, c);
        if options.mode != Mode::Volume {
            impose_spectrum(&mut start[c], size, &volume_spectrum(&exemplar.slice_spectrum(c)));
        }
    }
    let targets: Vec<BandTargets> = varying
        .iter()
        .map(|&c| analysis.targets(&exemplar.components[c], Pooling::Together))
        .collect();
    let steps = Steps {
        done: 0,
        of: options.iterations * varying.len() * if options.mode == Mode::Slices { 3 } else { 1 },
        progress,
    };
    let canvas = Canvas::new(start, &exemplar, options.matching);
    let canvas = match options.mode {
        Mode::Slices => match_slices(canvas, size, &varying, &targets, options, &plan, steps, &mut report)?,
        Mode::Spectrum | Mode::Volume => {
            let bank = FilterBank::new(&size, plan.levels, 1);
            let targets = if options.mode == Mode::Spectrum {
                let fields = varying.iter().map(|&c| &canvas.components[c]);
                targets
                    .iter()
                    .zip(fields)
                    .map(|(t, field)| corrected(t, &band_mean_squares(field, &bank)))
                    .collect()
            } else {
                targets
            };
            match_volume(canvas, &bank, &varying, &targets, options, steps, &mut report)?
        }
    };
    let shape = (size[0], size[1], size[2], exemplar.components.len());
    Ok((shaped(shape, canvas.finish()), report))
}

/// Tells the caller how far a synthesis is, and whether to stop.
struct Steps<'a> {
    done: usize,
    of: usize,
    progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

impl Steps<'_> {
    fn next(&mut self) -> Result<(), TextureError> {
        self.done += 1;
        match (self.progress)(self.done as f64 / self.of as f64) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(TextureError::Cancelled),
        }
    }
}

/// Matches the 2D bands of all slices, one axis after the other.
#[allow(clippy::too_many_arguments, reason = "the parts of one synthesis")]
fn match_slices<'a>(
    mut canvas: Canvas<'a>,
    size: [usize; 3],
    varying: &[usize],
    targets: &[BandTargets],
    options: &TextureOptions,
    plan: &Plan,
    mut steps: Steps<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let [nz, ny, nx] = size;
    // The volume's axes are turned after each pass, so that the slices always lie one after the other.
    let turns = [[nz, ny, nx], [ny, nx, nz], [nx, nz, ny]];
    let banks = turns.map(|[_, rows, columns]| FilterBank::new(&[rows, columns], plan.levels, options.orientations));
    for _ in 0..options.iterations {
        let mut errors = Vec::new();
        canvas.match_channels();
        for (bank, [slices, rows, columns]) in banks.iter().zip(turns) {
            for (&c, targets) in varying.iter().zip(targets) {
                errors.push(match_bands(&mut canvas.components[c], bank, targets, options.matching));
                steps.next()?;
            }
            for component in &mut canvas.components {
                *component = first_axis_last(component, slices, rows * columns);
            }
        }
        report.band_errors.push(root_mean_square(&errors));
    }
    Ok(canvas)
}

/// Matches the isotropic 3D bands of a volume.
fn match_volume<'a>(
    mut canvas: Canvas<'a>,
    bank: &FilterBank<f32>,
    varying: &[usize],
    targets: &[BandTargets],
    options: &TextureOptions,
    mut steps: Steps<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    for _ in 0..options.iterations {
        let mut errors = Vec::new();
        canvas.match_channels();
        for (&c, targets) in varying.iter().zip(targets) {
            errors.push(match_bands(&mut canvas.components[c], bank, targets, options.matching));
            steps.next()?;
        }
        report.band_errors.push(root_mean_square(&errors));
    }
    Ok(canvas)
}

/// Targets with the shape of the exemplar's distributions, and given mean squares.
fn corrected(targets: &BandTargets, mean_squares: &[f64]) -> BandTargets {
    let scaled = targets.of_band.iter().zip(mean_squares).map(|(&target, &wanted)| {
        let target = &targets.targets[target];
        let own = target.mean_square();
        #[allow(clippy::cast_possible_truncation, reason = "a factor near one")]
        let factor = if own > 0.0 { (wanted / own).sqrt() as f32 } else { 1.0 };
        target.scaled(factor)
    });
    BandTargets {
        targets: scaled.collect(),
        of_band: (0..targets.of_band.len()).collect(),
    }
}

/// Gives a noise the spectrum of a volume: its phases are kept, its amplitudes replaced.
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

/// A volume of `first` slices of `rest` samples with its first axis made the last.
fn first_axis_last(field: &[f32], first: usize, rest: usize) -> Vec<f32> {
    const TILE: usize = 32;
    let mut turned = vec![0.0; field.len()];
    turned
        .par_chunks_mut(first * TILE)
        .enumerate()
        .for_each(|(tile, turned)| {
            let start = tile * TILE;
            for block in (0..first).step_by(TILE) {
                for (j, row) in turned.chunks_exact_mut(first).enumerate() {
                    for (i, value) in row.iter_mut().enumerate().skip(block).take(TILE) {
                        *value = field[i * rest + start + j];
                    }
                }
            }
        });
    turned
}
