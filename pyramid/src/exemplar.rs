//! An exemplar and the statistics that its texture is made of.

use ndarray::{Array2, ArrayView2, ArrayView3, Axis};
use rayon::prelude::*;
use stereology_spectrum::{
    Complex, RadialSpectrum, RealFft, frequency, masked_autocovariance, periodic_component, radial_spectrum,
};

use crate::bank::FilterBank;
use crate::fill::fill_outside;
use crate::filters::{high_pass, low_pass};
use crate::{Finding, PrincipalColours, Quantiles, TextureError};

/// Fewest pixels that statistics are taken from.
const FEWEST_PIXELS: usize = 64;
/// Quantiles kept of a band or channel: beyond, they say nothing new.
const QUANTILES: usize = 1 << 16;
/// Samples of a pool that are sorted; larger pools are thinned out evenly.
const SAMPLES: usize = 1 << 22;
/// Radial bins of the slice spectrum up to Nyquist.
const RADIAL_BINS: usize = 32;
/// Farthest lag of the covariance under a mask, in pixels.
const REACH: usize = 64;

/// A picture of a texture (rows, columns, channels), values of any range around any mean, and the pixels that count.
#[derive(Clone, Copy, Debug)]
pub struct Exemplar<'a> {
    /// Values (y, x, channel).
    pub image: ArrayView3<'a, f32>,
    /// Pixels whose statistics count; all, if `None`. Values outside are never read.
    pub mask: Option<ArrayView2<'a, bool>>,
}

impl<'a> Exemplar<'a> {
    /// An exemplar all of whose pixels count.
    #[must_use]
    pub fn new(image: ArrayView3<'a, f32>) -> Self {
        Self { image, mask: None }
    }

    /// With a mask (y, x) that is true where pixels count.
    #[must_use]
    pub fn with_mask(mut self, mask: ArrayView2<'a, bool>) -> Self {
        self.mask = Some(mask);
        self
    }
}

/// An exemplar that was checked, made periodic and taken apart into colour components.
pub(crate) struct Prepared {
    pub(crate) colours: PrincipalColours,
    /// Distribution of each channel.
    pub(crate) channels: Vec<Quantiles>,
    /// Components (y, x), the pixels outside the mask filled smoothly.
    pub(crate) components: Vec<Array2<f32>>,
    mask: Option<Array2<bool>>,
}

