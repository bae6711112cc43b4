//! What is left of a photograph without its mean colours, as a volume that repeats; looked up between its voxels.

#![allow(
    clippy::cast_possible_truncation,
    reason = "colours are f32; places are in the box and positive"
)]

use nalgebra::{Point3, Vector3};
use ndarray::{Array4, ArrayView4};
use rayon::prelude::*;

/// Fine detail to add to the mean colours: one volume for the binder, one for the particles (section 4.3).
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Detail of the binder, axes (z, y, x, 3), in encoded colour values, −1 to 1.
    pub binder: Array4<f32>,
    /// Detail of the particles, likewise; its sizes may differ.
    pub particles: Array4<f32>,
    /// Edge of a voxel of both, in the unit of length of the box: the size of a pixel of the photograph.
    pub voxel: f64,
}

/// How a residual is read between its voxels' centres.
///
/// Between voxels a weighted mean of eight is less contrasty than the voxels are: of white noise an eighth of the variance is left in the middle. A solid read at other points than its voxels would look blurred, in
/// planes and stripes where the two grids fall out of step. [`Lookup::VarianceKept`] undoes this exactly, on average over the volume, at every point.
///
/// # Formula
///
/// ```text
/// r(p) = mean + (trilinear(p) − mean) √(C(0) / v(f)),   v(f) = Σ  A(fx,a) A(fy,b) A(fz,c) C(a,b,c)
///                                                           a,b,c ∈ {0,1}
/// A(f,0) = 1 − 2f(1−f),   A(f,1) = 2f(1−f)
/// ```
///
/// with f the position between the voxels and C the autocovariance at lags (±a, ±b, ±c), averaged over the signs; the gain is at most √8, that of white noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// The voxel that holds the point: exact statistics, visible voxels when enlarged.
    Nearest,
    /// The eight nearest voxels, weighted: smooth, less contrast between voxels.
    Trilinear,
    /// [`Lookup::Trilinear`], its contrast restored.
    #[default]
    VarianceKept,
}

const MOST_GAIN: f32 = 8.0;

/// Three channels and a fourth of no account, so that they are worked out at once.
type Lanes = [f32; 4];

/// A repeating colour volume prepared for lookups.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    /// Voxels along x, y, z.
    sizes: [usize; 3],
    voxels_per_length: Vector3<f64>,
    /// x fastest.
    samples: Vec<[f32; 3]>,
    mean: [f32; 3],
    /// Autocovariance at lag (a, b, c) at index a + 2b + 4c, of each channel.
    covariance: [[f32; 3]; 8],
}

impl Field {
    /// Of an array (z, y, x, 3) of at least one voxel.
    pub(crate) fn new(array: ArrayView4<'_, f32>, voxels_per_length: Vector3<f64>) -> Self {
        let (nz, ny, nx, _) = array.dim();
        let samples: Vec<[f32; 3]> = array.rows().into_iter().map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect();
        let mut field = Self {
            sizes: [nx, ny, nz],
            voxels_per_length,
            samples,
            mean: [0.0; 3],
            covariance: [[0.0; 3]; 8],
        };
        field.measure();
        field
    }

    /// Mean and autocovariance, summed plane by plane in order.
    fn measure(&mut self) {
        let [nx, ny, nz] = self.sizes;
        let row = |y: usize, z: usize| &self.samples[(z * ny + y) * nx..][..nx];
        let average = |sum_of_row: &(dyn Fn(usize, usize) -> [f64; 3] + Sync)| {
            let plane = |z: usize| (0..ny).map(|y| sum_of_row(y, z)).fold([0.0; 3], plus);
            let planes: Vec<[f64; 3]> = (0..nz).into_par_iter().map(plane).collect();
            planes
                .into_iter()
                .fold([0.0; 3], plus)
                .map(|sum| sum / (nx * ny * nz) as f64)
        };
        let mean = average(&|y, z| {
            row(y, z)
                .iter()
                .fold([0.0; 3], |sum, rgb| plus(sum, rgb.map(f64::from)))
        });
        let lagged = |a: usize, b: usize, c: usize| {
            average(&|y, z| {
                let (here, there) = (row(y, z), row((y + b) % ny, (z + c) % nz));
                let shifted = there[a % nx..].iter().chain(&there[..a % nx]);
                here.iter().zip(shifted).fold([0.0; 3], |sum, (p, q)| {
                    let product = |k: usize| (f64::from(p[k]) - mean[k]) * (f64::from(q[k]) - mean[k]);
                    plus(sum, [product(0), product(1), product(2)])
                })
            })
        };
        let mut covariance = [[0.0; 3]; 8];
        for (index, average) in covariance.iter_mut().enumerate() {
            let [a, b, c] = [index & 1, index >> 1 & 1, index >> 2 & 1];
            // A lag and its opposite are the same; of the others every sign counts.
            let signs = [
                (b, c),
                ((ny - b) % ny, c),
                (b, (nz - c) % nz),
                ((ny - b) % ny, (nz - c) % nz),
            ];
            let mut distinct = vec![signs[0]];
            if a + b + c > 1 {
                for sign in &signs[1..] {
                    if !distinct.contains(sign) {
                        distinct.push(*sign);
                    }
                }
            }
            if a == 0 {
                distinct.truncate(2);
            }
            let sum = distinct.iter().map(|&(b, c)| lagged(a, b, c)).fold([0.0; 3], plus);
            *average = sum.map(|sum| (sum / distinct.len() as f64) as f32);
        }
        self.mean = mean.map(|mean| mean as f32);
        self.covariance = covariance;
    }

