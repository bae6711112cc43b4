//! Comparison of the patches of two materials: sliced Wasserstein distance.

use ndarray::{ArrayView3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::wasserstein::wasserstein_sorted;

/// Square patches of images, all channels, as points of a space of side × side × channels dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    dimension: usize,
    values: Vec<f32>,
}

impl Patches {
    /// Draws `count` patches of `side` pixels at random places of the images; each image is drawn in proportion to its
    /// number of places. Empty if no patch fits.
    #[must_use]
    pub fn draw(images: &[ArrayView3<'_, f32>], side: usize, count: usize, seed: u64) -> Self {
        let places =
            |p: &ArrayView3<'_, f32>| (p.dim().0 + 1).saturating_sub(side) * (p.dim().1 + 1).saturating_sub(side);
        let mut ends = Vec::with_capacity(images.len());
        let mut total = 0;
        for image in images {
            total += places(image);
            ends.push(total);
        }
        let channels = images.first().map_or(0, |p| p.dim().2);
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
            let image = &images[which];
            let place = place - if which == 0 { 0 } else { ends[which - 1] };
            let across = image.dim().1 + 1 - side;
            let (y, x) = (place / across, place % across);
            let rows = image.slice_axis(Axis(0), (y..y + side).into());
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

    /// The patches projected on a direction, sorted.
    fn projected(&self, direction: &[f32]) -> Vec<f32> {
        let mut projected: Vec<f32> = self
            .values
            .chunks_exact(self.dimension)
            .map(|patch| patch.iter().zip(direction).map(|(v, d)| v * d).sum())
            .collect();
        projected.sort_unstable_by(f32::total_cmp);
        projected
    }
}

/// Sliced Wasserstein distance of two sets of patches: the mean, over random unit directions, of the Wasserstein-1
/// distance of the patches projected on each. `None` if a set is empty or their dimensions differ.
///
/// It is sensitive to every difference of the projected distributions: blur, contrast, grain size and shapes. Two
/// random draws of finite size never have distance 0; compare the value with that of two parts of the exemplar.
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
/// use stereology_metrics::{Patches, sliced_wasserstein};
///
/// let ramp = Array3::from_shape_fn((40, 40, 1), |(y, x, _)| (y * x) as f32 / 1600.0);
/// let lighter = &ramp + 0.1;
/// let of = |image: &Array3<f32>| Patches::draw(&[image.view()], 1, 1000, 1);
/// let distance = sliced_wasserstein(&of(&ramp), &of(&lighter), 8, 0).unwrap();
/// assert!((distance - 0.1).abs() < 1e-6); // single pixels: the shift alone
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
            wasserstein_sorted(&a.projected(&direction), &b.projected(&direction))
        })
        .collect();
    Some(distances.iter().sum::<f64>() / projections as f64)
}

/// A direction uniform on the unit sphere.
#[allow(clippy::cast_possible_truncation, reason = "directions in single precision suffice")]
fn direction(rng: &mut ChaCha8Rng, dimension: usize) -> Vec<f32> {
    let mut normal = || {
        // Box-Muller transform.
        let (u, v) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let numbers: Vec<f64> = (0..dimension).map(|_| normal()).collect();
    let length = numbers.iter().map(|n| n * n).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    numbers.iter().map(|n| (n / length) as f32).collect()
}
