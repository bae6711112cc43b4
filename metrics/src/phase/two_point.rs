//! The two-point correlation S2: the probability that two points at a given displacement are both in a phase.

use ndarray::{Array, ArrayView, Dimension};
use realfft::RealFftPlanner;

/// Fraction of the pairs of samples at displacement d, both inside the field, that are both in the phase. The field is
/// not wrapped around.
///
/// Displacement d has the entry `reach + d` along each axis, |d| ≤ `reach`; a reach beyond the field is reduced to its
/// last sample. An empty field gives an empty map. The counts of pairs are exact. Cost: N log N, N the number of
/// samples of the field extended by `reach` along each axis.
///
/// # Formula
///
/// ```text
/// S2(d) = Σ u(x) u(x + d) / Π (nₖ − |dₖ|)        u: 1 in the phase, else 0
/// S2(0) = φ, the phase's fraction;  S2(far) → φ²
/// overlapping spheres (radius R, λ per volume), outside of them:
/// S2(r) = exp(−λ (4π/3) R³ (1 + 3r/4R − r³/16R³))   for r < 2R, then φ²
/// ```
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_metrics::two_point;
///
/// let s2 = two_point(array![true, false, true, false].view(), 2);
/// assert_eq!(s2[2], 0.5); // lag 0: half the samples
/// assert_eq!(s2[3], 0.0); // neighbours are never both in the phase
/// assert_eq!(s2[4], 0.5); // one of the two pairs at lag 2
/// ```
#[must_use]
pub fn two_point<D: Dimension>(phase: ArrayView<'_, bool, D>, reach: usize) -> Array<f64, D> {
    let sizes = phase.shape().to_vec();
    let mut shape = phase.raw_dim();
    if phase.is_empty() {
        return Array::zeros(shape);
    }
    let reaches: Vec<usize> = sizes.iter().map(|n| reach.min(n - 1)).collect();
    // Rows one after the other, each followed by `reach` zeros, planes likewise: displacements of the field are
    // displacements along one line then, whose correlation takes one transform.
    let strides = strides(&sizes, &reaches);
    let line = pair_counts(phase, &strides, &reaches);
    (0..sizes.len()).for_each(|axis| shape[axis] = 2 * reaches[axis] + 1);
    let lags = shape.slice().to_vec();
    let mut s2 = Array::zeros(shape);
    for (entry, value) in s2.iter_mut().enumerate() {
        let (mut pairs, mut forwards, mut backwards) = (1.0, 0, 0);
        for (axis, index) in indices(entry, &lags).enumerate() {
            let axis = sizes.len() - 1 - axis;
            pairs *= (sizes[axis] - index.abs_diff(reaches[axis])) as f64;
            forwards += index * strides[axis];
            backwards += reaches[axis] * strides[axis];
        }
        // The correlation of a line is the same in both directions.
        *value = line[forwards.abs_diff(backwards)] / pairs;
    }
    s2
}

/// Samples of the line from one entry to the next along each axis, the last axis without gaps.
fn strides(sizes: &[usize], reaches: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; sizes.len()];
    for axis in (1..sizes.len()).rev() {
        strides[axis - 1] = strides[axis] * (sizes[axis] + reaches[axis]);
    }
    strides
}

/// Numbers of pairs of samples in the phase by their displacement along the line.
fn pair_counts<D: Dimension>(phase: ArrayView<'_, bool, D>, strides: &[usize], reaches: &[usize]) -> Vec<f64> {
    let sizes = phase.shape().to_vec();
    let span = |extent: &[usize]| extent.iter().zip(strides).map(|(n, stride)| n * stride).sum::<usize>();
    let last: Vec<usize> = sizes.iter().map(|n| n - 1).collect();
    // The zeros behind the last sample keep the wrapped line from meeting itself; powers of two transform fastest.
    let length = (span(&last) + span(reaches) + 1).next_power_of_two().max(2);
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut line = forward.make_input_vec();
    let mut spectrum = forward.make_output_vec();
    for (entry, _) in phase.iter().enumerate().filter(|(_, here)| **here) {
        let place: usize = indices(entry, &sizes)
            .zip(strides.iter().rev())
            .map(|(i, s)| i * s)
            .sum();
        line[place] = 1.0;
    }
    forward
        .process(&mut line, &mut spectrum)
        .expect("the buffers are the plan's own");
    spectrum
        .iter_mut()
        .for_each(|bin| *bin = (bin.norm_sqr() / length as f64).into());
    inverse
        .process(&mut spectrum, &mut line)
        .expect("squared absolute values are real");
    // Sums of ones are whole numbers.
    line.iter_mut().for_each(|count| *count = count.round());
    line
}