    /// The field at a point of the box.
    pub(crate) fn at(&self, p: &Point3<f64>, lookup: Lookup) -> [f32; 3] {
        self.row([p.y, p.z], lookup).at(p.x)
    }

    /// The field along a row of the box.
    pub(crate) fn row(&self, yz: [f64; 2], lookup: Lookup) -> FieldRow<'_> {
        let [nx, ny, _] = self.sizes;
        let start = |y: usize, z: usize| (z * ny + y) * nx;
        if lookup == Lookup::Nearest {
            let [y, z] = [0, 1].map(|k| (yz[k] * self.voxels_per_length[k + 1]) as usize % self.sizes[k + 1]);
            return FieldRow {
                field: self,
                lookup,
                starts: [start(y, z); 4],
                weights: [1.0, 0.0, 0.0, 0.0],
                variance: [[0.0; 4]; 2],
                whole: [1.0; 4],
                blended: Vec::new(),
            };
        }
        let [y, z] = [0, 1].map(|k| self.between(k + 1, yz[k]));
        let [ay, az] = [y, z].map(|of| 2.0 * of.share * (1.0 - of.share));
        let weights = [(1.0 - ay) * (1.0 - az), ay * (1.0 - az), (1.0 - ay) * az, ay * az];
        let (mut variance, mut whole) = ([[0.0; 4]; 2], [1.0; 4]);
        for c in 0..3 {
            if self.covariance[0][c] > 0.0 {
                whole[c] = self.covariance[0][c];
                for (lag, covariance) in self.covariance.iter().enumerate() {
                    variance[lag & 1][c] += weights[lag >> 1] * covariance[c];
                }
            }
        }
        FieldRow {
            field: self,
            lookup,
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
            variance,
            whole,
            blended: Vec::new(),
        }
    }

    /// The voxels on both sides of a place along an axis.
    fn between(&self, axis: usize, x: f64) -> Between {
        let n = self.sizes[axis];
        // Half a voxel off the centres, and a whole period on, so that it is positive.
        let place = x * self.voxels_per_length[axis] - 0.5 + n as f64;
        let floor = place as usize;
        let low = floor % n;
        Between {
            low,
            high: if low + 1 == n { 0 } else { low + 1 },
            share: (place - floor as f64) as f32,
        }
    }
}

/// Two neighbouring voxels and how near to the second.
#[derive(Clone, Copy)]
struct Between {
    low: usize,
    high: usize,
    share: f32,
}

/// A field at one y and z.
pub(crate) struct FieldRow<'a> {
    field: &'a Field,
    lookup: Lookup,
    /// Where the rows of voxels around it begin, and their shares.
    starts: [usize; 4],
    weights: [f32; 4],
    /// What trilinear weights leave of the variance: at the voxels' x, and what is in it of their neighbours'.
    variance: [Lanes; 2],
    /// Variance of the voxels; 1 where they do not vary.
    whole: Lanes,
    /// The four rows blended, if they are to be read more than once.
    blended: Vec<Lanes>,
}

