//! The filter bank of all pyramids: filters in the frequency domain, and a spectrum that is cropped from level to
//! level.
//!
//! The oriented bands of level `l` pass `H` with a cutoff at half the Nyquist frequency of the level. The low-pass `L`
//! with the same cutoff leaves a spectrum for a grid of `ceil(n/2)` samples per axis. Frequencies are those of the
//! first grid, from integer bin numbers, so nothing is lost at odd sizes. Coefficients have no gain: a constant image
//! has its value in the low-pass.

use std::ops::Range;

use rayon::prelude::*;
use stereology_spectrum::{Complex, Real, RealFft, Work};

use crate::filters::{Directions, high_pass, low_pass};

/// Smaller arrays are multiplied on the calling thread.
const PARALLEL_FROM: usize = 1 << 17;
const BLOCK: usize = 1 << 14;

/// Filters and transforms of all levels of fields of one shape (2D or 3D, with or without orientations).
#[derive(Clone, Debug)]
pub(crate) struct FilterBank<T: Real> {
    levels: Vec<Level<T>>,
    low: RealFft<T>,
    /// Filters for the frequencies beyond Nyquist (the corners of the frequency square or cube), and for the others.
    high_filter: Vec<T>,
    low_filter: Vec<T>,
    quadrature: bool,
    ranges: Vec<Range<usize>>,
}

#[derive(Clone, Debug)]
struct Level<T: Real> {
    fft: RealFft<T>,
    bands: Vec<Vec<T>>,
    low: Vec<T>,
}

/// Buffers of a bank, reused between calls.
#[derive(Clone, Debug)]
pub(crate) struct BankWork<T: Real> {
    spectra: Vec<Vec<Complex<T>>>,
    band: Vec<Complex<T>>,
    work: Vec<Work<T>>,
}

/// Shape of level `level` of a pyramid of fields of `shape` with distances `spacing` between samples along each axis
/// (equal if empty): an axis with wider spacing keeps its samples until the frequencies of the level need fewer.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a whole number of samples, at most the field's"
)]
pub(crate) fn level_shape(shape: &[usize], spacing: &[f64], level: usize) -> Vec<usize> {
    let finest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let ratio = |axis: usize| spacing.get(axis).map_or(1.0, |s| s / finest);
    let shrunk = 0.5_f64.powi(i32::try_from(level).unwrap_or(i32::MAX));
    shape
        .iter()
        .enumerate()
        .map(|(axis, &n)| ((n as f64 * ratio(axis) * shrunk).ceil() as usize).min(n))
        .collect()
}

/// Largest number of levels of a field: the coarsest band has at least 8 samples along the shortest axis.
pub(crate) fn most_levels(shape: &[usize], spacing: &[f64]) -> usize {
    let fits = |level: usize| level_shape(shape, spacing, level).iter().all(|&n| n >= 8);
    (0..usize::BITS as usize)
        .take_while(|&level| !shape.is_empty() && fits(level))
        .count()
}

impl<T: Real> FilterBank<T> {
    /// `shape` has two or three axes of at least 8; `levels` from 1 to [`most_levels`]; `spacing` has one number per
    /// axis, or is empty.
    pub(crate) fn new(shape: &[usize], spacing: &[f64], levels: usize, directions: &Directions) -> Self {
        let fft_of = |level: usize| {
            RealFft::<T>::new(&level_shape(shape, spacing, level)).expect("two or three axes of at least one sample")
        };
        let levels: Vec<Level<T>> = (0..levels)
            .map(|level| {
                let fft = fft_of(level);
                let cut = 0.5_f64.powi(i32::try_from(level).unwrap_or(i32::MAX) + 1);
                let filter = |f: &(dyn Fn(&[f64; 3], f64) -> f64 + Sync)| sample_filter(&fft, shape, spacing, f);
                let bands = (0..directions.count())
                    .map(|b| {
                        filter(&|k, r| {
                            let pass = high_pass(r, cut);
                            if pass == 0.0 {
                                pass
                            } else {
                                pass * directions.amplitude(b, k)
                            }
                        })
                    })
                    .collect();
                let low = filter(&|_, r| low_pass(r, cut));
                Level { bands, low, fft }
            })
            .collect();
        let low = fft_of(levels.len());
        let high_filter = sample_filter(&levels[0].fft, shape, spacing, &|_, r| high_pass(r, 1.0));
        let low_filter = sample_filter(&levels[0].fft, shape, spacing, &|_, r| low_pass(r, 1.0));
        let mut ranges = Vec::new();
        let mut start = 0;
        let mut push = |n: usize| {
            ranges.push(start..start + n);
            start += n;
        };
        push(levels[0].fft.samples());
        for level in &levels {
            (0..directions.count()).for_each(|_| push(level.fft.samples()));
        }
        push(low.samples());
        Self {
            quadrature: directions.quadrature(),
            levels,
            low,
            high_filter,
            low_filter,
            ranges,
        }
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.levels[0].fft.shape()
    }

    pub(crate) fn level_count(&self) -> usize {
        self.levels.len()
    }

