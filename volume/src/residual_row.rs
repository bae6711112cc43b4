//! The residual along rows of points: values per voxel and per position between voxels are computed once.

use crate::colour::{Lanes, fill_with_detail, lanes};
use crate::narrow::number;
use crate::residual::{Between, Field, FieldRow, Lookup, Weights};
use std::ops::Range;

/// Points by which a row is longer than requested.
pub(crate) const SPARE_POINTS: usize = 4;

/// Positions of the points of a row between voxels. Values per voxel and per interpolation weight are computed once for
/// all points that use them. Matching grids have few distinct weights.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    /// The voxels that are read, as ascending ranges without gaps.
    stretches: Vec<Range<usize>>,
    /// The weights that occur, ascending.
    shares: Vec<f32>,
    /// For each point, the positions of its voxels among those that are read, and of its weight.
    places: Vec<Place>,
    /// If the points are the voxels in order, repeated periodically: the first voxel.
    first: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    low: u32,
    high: u32,
    share: u32,
}

/// Buffers for a field along a row.
#[derive(Debug, Default)]
pub(crate) struct Details {
    blended: Vec<f32>,
    weights: Vec<Weights>,
}

/// A field along a row, at given positions.
pub(crate) enum Detail<'a> {
    /// The voxels of this row from the first on, repeated periodically.
    Voxels { row: &'a [f32], first: usize },
    /// Between the voxels of a row.
    Between {
        blended: &'a [f32],
        weights: &'a [Weights],
        places: &'a [Place],
    },
}

impl Field {
    /// Positions of points along x between the voxels, for [`FieldRow::detail`].
    pub(crate) fn places(&self, points: impl Iterator<Item = f64>, lookup: Lookup) -> Places {
        let between: Vec<Between> = points.map(|x| self.between(0, x, lookup)).collect();
        let [n, ..] = self.sizes;
        let at_voxels = between.iter().all(|place| place.share == 0.0)
            && between.windows(2).all(|pair| (pair[0].low + 1) % n == pair[1].low);
        let mut voxels: Vec<usize> = between.iter().flat_map(|place| [place.low, place.high]).collect();
        voxels.sort_unstable();
        voxels.dedup();
        let mut shares: Vec<f32> = between.iter().map(|place| place.share).collect();
        shares.sort_unstable_by(f32::total_cmp);
        shares.dedup();
        let sample = |v: usize| 3 * number(voxels.partition_point(|voxel| *voxel < v));
        let place = |of: &Between| Place {
            low: sample(of.low),
            high: sample(of.high),
            share: number(shares.partition_point(|share| *share < of.share)),
        };
        Places {
            places: between.iter().map(place).collect(),
            stretches: voxels
                .chunk_by(|a, b| a + 1 == *b)
                .map(|stretch| stretch[0]..stretch[0] + stretch.len())
                .collect(),
            shares,
            first: between.first().filter(|_| at_voxels).map(|place| place.low),
        }
    }
}

impl<'a> FieldRow<'a> {
    /// The row at given positions: the same bits as [`Field::at`].
    pub(crate) fn detail(&self, places: &'a Places, details: &'a mut Details) -> Detail<'a> {
        let [nx, ..] = self.field.sizes;
        let Details { blended, weights } = details;
        let [a, b, c, d] = self.starts.map(|start| &self.field.samples[start..start + 3 * nx]);
        if let (true, Some(first)) = (self.at_voxels, places.first) {
            return Detail::Voxels { row: a, first };
        }
        blended.clear();
        for stretch in &places.stretches {
            let of = 3 * stretch.start..3 * stretch.end;
            if self.at_voxels {
                blended.extend_from_slice(&a[of]);
                continue;
            }
            let fours = a[of.clone()].iter().zip(&b[of.clone()]).zip(&c[of.clone()]).zip(&d[of]);
            blended.extend(fours.map(|(((a, b), c), d)| self.blended([*a, *b, *c, *d])));
        }
        // The last voxel is read with a fourth channel.
        blended.push(0.0);
        weights.clear();
        weights.extend(places.shares.iter().map(|&share| self.weights(share)));
        Detail::Between {
            blended,
            weights,
            places: &places.places,
        }
    }
}

impl Detail<'_> {
    /// Writes a mean colour plus the detail at some of the points of a row; up to [`SPARE_POINTS`] points after them
    /// are overwritten.
    pub(crate) fn write(&self, points: Range<usize>, mean: [f32; 3], row: &mut [f32]) {
        match self {
            Self::Voxels { row: voxels, first } => {
                let period = voxels.len() / 3;
                let mut from = points.start;
                while from < points.end {
                    let voxel = (first + from) % period;
                    let end = points.end.min(from + period - voxel);
                    // Groups of four points, where there are voxels for them, are faster than an exact end.
                    let exact = 3 * (end - from);
                    let fours = exact.next_multiple_of(3 * SPARE_POINTS);
                    let details = &voxels[3 * voxel..];
                    let length = if fours > details.len() { exact } else { fours };
                    fill_with_detail(mean, &details[..length], &mut row[3 * from..3 * from + length]);
                    from = end;
                }
            }
            Self::Between {
                blended,
                weights,
                places,
            } => {
                let mean = lanes(mean);
                let four = |at: u32| Lanes::from(&blended[at as usize..at as usize + 4]);
                for (point, place) in points.clone().zip(&places[points]) {
                    let detail = weights[place.share as usize].mean(four(place.low), four(place.high));
                    row[3 * point..3 * point + 4].copy_from_slice((mean + detail).as_array());
                }
            }
        }
    }
}
