//! The texture during synthesis: colour components of every sample, and the two steps that every synthesis repeats.

use rayon::prelude::*;

use crate::bank::FilterBank;
use crate::exemplar::Prepared;
use crate::matching::{Extent, Table, match_by_table, match_exactly};
use crate::targets::BandTargets;
use crate::{Matching, Quantiles};

/// Number of samples whose colours are converted at once.
const BLOCK: usize = 1 << 14;

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

    /// Matches every channel to the distribution of the exemplar.
    pub(crate) fn match_channels(&mut self) {
        let mut channels = self.channels();
        for (channel, reference) in channels.iter_mut().zip(&self.exemplar.channels) {
            match_values(channel, reference, self.matching);
        }
        let colours = &self.exemplar.colours;
        convert(&channels, &mut self.components, |colour, component| {
            colours.decorrelate(colour, component);
        });
    }

    /// Interleaved channels of the samples, matched to the distribution of the exemplar.
    pub(crate) fn finish(self) -> Vec<f32> {
        let mut channels = self.channels();
        drop(self.components);
        for (channel, reference) in channels.iter_mut().zip(&self.exemplar.channels) {
            match_values(channel, reference, self.matching);
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
        convert(&self.components, &mut channels, |component, colour| {
            colours.recombine(component, colour);
        });
        channels
    }
}

