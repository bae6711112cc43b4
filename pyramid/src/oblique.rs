//! The bands on planes that lie obliquely to the volume's axes, given the exemplar's distributions.
//!
//! On the planes normal to n, a 2D pyramid is a family of 3D filters of the tangential frequency (see `cuts`). Their squares add
//! up to one, so what is taken apart by them is put together by their conjugates, as on the slices along an axis. The planes
//! taken are those normal to the face diagonals: each holds an axis, along which a band of level l keeps one sample of 2^l.

use nalgebra::{Unit, Vector3};
use rayon::prelude::*;
use stereology_spectrum::{Complex, RealFft, Work, frequency};

use crate::Matching;
use crate::bank::level_shape;
use crate::canvas::match_band;
use crate::cuts::Frame;
use crate::filters::{Directions, band_response};
use crate::targets::BandTargets;

/// Steps of the tables of responses, over radii from 0 to 2.
const STEPS: usize = 1 << 12;

/// Transforms, tables and buffers of the oblique bands of volumes of one size.
pub(crate) struct Oblique {
    size: [usize; 3],
    plane: Directions,
    /// Response of high-pass, levels, low-pass over the radius.
    tables: Vec<Vec<f32>>,
    full: Grid,
    /// By the axis along which samples are left out, and by level from 1.
    thinned: [Vec<Grid>; 3],
    spectrum: Vec<Complex<f32>>,
    sum: Vec<Complex<f32>>,
    bins: Vec<Complex<f32>>,
    values: Vec<f32>,
}

struct Grid {
    fft: RealFft<f32>,
    work: Work<f32>,
    size: [usize; 3],
}

impl Grid {
    fn new(size: [usize; 3]) -> Self {
        let fft = RealFft::<f32>::new(&size).expect("three sides of at least one sample");
        Self {
            work: fft.work(),
            fft,
            size,
        }
    }

    fn bins(&self) -> usize {
        self.fft.spectrum_shape().iter().product()
    }
}

impl Oblique {
    #[allow(clippy::cast_possible_truncation, reason = "responses are kept in f32")]
    pub(crate) fn new(size: [usize; 3], levels: usize, orientations: usize) -> Self {
        let full = Grid::new(size);
        let zero = Complex::new(0.0, 0.0);
        let table = |band| {
            let response = |i: usize| band_response(2.0 * i as f64 / STEPS as f64, band, levels) as f32;
            (0..STEPS + 2).map(response).collect()
        };
        let thinned = [0, 1, 2].map(|axis| {
            let grid = |level| {
                let mut small = size;
                small[axis] = level_shape(&[size[axis]], &[], level)[0];
                Grid::new(small)
            };
            (1..=levels).map(grid).collect()
        });
        Self {
            size,
            plane: Directions::plane(orientations),
            tables: (0..levels + 2).map(table).collect(),
            spectrum: vec![zero; full.bins()],
            sum: vec![zero; full.bins()],
            bins: vec![zero; full.bins()],
            values: vec![0.0; full.fft.samples()],
            thinned,
            full,
        }
    }

    /// Gives the bands on the planes of one normal their targets. Returns `Σ ln²(variance / target)` before, and the number
    /// of bands.
    pub(crate) fn match_cuts(
        &mut self,
        field: &mut [f32],
        normal: &Unit<Vector3<f64>>,
        targets: &BandTargets,
        matching: Matching,
    ) -> (f64, usize) {
        let (levels, k) = (self.tables.len() - 2, self.plane.count());
        let frame = Frame::of(normal);
        // The array's axis (z, y, x) that lies in the planes.
        let axis = [normal.z, normal.y, normal.x].iter().position(|n| n.abs() < 1e-12);
        self.full
            .fft
            .forward_into(field, &mut self.spectrum, &mut self.full.work);
        let scale = 1.0 / field.len() as f32;
        self.spectrum.par_iter_mut().for_each(|v| *v *= scale);
        self.sum.fill(Complex::new(0.0, 0.0));
        let (mut errors, mut count) = (0.0, 0);
        for (index, target) in targets.of_band.iter().enumerate() {
            let (band, orientation) = match index {
                0 => (0, None),
                i if i > levels * k => (levels + 1, None),
                i => (1 + (i - 1) / k, Some((i - 1) % k)),
            };
            let grid = match axis {
                Some(axis) if band > 1 => &mut self.thinned[axis][band - 2],
                _ => &mut self.full,
            };
            let filter = Filter {
                size: self.size,
                frame: &frame,
                table: &self.tables[band],
                orientation: orientation.map(|b| (&self.plane, b)),
            };
            let odd = orientation.is_some() && self.plane.quadrature();
            let bins = &mut self.bins[..grid.bins()];
            let values = &mut self.values[..grid.fft.samples()];
            filter.take(&self.spectrum, bins, grid.size, odd);
            grid.fft.inverse_into(bins, values, &mut grid.work);
            if let Some(target) = target
                && let Some(error) = match_band(values, &targets.targets[*target], matching)
            {
                errors += error * error;
                count += 1;
            }
            grid.fft.forward_into(values, bins, &mut grid.work);
            filter.add(&mut self.sum, bins, grid.size, odd);
        }
        self.full.fft.inverse_into(&mut self.sum, field, &mut self.full.work);
        (errors, count)
    }
}