    pub(crate) fn orientations(&self) -> usize {
        self.levels[0].bands.len()
    }

    /// Shape of the bands of a level; the low-pass band is at `level_count()`.
    pub(crate) fn shape_at(&self, level: usize) -> &[usize] {
        self.levels.get(level).map_or(self.low.shape(), |l| l.fft.shape())
    }

    /// Range of each band among the coefficients: high-pass, then level by level and orientation by orientation,
    /// low-pass.
    pub(crate) fn ranges(&self) -> &[Range<usize>] {
        &self.ranges
    }

    pub(crate) fn coefficients(&self) -> usize {
        self.ranges.last().map_or(0, |r| r.end)
    }

    pub(crate) fn work(&self) -> BankWork<T> {
        let zero = Complex::new(T::zero(), T::zero());
        let ffts = self.levels.iter().map(|l| &l.fft).chain([&self.low]);
        let spectra: Vec<Vec<Complex<T>>> = ffts
            .clone()
            .map(|fft| vec![zero; fft.spectrum_shape().iter().product()])
            .collect();
        BankWork {
            band: spectra[0].clone(),
            spectra,
            work: ffts.map(RealFft::work).collect(),
        }
    }

    /// Coefficients of a field.
    pub(crate) fn analyse(&self, field: &[T], coefficients: &mut [T], work: &mut BankWork<T>) {
        let BankWork { spectra, band, work } = work;
        let first = &self.levels[0].fft;
        first.forward_into(field, &mut spectra[0], &mut work[0]);
        let scale = T::one() / T::from_f64_lossy(first.samples() as f64);
        each(&mut spectra[0], |v, _| *v = *v * scale);
        let full = &mut band[..spectra[0].len()];
        pair(full, &spectra[0], &self.high_filter, |out, v, f| *out = v * f);
        first.inverse_into(full, &mut coefficients[self.ranges[0].clone()], &mut work[0]);
        each(&mut spectra[0], |v, i| *v = *v * self.low_filter[i]);
        let mut ranges = self.ranges[1..].iter();
        for (l, level) in self.levels.iter().enumerate() {
            let (here, below) = spectra.split_at_mut(l + 1);
            let spectrum = &mut here[l];
            let bins = &mut band[..spectrum.len()];
            for (filter, range) in level.bands.iter().zip(&mut ranges) {
                if self.quadrature {
                    pair(bins, spectrum, filter, |out, v, f| {
                        *out = Complex::new(-v.im * f, v.re * f);
                    });
                } else {
                    pair(bins, spectrum, filter, |out, v, f| *out = v * f);
                }
                level
                    .fft
                    .inverse_into(bins, &mut coefficients[range.clone()], &mut work[l]);
            }
            each(spectrum, |v, i| *v = *v * level.low[i]);
            let next = self.shape_at(l + 1);
            for_kept_rows(level.fft.shape(), next, |from, to, length| {
                below[0][to..to + length].copy_from_slice(&spectrum[from..from + length]);
            });
        }
        let last = self.levels.len();
        let low = &mut coefficients[self.ranges[self.ranges.len() - 1].clone()];
        self.low.inverse_into(&mut spectra[last], low, &mut work[last]);
    }

    /// Field of coefficients: the transpose of [`Self::analyse`] up to the number of samples, and its inverse.
    pub(crate) fn synthesise(&self, coefficients: &[T], field: &mut [T], work: &mut BankWork<T>) {
        let BankWork { spectra, band, work } = work;
        let last = self.levels.len();
        let zero = Complex::new(T::zero(), T::zero());
        let per_sample = |fft: &RealFft<T>| T::one() / T::from_f64_lossy(fft.samples() as f64);
        self.low.forward_into(
            &coefficients[self.ranges[self.ranges.len() - 1].clone()],
            &mut spectra[last],
            &mut work[last],
        );
        let scale = per_sample(&self.low);
        each(&mut spectra[last], |v, _| *v = *v * scale);
        for (l, level) in self.levels.iter().enumerate().rev() {
            let (here, below) = spectra.split_at_mut(l + 1);
            let spectrum = &mut here[l];
            each(spectrum, |v, _| *v = zero);
            for_kept_rows(level.fft.shape(), self.shape_at(l + 1), |to, from, length| {
                spectrum[to..to + length].copy_from_slice(&below[0][from..from + length]);
            });
            each(spectrum, |v, i| *v = *v * level.low[i]);
            let scale = per_sample(&level.fft);
            let bins = &mut band[..spectrum.len()];
            let count = level.bands.len();
            for (filter, range) in level.bands.iter().zip(&self.ranges[1 + l * count..]) {
                level.fft.forward_into(&coefficients[range.clone()], bins, &mut work[l]);
                if self.quadrature {
                    // The conjugate filter: −i instead of i.
                    pair(spectrum, bins, filter, |out, v, f| {
                        let f = f * scale;
                        *out = Complex::new(out.re + v.im * f, out.im - v.re * f);
                    });
                } else {
                    pair(spectrum, bins, filter, |out, v, f| *out = *out + v * (f * scale));
                }
            }
        }
        let first = &self.levels[0].fft;
        each(&mut spectra[0], |v, i| *v = *v * self.low_filter[i]);
        let scale = per_sample(first);
        first.forward_into(&coefficients[self.ranges[0].clone()], band, &mut work[0]);
        pair(&mut spectra[0], band, &self.high_filter, |out, v, f| {
            *out = *out + v * (f * scale);
        });
        first.inverse_into(&mut spectra[0], field, &mut work[0]);
    }
}