impl FieldRow<'_> {
    /// The same row, to be read at `reads` places: blended at once if that is less work.
    pub(crate) fn prepared_for(mut self, reads: usize) -> Self {
        if 2 * reads > self.field.sizes[0] {
            self.blended = (0..self.field.sizes[0]).map(|voxel| self.blend(voxel)).collect();
        }
        self
    }

    /// The field at an x; the same bits prepared or not.
    pub(crate) fn at(&self, x: f64) -> [f32; 3] {
        let place = self.place(x);
        if self.blended.is_empty() {
            self.between(self.blend(place.low), self.blend(place.high), place.share)
        } else {
            self.between(self.blended[place.low], self.blended[place.high], place.share)
        }
    }

    fn place(&self, x: f64) -> Between {
        if self.lookup == Lookup::Nearest {
            let voxel = (x * self.field.voxels_per_length.x) as usize % self.field.sizes[0];
            Between {
                low: voxel,
                high: voxel,
                share: 0.0,
            }
        } else {
            self.field.between(0, x)
        }
    }

    /// The four rows at the x of a voxel.
    fn blend(&self, voxel: usize) -> Lanes {
        let [a, b, c, d] = self.starts.map(|start| lanes(self.field.samples[start + voxel]));
        let w = self.weights;
        [0, 1, 2, 3].map(|k| (w[0] * a[k] + w[1] * b[k]) + (w[2] * c[k] + w[3] * d[k]))
    }

    fn between(&self, low: Lanes, high: Lanes, f: f32) -> [f32; 3] {
        let mut value = [0, 1, 2, 3].map(|c| (1.0 - f) * low[c] + f * high[c]);
        if self.lookup == Lookup::VarianceKept {
            let apart = 2.0 * f * (1.0 - f);
            let mean = lanes(self.field.mean);
            let left = [0, 1, 2, 3].map(|c| (1.0 - apart) * self.variance[0][c] + apart * self.variance[1][c]);
            let gain = [0, 1, 2, 3].map(|c| {
                let least = self.whole[c] / MOST_GAIN;
                let left = if left[c] > least { left[c] } else { least };
                (self.whole[c] / left).sqrt()
            });
            value = [0, 1, 2, 3].map(|c| mean[c] + (value[c] - mean[c]) * gain[c]);
        }
        [value[0], value[1], value[2]]
    }
}

fn lanes([r, g, b]: [f32; 3]) -> Lanes {
    [r, g, b, 0.0]
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg(test)]
mod tests {
    use super::{Field, Lookup};
    use nalgebra::{Point3, Vector3};
    use ndarray::Array4;
    use rand::{RngExt, SeedableRng};

    /// Noise smoothed along x, so that neighbours hang together differently along each axis.
    fn noise() -> Array4<f32> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let white = Array4::from_shape_fn((16, 16, 16, 3), |_| rng.random::<f32>());
        Array4::from_shape_fn((16, 16, 16, 3), |(z, y, x, c)| {
            0.4 * white[[z, y, x, c]] + 0.3 * (white[[z, y, (x + 1) % 16, c]] + white[[z, (y + 1) % 16, x, c]])
        })
    }

    /// At a fixed place between the voxels, the variance over all voxels is that of the voxels themselves: an identity, not an estimate, where the field repeats.
    #[test]
    fn variance_is_kept_at_every_place_between_voxels() {
        let field = Field::new(noise().view(), Vector3::repeat(1.0));
        for share in [[0.5, 0.5, 0.5], [0.2, 0.9, 0.6], [0.0, 0.5, 0.0], [0.7, 0.7, 0.1]] {
            let all = (0..16 * 16 * 16).map(|i| {
                let voxel = [i % 16, i / 16 % 16, i / 256].map(f64::from);
                let p = Point3::from(Vector3::from_fn(|k, _| (voxel[k] + 0.5 + share[k]) % 16.0));
                f64::from(field.at(&p, Lookup::VarianceKept)[1])
            });
            let (sum, square) = all.fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
            let mean = sum / 4096.0;
            let variance = square / 4096.0 - mean * mean;
            assert!((mean - f64::from(field.mean[1])).abs() < 1e-5);
            assert!(
                (variance / f64::from(field.covariance[0][1]) - 1.0).abs() < 1e-4,
                "{share:?} {variance}"
            );
        }
    }

    #[test]
    fn voxel_centres_show_the_voxels_whatever_the_lookup() {
        let array = noise();
        let field = Field::new(array.view(), Vector3::repeat(2.0));
        for lookup in [Lookup::Nearest, Lookup::Trilinear, Lookup::VarianceKept] {
            for (z, y, x) in [(0, 0, 0), (15, 3, 7), (8, 15, 15)] {
                let p = Point3::from([x, y, z].map(|i: usize| (i as f64 + 0.5) / 2.0));
                let value = field.at(&p, lookup);
                (0..3).for_each(|c| assert!((value[c] - array[[z, y, x, c]]).abs() < 1e-6));
            }
        }
    }
}
