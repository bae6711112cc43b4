//! The residual: a periodic volume of fine detail, interpolated between its voxels.

use crate::autocovariance::mean_and_autocovariance;
use crate::colour::{Lanes, lanes};
use crate::narrow::{single, whole};
use nalgebra::{Point3, Vector3};
use ndarray::Array4;

/// Fine detail to add to the mean colours: one volume for the binder, one for the particles (section 4.3).
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Detail of the binder, axes (z, y, x, 3), in encoded colour values from −1 to 1.
    pub binder: Array4<f32>,
    /// Detail of the particles, likewise; its sizes may differ.
    pub particles: Array4<f32>,
    /// Edge of a voxel of both, in the unit of length of the box: the size of a pixel of the photograph.
    pub voxel: f64,
}

/// Interpolation of a residual between its voxels' centres.
///
/// A weighted mean of eight voxels has less contrast than the voxels: for white noise an eighth of the variance is left
/// in the middle. A solid sampled between voxels would look blurred, in planes and stripes where the two grids are out
/// of phase. [`Lookup::VarianceKept`] compensates for this exactly, on average over the volume, at every point.
///
/// # Formula
///
/// ```text
/// r(p) = mean + (trilinear(p) − mean) √(C(0) / v(f)),   v(f) = Σ  A(fx,a) A(fy,b) A(fz,c) C(a,b,c)
///                                                           a,b,c ∈ {0,1}
/// A(f,0) = 1 − 2f(1−f),   A(f,1) = 2f(1−f)
/// ```
///
/// with f the position between the voxels and C the autocovariance at lags (±a, ±b, ±c), averaged over the signs; the
/// gain is at most √8, that of white noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// The voxel that contains the point: exact statistics, visible voxels when enlarged.
    Nearest,
    /// The weighted mean of the eight nearest voxels: smooth, with less contrast between voxels.
    Trilinear,
    /// [`Lookup::Trilinear`] with its contrast restored.
    #[default]
    VarianceKept,
}

const MOST_GAIN: f32 = 8.0;
/// Points nearer to a voxel than this fraction of the voxel spacing count as at the voxel: more than rounding, less
/// than is visible.
const AT_VOXEL: f64 = 1e-6;

/// A periodic colour volume prepared for lookups.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    /// Voxels along x, y, z.
    pub(crate) sizes: [usize; 3],
    voxels_per_length: Vector3<f64>,
    /// Axes (z, y, x, 3).
    pub(crate) samples: Vec<f32>,
    mean: Lanes,
    /// Autocovariance at lag (a, b, c) at index a + 2b + 4c, of each channel.
    covariance: [Lanes; 8],
}

impl Field {
    /// From an array (z, y, x, 3) of at least one voxel.
    pub(crate) fn new(array: Array4<f32>, voxels_per_length: Vector3<f64>) -> Self {
        let (nz, ny, nx, _) = array.dim();
        let samples = if array.is_standard_layout() {
            array.into_raw_vec_and_offset().0
        } else {
            array.iter().copied().collect()
        };
        let (mean, covariance) = mean_and_autocovariance(&samples, [nx, ny, nz]);
        Self {
            sizes: [nx, ny, nz],
            voxels_per_length,
            samples,
            mean: lanes(mean),
            covariance: covariance.map(lanes),
        }
    }

    /// The field at a point of the box.
    pub(crate) fn at(&self, p: &Point3<f64>, lookup: Lookup) -> [f32; 3] {
        let row = self.row([p.y, p.z], lookup);
        let Between { low, high, share } = self.between(0, p.x, lookup);
        let [low, high] = [low, high].map(|voxel| row.blend(voxel));
        let [r, g, b, _] = row.weights(share).mean(low, high).to_array();
        [r, g, b]
    }

    /// The field along a row of the box.
    pub(crate) fn row(&self, yz: [f64; 2], lookup: Lookup) -> FieldRow<'_> {
        let [nx, ny, _] = self.sizes;
        let start = |y: usize, z: usize| 3 * (z * ny + y) * nx;
        let [y, z] = [0, 1].map(|k| self.between(k + 1, yz[k], lookup));
        let [ay, az] = [y, z].map(|of| 2.0 * of.share * (1.0 - of.share));
        let left = [(1.0 - ay) * (1.0 - az), ay * (1.0 - az), (1.0 - ay) * az, ay * az];
        let at_x = |a: usize| (0..4).fold(Lanes::ZERO, |sum, lag| sum + self.covariance[2 * lag + a] * left[lag]);
        FieldRow {
            field: self,
            starts: [
                start(y.low, z.low),
                start(y.high, z.low),
                start(y.low, z.high),
                start(y.high, z.high),
            ],
            weights: [
                (1.0 - y.share) * (1.0 - z.share),
                y.share * (1.0 - z.share),
                (1.0 - y.share) * z.share,
                y.share * z.share,
            ],
            at_voxels: y.share == 0.0 && z.share == 0.0,
            variance: [at_x(0), at_x(1) - at_x(0)],
            keeps_variance: lookup == Lookup::VarianceKept,
        }
    }

    /// The voxels on both sides of a position along an axis; twice the nearest voxel for [`Lookup::Nearest`].
    pub(crate) fn between(&self, axis: usize, x: f64, lookup: Lookup) -> Between {
        let n = self.sizes[axis];
        if lookup == Lookup::Nearest {
            let voxel = whole(x * self.voxels_per_length[axis]) % n;
            return Between {
                low: voxel,
                high: voxel,
                share: 0.0,
            };
        }
        // Relative to voxel centres, plus a whole period so that it is positive.
        let place = x * self.voxels_per_length[axis] - 0.5 + n as f64;
        let (mut floor, mut share) = (whole(place), place.fract());
        // At a voxel to within rounding counts as at the voxel.
        if share < AT_VOXEL {
            share = 0.0;
        } else if share > 1.0 - AT_VOXEL {
            (floor, share) = (floor + 1, 0.0);
        }
        let low = floor % n;
        Between {
            low,
            high: if low + 1 == n { 0 } else { low + 1 },
            share: single(share),
        }
    }
}