impl Prepared {
    pub(crate) fn new(exemplar: &Exemplar<'_>) -> Result<Self, TextureError> {
        let (height, width, channels) = exemplar.image.dim();
        if height < 8 || width < 8 {
            return Err(TextureError::ExemplarTooSmall { height, width });
        }
        if channels == 0 {
            return Err(TextureError::NoChannels);
        }
        if let Some(mask) = exemplar.mask
            && mask.dim() != (height, width)
        {
            return Err(TextureError::MaskShape {
                mask: [mask.nrows(), mask.ncols()],
                image: [height, width],
            });
        }
        let mask = exemplar
            .mask
            .filter(|mask| !mask.iter().all(|&m| m))
            .map(|mask| mask.to_owned());
        let counts = |at: (usize, usize)| mask.as_ref().is_none_or(|mask| mask[at]);
        let selected = mask
            .as_ref()
            .map_or(height * width, |mask| mask.iter().filter(|m| **m).count());
        if selected < FEWEST_PIXELS {
            return Err(TextureError::MaskTooSmall {
                selected,
                needed: FEWEST_PIXELS,
            });
        }
        if let Some(((row, column, _), _)) = exemplar
            .image
            .indexed_iter()
            .find(|((y, x, _), v)| !v.is_finite() && counts((*y, *x)))
        {
            return Err(TextureError::NotFinite { row, column });
        }
        let views: Vec<ArrayView2<'_, f32>> = exemplar.image.axis_iter(Axis(2)).collect();
        let planes: Vec<Array2<f32>> = views
            .into_par_iter()
            .map(|plane| periodic_plane(plane, mask.as_ref()))
            .collect();
        let inside: Vec<f32> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (y, x)))
            .filter(|&at| counts(at))
            .flat_map(|at| planes.iter().map(move |plane| plane[at]))
            .collect();
        let colours = PrincipalColours::fit(channels, inside.chunks_exact(channels));
        let channels = (0..channels)
            .map(|c| quantiles(inside.iter().skip(c).step_by(channels).copied(), selected))
            .collect();
        let mut components = vec![Array2::zeros((height, width)); planes.len()];
        let (mut colour, mut component) = (vec![0.0; planes.len()], vec![0.0; planes.len()]);
        for y in 0..height {
            for x in 0..width {
                colour.iter_mut().zip(&planes).for_each(|(v, plane)| *v = plane[[y, x]]);
                colours.decorrelate(&colour, &mut component);
                components
                    .iter_mut()
                    .zip(&component)
                    .for_each(|(plane, &v)| plane[[y, x]] = v);
            }
        }
        Ok(Self {
            colours,
            channels,
            components,
            mask,
        })
    }

    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.components[0].nrows(), self.components[0].ncols()]
    }

    /// Whether a component varies enough to have a texture.
    pub(crate) fn varies(&self, component: usize) -> bool {
        let variances = self.colours.variances();
        variances[component] > 1e-12 && variances[component] > 1e-9 * variances[0]
    }

    /// Spectrum that the slices of a volume should have in one component.
    pub(crate) fn slice_spectrum(&self, component: usize) -> RadialSpectrum {
        let image = &self.components[component];
        match &self.mask {
            None => radial_spectrum(image.view(), RADIAL_BINS).expect("a checked image"),
            Some(mask) => masked_spectrum(&image.mapv(f64::from), mask.view()),
        }
    }
}

/// One channel, filled outside the mask, without jumps at its edges, with the mean of its pixels that count kept.
fn periodic_plane(plane: ArrayView2<'_, f32>, mask: Option<&Array2<bool>>) -> Array2<f32> {
    let mut plane = plane.to_owned();
    if let Some(mask) = mask {
        fill_outside(&mut plane, mask.view());
    }
    let mean = |values: &Array2<f32>| {
        let inside = values
            .iter()
            .enumerate()
            .filter(|(i, _)| mask.is_none_or(|mask| mask.as_slice().is_none_or(|mask| mask[*i])));
        let (sum, n) = inside.fold((0.0, 0.0), |(sum, n), (_, &v)| (sum + f64::from(v), n + 1.0));
        sum / n
    };
    let mut periodic = periodic_component(plane.view()).expect("a checked image, filled where it was not");
    #[allow(clippy::cast_possible_truncation, reason = "a small correction of f32 values")]
    let shift = (mean(&plane) - mean(&periodic)) as f32;
    periodic.mapv_inplace(|v| v + shift);
    periodic
}

fn quantiles(values: impl Iterator<Item = f32>, count: usize) -> Quantiles {
    let step = count.div_ceil(SAMPLES).max(1);
    let kept: Vec<f32> = values.step_by(step).collect();
    Quantiles::new(kept)
        .expect("finite values of a checked exemplar, at least one")
        .reduced(QUANTILES)
}

