//! Synthesis of volumes whose slices look like an image.

use std::ops::ControlFlow;

use nalgebra::Vector3;
use ndarray::Array4;
use rayon::prelude::*;
use stereology_spectrum::{RealFft, frequency};

use crate::bank::FilterBank;
use crate::canvas::{Canvas, band_mean_squares, match_bands};
use crate::cuts::{Cuts, face_diagonals};
use crate::exemplar::{Exemplar, Prepared, View};
use crate::filters::Directions;
use crate::isotropy::Isotropy;
use crate::oblique::Oblique;
use crate::plan::{Plan, root_mean_square, shaped, white_noise};
use crate::targets::{Analysis, BandTargets, Pooling};
use crate::{Mode, TextureError, TextureOptions, TextureReport, VolumeSpectrum, volume_spectrum};

/// How much nearer each slice's band powers are brought to the mean over the slices before matching, as an exponent: 0 lets
/// some slices of a coarse texture have half of the contrast of others, 1 makes them all alike.
const EVENNESS: f32 = 0.5;

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
/// assert!(report.band_errors[1] < report.band_errors[0]);
/// assert_eq!((report.levels, report.findings[0].code), (2, "levels-reduced"));
/// # Ok::<(), stereology_pyramid::TextureError>(())
/// ```
pub fn synthesize_volume_with_report(
    exemplar: &Exemplar<'_>,
    size: [usize; 3],
    options: &TextureOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    synthesize(&[*exemplar], size, options, progress)
}

/// A volume whose slices look like one exemplar an axis, orientations included: see
/// [`synthesize_volume_with_report`] for what else holds. The mode of `options` is of no account.
///
/// The first exemplar shows the slices normal to z (its rows run along y, its columns along x), the second those normal to y
/// (rows along z, columns along x), the third those normal to x (rows along z, columns along y). With two, the second
/// stands for both y and x: a view from above and one from the side. With one, it stands for all three.
///
/// The colours of the volume are distributed as those of all exemplars together. Where exemplars contradict one another (a
/// volume has one spectrum, and every wave of it shows on two or three of the axes), the result lies between them:
/// the report's `band_errors` stay high. What is coarser than the pyramid is matched only on the axes whose exemplars vary most in
/// it: a picture of one layer does not tell how much the layers differ.
///
/// # Errors
///
/// As [`synthesize_volume`]; [`TextureError::Exemplars`] for none or more than three, [`TextureError::ChannelsDiffer`].
///
/// # Examples
///
/// Layers seen from the side, nothing but noise from above:
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
/// let (volume, _) = synthesize_oriented_volume(&exemplars, [16; 3], &options, &|_| ControlFlow::Continue(()))?;
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
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<(Array4<f32>, TextureReport), TextureError> {
    if exemplars.is_empty() || exemplars.len() > 3 {
        return Err(TextureError::Exemplars { found: exemplars.len() });
    }
    synthesize(exemplars, size, &options.clone().with_mode(Mode::Oriented), progress)
}

