//! Comparison of a solid's slices with its exemplar.

use std::ops::ControlFlow;

use ndarray::{Array3, ArrayView3, Axis};

use super::error::MeasureError;
use super::figures::{Comparison, Curves, Figure};
use super::options::{FringeBand, MeasureOptions};
use super::statistics::{POROSITY_BINS, Settings, Statistics};
use crate::phase::radial_mean;
use crate::progress::Progress;
use crate::texture::{CrossScale, PAIRS, grey, histogram, kl_divergence, sliced_wasserstein};
use crate::wasserstein::wasserstein_sorted;

/// Pixels that an exemplar needs along each axis so that its halves can be measured; half as many suffice for slices.
const LEAST: usize = 16;

/// Ways to cut the exemplar into halves: left and right, upper and lower, opposite quarters.
const CUTS: u8 = 3;

/// Compares the slices of a solid with an exemplar, values 0 to 1, axes (row, column, channel). The exemplar may be
/// several images, such as the slices of a real volume.
///
/// Patches are compared in colour if both sides have as many channels, else in grey; all other figures are of grey
/// levels. Without a band the figures of fringes are `None`. Cost: about .3 s per million pixels and core, and 3 s for
/// the patches.
///
/// # Errors
///
/// [`MeasureError`].
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use std::ops::ControlFlow;
/// use stereology_metrics::{MeasureOptions, compare};
///
/// let wave = |v: usize| 0.5 + 0.5 * (v as f32 * 0.003).sin();
/// let waves = |shift: usize| Array3::from_shape_fn((64, 64, 1), move |(y, x, _)| wave((x + shift) * (y + 7)));
/// let exemplar = waves(0);
/// let blurred = waves(3).mapv(|v| 0.5 + 0.7 * (v - 0.5));
/// let options = MeasureOptions::new(0.5).with_patches(500);
/// let found = compare(&[exemplar.view()], &[blurred.view()], None, &options, &|_| ControlFlow::Continue(()))?;
/// assert!((found.std_ratio.value.unwrap() - 0.7).abs() < 0.02);
/// assert!((found.gradient_ratio.value.unwrap() - 0.7).abs() < 0.02);
/// # Ok::<(), stereology_metrics::MeasureError>(())
/// ```
pub fn compare(
    exemplar: &[ArrayView3<'_, f32>],
    slices: &[ArrayView3<'_, f32>],
    band: Option<FringeBand<'_>>,
    options: &MeasureOptions,
    progress: Progress<'_>,
) -> Result<Comparison, MeasureError> {
    check_images(exemplar, slices)?;
    let as_colours = channels(exemplar).is_some() && channels(exemplar) == channels(slices);
    let (exemplar, slices) = (
        compared_channels(exemplar, as_colours),
        compared_channels(slices, as_colours),
    );
    let exemplar: Vec<ArrayView3<'_, f32>> = exemplar.iter().map(|image| image.view()).collect();
    let slices: Vec<ArrayView3<'_, f32>> = slices.iter().map(|image| image.view()).collect();
    let settings = settings(&exemplar, &slices, band, options);
    let report = |done: f64| match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(MeasureError::Cancelled),
    };
    report(0.0)?;
    let of_exemplar = Statistics::of(&exemplar, &settings, options.seed)?;
    if of_exemplar.deviation() < 1e-6 {
        return Err(MeasureError::ConstantExemplar);
    }
    report(0.1)?;
    let of_slices = Statistics::of(&slices, &settings, options.seed.wrapping_add(1))?;
    report(0.6)?;
    let mut found = figures(&of_exemplar, &of_slices, options);
    report(0.7)?;
    let mut halves = Vec::new();
    for cut in 0..CUTS {
        halves.push(halves_compared(&exemplar, cut, &settings, options)?);
        report(0.7 + 0.1 * f64::from(cut + 1))?;
    }
    set_floors(&mut found, &halves);
    found.curves = curves(&of_exemplar, &of_slices, &settings);
    Ok(found)
}

/// Checks that an exemplar and slices can be compared: images of enough pixels (16 along each axis of an exemplar, 8 of
/// a slice) with finite samples.
///
/// # Errors
///
/// [`MeasureError::Empty`], [`MeasureError::TooSmall`], [`MeasureError::NotFinite`].
pub fn check_images(exemplar: &[ArrayView3<'_, f32>], slices: &[ArrayView3<'_, f32>]) -> Result<(), MeasureError> {
    for (images, side, least) in [(exemplar, "exemplar", LEAST), (slices, "volume", LEAST / 2)] {
        if images.is_empty() {
            return Err(MeasureError::Empty { side });
        }
        for image in images {
            let (height, width, channels) = image.dim();
            if height < least || width < least || channels == 0 {
                return Err(MeasureError::TooSmall {
                    side,
                    width,
                    height,
                    least,
                });
            }
            if image.iter().any(|v| !v.is_finite()) {
                return Err(MeasureError::NotFinite { side });
            }
        }
    }
    Ok(())
}

/// Channels that are compared, 1 or 3, without opacity; `None` if the images differ.
fn channels(images: &[ArrayView3<'_, f32>]) -> Option<usize> {
    let of = |image: &ArrayView3<'_, f32>| if image.dim().2 >= 3 { 3 } else { 1 };
    let first = of(images.first()?);
    images.iter().all(|image| of(image) == first).then_some(first)
}

fn compared_channels(images: &[ArrayView3<'_, f32>], as_colours: bool) -> Vec<Array3<f32>> {
    images
        .iter()
        .map(|image| {
            if as_colours && image.dim().2 >= 3 {
                image.slice_axis(Axis(2), (..3).into()).to_owned()
            } else {
                grey(*image).insert_axis(Axis(2))
            }
        })
        .collect()
}

fn settings<'a>(
    exemplar: &[ArrayView3<'_, f32>],
    slices: &[ArrayView3<'_, f32>],
    band: Option<FringeBand<'a>>,
    options: &MeasureOptions,
) -> Settings<'a> {
    let least =
        |side: &dyn Fn(&ArrayView3<'_, f32>) -> usize| exemplar.iter().chain(slices).map(side).min().unwrap_or(LEAST);
    let window = [least(&|image| image.dim().0), least(&|image| image.dim().1)];
    let half = exemplar
        .iter()
        .map(|image| image.dim().0.min(image.dim().1) / 2)
        .min()
        .unwrap_or(LEAST);
    let reach = (window[0].min(window[1]).min(half) / 2).clamp(2, 32);
    Settings {
        threshold: options.threshold,
        band,
        reach,
        cell: reach.min(16),
        window,
        patches: options.patches,
    }
}

/// The figures of one half of the exemplar beside the other: left and right halves (cut 0), upper and lower ones (cut
/// 1), or both pairs of opposite quarters (cut 2), whose differences are independent if the quarters are.
fn halves_compared(
    exemplar: &[ArrayView3<'_, f32>],
    cut: u8,
    settings: &Settings<'_>,
    options: &MeasureOptions,
) -> Result<Comparison, MeasureError> {
    let half = |part: u8| -> Result<Statistics, MeasureError> {
        let parts: Vec<ArrayView3<'_, f32>> = exemplar
            .iter()
            .flat_map(|image| match cut {
                0 | 1 => vec![half_of(*image, Axis(usize::from(1 - cut)), part)],
                _ => [0, 1]
                    .map(|lower| half_of(half_of(*image, Axis(0), lower), Axis(1), lower ^ part))
                    .to_vec(),
            })
            .collect();
        let stream = 2 + 2 * u64::from(cut) + u64::from(part);
        Statistics::of(&parts, settings, options.seed.wrapping_add(stream))
    };
    Ok(figures(&half(0)?, &half(1)?, options))
}

/// The first (0) or second half (1) of an image along an axis.
fn half_of(image: ArrayView3<'_, f32>, axis: Axis, part: u8) -> ArrayView3<'_, f32> {
    let n = image.len_of(axis) / 2;
    let from = usize::from(part) * n;
    image.slice_axis_move(axis, (from..from + n).into())
}

/// Sets the floor of each figure: the mean distance from the ideal of the halves of the exemplar, over all ways to cut
/// it.
fn set_floors(found: &mut Comparison, halves: &[Comparison]) {
    let distances: Vec<Vec<Option<f64>>> = halves
        .iter()
        .map(|half| {
            half.figures()
                .iter()
                .map(|(_, f)| Some((f.value? - f.ideal?).abs()))
                .collect()
        })
        .collect();
    for (i, figure) in found.figures_mut().into_iter().enumerate() {
        let of: Vec<f64> = distances.iter().filter_map(|cut| cut[i]).collect();
        figure.floor = (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64);
    }
}

/// The figures of `solid` beside `exemplar`, without floors.
fn figures(exemplar: &Statistics, solid: &Statistics, options: &MeasureOptions) -> Comparison {
    let distance = |value: Option<f64>| Figure {
        value,
        ideal: Some(0.0),
        floor: None,
    };
    let ratio = |of: Option<f64>, to: Option<f64>| Figure {
        value: of.zip(to).filter(|(_, to)| *to > 0.0).map(|(of, to)| of / to),
        ideal: Some(1.0),
        floor: None,
    };
    let level = |of: Option<f64>, to: Option<f64>| Figure {
        value: of,
        ideal: to,
        floor: None,
    };
    let s2 = (&exemplar.two_point - &solid.two_point)
        .mapv(|d| d * d)
        .mean()
        .map(f64::sqrt);
    let pairs = |k: usize| exemplar.lineal_path[k].iter().zip(&solid.lineal_path[k]);
    let path = (0..2).flat_map(pairs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let difference = |a: &[f64], b: &[f64]| (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>()).sqrt();
    let scales = exemplar.scales.as_ref().zip(solid.scales.as_ref());
    let per_pair = (PAIRS as f64).sqrt();
    let magnitudes = scales.map(|(a, b)| difference(&a.magnitudes(), &b.magnitudes()) / per_pair);
    let phases = scales.map(|(a, b)| difference(a.phases().as_flattened(), b.phases().as_flattened()) / per_pair);
    let mean = |of: &Statistics, phase: usize| of.chords(phase).map(|chords| chords.mean);
    let variation = |of: &Statistics, phase: usize| of.chords(phase).map(|chords| chords.variation);
    let swd = |k: usize| {
        sliced_wasserstein(
            &exemplar.patches[k],
            &solid.patches[k],
            options.projections,
            options.seed,
        )
    };
    Comparison {
        kl_grey: distance(Some(kl_divergence(&solid.grey, &exemplar.grey))),
        std_ratio: ratio(Some(solid.deviation()), Some(exemplar.deviation())),
        skewness: level(Some(solid.skewness()), Some(exemplar.skewness())),
        kl_orientation: distance(Some(kl_divergence(&solid.orientation, &exemplar.orientation))),
        coherence: level(Some(solid.coherence), Some(exemplar.coherence)),
        fringe_length: level(solid.fringes.mean_length(), exemplar.fringes.mean_length()),
        fringe_length_by_ends: level(
            solid.fringes.mean_length_by_ends(),
            exemplar.fringes.mean_length_by_ends(),
        ),
        tortuosity: level(solid.fringes.mean_tortuosity(), exemplar.fringes.mean_tortuosity()),
        s2: distance(s2),
        lineal_path: distance(Some(path)),
        chord_ratio: ratio(mean(solid, 0), mean(exemplar, 0)),
        local_porosity: distance(Some(wasserstein_sorted(&exemplar.porosities, &solid.porosities))),
        swd7: distance(swd(0)),
        swd16: distance(swd(1)),
        gradient_ratio: ratio(Some(solid.gradient), Some(exemplar.gradient)),
        swd31: distance(swd(2)),
        scale_magnitudes: distance(magnitudes),
        scale_phases: distance(phases),
        boundary_ratio: ratio(Some(solid.boundary), Some(exemplar.boundary)),
        euler: level(Some(1e4 * solid.euler), Some(1e4 * exemplar.euler)),
        dark_chord_ratio: ratio(mean(solid, 1), mean(exemplar, 1)),
        chord_variation: level(variation(solid, 0), variation(exemplar, 0)),
        dark_chord_variation: level(variation(solid, 1), variation(exemplar, 1)),
        curves: Curves::default(),
    }
}

fn curves(exemplar: &Statistics, solid: &Statistics, settings: &Settings<'_>) -> Curves {
    let both = |of: &dyn Fn(&Statistics) -> Vec<f64>| [of(exemplar), of(solid)];
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let r = settings.reach;
    Curves {
        grey: both(&|s| s.grey.clone()),
        orientation: both(&|s| s.orientation.clone()),
        two_point: both(&|s| radial_mean(s.two_point.view())),
        two_point_along: both(&|s| s.two_point.row(r).iter().skip(r).copied().collect()),
        two_point_across: both(&|s| s.two_point.column(r).iter().skip(r).copied().collect()),
        lineal_path: both(&|s| {
            s.lineal_path[0]
                .iter()
                .zip(&s.lineal_path[1])
                .map(|(a, b)| (a + b) / 2.0)
                .collect()
        }),
        chords: both(&|s| fractions(&s.chords[0], 2 * r)),
        dark_chords: both(&|s| fractions(&s.chords[1], 2 * r)),
        scale_magnitudes: both(&|s| s.scales.iter().flat_map(CrossScale::magnitudes).collect()),
        scale_phases: both(&|s| {
            s.scales
                .iter()
                .flat_map(|of| of.phases().as_flattened().to_vec())
                .collect()
        }),
        local_porosity: both(&|s| histogram(s.porosities.iter().copied(), POROSITY_BINS)),
        fringe_lengths: both(&|s| sorted(s.fringes.lengths.clone())),
        tortuosities: both(&|s| sorted(s.fringes.tortuosities.clone())),
        deviations: both(&|s| s.moments.iter().map(|m| m.deviation).collect()),
        skewnesses: both(&|s| s.moments.iter().map(|m| m.skewness).collect()),
        threshold: settings.threshold,
        cell: settings.cell,
        period: settings.band.map(|band| band.period),
        direction: settings.band.and_then(|band| band.direction),
        window: settings.window,
    }
}

/// Fractions of chords of 1 to `longest` pixels.
fn fractions(chords: &[usize], longest: usize) -> Vec<f64> {
    let mut fractions = vec![0.0; longest];
    for &chord in chords.iter().filter(|&&chord| chord <= longest) {
        fractions[chord - 1] += 1.0 / chords.len() as f64;
    }
    fractions
}