/// Applies a map of colours to planar samples.
fn convert(from: &[Vec<f32>], to: &mut [Vec<f32>], map: impl Fn(&[f32], &mut [f32]) + Sync) {
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

/// Matches the values of a band to the target distribution. Returns ln(variance / target) before matching.
pub(crate) fn match_band(values: &mut [f32], target: &Quantiles, matching: Matching) -> Option<f64> {
    let extent = Extent::of(values);
    match matching {
        Matching::Table => Table::new(&[(values, 1.0)], extent, target).apply(values, 1.0),
        Matching::Exact => match_exactly(&mut [values], target),
    }
    log_ratio(extent, values.len(), target)
}

/// ln(variance / target), where both are positive.
fn log_ratio(extent: Extent, n: usize, target: &Quantiles) -> Option<f64> {
    let (before, wanted) = (extent.power / n as f64, target.mean_square());
    (before > 0.0 && wanted > 0.0).then(|| (before / wanted).ln())
}

fn match_values(values: &mut [f32], reference: &Quantiles, matching: Matching) {
    match matching {
        Matching::Table => match_by_table(values, reference),
        Matching::Exact => match_exactly(&mut [values], reference),
    }
}

/// Matches the bands of the members of a field (the slices of a volume, or the single image or volume) to the target
/// distributions, each band over all members at once, after the powers of the members have been equalised partially
/// ([`evening_factors`]). `coefficients` is a buffer that is reused by the next call. Returns `Σ ln²(variance /
/// target)` over the bands, and their number.
pub(crate) fn match_bands(
    field: &mut [f32],
    bank: &FilterBank<f32>,
    targets: &BandTargets,
    matching: Matching,
    evenness: f64,
    coefficients: &mut Vec<f32>,
) -> (f64, usize) {
    let samples: usize = bank.shape().iter().product();
    let (total, ranges) = (bank.coefficients(), bank.ranges());
    coefficients.resize(field.len() / samples * total, 0.0);
    let extents: Vec<Vec<Extent>> = coefficients
        .par_chunks_mut(total)
        .zip(field.par_chunks(samples))
        .map_init(
            || bank.work(),
            |work, (coefficients, field)| {
                bank.analyse(field, coefficients, work);
                ranges
                    .iter()
                    .map(|range| Extent::of(&coefficients[range.clone()]))
                    .collect()
            },
        )
        .collect();
    let factors = evening_factors(&extents, bank, evenness);
    let matched: Vec<(Option<Table>, Option<f64>)> = match matching {
        Matching::Table => (0..ranges.len())
            .into_par_iter()
            .map(|band| {
                let Some(target) = targets.of_band[band] else {
                    return (None, None);
                };
                let target = &targets.targets[target];
                let of_members = extents.iter().zip(&factors).map(|(e, f)| e[band].scaled(f[band]));
                let extent = of_members.reduce(Extent::with).expect("at least one member");
                let members = coefficients.chunks_exact(total).zip(&factors);
                let pieces: Vec<(&[f32], f32)> = members
                    .map(|(member, factors)| (&member[ranges[band].clone()], factors[band]))
                    .collect();
                let n = pieces.len() * ranges[band].len();
                (Some(Table::new(&pieces, extent, target)), log_ratio(extent, n, target))
            })
            .collect(),
        Matching::Exact => match_bands_exactly(coefficients, bank, targets, &factors),
    };
    field
        .par_chunks_mut(samples)
        .zip(coefficients.par_chunks_mut(total))
        .zip(&factors)
        .for_each_init(
            || bank.work(),
            |work, ((field, coefficients), factors)| {
                for (((table, _), range), &factor) in matched.iter().zip(ranges).zip(factors) {
                    if let Some(table) = table {
                        table.apply(&mut coefficients[range.clone()], factor);
                    }
                }
                bank.synthesise(coefficients, field, work);
            },
        );
    let errors: Vec<f64> = matched.into_iter().filter_map(|(_, error)| error).collect();
    (errors.iter().map(|e| e * e).sum(), errors.len())
}

/// Multiplies the bands of all members by their factors and matches them by rank.
fn match_bands_exactly(
    coefficients: &mut [f32],
    bank: &FilterBank<f32>,
    targets: &BandTargets,
    factors: &[Vec<f32>],
) -> Vec<(Option<Table>, Option<f64>)> {
    let mut bands: Vec<Vec<&mut [f32]>> = bank.ranges().iter().map(|_| Vec::new()).collect();
    for member in coefficients.chunks_exact_mut(bank.coefficients()) {
        let mut rest = member;
        for (band, range) in bands.iter_mut().zip(bank.ranges()) {
            let (here, behind) = rest.split_at_mut(range.len());
            band.push(here);
            rest = behind;
        }
    }
    bands
        .par_iter_mut()
        .enumerate()
        .map(|(band, pieces)| {
            let Some(target) = targets.of_band[band] else {
                return (None, None);
            };
            let target = &targets.targets[target];
            for (piece, factors) in pieces.iter_mut().zip(factors) {
                piece.iter_mut().for_each(|v| *v *= factors[band]);
            }
            let extent = pieces.iter().map(|piece| Extent::of(piece)).reduce(Extent::with);
            match_exactly(pieces, target);
            let n = pieces.iter().map(|piece| piece.len()).sum();
            (None, extent.and_then(|extent| log_ratio(extent, n, target)))
        })
        .collect()
}

/// Factors by member and band that bring the power of every member in every level (orientations together) towards the
/// mean over the members. `evenness` is the fraction of the logarithmic difference that is removed.
fn evening_factors(extents: &[Vec<Extent>], bank: &FilterBank<f32>, evenness: f64) -> Vec<Vec<f32>> {
    let (bands, count) = (bank.ranges().len(), bank.orientations());
    let mut factors = vec![vec![1.0; bands]; extents.len()];
    if evenness == 0.0 {
        return factors;
    }
    let levels = (0..bank.level_count()).map(|l| 1 + l * count..1 + (l + 1) * count);
    for level in std::iter::once(0..1).chain(levels) {
        let power = |extents: &Vec<Extent>| extents[level.clone()].iter().map(|e| e.power).sum::<f64>();
        let mean = extents.iter().map(power).sum::<f64>() / extents.len() as f64;
        for (factors, extents) in factors.iter_mut().zip(extents) {
            let power = power(extents);
            if power > 0.0 {
                #[allow(clippy::cast_possible_truncation, reason = "a factor near one")]
                factors[level.clone()].fill((mean / power).powf(evenness / 2.0) as f32);
            }
        }
    }
    factors
}

/// Mean squares of the bands of one field.
pub(crate) fn band_mean_squares(field: &[f32], bank: &FilterBank<f32>) -> Vec<f64> {
    let mut coefficients = vec![0.0; bank.coefficients()];
    bank.analyse(field, &mut coefficients, &mut bank.work());
    bank.ranges()
        .iter()
        .map(|range| Extent::of(&coefficients[range.clone()]).power / range.len() as f64)
        .collect()
}
