//! Patches of two materials compared: sliced Wasserstein distance.

use ndarray::{ArrayView3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Square patches of pictures, all channels, as points of a space of side × side × channels dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    dimension: usize,
    values: Vec<f32>,
}

impl Patches {
    /// Draws `count` patches of `side` pixels at random places of the pictures, each picture as often as its share of places. Empty if no patch fits.
    #[must_use]
    pub fn draw(pictures: &[ArrayView3<'_, f32>], side: usize, count: usize, seed: u64) -> Self {
        let places =
            |p: &ArrayView3<'_, f32>| (p.dim().0 + 1).saturating_sub(side) * (p.dim().1 + 1).saturating_sub(side);
        let mut ends = Vec::with_capacity(pictures.len());
        let mut total = 0;
        for picture in pictures {
            total += places(picture);
            ends.push(total);
        }
        let channels = pictures.first().map_or(0, |p| p.dim().2);
        let dimension = side * side * channels;
        if total == 0 || dimension == 0 {
            return Self {
                dimension: 0,
                values: Vec::new(),
            };
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut values = Vec::with_capacity(count * dimension);
        for _ in 0..count {
            let place = rng.random_range(0..total);
            let which = ends.partition_point(|&end| end <= place);
            let picture = &pictures[which];
            let place = place - if which == 0 { 0 } else { ends[which - 1] };
            let across = picture.dim().1 + 1 - side;
            let (y, x) = (place / across, place % across);
            let rows = picture.slice_axis(Axis(0), (y..y + side).into());
            values.extend(rows.slice_axis(Axis(1), (x..x + side).into()).iter().copied());
        }
        Self { dimension, values }
    }

    /// Number of patches.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.dimension).unwrap_or(0)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The patches seen along a direction, sorted.
    fn projected(&self, direction: &[f32]) -> Vec<f32> {
        let mut seen: Vec<f32> = self
            .values
            .chunks_exact(self.dimension)
            .map(|patch| patch.iter().zip(direction).map(|(v, d)| v * d).sum())
            .collect();
        seen.sort_unstable_by(f32::total_cmp);
        seen
    }
}

/// Sliced Wasserstein distance of two sets of patches: the mean over random unit directions of the Wasserstein distance of the patches seen along each. `None` if a set is empty or their dimensions differ.
///
/// Every marginal that a random direction sees counts, so it tells blur, wrong contrast, wrong grain and wrong shapes alike. Two draws of finite size are never at distance 0: compare it with what two parts of the exemplar show.
///
/// # Formula
///
/// ```text
/// SWD = E_u W1(u·p, u·q)      u uniform on the unit sphere
/// ```
///
/// # References
///
/// Rabin et al. 2012.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_exemplar::measure::{Patches, sliced_wasserstein};
///
/// let ramp = Array3::from_shape_fn((40, 40, 1), |(y, x, _)| (y * x) as f32 / 1600.0);
/// let lighter = &ramp + 0.1;
/// let of = |picture: &Array3<f32>| Patches::draw(&[picture.view()], 1, 1000, 1);
/// let apart = sliced_wasserstein(&of(&ramp), &of(&lighter), 8, 0).unwrap();
/// assert!((apart - 0.1).abs() < 1e-6); // single pixels: just the shift
/// ```
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "directions in single precision suffice")]
pub fn sliced_wasserstein(a: &Patches, b: &Patches, projections: usize, seed: u64) -> Option<f64> {
    if a.is_empty() || b.is_empty() || a.dimension != b.dimension || projections == 0 {
        return None;
    }
    let distances: Vec<f64> = (0..projections as u64)
        .into_par_iter()
        .map(|task| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(task);
            let direction = direction(&mut rng, a.dimension);
            wasserstein(&a.projected(&direction), &b.projected(&direction))
        })
        .collect();
    Some(distances.iter().sum::<f64>() / projections as f64)
}

/// A direction uniform on the unit sphere.
#[allow(clippy::cast_possible_truncation, reason = "directions in single precision suffice")]
fn direction(rng: &mut ChaCha8Rng, dimension: usize) -> Vec<f32> {
    let mut normal = || {
        // Box and Muller.
        let (u, v) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let numbers: Vec<f64> = (0..dimension).map(|_| normal()).collect();
    let length = numbers.iter().map(|n| n * n).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    numbers.iter().map(|n| (n / length) as f32).collect()
}

/// Wasserstein distance of two sorted samples, of any numbers: the area between their distribution functions. Zero if one is empty.
///
/// ```
/// use stereology_exemplar::measure::wasserstein;
///
/// assert_eq!(wasserstein(&[0.0, 1.0], &[1.0, 2.0]), 1.0);
/// assert_eq!(wasserstein(&[0.0, 0.0, 3.0], &[1.0]), 4.0 / 3.0);
/// ```
#[must_use]
pub fn wasserstein(a: &[f32], b: &[f32]) -> f64 {
    let (n, m) = (a.len(), b.len());
    if n == 0 || m == 0 {
        return 0.0;
    }
    if n == m {
        return a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / n as f64;
    }
    // Quantiles change at i / n and j / m; in units of 1 / (n m) these are whole numbers.
    let (mut i, mut j, mut at, mut sum) = (0, 0, 0, 0.0);
    while i < n && j < m {
        let (next_a, next_b) = ((i + 1) * m, (j + 1) * n);
        let next = next_a.min(next_b);
        sum += (next - at) as f64 * f64::from((a[i] - b[j]).abs());
        at = next;
        i += usize::from(next == next_a);
        j += usize::from(next == next_b);
    }
    sum / (n * m) as f64
}
