//! Histogram matching: values are changed to the distribution of a reference, keeping their order.

use rayon::prelude::*;

/// Number of bins of the table of [`match_histogram_table`].
const TABLE: usize = 4096;
/// Number of values per task.
const BLOCK: usize = 1 << 16;
/// Number of values whose bins are computed together.
const LANES: usize = 16;
/// Number of tables that are counted separately.
const PARTS: usize = 16;

/// Why values cannot be matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MatchError {
    /// The reference has no values.
    #[error("a histogram needs at least one value")]
    Empty,
    /// A value is NaN or infinite.
    #[error("value {index} is NaN or infinite")]
    NotFinite {
        /// Its index.
        index: usize,
    },
}

/// The distribution of a reference: its sorted values.
///
/// # Examples
///
/// ```
/// use stereology_pyramid::Quantiles;
///
/// let quantiles = Quantiles::new(vec![3.0, 1.0, 2.0])?;
/// assert_eq!(quantiles.at(0.5), 2.0);
/// assert_eq!((quantiles.at(0.0), quantiles.at(1.0)), (1.0, 3.0));
/// # Ok::<(), stereology_pyramid::MatchError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Quantiles {
    sorted: Vec<f32>,
}

impl Quantiles {
    /// Sorts the values: `O(n log n)`.
    ///
    /// # Errors
    ///
    /// [`MatchError::Empty`], [`MatchError::NotFinite`].
    pub fn new(mut values: Vec<f32>) -> Result<Self, MatchError> {
        if values.is_empty() {
            return Err(MatchError::Empty);
        }
        finite(&values)?;
        values.par_sort_unstable_by(f32::total_cmp);
        Ok(Self { sorted: values })
    }

    /// Quantile `q` of the reference: the `i`-th of `m` values is the quantile `(i + 1/2) / m`, with linear
    /// interpolation between and constant values beyond the ends.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "the position is clamped to the values")]
    pub fn at(&self, q: f64) -> f32 {
        let last = self.sorted.len() - 1;
        let position = (q * self.sorted.len() as f64 - 0.5).clamp(0.0, last as f64);
        let below = position as usize;
        let above = (below + 1).min(last);
        let part = (position - below as f64) as f32;
        self.sorted[below] + part * (self.sorted[above] - self.sorted[below])
    }

    /// The values, ascending.
    #[must_use]
    pub fn sorted(&self) -> &[f32] {
        &self.sorted
    }

    /// Mean of the squared values.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.sorted.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / self.sorted.len() as f64
    }

    /// At most `most` evenly spaced quantiles, for references of millions of values.
    pub(crate) fn reduced(self, most: usize) -> Self {
        if self.sorted.len() <= most {
            return self;
        }
        Self {
            sorted: (0..most).map(|i| self.at((i as f64 + 0.5) / most as f64)).collect(),
        }
    }

    pub(crate) fn scaled(&self, factor: f32) -> Self {
        Self {
            sorted: self.sorted.iter().map(|v| v * factor).collect(),
        }
    }
}

fn finite(values: &[f32]) -> Result<(), MatchError> {
    values
        .iter()
        .position(|v| !v.is_finite())
        .map_or(Ok(()), |index| Err(MatchError::NotFinite { index }))
}

/// Matches `values` exactly to the distribution of `reference`: the value of rank `r` of `n` becomes the quantile `(r +
/// 1/2) / n` of the reference. Equal values are ranked by position. If there are as many values as in the reference,
/// the result is a permutation of the reference. `O(n)`: values are sorted by radix sort.
///
/// # Errors
///
/// [`MatchError::NotFinite`]; then no value is changed.
///
/// # References
///
/// Heeger & Bergen 1995, section 3; with ranks instead of their table, as in Briand et al., IPOL 2014.
///
/// # Examples
///
/// ```
/// use stereology_pyramid::{Quantiles, match_histogram};
///
/// let mut values = [0.3, -5.0, 9.0];
/// match_histogram(&mut values, &Quantiles::new(vec![10.0, 30.0, 20.0])?)?;
/// assert_eq!(values, [20.0, 10.0, 30.0]);
/// # Ok::<(), stereology_pyramid::MatchError>(())
/// ```
pub fn match_histogram(values: &mut [f32], reference: &Quantiles) -> Result<(), MatchError> {
    finite(values)?;
    match_exactly(&mut [values], reference);
    Ok(())
}

