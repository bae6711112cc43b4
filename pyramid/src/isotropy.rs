//! Equalisation of the power over directions, which the matching of slices makes unequal.
//!
//! Slices lie along the axes only. Where the spectrum of the exemplar is not exactly that of slices of any isotropic
//! volume, matching adds the missing power to waves along the axes or perpendicular to them. On every shell of
//! frequencies the power is fitted by cubic harmonics of degrees 4 and 6 of the direction u, and divided by the fit:
//!
//! ```text
//! P(k) ≈ c₀ + c₁ Y₄(u) + c₂ Y₆(u),   Y₄ = Σ u_i⁴ − 3/5,   Y₆ = u_x² u_y² u_z² + Y₄/22 − 1/105
//! ```

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use stereology_spectrum::{Complex, RealFft, frequency};

/// Number of shells of frequencies up to the corner of the cube.
const SHELLS: usize = 56;
/// A shell with fewer frequencies is not changed.
const FEWEST: f64 = 60.0;
/// Largest factor by which power is changed.
const MOST: f64 = 3.0;

/// The transform of the fields of a volume, and buffers.
pub(crate) struct Isotropy {
    fft: RealFft<f32>,
    size: [usize; 3],
    spectrum: Vec<Complex<f32>>,
    work: stereology_spectrum::Work<f32>,
}

/// Contribution to the least squares of a shell.
#[derive(Clone, Copy)]
struct Sums {
    normal: Matrix3<f64>,
    right: Vector3<f64>,
}

impl Isotropy {
    pub(crate) fn new(size: [usize; 3]) -> Self {
        let fft = RealFft::<f32>::new(&size).expect("sides of at least 8");
        Self {
            spectrum: vec![Complex::new(0.0, 0.0); fft.spectrum_shape().iter().product()],
            work: fft.work(),
            fft,
            size,
        }
    }

    /// Divides the power of each shell by its dependence on direction and keeps its mean.
    pub(crate) fn restore(&mut self, field: &mut [f32]) {
        self.fft.forward_into(field, &mut self.spectrum, &mut self.work);
        let (size, half) = (self.size, self.size[2] / 2 + 1);
        let nothing = Sums {
            normal: Matrix3::zeros(),
            right: Vector3::zeros(),
        };
        // One sum per plane, added in order: the same bits at any number of threads.
        let planes: Vec<Vec<Sums>> = self
            .spectrum
            .par_chunks(half * size[1])
            .enumerate()
            .map(|(z, bins)| {
                let mut shells = vec![nothing; SHELLS];
                for (i, bin) in bins.iter().enumerate() {
                    let (radius, basis) = harmonics(size, [z, i / half, i % half]);
                    let twice = if i % half == 0 || 2 * (i % half) == size[2] {
                        1.0
                    } else {
                        2.0
                    };
                    let sums = &mut shells[shell(radius)];
                    sums.normal += twice * basis * basis.transpose();
                    sums.right += twice * f64::from(bin.norm_sqr()) * basis;
                }
                shells
            })
            .collect();
        let fits: Vec<Option<Vector3<f64>>> = (0..SHELLS)
            .map(|s| {
                let sums = planes.iter().fold(nothing, |all, plane| Sums {
                    normal: all.normal + plane[s].normal,
                    right: all.right + plane[s].right,
                });
                let count = sums.normal[(0, 0)];
                let mean = sums.right[0] / count;
                (count >= FEWEST && mean > 0.0)
                    .then(|| sums.normal.cholesky().map(|c| c.solve(&sums.right) / mean))
                    .flatten()
            })
            .collect();
        let scale = 1.0 / field.len() as f64;
        self.spectrum
            .par_chunks_mut(half * size[1])
            .enumerate()
            .for_each(|(z, bins)| {
                for (i, bin) in bins.iter_mut().enumerate() {
                    let (radius, basis) = harmonics(size, [z, i / half, i % half]);
                    let excess = fits[shell(radius)].map_or(1.0, |fit| fit.dot(&basis).clamp(1.0 / MOST, MOST));
                    #[allow(clippy::cast_possible_truncation, reason = "computed in f64, kept in f32")]
                    let factor = (scale / excess.sqrt()) as f32;
                    *bin *= factor;
                }
            });
        self.fft.inverse_into(&mut self.spectrum, field, &mut self.work);
    }
}

/// Radius in cycles per sample, and 1, Y₄, Y₆ of the direction.
fn harmonics(size: [usize; 3], bin: [usize; 3]) -> (f64, Vector3<f64>) {
    let k = [0, 1, 2].map(|axis| frequency(bin[axis], size[axis]).powi(2));
    let square: f64 = k.iter().sum();
    if square == 0.0 {
        return (0.0, Vector3::new(1.0, 0.0, 0.0));
    }
    let u = k.map(|k| k / square);
    let fourth = u.iter().map(|u| u * u).sum::<f64>() - 0.6;
    let sixth = u[0] * u[1] * u[2] + fourth / 22.0 - 1.0 / 105.0;
    // Scaled to about unit size.
    (square.sqrt(), Vector3::new(1.0, 4.0 * fourth, 40.0 * sixth))
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "radii are at most √3/2"
)]
fn shell(radius: f64) -> usize {
    ((radius / 0.75_f64.sqrt() * SHELLS as f64) as usize).min(SHELLS - 1)
}