/// Radial spectrum of the pixels under a mask: the transform of their covariance, tapered by a Hann window.
#[allow(clippy::cast_possible_truncation, reason = "bin numbers are small and not negative")]
fn masked_spectrum(image: &Array2<f64>, mask: ArrayView2<'_, bool>) -> RadialSpectrum {
    let reach = REACH.min(image.nrows().min(image.ncols()) / 2);
    let (covariance, pairs) = masked_autocovariance(image.view(), mask, reach).expect("a checked mask and image");
    let side = 2 * reach + 2;
    let mut tapered = Array2::zeros((side, side));
    for ((i, j), &c) in covariance.indexed_iter() {
        let lag = (i as f64 - reach as f64).hypot(j as f64 - reach as f64) / (reach + 1) as f64;
        if lag < 1.0 && pairs[[i, j]] >= 16.0 {
            let taper = 0.5 + 0.5 * (std::f64::consts::PI * lag).cos();
            tapered[[(i + side - reach) % side, (j + side - reach) % side]] = c * taper;
        }
    }
    let fft = RealFft::<f64>::new(&[side, side]).expect("a positive size");
    let spectrum = fft.forward(tapered.view()).expect("the planned shape");
    let width = 0.5 / RADIAL_BINS as f64;
    let bins = (std::f64::consts::FRAC_1_SQRT_2 / width).floor() as usize + 1;
    let (mut power, mut count) = (vec![0.0; bins], vec![0_u64; bins]);
    for ((y, x), value) in spectrum.indexed_iter().filter(|(at, _)| *at != (0, 0)) {
        let radius = frequency(y, side).hypot(x as f64 / side as f64);
        let bin = ((radius / width + 1e-9).floor() as usize).min(bins - 1);
        let twice = if x == 0 || 2 * x == side { 1 } else { 2 };
        power[bin] += twice as f64 * value.re;
        count[bin] += twice;
    }
    power.iter_mut().zip(&count).for_each(|(p, &c)| *p /= c.max(1) as f64);
    // An estimate from few pairs can fall below zero.
    let floor = 1e-5 * power.iter().copied().fold(0.0, f64::max);
    power.iter_mut().for_each(|p| *p = p.max(floor));
    RadialSpectrum {
        frequency: (0..bins).map(|i| (i as f64 + 0.5) * width).collect(),
        power,
        count,
    }
}

/// Target distributions of the bands of one component.
pub(crate) struct BandTargets {
    pub(crate) targets: Vec<Quantiles>,
    /// Target of each band.
    pub(crate) of_band: Vec<usize>,
}

/// Whether the orientations of a level share one target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pooling {
    Apart,
    Together,
}

/// Bands of the components, each coefficient with the share of its filter's energy that falls on the mask.
pub(crate) struct Analysis {
    bank: FilterBank<f32>,
    /// For each level (high-pass, levels, low-pass): whether a sample counts.
    counted: Vec<Option<Vec<bool>>>,
    pub(crate) findings: Vec<Finding>,
}

impl Analysis {
    pub(crate) fn new(exemplar: &Prepared, levels: usize, orientations: usize) -> Self {
        let bank = FilterBank::new(&exemplar.shape(), levels, orientations);
        let mut findings = Vec::new();
        let counted = (0..levels + 2)
            .map(|i| {
                let mask = exemplar.mask.as_ref()?;
                let shape = bank.shape_at(i.saturating_sub(1));
                let shares = filter_shares(mask, i, levels, shape);
                let (counted, least) = enough(&shares);
                if least < 0.5 {
                    let name = match i {
                        0 => "the high-pass".to_owned(),
                        i if i == levels + 1 => "the low-pass".to_owned(),
                        i => format!("level {}", i - 1),
                    };
                    let message = format!(
                        "the mask's regions are small for {name} of the pyramid: samples were used of which only \
                         {:.0} % lie in the mask",
                        100.0 * least
                    );
                    findings.push(Finding {
                        code: "few-samples",
                        message,
                    });
                }
                Some(counted)
            })
            .collect();
        Self {
            bank,
            counted,
            findings,
        }
    }

