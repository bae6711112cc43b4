//! The texture in the making: colour components of every sample, and the two steps that every synthesis repeats.

use rayon::prelude::*;

use crate::bank::FilterBank;
use crate::exemplar::Prepared;
use crate::matching::{match_by_table, match_exactly};
use crate::targets::BandTargets;
use crate::{Matching, Quantiles};

/// Samples whose colours are changed at a time.
const BLOCK: usize = 1 << 14;
/// Longest piece of a band that is matched on one thread.
const PIECE: usize = 1 << 17;

/// Components of the samples, planar.
pub(crate) struct Canvas<'a> {
    pub(crate) components: Vec<Vec<f32>>,
    exemplar: &'a Prepared,
    matching: Matching,
}

impl<'a> Canvas<'a> {
    pub(crate) fn new(components: Vec<Vec<f32>>, exemplar: &'a Prepared, matching: Matching) -> Self {
        Self {
            components,
            exemplar,
            matching,
        }
    }

    /// Gives every channel the exemplar's distribution.
    pub(crate) fn match_channels(&mut self) {
        let mut channels = self.channels();
        for (channel, reference) in channels.iter_mut().zip(&self.exemplar.channels) {
            match_values(&mut [channel], reference, self.matching);
        }
        let colours = &self.exemplar.colours;
        turn(&channels, &mut self.components, |colour, component| {
            colours.decorrelate(colour, component);
        });
    }

    /// Channels of the samples, interleaved, with the exemplar's distribution.
    pub(crate) fn finish(self) -> Vec<f32> {
        let mut channels = self.channels();
        drop(self.components);
        for (channel, reference) in channels.iter_mut().zip(&self.exemplar.channels) {
            match_values(&mut [channel], reference, self.matching);
        }
        let count = channels.len();
        let mut values = vec![0.0; count * channels[0].len()];
        values
            .par_chunks_mut(count * BLOCK)
            .enumerate()
            .for_each(|(block, values)| {
                for (i, colour) in values.chunks_exact_mut(count).enumerate() {
                    colour
                        .iter_mut()
                        .zip(&channels)
                        .for_each(|(v, channel)| *v = channel[block * BLOCK + i]);
                }
            });
        values
    }

    fn channels(&self) -> Vec<Vec<f32>> {
        let colours = &self.exemplar.colours;
        let mut channels: Vec<Vec<f32>> = self.components.iter().map(|c| vec![0.0; c.len()]).collect();
        turn(&self.components, &mut channels, |component, colour| {
            colours.recombine(component, colour);
        });
        channels
    }
}

/// Applies a map of colours to planar samples.
fn turn(from: &[Vec<f32>], to: &mut [Vec<f32>], map: impl Fn(&[f32], &mut [f32]) + Sync) {
    let n = from[0].len();
    let mut blocks: Vec<(usize, Vec<&mut [f32]>)> = (0..n.div_ceil(BLOCK))
        .map(|block| (block * BLOCK, Vec::with_capacity(to.len())))
        .collect();
    for plane in to {
        blocks
            .iter_mut()
            .zip(plane.chunks_mut(BLOCK))
            .for_each(|(block, piece)| block.1.push(piece));
    }
    blocks.into_par_iter().for_each(|(start, mut to)| {
        let (mut before, mut after) = (vec![0.0; from.len()], vec![0.0; from.len()]);
        for i in 0..to[0].len() {
            before.iter_mut().zip(from).for_each(|(v, plane)| *v = plane[start + i]);
            map(&before, &mut after);
            to.iter_mut().zip(&after).for_each(|(plane, &v)| plane[i] = v);
        }
    });
}

/// Gives the values of a band the target distribution. Returns ln(variance / target) before.
pub(crate) fn match_band(values: &mut [f32], target: &Quantiles, matching: Matching) -> Option<f64> {
    let mut pieces: Vec<&mut [f32]> = values.chunks_mut(PIECE).collect();
    let (before, wanted) = (mean_square(&pieces), target.mean_square());
    match_values(&mut pieces, target, matching);
    (before > 0.0 && wanted > 0.0).then(|| (before / wanted).ln())
}

fn match_values(pieces: &mut [&mut [f32]], reference: &Quantiles, matching: Matching) {
    match matching {
        Matching::Table => match_by_table(pieces, reference),
        Matching::Exact => match_exactly(pieces, reference),
    }
}