/// Values of a filter at the bins of a level, as a function of physical frequencies (z, y, x) in cycles per finest
/// spacing and of the radius in units of the Nyquist frequency of that spacing.
///
/// A bin at the Nyquist frequency of its axis represents both signs, which oriented filters cannot distinguish: it gets
/// a radius of at least one, and so belongs to the high-pass.
fn sample_filter<T: Real>(
    fft: &RealFft<T>,
    original: &[usize],
    spacing: &[f64],
    filter: &(dyn Fn(&[f64; 3], f64) -> f64 + Sync),
) -> Vec<T> {
    let (shape, bins) = (fft.shape(), fft.spectrum_shape());
    let axes = shape.len();
    let half = bins[axes - 1];
    let signed = |k: usize, n: usize| if 2 * k < n { k as f64 } else { k as f64 - n as f64 };
    let finest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    // Extent of each axis in finest spacings.
    let extent: Vec<f64> = (0..axes)
        .map(|axis| original[axis] as f64 * spacing.get(axis).map_or(1.0, |s| s / finest))
        .collect();
    let own_nyquist = |k: usize, axis: usize| shape[axis] == original[axis] && 2 * k == shape[axis];
    let mut values = vec![T::zero(); bins.iter().product()];
    values.par_chunks_mut(half).enumerate().for_each(|(row, values)| {
        let mut frequency = [0.0; 3];
        let mut rest = row;
        let mut ambiguous = false;
        for axis in (0..axes - 1).rev() {
            frequency[3 - axes + axis] = signed(rest % shape[axis], shape[axis]) / extent[axis];
            ambiguous |= own_nyquist(rest % shape[axis], axis);
            rest /= shape[axis];
        }
        for (k, value) in values.iter_mut().enumerate() {
            frequency[2] = k as f64 / extent[axes - 1];
            let r = 2.0 * frequency.iter().map(|f| f * f).sum::<f64>().sqrt();
            let alone = ambiguous || own_nyquist(k, axes - 1);
            *value = T::from_f64_lossy(filter(&frequency, if alone { r.max(1.0) } else { r }));
        }
    });
    values
}

/// Calls `copy(start in the large spectrum, start in the small one, length)` for the bins that a crop keeps.
///
/// The bin of frequency −m/2 of an even length m needs no special treatment: it is zero after the low-pass.
fn for_kept_rows(large: &[usize], small: &[usize], mut copy: impl FnMut(usize, usize, usize)) {
    let axes = large.len();
    let (large_half, small_half) = (large[axes - 1] / 2 + 1, small[axes - 1] / 2 + 1);
    let kept = |k: usize, axis: usize| {
        if 2 * k < small[axis] {
            k
        } else {
            k + large[axis] - small[axis]
        }
    };
    let planes = if axes == 3 { small[0] } else { 1 };
    for z in 0..planes {
        let plane = if axes == 3 { kept(z, 0) } else { 0 };
        for y in 0..small[axes - 2] {
            let from = (plane * large[axes - 2] + kept(y, axes - 2)) * large_half;
            copy(from, (z * small[axes - 2] + y) * small_half, small_half);
        }
    }
}

/// Applies `f(value, index)` to every value, in parallel blocks for large arrays.
fn each<V: Send>(values: &mut [V], f: impl Fn(&mut V, usize) + Sync) {
    if values.len() < PARALLEL_FROM {
        values.iter_mut().enumerate().for_each(|(i, v)| f(v, i));
    } else {
        values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, values)| {
            values.iter_mut().enumerate().for_each(|(i, v)| f(v, block * BLOCK + i));
        });
    }
}

/// Applies `f(out, value, filter)` along three arrays, in parallel blocks for large arrays.
fn pair<T: Real>(
    out: &mut [Complex<T>],
    values: &[Complex<T>],
    filter: &[T],
    f: impl Fn(&mut Complex<T>, Complex<T>, T) + Sync,
) {
    let block = |out: &mut [Complex<T>], values: &[Complex<T>], filter: &[T]| {
        for ((o, &v), &w) in out.iter_mut().zip(values).zip(filter) {
            f(o, v, w);
        }
    };
    if out.len() < PARALLEL_FROM {
        block(out, values, filter);
    } else {
        out.par_chunks_mut(BLOCK)
            .zip(values.par_chunks(BLOCK))
            .zip(filter.par_chunks(BLOCK))
            .for_each(|((out, values), filter)| block(out, values, filter));
    }
}