/// One 2D filter on the planes of a normal, as a 3D filter.
struct Filter<'a> {
    size: [usize; 3],
    frame: &'a Frame,
    table: &'a [f32],
    orientation: Option<(&'a Directions, usize)>,
}

impl Filter<'_> {
    /// The filtered spectrum on a smaller grid.
    fn take(&self, spectrum: &[Complex<f32>], bins: &mut [Complex<f32>], small: [usize; 3], odd: bool) {
        let (half, small_half) = (self.size[2] / 2 + 1, small[2] / 2 + 1);
        bins.par_chunks_mut(small[1] * small_half)
            .enumerate()
            .for_each(|(z, plane)| {
                let z = large_index(z, small[0], self.size[0]);
                for (y, bins) in plane.chunks_exact_mut(small_half).enumerate() {
                    let y = large_index(y, small[1], self.size[1]);
                    let from = &spectrum[(z * self.size[1] + y) * half..];
                    let pairs = bins.iter_mut().zip(from);
                    self.row(z, y, pairs, |(out, v), f| {
                        *out = if odd { Complex::new(-v.im * f, v.re * f) } else { v * f };
                    });
                }
            });
    }

    /// Adds the transform of a band on a smaller grid, filtered by the conjugate.
    fn add(&self, sum: &mut [Complex<f32>], bins: &[Complex<f32>], small: [usize; 3], odd: bool) {
        let (half, small_half) = (self.size[2] / 2 + 1, small[2] / 2 + 1);
        let scale = 1.0 / small.iter().product::<usize>() as f32;
        sum.par_chunks_mut(self.size[1] * half)
            .enumerate()
            .for_each(|(z, plane)| {
                let Some(from_z) = small_index(z, small[0], self.size[0]) else {
                    return;
                };
                for (y, sum) in plane.chunks_exact_mut(half).enumerate() {
                    let Some(from_y) = small_index(y, small[1], self.size[1]) else {
                        continue;
                    };
                    let start = (from_z * small[1] + from_y) * small_half;
                    let pairs = sum.iter_mut().zip(&bins[start..start + small_half]);
                    self.row(z, y, pairs, |(out, v), f| {
                        let f = f * scale;
                        *out += if odd { Complex::new(v.im * f, -v.re * f) } else { v * f };
                    });
                }
            });
    }

    /// Calls `f(item, response)` along the bins of a row of the large grid.
    #[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
    fn row<I>(&self, z: usize, y: usize, items: impl Iterator<Item = I>, f: impl Fn(I, f32)) {
        let size = self.size;
        let [a, b] = self.frame.along;
        let n = self.frame.normal;
        let start = Vector3::new(0.0, frequency(y, size[1]), frequency(z, size[0]));
        let step = 2.0 / size[2] as f64;
        let (a0, b0) = ((2.0 * start.dot(&a)) as f32, (2.0 * start.dot(&b)) as f32);
        let (da, db) = ((step * a.x) as f32, (step * b.x) as f32);
        // A bin at the Nyquist frequency of an axis stands for both signs: see `cuts`.
        let oblique = |along: f64| along.abs() < 1.0 - 1e-12;
        let ambiguous = (2 * z == size[0] && oblique(n.z)) || (2 * y == size[1] && oblique(n.y));
        let (power, gain, cos, sin) = self.orientation.map_or((0, 1.0, 0.0, 0.0), |(plane, b)| {
            let v = plane.vectors()[b];
            (plane.power(), plane.signed_gain(), v[2] as f32, v[1] as f32)
        });
        for (x, item) in items.enumerate() {
            let (ka, kb) = (a0 + x as f32 * da, b0 + x as f32 * db);
            let radius = (ka * ka + kb * kb).sqrt();
            let alone = ambiguous || (2 * x == size[2] && oblique(n.x));
            let response = at(self.table, if alone { radius.max(1.0) } else { radius });
            let response = if power == 0 || response == 0.0 {
                response
            } else {
                response * gain * ((ka * cos + kb * sin) / radius.max(1e-9)).powi(power)
            };
            f(item, response);
        }
    }
}

