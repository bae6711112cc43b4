//! A solid's slices compared with its exemplar by every measure.

use super::figures::{Comparison, Curves, Figure};
use super::portrait::{POROSITY_BINS, Portrait, Settings};
use super::{BandPass, grey, histogram, kl_divergence, otsu_threshold, radial_mean, sliced_wasserstein, wasserstein};
use ndarray::{Array2, Array3, ArrayView3, Axis};
use std::ops::ControlFlow;
use stereology_spectrum::SpectrumError;

/// How to compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureOptions {
    /// Patches drawn from each side.
    pub patches: usize,
    /// Directions of the sliced Wasserstein distance.
    pub projections: usize,
    /// Chooses patches and directions.
    pub seed: u64,
    /// The band of the fringes; `None` takes it from the exemplar.
    pub band: Option<BandPass>,
}

impl Default for MeasureOptions {
    /// 16,384 patches, 128 directions, seed 0, band from the exemplar.
    fn default() -> Self {
        Self {
            patches: 16_384,
            projections: 128,
            seed: 0,
            band: None,
        }
    }
}

impl MeasureOptions {
    /// With another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With a band for the fringes.
    #[must_use]
    pub fn with_band(self, band: BandPass) -> Self {
        Self {
            band: Some(band),
            ..self
        }
    }

    /// With so many patches from each side.
    #[must_use]
    pub fn with_patches(self, patches: usize) -> Self {
        Self { patches, ..self }
    }
}

/// Why a comparison cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// Nothing to compare.
    #[error("the {side} has no pictures")]
    Empty {
        /// Which side: exemplar or volume.
        side: &'static str,
    },
    /// A picture is too small.
    #[error("the {side} shows a picture of {width} x {height} pixels; at least {least} x {least} are needed")]
    TooSmall {
        /// Which side.
        side: &'static str,
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Pixels needed each way.
        least: usize,
    },
    /// A sample is not a number.
    #[error("the {side} holds samples that are not finite; replace them before measuring")]
    NotFinite {
        /// Which side.
        side: &'static str,
    },
    /// The exemplar has one grey level.
    #[error("the exemplar has one grey level everywhere: there is nothing to compare with")]
    ConstantExemplar,
    /// Transform of a picture.
    #[error(transparent)]
    Spectrum(#[from] SpectrumError),
    /// The callback broke off.
    #[error("cancelled")]
    Cancelled,
}

/// Pixels that an exemplar needs each way, so that its halves can be measured; half as many suffice for slices.
const LEAST: usize = 16;