/// Matches `values` to the distribution of `reference` by a table of 4096 bins over their range, linear within a bin.
///
/// Three to five times faster than [`match_histogram`]; equal values stay equal. The error of the distribution is
/// limited by the width of a bin: below a thousandth of the standard deviation except for extremely heavy tails.
/// `O(n)`.
///
/// # Errors
///
/// [`MatchError::NotFinite`]; then no value is changed.
///
/// # Examples
///
/// ```
/// use stereology_pyramid::{Quantiles, match_histogram_table};
///
/// let mut values: Vec<f32> = (0..1000).map(|i| (i as f32).sqrt()).collect();
/// let uniform = Quantiles::new((0..500).map(|i| i as f32 / 500.0).collect())?;
/// match_histogram_table(&mut values, &uniform)?;
/// assert!((values[250] - 0.25).abs() < 0.002);
/// # Ok::<(), stereology_pyramid::MatchError>(())
/// ```
pub fn match_histogram_table(values: &mut [f32], reference: &Quantiles) -> Result<(), MatchError> {
    finite(values)?;
    match_by_table(values, reference);
    Ok(())
}

/// Matches the joint distribution of several pieces to a reference.
#[allow(clippy::cast_possible_truncation, reason = "the index is the key's lower half")]
pub(crate) fn match_exactly(pieces: &mut [&mut [f32]], reference: &Quantiles) {
    let n: usize = pieces.iter().map(|piece| piece.len()).sum();
    let mut start = 0_u64;
    let mut order: Vec<u64> = Vec::with_capacity(n);
    for piece in pieces.iter() {
        order.extend(
            piece
                .iter()
                .zip(start..)
                .map(|(&v, index)| u64::from(ordered_bits(v)) << 32 | index),
        );
        start += piece.len() as u64;
    }
    assert!(u32::try_from(start).is_ok(), "more than 2^32 values in one histogram");
    let order = sorted_by_value(order);
    let target = |rank: usize| {
        if n == reference.sorted.len() {
            reference.sorted[rank]
        } else {
            reference.at((rank as f64 + 0.5) / n as f64)
        }
    };
    let mut matched = vec![0.0; n];
    for (rank, key) in order.iter().enumerate() {
        matched[(key & u64::from(u32::MAX)) as usize] = target(rank);
    }
    let mut rest = matched.as_slice();
    for piece in pieces {
        let (here, behind) = rest.split_at(piece.len());
        piece.copy_from_slice(here);
        rest = behind;
    }
}

/// Radix sort of keys by their upper halves; equal keys keep their order.
#[allow(clippy::cast_possible_truncation, reason = "digits are masked")]
fn sorted_by_value(mut keys: Vec<u64>) -> Vec<u64> {
    const BITS: usize = 8;
    const DIGITS: usize = 1 << BITS;
    const PASSES: usize = 32 / BITS;
    let digit = |key: u64, pass: usize| (key >> (32 + BITS * pass)) as usize & (DIGITS - 1);
    let mut counts = [[0_usize; DIGITS]; PASSES];
    for &key in &keys {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(key, pass)] += 1;
        }
    }
    let mut other = vec![0; keys.len()];
    for (pass, counts) in counts.iter_mut().enumerate() {
        let mut next = 0;
        for count in counts.iter_mut() {
            (*count, next) = (next, next + *count);
        }
        for &key in &keys {
            let position = &mut counts[digit(key, pass)];
            other[*position] = key;
            *position += 1;
        }
        std::mem::swap(&mut keys, &mut other);
    }
    keys
}

/// Bits of a number that have the same order as the numbers; both zeros are equal.
fn ordered_bits(value: f32) -> u32 {
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Range and power of values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) lowest: f32,
    pub(crate) highest: f32,
    /// Sum of squares.
    pub(crate) power: f64,
}

impl Extent {
    const NOTHING: Self = Self {
        lowest: f32::INFINITY,
        highest: f32::NEG_INFINITY,
        power: 0.0,
    };

    /// Of many values: one extent per block, joined in order.
    pub(crate) fn of(values: &[f32]) -> Self {
        let blocks: Vec<Self> = values.par_chunks(BLOCK).map(Self::of_block).collect();
        blocks.into_iter().fold(Self::NOTHING, Self::with)
    }

    fn of_block(values: &[f32]) -> Self {
        let mut low = [f32::INFINITY; 8];
        let mut high = [f32::NEG_INFINITY; 8];
        let mut power = [0.0_f64; 8];
        let eights = values.chunks_exact(8);
        for (i, &v) in eights.remainder().iter().enumerate() {
            low[i] = v;
            high[i] = v;
            power[i] = f64::from(v) * f64::from(v);
        }
        for eight in eights {
            for (i, &v) in eight.iter().enumerate() {
                low[i] = if v < low[i] { v } else { low[i] };
                high[i] = if v > high[i] { v } else { high[i] };
                power[i] += f64::from(v) * f64::from(v);
            }
        }
        Self {
            lowest: low.into_iter().fold(f32::INFINITY, f32::min),
            highest: high.into_iter().fold(f32::NEG_INFINITY, f32::max),
            power: power.iter().sum(),
        }
    }