/// Gives the bands of a field's members (the slices of a volume, or the one image or volume) the target distributions,
/// each band over all members at once. Returns `Σ ln²(variance / target)` over the bands, and their number.
pub(crate) fn match_bands(
    field: &mut [f32],
    bank: &FilterBank<f32>,
    targets: &BandTargets,
    matching: Matching,
    evenness: f32,
) -> (f64, usize) {
    let samples: usize = bank.shape().iter().product();
    let total = bank.coefficients();
    let members = field.len() / samples;
    let mut coefficients = vec![0.0; members * total];
    coefficients
        .par_chunks_mut(total)
        .zip(field.par_chunks(samples))
        .for_each_init(
            || bank.work(),
            |work, (coefficients, field)| bank.analyse(field, coefficients, work),
        );
    if evenness > 0.0 {
        even_out(&mut coefficients, bank, evenness);
    }
    let mut bands: Vec<Vec<&mut [f32]>> = bank.ranges().iter().map(|_| Vec::new()).collect();
    for member in coefficients.chunks_exact_mut(total) {
        let mut rest = member;
        for (band, range) in bands.iter_mut().zip(bank.ranges()) {
            let (here, behind) = rest.split_at_mut(range.len());
            band.extend(here.chunks_mut(PIECE));
            rest = behind;
        }
    }
    let errors: Vec<Option<f64>> = bands
        .par_iter_mut()
        .zip(&targets.of_band)
        .map(|(pieces, &target)| {
            let target = &targets.targets[target?];
            let (before, wanted) = (mean_square(pieces), target.mean_square());
            match_values(pieces, target, matching);
            (before > 0.0 && wanted > 0.0).then(|| (before / wanted).ln())
        })
        .collect();
    drop(bands);
    field
        .par_chunks_mut(samples)
        .zip(coefficients.par_chunks(total))
        .for_each_init(
            || bank.work(),
            |work, (field, coefficients)| bank.synthesise(coefficients, field, work),
        );
    let errors: Vec<f64> = errors.into_iter().flatten().collect();
    (errors.iter().map(|e| e * e).sum(), errors.len())
}

/// Brings the power of every member in every level (orientations together) nearer to the mean over the members.
fn even_out(coefficients: &mut [f32], bank: &FilterBank<f32>, evenness: f32) {
    let (total, ranges, count) = (bank.coefficients(), bank.ranges(), bank.orientations());
    let levels: Vec<std::ops::Range<usize>> = [ranges[0].clone()]
        .into_iter()
        .chain((0..bank.level_count()).map(|l| ranges[1 + l * count].start..ranges[(l + 1) * count].end))
        .collect();
    let powers: Vec<Vec<f64>> = coefficients
        .par_chunks(total)
        .map(|member| {
            levels
                .iter()
                .map(|level| member[level.clone()].iter().map(|&v| f64::from(v).powi(2)).sum())
                .collect()
        })
        .collect();
    let means: Vec<f64> = (0..levels.len())
        .map(|l| powers.iter().map(|power| power[l]).sum::<f64>() / powers.len() as f64)
        .collect();
    coefficients
        .par_chunks_mut(total)
        .zip(&powers)
        .for_each(|(member, powers)| {
            for ((level, power), mean) in levels.iter().zip(powers).zip(&means) {
                if *power > 0.0 {
                    #[allow(clippy::cast_possible_truncation, reason = "a factor near one")]
                    let factor = (mean / power).powf(f64::from(evenness) / 2.0) as f32;
                    member[level.clone()].iter_mut().for_each(|v| *v *= factor);
                }
            }
        });
}

/// Mean squares of the bands of one field.
pub(crate) fn band_mean_squares(field: &[f32], bank: &FilterBank<f32>) -> Vec<f64> {
    let mut coefficients = vec![0.0; bank.coefficients()];
    bank.analyse(field, &mut coefficients, &mut bank.work());
    bank.ranges()
        .iter()
        .map(|range| mean_square(&coefficients[range.clone()].chunks(PIECE).collect::<Vec<_>>()))
        .collect()
}

/// Mean square over pieces: one sum a piece, added in order.
fn mean_square<P: AsRef<[f32]> + Sync>(pieces: &[P]) -> f64 {
    let sums: Vec<f64> = pieces
        .par_iter()
        .map(|piece| {
            let values = piece.as_ref().chunks_exact(4);
            let rest: f64 = values.remainder().iter().map(|&v| f64::from(v).powi(2)).sum();
            let mut lanes = [0.0_f64; 4];
            for four in values {
                lanes
                    .iter_mut()
                    .zip(four)
                    .for_each(|(sum, &v)| *sum += f64::from(v) * f64::from(v));
            }
            lanes.iter().sum::<f64>() + rest
        })
        .collect();
    let n: usize = pieces.iter().map(|piece| piece.as_ref().len()).sum();
    sums.iter().sum::<f64>() / n as f64
}