fn synthesize(
    exemplars: &[Exemplar<'_>],
    size: [usize; 3],
    options: &TextureOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
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
    let passes = |round| match options.mode {
        Mode::Slices if options.is_oblique(round) => face_diagonals().len(),
        Mode::Slices | Mode::Oriented => 3,
        Mode::Spectrum | Mode::Volume => 1,
    };
    let steps = Steps {
        done: 0,
        of: varying.len() * (0..options.iterations).map(passes).sum::<usize>(),
        progress,
    };
    let canvas = Canvas::new(start, &prepared, options.matching);
    let canvas = match options.mode {
        Mode::Slices => {
            let targets = targets_of(&prepared.views[0], &varying, &plan, options, &mut report);
            match_slices(
                canvas,
                size,
                &varying,
                &[&targets; 3],
                options,
                &plan,
                steps,
                &mut report,
            )?
        }
        Mode::Oriented => {
            let last = prepared.views.len() - 1;
            // The passes below see the slices normal to y with rows along x: transposed.
            let views = [
                &prepared.views[0],
                &prepared.views[last.min(1)].transposed(),
                &prepared.views[last],
            ];
            let targets = views.map(|view| targets_of(view, &varying, &plan, options, &mut report));
            let targets = without_layers(targets);
            let targets = [&targets[0], &targets[1], &targets[2]].map(Vec::as_slice);
            match_slices(canvas, size, &varying, &targets, options, &plan, steps, &mut report)?
        }
        Mode::Spectrum | Mode::Volume => {
            let bank = FilterBank::new(&size, &[], plan.levels, &Directions::none());
            let targets = targets_of(&prepared.views[0], &varying, &plan, options, &mut report);
            let convergence = Convergence::new(size, options, &plan, &[&targets; 3]);
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
            match_volume(
                canvas,
                &bank,
                &varying,
                &targets,
                options,
                steps,
                convergence,
                &mut report,
            )?
        }
    };
    let shape = (size[0], size[1], size[2], prepared.count());
    Ok((shaped(shape, canvas.finish()), report))
}

/// One picture of a layered rock from above shows one layer: it cannot say how much the layers differ. So what is coarser than
/// the pyramid is matched only on the axes whose exemplars (nearly) vary most in it.
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

/// The targets of the varying components of one exemplar; what there is to know about them goes into the report.
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

/// How far the bands of the slices are from the exemplar's.
struct Convergence {
    cuts: Cuts,
    /// Mean squares wanted, by axis (z, y, x), component and band.
    wanted: [Vec<Vec<f64>>; 3],
}

impl Convergence {
    fn new(size: [usize; 3], options: &TextureOptions, plan: &Plan, targets: &[&[BandTargets]; 3]) -> Self {
        let orientations = match options.mode {
            Mode::Slices | Mode::Oriented => options.orientations,
            Mode::Spectrum | Mode::Volume => 1,
        };
        let of = |targets: &&[BandTargets]| targets.iter().map(|t| t.level_mean_squares(orientations)).collect();
        Self {
            cuts: Cuts::new(size, plan.levels),
            wanted: [of(&targets[0]), of(&targets[1]), of(&targets[2])],
        }
    }

    /// Root mean square over axes, components and bands of ln(variance on slices / exemplar's).
    fn error(&mut self, canvas: &Canvas<'_>, varying: &[usize]) -> f64 {
        let normals = [Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
        let mut errors = Vec::new();
        for (i, &c) in varying.iter().enumerate() {
            let found = self.cuts.variances(&canvas.components[c], &normals);
            for (found, wanted) in found.iter().zip(&self.wanted) {
                let levels = found.len() - 1;
                let bands = found[..levels]
                    .iter()
                    .zip(&wanted[i])
                    .filter(|(f, w)| **f > 0.0 && **w > 0.0);
                errors.extend(bands.map(|(f, w)| ((f / w).ln().powi(2), 1)));
            }
        }
        root_mean_square(&errors)
    }

    /// Brings the band variances of cuts of all directions near those wanted on the first axis.
    fn bring(&mut self, canvas: &mut Canvas<'_>, varying: &[usize]) {
        for (&c, wanted) in varying.iter().zip(&self.wanted[0]) {
            self.cuts.bring_variances(&mut canvas.components[c], wanted);
        }
    }
}

/// Matches the 2D bands of all slices, one axis (z, y, x) or one face diagonal after the other; then, in [`Mode::Slices`], the
/// band variances of cuts of all directions.
#[allow(clippy::too_many_arguments, reason = "the parts of one synthesis")]
fn match_slices<'a>(
    mut canvas: Canvas<'a>,
    size: [usize; 3],
    varying: &[usize],
    targets: &[&[BandTargets]; 3],
    options: &TextureOptions,
    plan: &Plan,
    mut steps: Steps<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let [nz, ny, nx] = size;
    // The volume's axes are turned after each pass, so that the slices always lie one after the other.
    let turns = [[nz, ny, nx], [ny, nx, nz], [nx, nz, ny]];
    let plane = Directions::plane(options.orientations);
    let banks = turns.map(|[_, rows, columns]| FilterBank::new(&[rows, columns], &[], plan.levels, &plane));
    let mut isotropy = (options.mode == Mode::Slices).then(|| Isotropy::new(size));
    let mut oblique = (0..options.iterations)
        .any(|round| options.is_oblique(round))
        .then(|| Oblique::new(size, plan.levels, options.orientations));
    let mut convergence = Convergence::new(size, options, plan, targets);
    for round in 0..options.iterations {
        let mut errors = Vec::new();
        if let Some(isotropy) = isotropy.as_mut().filter(|_| round > 0) {
            varying
                .iter()
                .for_each(|&c| isotropy.restore(&mut canvas.components[c]));
        }
        canvas.match_channels();
        if let Some(oblique) = oblique.as_mut().filter(|_| options.is_oblique(round)) {
            for (&c, targets) in varying.iter().zip(targets[0]) {
                for normal in face_diagonals() {
                    let field = &mut canvas.components[c];
                    errors.push(oblique.match_cuts(field, &normal, targets, options.matching));
                    steps.next()?;
                }
            }
        } else {
            for (axis, (bank, [slices, rows, columns])) in banks.iter().zip(turns).enumerate() {
                for (&c, targets) in varying.iter().zip(targets[axis]) {
                    let field = &mut canvas.components[c];
                    errors.push(match_bands(field, bank, targets, options.matching, EVENNESS));
                    steps.next()?;
                }
                for component in &mut canvas.components {
                    *component = first_axis_last(component, slices, rows * columns);
                }
            }
        }
        if options.mode == Mode::Slices && options.oblique_rounds > 0 && round + 1 == options.iterations {
            convergence.bring(&mut canvas, varying);
            canvas.match_channels();
            convergence.bring(&mut canvas, varying);
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, varying));
    }
    Ok(canvas)
}

/// Matches the isotropic 3D bands of a volume.
#[allow(clippy::too_many_arguments, reason = "the parts of one synthesis")]
fn match_volume<'a>(
    mut canvas: Canvas<'a>,
    bank: &FilterBank<f32>,
    varying: &[usize],
    targets: &[BandTargets],
    options: &TextureOptions,
    mut steps: Steps<'_>,
    mut convergence: Convergence,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    for _ in 0..options.iterations {
        let mut errors = Vec::new();
        canvas.match_channels();
        for (&c, targets) in varying.iter().zip(targets) {
            errors.push(match_bands(
                &mut canvas.components[c],
                bank,
                targets,
                options.matching,
                0.0,
            ));
            steps.next()?;
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, varying));
    }
    Ok(canvas)
}

/// Targets with the shape of the exemplar's distributions, and given mean squares.
fn corrected(targets: &BandTargets, mean_squares: &[f64]) -> BandTargets {
    let scaled = targets.of_band.iter().zip(mean_squares).map(|(&target, &wanted)| {
        let target = &targets.targets[target.unwrap_or(0)];
        let own = target.mean_square();
        #[allow(clippy::cast_possible_truncation, reason = "a factor near one")]
        let factor = if own > 0.0 { (wanted / own).sqrt() as f32 } else { 1.0 };
        target.scaled(factor)
    });
    BandTargets {
        targets: scaled.collect(),
        of_band: (0..targets.of_band.len()).map(Some).collect(),
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