/// Indices of an entry of an array in C order, last axis first.
fn indices(entry: usize, sizes: &[usize]) -> impl Iterator<Item = usize> {
    let mut rest = entry;
    sizes.iter().rev().map(move |n| {
        let index = rest % n;
        rest /= n;
        index
    })
}

/// Means of a map of displacements over rings of whole distances from its middle: entry r averages the displacements of
/// length r − ½ to r + ½, up to the map's nearest border.
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::radial_mean;
///
/// let map = Array2::from_shape_fn((9, 9), |(y, x)| (y as f64 - 4.0).hypot(x as f64 - 4.0));
/// let means = radial_mean(map.view());
/// assert_eq!((means.len(), means[0]), (5, 0.0));
/// assert!((means[3] - 3.0).abs() < 0.1);
/// ```
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a distance in a map"
)]
pub fn radial_mean<D: Dimension>(map: ArrayView<'_, f64, D>) -> Vec<f64> {
    let sizes = map.shape().to_vec();
    let reach = sizes.iter().map(|n| n / 2).filter(|&r| r > 0).min().unwrap_or(0);
    let mut rings = vec![(0.0, 0_u32); reach + 1];
    for (entry, value) in map.iter().enumerate() {
        let square: f64 = indices(entry, &sizes)
            .zip(sizes.iter().rev())
            .map(|(index, side)| (index as f64 - (side / 2) as f64).powi(2))
            .sum();
        if let Some(ring) = rings.get_mut(square.sqrt().round() as usize) {
            *ring = (ring.0 + value, ring.1 + 1);
        }
    }
    rings.iter().map(|(sum, n)| sum / f64::from((*n).max(1))).collect()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "counts are exact")]
mod tests {
    use super::two_point;
    use ndarray::{Array2, Array3};
    use proptest::prelude::*;

    proptest! {
        /// Equal to counting all pairs, to the bit, in two and three dimensions.
        #[test]
        fn pairs_are_counted(bits in prop::collection::vec(any::<bool>(), 120), reach in 0_usize..9) {
            let plane = Array2::from_shape_vec((10, 12), bits.clone()).unwrap_or_default();
            let s2 = two_point(plane.view(), reach);
            let volume = Array3::from_shape_vec((4, 5, 6), bits).unwrap_or_default();
            let s2_volume = two_point(volume.view(), reach);
            let signed = |index: usize, n: usize| index as isize - reach.min(n - 1) as isize;
            for ((dy, dx), found) in s2.indexed_iter() {
                let (dy, dx) = (signed(dy, 10), signed(dx, 12));
                let at = |y: usize, x: usize| plane.get([y.checked_add_signed(dy)?, x.checked_add_signed(dx)?]).copied();
                let pairs: Vec<bool> = plane.indexed_iter().filter_map(|((y, x), here)| at(y, x).map(|other| *here && other)).collect();
                prop_assert_eq!(*found, pairs.iter().filter(|both| **both).count() as f64 / pairs.len() as f64);
            }
            for ((dz, dy, dx), found) in s2_volume.indexed_iter() {
                let d = [signed(dz, 4), signed(dy, 5), signed(dx, 6)];
                let at = |p: [usize; 3]| volume.get([p[0].checked_add_signed(d[0])?, p[1].checked_add_signed(d[1])?, p[2].checked_add_signed(d[2])?]).copied();
                let pairs: Vec<bool> = volume.indexed_iter().filter_map(|((z, y, x), here)| at([z, y, x]).map(|other| *here && other)).collect();
                prop_assert_eq!(*found, pairs.iter().filter(|both| **both).count() as f64 / pairs.len() as f64);
            }
        }
    }

    /// A field without samples has a map without entries.
    #[test]
    fn nothing_has_no_pairs() {
        assert!(two_point(Array2::from_elem((0, 3), true).view(), 2).is_empty());
    }
}
