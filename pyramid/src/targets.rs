//! Target distributions of the bands of a texture.

use ndarray::Array2;
use rayon::prelude::*;
use stereology_metrics::Finding;
use stereology_spectrum::{Complex, RealFft, frequency};

use crate::Quantiles;
use crate::bank::FilterBank;
use crate::exemplar::{FEWEST_PIXELS, View, quantiles};
use crate::filters::{Directions, band_response};

/// Target distributions of the bands of one component.
pub(crate) struct BandTargets {
    pub(crate) targets: Vec<Quantiles>,
    /// Target of each band; none for a band that is not changed.
    pub(crate) of_band: Vec<Option<usize>>,
}

impl BandTargets {
    /// Variance of the low-pass.
    pub(crate) fn low_variance(&self) -> f64 {
        let target = self.of_band.last().copied().flatten();
        target.map_or(0.0, |target| {
            let values = self.targets[target].sorted();
            let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
            self.targets[target].mean_square() - mean * mean
        })
    }

    /// Without a target for the low-pass.
    pub(crate) fn without_low(mut self) -> Self {
        if let Some(last) = self.of_band.last_mut() {
            *last = None;
        }
        self
    }

    /// Mean squares of the high-pass and of each level (sum over its `orientations`); variance of the low-pass.
    pub(crate) fn level_mean_squares(&self, orientations: usize) -> Vec<f64> {
        let of = |band: &Option<usize>| band.map_or(0.0, |target| self.targets[target].mean_square());
        let (high, rest) = self.of_band.split_at(1);
        let levels = rest[..rest.len() - 1].chunks(orientations);
        [of(&high[0])]
            .into_iter()
            .chain(levels.map(|bands| bands.iter().map(of).sum()))
            .chain([self.low_variance()])
            .collect()
    }
}

/// Whether the orientations of a level share one target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pooling {
    Apart,
    Together,
}

/// Bands of the components, and the coefficients whose filters lie sufficiently inside the mask.
pub(crate) struct Analysis {
    bank: FilterBank<f32>,
    /// For each level (high-pass, levels, low-pass): whether a sample counts.
    counted: Vec<Option<Vec<bool>>>,
    pub(crate) findings: Vec<Finding>,
}

impl Analysis {
    pub(crate) fn new(view: &View, levels: usize, orientations: usize) -> Self {
        let bank = FilterBank::new(&view.shape(), &[], levels, &Directions::plane(orientations));
        let mut findings = Vec::new();
        let counted = (0..levels + 2)
            .map(|i| {
                let shape = bank.shape_at(i.saturating_sub(1));
                let Some(mask) = view.mask.as_ref() else {
                    return view.mirrored().then(|| original_quarter(shape));
                };
                let fractions = filter_fractions(mask, i, levels, shape);
                let (mut counted, least) = enough(&fractions);
                if view.mirrored() {
                    let quarter = original_quarter(shape);
                    counted
                        .iter_mut()
                        .zip(quarter)
                        .for_each(|(counted, original)| *counted &= original);
                }
                if least < 0.5 {
                    let name = match i {
                        0 => "the high-pass".to_owned(),
                        i if i == levels + 1 => "the low-pass".to_owned(),
                        i => format!("level {}", i - 1),
                    };
                    let message = format!(
                        "the regions of the mask are small for {name} of the pyramid: samples with only {:.0} % of their \
                         filter inside the mask were used",
                        100.0 * least
                    );
                    findings.push(Finding::new("few-samples", message));
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
        // Bands that share a target, and the level of their mask.
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
        let mut of_band = vec![None; ranges.len()];
        groups
            .iter()
            .enumerate()
            .for_each(|(g, (_, bands))| bands.iter().for_each(|&b| of_band[b] = Some(g)));
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

/// The samples of a level of a mirrored exemplar that lie in the original quarter.
fn original_quarter(shape: &[usize]) -> Vec<bool> {
    let half = |n: usize| n.div_ceil(2);
    (0..shape[0])
        .flat_map(|y| (0..shape[1]).map(move |x| (y, x)))
        .map(|(y, x)| y < half(shape[0]) && x < half(shape[1]))
        .collect()
}

/// For each sample of a level, the fraction of the energy of its filter that lies on the mask.
fn filter_fractions(mask: &Array2<bool>, i: usize, levels: usize, shape: &[usize]) -> Vec<f64> {
    let (height, width) = mask.dim();
    let fft = RealFft::<f64>::new(&[height, width]).expect("a checked mask");
    let kernel = Array2::from_shape_fn((height, width / 2 + 1), |(y, x)| {
        let r = 2.0 * frequency(y, height).hypot(x as f64 / width as f64);
        Complex::new(band_response(r, i, levels), 0.0)
    });
    let mut energy = fft.inverse(kernel).expect("the planned shape");
    energy.mapv_inplace(|v| v * v);
    let total = energy.sum();
    let on_mask = mask.mapv(|m| if m { 1.0 } else { 0.0 });
    let spectrum = fft.forward(on_mask.view()).expect("the planned shape")
        * fft.forward(energy.view()).expect("the planned shape");
    let fraction = fft.inverse(spectrum).expect("the planned shape");
    let nearest = |i: usize, level: usize, full: usize| (2 * i * full + level) / (2 * level) % full;
    (0..shape[0])
        .flat_map(|y| (0..shape[1]).map(move |x| (y, x)))
        .map(|(y, x)| fraction[[nearest(y, shape[0], height), nearest(x, shape[1], width)]] / total)
        .collect()
}

/// The samples inside the mask by the strictest limit of the fraction that leaves enough of them, and that limit.
fn enough(fractions: &[f64]) -> (Vec<bool>, f64) {
    let inside = fractions.iter().filter(|&&s| s >= 0.5).count();
    let needed = (inside / 4).max(FEWEST_PIXELS.min(fractions.len() / 8)).max(1);
    let limit = [0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
        .into_iter()
        .find(|&limit| fractions.iter().filter(|&&s| s >= limit).count() >= needed)
        .unwrap_or(0.0);
    let limit = if limit > 0.0 {
        limit
    } else {
        fractions.iter().copied().fold(0.0, f64::max)
    };
    (fractions.iter().map(|&s| s >= limit).collect(), limit)
}