    /// Of these values and others.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
            power: self.power + other.power,
        }
    }

    /// Of the values times a positive factor.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self {
            lowest: factor * self.lowest,
            highest: factor * self.highest,
            power: f64::from(factor).powi(2) * self.power,
        }
    }
}

/// A map of values from one distribution to another, linear in each of [`TABLE`] bins.
pub(crate) struct Table {
    lowest: f32,
    /// Bins per unit of value; zero for a constant.
    scale: f32,
    /// Value at the lower edge of each bin, and the increment to its upper edge.
    bins: Vec<[f32; 2]>,
}

impl Table {
    /// For pieces of values, each multiplied by its factor, with the common `extent`. A constant becomes the median.
    pub(crate) fn new(pieces: &[(&[f32], f32)], extent: Extent, reference: &Quantiles) -> Self {
        let lowest = extent.lowest;
        // Slightly fewer than all bins, so that the highest value lies in the last bin.
        let scale = TABLE as f32 * (1.0 - 1e-6) / (extent.highest - lowest);
        if !(scale.is_finite() && scale > 0.0) {
            return Self {
                lowest: 0.0,
                scale: 0.0,
                bins: vec![[reference.at(0.5), 0.0]],
            };
        }
        let blocks: Vec<(&[f32], f32)> = pieces
            .iter()
            .flat_map(|&(piece, factor)| piece.chunks(BLOCK).map(move |values| (values, factor)))
            .collect();
        let counts: Vec<Vec<u64>> = blocks
            .par_chunks(blocks.len().div_ceil(PARTS).max(1))
            .map(|blocks| {
                let mut counts = vec![0; TABLE];
                for &(values, factor) in blocks {
                    for values in values.chunks(LANES) {
                        let mut bins = [0; LANES];
                        for (i, &v) in bins.iter_mut().zip(values) {
                            *i = bin(factor * v, lowest, scale).0;
                        }
                        bins[..values.len()]
                            .iter()
                            .for_each(|&i| counts[(i as usize).min(TABLE - 1)] += 1);
                    }
                }
                counts
            })
            .collect();
        let counts = counts.into_iter().fold(vec![0_u64; TABLE], |mut sum, part| {
            sum.iter_mut().zip(&part).for_each(|(sum, n)| *sum += n);
            sum
        });
        let n = counts.iter().sum::<u64>() as f64;
        let mut below = 0_u64;
        let mut edge = reference.at(0.0);
        let bins = counts
            .into_iter()
            .map(|count| {
                below += count;
                let before = std::mem::replace(&mut edge, reference.at(below as f64 / n));
                [before, edge - before]
            })
            .collect();
        Self { lowest, scale, bins }
    }

    /// Maps the values, multiplied by a factor.
    pub(crate) fn apply(&self, values: &mut [f32], factor: f32) {
        values.par_chunks_mut(BLOCK).for_each(|values| {
            if self.scale == 0.0 {
                values.fill(self.bins[0][0]);
                return;
            }
            for values in values.chunks_mut(LANES) {
                let mut positions = [(0, 0.0); LANES];
                for (position, &v) in positions.iter_mut().zip(values.iter()) {
                    *position = bin(factor * v, self.lowest, self.scale);
                }
                for (v, &(i, part)) in values.iter_mut().zip(&positions) {
                    let [edge, step] = self.bins[(i as usize).min(TABLE - 1)];
                    *v = edge + part * step;
                }
            }
        });
    }
}

/// [`match_exactly`] by a table, for one piece.
pub(crate) fn match_by_table(values: &mut [f32], reference: &Quantiles) {
    let table = Table::new(&[(values, 1.0)], Extent::of(values), reference);
    table.apply(values, 1.0);
}

/// Bin of a value, and its relative position in the bin.
fn bin(value: f32, lowest: f32, scale: f32) -> (u32, f32) {
    whole_and_part((value - lowest) * scale)
}

/// Integer and fractional part of a number from 0 to 2^22; a whole number may be split into the one before and 1.
///
/// The sum with 2^23 is rounded to an integer, which is stored in its last bits. Unlike a conversion, this is
/// vectorised.
pub(crate) fn whole_and_part(number: f32) -> (u32, f32) {
    const WHOLE: f32 = 8_388_608.0;
    let below = if number > 0.5 { number - 0.5 } else { 0.0 };
    let floor = below + WHOLE;
    (floor.to_bits() - WHOLE.to_bits(), number - (floor - WHOLE))
}