    pub(crate) fn targets(&self, component: &Array2<f32>, pooling: Pooling) -> BandTargets {
        let mut coefficients = vec![0.0; self.bank.coefficients()];
        let field = component.as_slice().expect("components are in C order");
        self.bank.analyse(field, &mut coefficients, &mut self.bank.work());
        let (levels, count) = (self.bank.level_count(), self.bank.orientations());
        let ranges = self.bank.ranges();
        // The bands that share a target, and the level whose mask they share.
        let groups: Vec<(usize, Vec<usize>)> = [(0, vec![0])]
            .into_iter()
            .chain((0..levels).flat_map(|l| {
                let bands = 1 + l * count..1 + (l + 1) * count;
                match pooling {
                    Pooling::Together => vec![(l + 1, bands.collect())],
                    Pooling::Apart => bands.map(|b| (l + 1, vec![b])).collect(),
                }
            }))
            .chain([(levels + 1, vec![ranges.len() - 1])])
            .collect();
        let mut of_band = vec![0; ranges.len()];
        groups
            .iter()
            .enumerate()
            .for_each(|(g, (_, bands))| bands.iter().for_each(|&b| of_band[b] = g));
        let targets = groups
            .par_iter()
            .map(|(level, bands)| {
                let counted = self.counted[*level].as_ref();
                let values = bands
                    .iter()
                    .flat_map(|&b| coefficients[ranges[b].clone()].iter().enumerate());
                let kept = values
                    .filter(|(i, _)| counted.is_none_or(|counted| counted[*i]))
                    .map(|(_, &v)| v);
                let samples: usize = bands.len()
                    * counted.map_or(ranges[bands[0]].len(), |counted| counted.iter().filter(|c| **c).count());
                quantiles(kept, samples)
            })
            .collect();
        BandTargets { targets, of_band }
    }
}

/// For each sample of a level, the share of its filter's energy that falls on the mask.
fn filter_shares(mask: &Array2<bool>, i: usize, levels: usize, shape: &[usize]) -> Vec<f64> {
    let (height, width) = mask.dim();
    let fft = RealFft::<f64>::new(&[height, width]).expect("a checked mask");
    let cut = |level: usize| 0.5_f64.powi(i32::try_from(level).unwrap_or(i32::MAX) + 1);
    let response = |r: f64| {
        let below = |levels: usize| low_pass(r, 1.0) * (0..levels).map(|l| low_pass(r, cut(l))).product::<f64>();
        if i == 0 {
            high_pass(r, 1.0)
        } else if i > levels {
            below(levels)
        } else {
            below(i - 1) * high_pass(r, cut(i - 1))
        }
    };
    let kernel = Array2::from_shape_fn((height, width / 2 + 1), |(y, x)| {
        let r = 2.0 * frequency(y, height).hypot(x as f64 / width as f64);
        Complex::new(response(r), 0.0)
    });
    let mut energy = fft.inverse(kernel).expect("the planned shape");
    energy.mapv_inplace(|v| v * v);
    let total = energy.sum();
    let on_mask = mask.mapv(|m| if m { 1.0 } else { 0.0 });
    let spectrum = fft.forward(on_mask.view()).expect("the planned shape")
        * fft.forward(energy.view()).expect("the planned shape");
    let share = fft.inverse(spectrum).expect("the planned shape");
    let nearest = |i: usize, level: usize, full: usize| (2 * i * full + level) / (2 * level) % full;
    (0..shape[0])
        .flat_map(|y| (0..shape[1]).map(move |x| (y, x)))
        .map(|(y, x)| share[[nearest(y, shape[0], height), nearest(x, shape[1], width)]] / total)
        .collect()
}

/// The samples that lie well inside the mask, by the strictest of a few limits that leaves enough of them, and that limit.
fn enough(shares: &[f64]) -> (Vec<bool>, f64) {
    let inside = shares.iter().filter(|&&s| s >= 0.5).count();
    let needed = (inside / 4).max(FEWEST_PIXELS.min(shares.len() / 8)).max(1);
    let limit = [0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
        .into_iter()
        .find(|&limit| shares.iter().filter(|&&s| s >= limit).count() >= needed)
        .unwrap_or(0.0);
    let limit = if limit > 0.0 {
        limit
    } else {
        shares.iter().copied().fold(0.0, f64::max)
    };
    (shares.iter().map(|&s| s >= limit).collect(), limit)
}