/// Compares the slices of a solid with an exemplar, values 0 to 1, axes (row, column, channel); the exemplar may be several pictures, such as the slices of a true volume.
///
/// Colours are compared as they are by patches if both sides have as many channels, else as grey; everything else is of grey. The bright phase is what lies above Otsu's level of the exemplar.
/// Cost: about .3 s a million pixels and core, and 3 s for the patches.
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
/// use stereology_exemplar::measure::{MeasureOptions, compare};
///
/// let waves = |shift: usize| Array3::from_shape_fn((64, 64, 1), move |(y, x, _)| 0.5 + 0.5 * (((x + shift) * (y + 7)) as f32 * 0.003).sin());
/// let exemplar = waves(0);
/// let blurred = waves(3).mapv(|v| 0.5 + 0.7 * (v - 0.5));
/// let options = MeasureOptions::default().with_patches(500);
/// let found = compare(&[exemplar.view()], &[blurred.view()], &options, &|_| ControlFlow::Continue(()))?;
/// assert!((found.std_ratio.value.unwrap() - 0.7).abs() < 0.02);
/// assert!((found.gradient_ratio.value.unwrap() - 0.7).abs() < 0.02);
/// # Ok::<(), stereology_exemplar::measure::MeasureError>(())
/// ```
pub fn compare(
    exemplar: &[ArrayView3<'_, f32>],
    slices: &[ArrayView3<'_, f32>],
    options: &MeasureOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Comparison, MeasureError> {
    check(exemplar, "exemplar", LEAST)?;
    check(slices, "volume", LEAST / 2)?;
    let as_colours = colours(exemplar).is_some() && colours(exemplar) == colours(slices);
    let (exemplar, slices) = (pictures(exemplar, as_colours), pictures(slices, as_colours));
    let exemplar: Vec<ArrayView3<'_, f32>> = exemplar.iter().map(|p| p.view()).collect();
    let slices: Vec<ArrayView3<'_, f32>> = slices.iter().map(|p| p.view()).collect();
    let settings = settings(&exemplar, &slices, options)?;
    let seed = options.seed;
    let told = |done: f64| match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(MeasureError::Cancelled),
    };
    told(0.0)?;
    let of_exemplar = Portrait::of(&exemplar, &settings, seed)?;
    if of_exemplar.deviation() < 1e-6 {
        return Err(MeasureError::ConstantExemplar);
    }
    told(0.1)?;
    let of_slices = Portrait::of(&slices, &settings, seed.wrapping_add(1))?;
    told(0.6)?;
    let mut found = apart(&of_exemplar, &of_slices, options);
    told(0.7)?;
    let mut halves = Vec::new();
    for (cut, axis) in [Axis(1), Axis(0)].into_iter().enumerate() {
        let half = |part: usize| -> Result<Portrait, MeasureError> {
            let parts: Vec<ArrayView3<'_, f32>> = exemplar
                .iter()
                .map(|p| {
                    let n = p.len_of(axis) / 2;
                    p.slice_axis(axis, (part * n..part * n + n).into())
                })
                .collect();
            Portrait::of(&parts, &settings, seed.wrapping_add(2 + 2 * cut as u64 + part as u64))
        };
        halves.push(apart(&half(0)?, &half(1)?, options));
        told(0.85 + 0.15 * cut as f64)?;
    }
    let floors: Vec<Vec<Option<f64>>> = halves
        .iter()
        .map(|half| {
            half.figures()
                .iter()
                .map(|(_, f)| Some((f.value? - f.ideal?).abs()))
                .collect()
        })
        .collect();
    for (i, figure) in found.each_mut().into_iter().enumerate() {
        let of: Vec<f64> = floors.iter().filter_map(|cut| cut[i]).collect();
        figure.floor = (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64);
    }
    found.curves = curves(&of_exemplar, &of_slices, &settings);
    Ok(found)
}

impl Comparison {
    /// The figures in the order of [`Comparison::figures`].
    fn each_mut(&mut self) -> [&mut Figure; 15] {
        [
            &mut self.kl_grey,
            &mut self.std_ratio,
            &mut self.skewness,
            &mut self.kl_orientation,
            &mut self.coherence,
            &mut self.fringe_length,
            &mut self.fringe_length_by_ends,
            &mut self.tortuosity,
            &mut self.s2,
            &mut self.lineal_path,
            &mut self.chord_ratio,
            &mut self.local_porosity,
            &mut self.swd7,
            &mut self.swd16,
            &mut self.gradient_ratio,
        ]
    }
}

fn check(pictures: &[ArrayView3<'_, f32>], side: &'static str, least: usize) -> Result<(), MeasureError> {
    if pictures.is_empty() {
        return Err(MeasureError::Empty { side });
    }
    for picture in pictures {
        let (height, width, channels) = picture.dim();
        if height < least || width < least || channels == 0 {
            return Err(MeasureError::TooSmall {
                side,
                width,
                height,
                least,
            });
        }
        if picture.iter().any(|v| !v.is_finite()) {
            return Err(MeasureError::NotFinite { side });
        }
    }
    Ok(())
}

/// Channels that are compared, 1 or 3, opacity left out; `None` if pictures differ.
fn colours(pictures: &[ArrayView3<'_, f32>]) -> Option<usize> {
    let of = |p: &ArrayView3<'_, f32>| if p.dim().2 >= 3 { 3 } else { 1 };
    let first = of(pictures.first()?);
    pictures.iter().all(|p| of(p) == first).then_some(first)
}

fn pictures(views: &[ArrayView3<'_, f32>], as_colours: bool) -> Vec<Array3<f32>> {
    views
        .iter()
        .map(|view| {
            if as_colours && view.dim().2 >= 3 {
                view.slice_axis(Axis(2), (..3).into()).to_owned()
            } else {
                grey(*view).insert_axis(Axis(2))
            }
        })
        .collect()
}

fn settings(
    exemplar: &[ArrayView3<'_, f32>],
    slices: &[ArrayView3<'_, f32>],
    options: &MeasureOptions,
) -> Result<Settings, MeasureError> {
    let least =
        |side: &dyn Fn(&ArrayView3<'_, f32>) -> usize| exemplar.iter().chain(slices).map(side).min().unwrap_or(LEAST);
    let window = [least(&|p| p.dim().0), least(&|p| p.dim().1)];
    let half = exemplar
        .iter()
        .map(|p| p.dim().0.min(p.dim().1) / 2)
        .min()
        .unwrap_or(LEAST);
    let reach = (window[0].min(window[1]).min(half) / 2).clamp(2, 32);
    let levels: Vec<Array2<f32>> = exemplar.iter().map(|p| grey(*p)).collect();
    let band = match options.band {
        Some(band) => band,
        // The middle picture stands for all.
        None => BandPass::of(&levels[levels.len() / 2].mapv(f64::from))?,
    };
    Ok(Settings {
        threshold: otsu_threshold(levels.iter().flat_map(|p| p.iter().copied())),
        band,
        reach,
        cell: reach.min(16),
        window,
        patches: options.patches,
    })
}

/// The figures of `solid` beside `exemplar`, without floors.
fn apart(exemplar: &Portrait, solid: &Portrait, options: &MeasureOptions) -> Comparison {
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
        chord_ratio: ratio(solid.mean_chord(), exemplar.mean_chord()),
        local_porosity: distance(Some(wasserstein(&exemplar.porosities, &solid.porosities))),
        swd7: distance(swd(0)),
        swd16: distance(swd(1)),
        gradient_ratio: ratio(Some(solid.gradient), Some(exemplar.gradient)),
        curves: Curves::default(),
    }
}

fn curves(exemplar: &Portrait, solid: &Portrait, settings: &Settings) -> Curves {
    let both = |of: &dyn Fn(&Portrait) -> Vec<f64>| [of(exemplar), of(solid)];
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let r = settings.reach;
    Curves {
        grey: both(&|p| p.grey.clone()),
        orientation: both(&|p| p.orientation.clone()),
        two_point: both(&|p| radial_mean(p.two_point.view())),
        two_point_along: both(&|p| p.two_point.row(r).iter().skip(r).copied().collect()),
        two_point_across: both(&|p| p.two_point.column(r).iter().skip(r).copied().collect()),
        lineal_path: both(&|p| {
            p.lineal_path[0]
                .iter()
                .zip(&p.lineal_path[1])
                .map(|(a, b)| (a + b) / 2.0)
                .collect()
        }),
        chords: both(&|p| {
            let mut shares = vec![0.0; 2 * r];
            for &chord in p.chords.iter().filter(|&&chord| chord <= 2 * r) {
                shares[chord - 1] += 1.0 / p.chords.len() as f64;
            }
            shares
        }),
        local_porosity: both(&|p| histogram(p.porosities.iter().copied(), POROSITY_BINS)),
        fringe_lengths: both(&|p| sorted(p.fringes.lengths.clone())),
        tortuosities: both(&|p| sorted(p.fringes.tortuosities.clone())),
        deviations: both(&|p| p.moments.iter().map(|m| m.deviation).collect()),
        skewnesses: both(&|p| p.moments.iter().map(|m| m.skewness).collect()),
        threshold: settings.threshold,
        cell: settings.cell,
        period: settings.band.period,
        direction: settings.band.direction.map(|(angle, _)| angle.to_degrees()),
        window: settings.window,
    }
}