/// Two neighbouring voxels and the weight of the second.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    pub(crate) low: usize,
    pub(crate) high: usize,
    pub(crate) share: f32,
}

/// A field at one y and z.
pub(crate) struct FieldRow<'a> {
    pub(crate) field: &'a Field,
    /// Where the surrounding rows of voxels begin, and their weights.
    pub(crate) starts: [usize; 4],
    weights: [f32; 4],
    /// Whether the first of these rows has all the weight.
    pub(crate) at_voxels: bool,
    /// Variance after trilinear weighting: at the voxels' x, and its change between them.
    variance: [Lanes; 2],
    keeps_variance: bool,
}

/// Factors of two voxels' values and the constant that give the value between them, with contrast restored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    low: Lanes,
    high: Lanes,
    added: Lanes,
}

impl Weights {
    pub(crate) fn mean(&self, low: Lanes, high: Lanes) -> Lanes {
        (low * self.low + high * self.high) + self.added
    }
}

impl FieldRow<'_> {
    /// The four rows at the x of a voxel.
    fn blend(&self, voxel: usize) -> Lanes {
        let [a, b, c, d] = self.starts.map(|start| {
            let from = start + 3 * voxel;
            let samples = &self.field.samples[from..from + 3];
            lanes([samples[0], samples[1], samples[2]])
        });
        let w = self.weights.map(Lanes::splat);
        (w[0] * a + w[1] * b) + (w[2] * c + w[3] * d)
    }

    /// One channel of [`Self::blend`].
    pub(crate) fn blended(&self, [a, b, c, d]: [f32; 4]) -> f32 {
        let w = self.weights;
        (w[0] * a + w[1] * b) + (w[2] * c + w[3] * d)
    }

    pub(crate) fn weights(&self, share: f32) -> Weights {
        let gain = if self.keeps_variance {
            self.gain(share)
        } else {
            Lanes::ONE
        };
        Weights {
            low: Lanes::splat(1.0 - share) * gain,
            high: Lanes::splat(share) * gain,
            added: self.field.mean * (Lanes::ONE - gain),
        }
    }

    /// Factor of contrast between two voxels.
    fn gain(&self, share: f32) -> Lanes {
        let apart = Lanes::splat(2.0 * share * (1.0 - share));
        let left = self.variance[0] + apart * self.variance[1];
        let whole = self.field.covariance[0];
        // Constant voxels have no contrast to restore.
        let whole = whole.simd_gt(Lanes::ZERO).select(whole, Lanes::ONE);
        let least = whole * Lanes::splat(1.0 / MOST_GAIN);
        (whole / left.simd_gt(least).select(left, least)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::{Field, Lookup};
    use nalgebra::{Point3, Vector3};
    use ndarray::Array4;
    use rand::{RngExt, SeedableRng};

    /// Noise smoothed along x, so that the correlation of neighbours differs between axes.
    fn noise() -> Array4<f32> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let white = Array4::from_shape_fn((16, 16, 16, 3), |_| rng.random::<f32>());
        Array4::from_shape_fn((16, 16, 16, 3), |(z, y, x, c)| {
            0.4 * white[[z, y, x, c]] + 0.3 * (white[[z, y, (x + 1) % 16, c]] + white[[z, (y + 1) % 16, x, c]])
        })
    }

    /// At a fixed position between the voxels, the variance over all voxels equals that of the voxels themselves: an
    /// identity for a periodic field.
    #[test]
    fn variance_is_kept_at_every_position_between_voxels() {
        let field = Field::new(noise(), Vector3::repeat(1.0));
        for share in [[0.5, 0.5, 0.5], [0.2, 0.9, 0.6], [0.0, 0.5, 0.0], [0.7, 0.7, 0.1]] {
            let all = (0..16 * 16 * 16).map(|i| {
                let voxel = [i % 16, i / 16 % 16, i / 256].map(f64::from);
                let p = Point3::from(Vector3::from_fn(|k, _| (voxel[k] + 0.5 + share[k]) % 16.0));
                f64::from(field.at(&p, Lookup::VarianceKept)[1])
            });
            let (sum, square) = all.fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
            let mean = sum / 4096.0;
            let variance = square / 4096.0 - mean * mean;
            assert!((mean - f64::from(field.mean.to_array()[1])).abs() < 1e-5);
            assert!(
                (variance / f64::from(field.covariance[0].to_array()[1]) - 1.0).abs() < 1e-4,
                "{share:?} {variance}"
            );
        }
    }

    #[test]
    fn voxel_centres_show_the_voxels_whatever_the_lookup() {
        let array = noise();
        let field = Field::new(array.clone(), Vector3::repeat(2.0));
        for lookup in [Lookup::Nearest, Lookup::Trilinear, Lookup::VarianceKept] {
            for (z, y, x) in [(0, 0, 0), (15, 3, 7), (8, 15, 15)] {
                let p = Point3::from([x, y, z].map(|i: usize| (i as f64 + 0.5) / 2.0));
                let value = field.at(&p, lookup);
                (0..3).for_each(|c| assert!((value[c] - array[[z, y, x, c]]).abs() < 1e-6));
            }
        }
    }
}
