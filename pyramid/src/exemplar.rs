//! Exemplars: images of textures, checked and decomposed into colour components.

use ndarray::{Array2, ArrayView2, ArrayView3, Axis};
use rayon::prelude::*;
use stereology_spectrum::{
    RadialSpectrum, RealFft, frequency, masked_autocovariance, periodic_component, radial_spectrum,
};

use crate::fill::fill_outside;
use crate::{Edges, PrincipalColours, Quantiles, TextureError};

/// Smallest number of pixels for statistics.
pub(crate) const FEWEST_PIXELS: usize = 64;
/// Number of quantiles kept per band or channel; more add no information.
const QUANTILES: usize = 1 << 16;
/// Largest number of samples that are sorted; larger pools are subsampled evenly.
const SAMPLES: usize = 1 << 22;
/// Number of radial bins of the slice spectrum up to Nyquist.
const RADIAL_BINS: usize = 32;
/// Weights of red, green and blue in brightness (Rec. 601, of encoded values).
const BRIGHTNESS: [f64; 3] = [0.299, 0.587, 0.114];
/// Largest lag of the covariance under a mask, in pixels.
const REACH: usize = 64;

/// An image of a texture (rows, columns, channels) with values of any range, and the mask of the pixels that count.
#[derive(Clone, Copy, Debug)]
pub struct Exemplar<'a> {
    /// Values (y, x, channel).
    pub image: ArrayView3<'a, f32>,
    /// Mask of the pixels that count; `None` for all. Values outside are never read.
    pub mask: Option<ArrayView2<'a, bool>>,
}

impl<'a> Exemplar<'a> {
    /// An exemplar in which all pixels count.
    #[must_use]
    pub fn new(image: ArrayView3<'a, f32>) -> Self {
        Self { image, mask: None }
    }

    /// Sets the mask (y, x), true for the pixels that count.
    #[must_use]
    pub fn with_mask(mut self, mask: ArrayView2<'a, bool>) -> Self {
        self.mask = Some(mask);
        self
    }
}

/// Checked exemplars (one, or one per axis), with treated edges and common colour components.
pub(crate) struct Prepared {
    pub(crate) colours: PrincipalColours,
    /// Distribution of each channel.
    pub(crate) channels: Vec<Quantiles>,
    pub(crate) views: Vec<View>,
}

/// One exemplar's colour components.
pub(crate) struct View {
    /// Components (y, x), filled smoothly outside the mask; with twice the sides if mirrored.
    pub(crate) components: Vec<Array2<f32>>,
    pub(crate) mask: Option<Array2<bool>>,
    edges: Edges,
}

impl Prepared {
    pub(crate) fn new(exemplars: &[Exemplar<'_>], edges: Edges) -> Result<Self, TextureError> {
        let channels = exemplars.first().map_or(0, |exemplar| exemplar.image.dim().2);
        let mut inside: Vec<Vec<f32>> = Vec::new();
        let (mut planes_of, mut masks) = (Vec::new(), Vec::new());
        for exemplar in exemplars {
            let found = exemplar.image.dim().2;
            if found != channels {
                return Err(TextureError::ChannelsDiffer {
                    expected: channels,
                    found,
                });
            }
            let (height, width, _) = exemplar.image.dim();
            let mask = checked_mask(exemplar)?;
            let counts = |at: (usize, usize)| mask.as_ref().is_none_or(|mask| mask[at]);
            let slices: Vec<ArrayView2<'_, f32>> = exemplar.image.axis_iter(Axis(2)).collect();
            let planes: Vec<Array2<f32>> = slices
                .into_par_iter()
                .map(|plane| plane_without_edges(plane, mask.as_ref(), edges))
                .collect();
            inside.push(
                (0..height)
                    .flat_map(|y| (0..width).map(move |x| (y, x)))
                    .filter(|&at| counts(at))
                    .flat_map(|at| planes.iter().map(move |plane| plane[at]))
                    .collect(),
            );
            let mask = mask.map(|mask| {
                if edges == Edges::Mirror {
                    mirrored(mask.view())
                } else {
                    mask
                }
            });
            planes_of.push(planes);
            masks.push(mask);
        }
        // Every exemplar has the same weight, whatever its size.
        let least = inside.iter().map(|values| values.len() / channels).min().unwrap_or(0);
        let pooled: Vec<f32> = inside
            .iter()
            .flat_map(|values| {
                let n = values.len() / channels;
                (0..least).flat_map(move |i| {
                    let at = i * n / least * channels;
                    values[at..at + channels].iter().copied()
                })
            })
            .collect();
        let mut colours = PrincipalColours::fit(channels, pooled.chunks_exact(channels));
        if channels == BRIGHTNESS.len() {
            colours = colours.led_by(&BRIGHTNESS);
        }
        let views = planes_of
            .iter()
            .zip(masks)
            .map(|(planes, mask)| View {
                components: components(planes, &colours),
                mask,
                edges,
            })
            .collect();
        let channels = (0..channels)
            .map(|c| {
                quantiles(
                    pooled.iter().skip(c).step_by(channels).copied(),
                    pooled.len() / channels,
                )
            })
            .collect();
        Ok(Self {
            colours,
            channels,
            views,
        })
    }

    /// Number of colour components.
    pub(crate) fn count(&self) -> usize {
        self.channels.len()
    }

    /// Fraction of the variance in a component.
    pub(crate) fn variance_fraction(&self, component: usize) -> f64 {
        let variances = self.colours.variances();
        variances[component] / variances.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Whether a component varies enough to be synthesised.
    pub(crate) fn varies(&self, component: usize) -> bool {
        self.colours.variances()[component] > 1e-12 && self.variance_fraction(component) > 1e-9
    }

    /// Target spectrum of the slices of a volume in one component: the mean over the exemplars.
    pub(crate) fn slice_spectrum(&self, component: usize) -> RadialSpectrum {
        let mut spectra = self.views.iter().map(|view| view.spectrum(component));
        let mut mean = spectra.next().expect("at least one exemplar");
        for other in spectra {
            mean.power.iter_mut().zip(&other.power).for_each(|(m, p)| *m += p);
        }
        let n = self.views.len() as f64;
        mean.power.iter_mut().for_each(|p| *p /= n);
        mean
    }
}

impl View {
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.components[0].nrows(), self.components[0].ncols()]
    }