/// Where a bin of an axis of `small` samples lies among those of `large`.
fn large_index(k: usize, small: usize, large: usize) -> usize {
    if 2 * k < small || small == large {
        k
    } else {
        k + large - small
    }
}

/// The inverse of [`large_index`], for bins that have one.
fn small_index(k: usize, small: usize, large: usize) -> Option<usize> {
    if 2 * k < small || small == large {
        Some(k)
    } else {
        k.checked_sub(large - small).filter(|&k| 2 * k >= small)
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "radii are at most √3 < 2"
)]
fn at(table: &[f32], radius: f32) -> f32 {
    let position = 0.5 * radius * STEPS as f32;
    let below = position as usize;
    table[below] + (position - below as f32) * (table[below + 1] - table[below])
}

#[cfg(test)]
mod tests {
    use super::Oblique;
    use crate::Matching;
    use crate::cuts::{Cuts, face_diagonals};
    use crate::plan::white_noise;
    use crate::targets::BandTargets;

    /// Where nothing is matched, the field comes back from its oblique bands, at odd and unequal sides: the filters' squares
    /// add up to one and thinning loses nothing.
    #[test]
    fn fields_come_back_from_their_oblique_bands() {
        for size in [[16, 16, 16], [19, 24, 33]] {
            let samples: usize = size.iter().product();
            let noise = white_noise(samples, size[2], 1, 0);
            for normal in face_diagonals() {
                let mut field = noise.clone();
                let nothing = BandTargets {
                    targets: Vec::new(),
                    of_band: vec![None; 2 + 2 * 4],
                };
                Oblique::new(size, 2, 4).match_cuts(&mut field, &normal, &nothing, Matching::Exact);
                let worst = field.iter().zip(&noise).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 2e-5, "{size:?}, {normal:?}: {worst}");
            }
        }
    }

    /// Noise that is smooth in all directions, smoothed once more along one, has its cuts brought back to their band variances.
    #[test]
    fn variances_of_cuts_are_brought_where_they_are_wanted() {
        let (n, levels) = (24, 2);
        let smoothed = |field: &[f32], stride: usize| -> Vec<f32> {
            let next = |i: usize| i / (stride * n) * stride * n + (i + stride) % (stride * n);
            (0..field.len()).map(|i| 0.5 * (field[i] + field[next(i)])).collect()
        };
        let mut model = white_noise(n * n * n, n, 1, 0);
        for stride in [1, 1, 1, n, n, n, n * n, n * n, n * n] {
            model = smoothed(&model, stride);
        }
        let mut cuts = Cuts::new([n; 3], levels);
        let wanted = cuts.variances(&model, &face_diagonals())[0].clone();
        let mut error = |field: &[f32]| {
            let found = cuts.variances(field, &face_diagonals());
            let squares = found
                .iter()
                .flat_map(|f| (1..=levels).map(|b| (f[b] / wanted[b]).ln().powi(2)));
            squares.sum::<f64>().sqrt()
        };
        let mut field = smoothed(&model, 1);
        let before = error(&field);
        Cuts::new([n; 3], levels).bring_variances(&mut field, &wanted);
        let after = error(&field);
        assert!(after < 0.25 * before, "{before} {after}");
    }
}