    pub(crate) fn transposed(&self) -> Self {
        let turned = |image: &Array2<f32>| image.t().as_standard_layout().into_owned();
        Self {
            components: self.components.iter().map(turned).collect(),
            mask: self
                .mask
                .as_ref()
                .map(|mask| mask.t().as_standard_layout().into_owned()),
            edges: self.edges,
        }
    }

    pub(crate) fn mirrored(&self) -> bool {
        self.edges == Edges::Mirror
    }

    fn spectrum(&self, component: usize) -> RadialSpectrum {
        let image = &self.components[component];
        match &self.mask {
            None => radial_spectrum(image.view(), RADIAL_BINS).expect("a checked image"),
            Some(mask) => masked_spectrum(&image.mapv(f64::from), mask.view()),
        }
    }
}

/// Checks sizes, channels, mask and values. Returns the mask if it excludes any pixel.
fn checked_mask(exemplar: &Exemplar<'_>) -> Result<Option<Array2<bool>>, TextureError> {
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
    let selected = mask
        .as_ref()
        .map_or(height * width, |mask| mask.iter().filter(|m| **m).count());
    if selected < FEWEST_PIXELS {
        return Err(TextureError::MaskTooSmall {
            selected,
            needed: FEWEST_PIXELS,
        });
    }
    let counts = |at: (usize, usize)| mask.as_ref().is_none_or(|mask| mask[at]);
    let bad = |((y, x, _), v): &((usize, usize, usize), &f32)| !v.is_finite() && counts((*y, *x));
    if let Some(((row, column, _), _)) = exemplar.image.indexed_iter().find(bad) {
        return Err(TextureError::NotFinite { row, column });
    }
    Ok(mask)
}

fn components(planes: &[Array2<f32>], colours: &PrincipalColours) -> Vec<Array2<f32>> {
    let mut components = vec![Array2::zeros(planes[0].dim()); planes.len()];
    let (mut colour, mut component) = (vec![0.0; planes.len()], vec![0.0; planes.len()]);
    for y in 0..planes[0].nrows() {
        for x in 0..planes[0].ncols() {
            colour.iter_mut().zip(planes).for_each(|(v, plane)| *v = plane[[y, x]]);
            colours.decorrelate(&colour, &mut component);
            components
                .iter_mut()
                .zip(&component)
                .for_each(|(plane, &v)| plane[[y, x]] = v);
        }
    }
    components
}

/// An image with its mirror images beside and below it: twice the sides, without a jump where it wraps around.
fn mirrored<T: Copy>(image: ArrayView2<'_, T>) -> Array2<T> {
    let (height, width) = image.dim();
    let back = |i: usize, n: usize| if i < n { i } else { 2 * n - 1 - i };
    Array2::from_shape_fn((2 * height, 2 * width), |(y, x)| {
        image[[back(y, height), back(x, width)]]
    })
}

/// One channel, filled outside the mask and with treated edges; the mean inside the mask is kept.
fn plane_without_edges(plane: ArrayView2<'_, f32>, mask: Option<&Array2<bool>>, edges: Edges) -> Array2<f32> {
    let mut plane = plane.to_owned();
    if let Some(mask) = mask {
        fill_outside(&mut plane, mask.view());
    }
    match edges {
        Edges::Wrap => return plane,
        Edges::Mirror => return mirrored(plane.view()),
        Edges::PeriodicComponent => {}
    }
    let mean = |values: &Array2<f32>| {
        let inside = values
            .iter()
            .enumerate()
            .filter(|(i, _)| mask.is_none_or(|mask| mask.as_slice().is_none_or(|mask| mask[*i])));
        let (sum, n) = inside.fold((0.0, 0.0), |(sum, n), (_, &v)| (sum + f64::from(v), n + 1.0));
        sum / n
    };
    let mut periodic = periodic_component(plane.view()).expect("a checked image, filled outside the mask");
    #[allow(clippy::cast_possible_truncation, reason = "a small correction of f32 values")]
    let shift = (mean(&plane) - mean(&periodic)) as f32;
    periodic.mapv_inplace(|v| v + shift);
    periodic
}

pub(crate) fn quantiles(values: impl Iterator<Item = f32>, count: usize) -> Quantiles {
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
    // An estimate from few pairs can be negative.
    let floor = 1e-5 * power.iter().copied().fold(0.0, f64::max);
    power.iter_mut().for_each(|p| *p = p.max(floor));
    RadialSpectrum {
        frequency: (0..bins).map(|i| (i as f64 + 0.5) * width).collect(),
        power,
        count,
    }
}
