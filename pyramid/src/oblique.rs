//! Matching of the bands on planes oblique to the axes of the volume.
//!
//! On the planes normal to n, a 2D pyramid is a family of 3D filters of the tangential frequency (see `cuts`). Their
//! squares sum to one, so the conjugate filters reconstruct the volume, as on the slices along an axis.
//!
//! A band whose filter ends at radius ρ fills a cylinder of frequencies about n. Along axis a the cylinder is 2ρ / √(1
//! − n_a²) thick, so samples at a distance of 1 / thickness along a represent it without aliasing. Coarse bands
//! therefore need only a part of the samples along y and z, and along x if that axis lies in the planes.

use nalgebra::{Unit, Vector3};
use rayon::prelude::*;
use stereology_spectrum::{Complex, RealFft, Work, frequency};

use crate::Matching;
use crate::canvas::match_band;
use crate::cuts::Frame;
use crate::filters::{Directions, band_response};
use crate::targets::BandTargets;

/// Number of steps of the tables of responses, for radii from 0 to 2.
const STEPS: usize = 1 << 12;

/// Tables and buffers of the oblique bands of volumes of one size.
pub(crate) struct Oblique {
    size: [usize; 3],
    plane: Directions,
    /// Response of high-pass, levels, low-pass over the radius.
    tables: Vec<Vec<f32>>,
    /// For the oriented bands: response times gain, to the power of 1 / (power of the cosine).
    roots: Vec<Vec<f32>>,
    full: Grid,
    /// Smaller grids, created when a normal first needs them.
    thinned: Vec<Grid>,
    spectrum: Vec<Complex<f32>>,
    sum: Vec<Complex<f32>>,
    bins: Vec<Complex<f32>>,
    values: Vec<f32>,
    radial: Vec<f32>,
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
        let plane = Directions::plane(orientations);
        let response = |i: usize, band| band_response(2.0 * i as f64 / STEPS as f64, band, levels);
        let table = |band| (0..STEPS + 2).map(|i| response(i, band) as f32).collect();
        let (gain, root) = (
            f64::from(plane.signed_gain().abs()),
            1.0 / f64::from(plane.power().max(1)),
        );
        let root = |band| {
            (0..STEPS + 2)
                .map(|i| (gain * response(i, band)).powf(root) as f32)
                .collect()
        };
        Self {
            size,
            tables: (0..levels + 2).map(table).collect(),
            roots: (0..levels + 2).map(root).collect(),
            plane,
            spectrum: vec![zero; full.bins()],
            sum: vec![zero; full.bins()],
            bins: vec![zero; full.bins()],
            radial: vec![0.0; full.bins()],
            values: vec![0.0; full.fft.samples()],
            thinned: Vec::new(),
            full,
        }
    }

    /// Matches the bands on the planes of one normal to their targets. Returns `Σ ln²(variance / target)` before
    /// matching, and the number of bands.
    pub(crate) fn match_cuts(
        &mut self,
        field: &mut [f32],
        normal: &Unit<Vector3<f64>>,
        targets: &BandTargets,
        matching: Matching,
    ) -> (f64, usize) {
        let (levels, k) = (self.tables.len() - 2, self.plane.count());
        self.full
            .fft
            .forward_into(field, &mut self.spectrum, &mut self.full.work);
        let scale = 1.0 / field.len() as f32;
        self.spectrum.par_iter_mut().for_each(|v| *v *= scale);
        self.sum.par_iter_mut().for_each(|v| *v = Complex::new(0.0, 0.0));
        let (mut errors, mut count) = (0.0, 0);
        for band in 0..levels + 2 {
            let orientations = if band == 0 || band > levels { 1 } else { k };
            let ends = 0.5_f64.powi(i32::try_from(band).unwrap_or(i32::MAX) - 1);
            let small = thinned(self.size, normal, ends);
            let grid = if small == self.size {
                &mut self.full
            } else {
                let known = self.thinned.iter().position(|grid| grid.size == small);
                let at = known.unwrap_or_else(|| {
                    self.thinned.push(Grid::new(small));
                    self.thinned.len() - 1
                });
                &mut self.thinned[at]
            };
            let mut filter = Filter {
                large: self.size,
                small,
                frame: Frame::of(normal),
                ends: if band == 0 { f64::INFINITY } else { ends },
                radial: &mut self.radial,
            };
            let power = if orientations == 1 { 0 } else { self.plane.power() };
            let table = if power == 0 {
                &self.tables[band]
            } else {
                &self.roots[band]
            };
            filter.fill_radial(table, power > 0);
            for b in 0..orientations {
                let index = if band == 0 { 0 } else { 1 + (band - 1) * k + b };
                let direction = (power > 0).then(|| Direction {
                    along: [self.plane.vectors()[b][2], self.plane.vectors()[b][1]],
                    power,
                    sign: self.plane.signed_gain().signum(),
                    odd: self.plane.quadrature(),
                });
                let bins = &mut self.bins[..grid.bins()];
                let values = &mut self.values[..grid.fft.samples()];
                filter.take(&self.spectrum, bins, direction.as_ref());
                grid.fft.inverse_into(bins, values, &mut grid.work);
                if let Some(target) = targets.of_band[index]
                    && let Some(error) = match_band(values, &targets.targets[target], matching)
                {
                    errors += error * error;
                    count += 1;
                }
                grid.fft.forward_into(values, bins, &mut grid.work);
                filter.add(&mut self.sum, bins, direction.as_ref());
            }
        }
        self.full.fft.inverse_into(&mut self.sum, field, &mut self.full.work);
        (errors, count)
    }
}

/// Number of samples along each axis (z, y, x) that represent the cylinder of frequencies about a normal with radius
/// `ends` of Nyquist.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a whole number of samples, at most the volume's"
)]
fn thinned(size: [usize; 3], normal: &Unit<Vector3<f64>>, ends: f64) -> [usize; 3] {
    let along = [normal.z, normal.y, normal.x];
    let mut small = [0, 1, 2].map(|axis| {
        let across = (1.0 - along[axis] * along[axis]).sqrt();
        // Larger by one: the ends of the cylinder, where the filter is zero, may coincide, but must not fall on the
        // Nyquist frequency.
        let fewest = (size[axis] as f64 * ends / across.max(1e-9)).ceil() as usize + 2;
        (fewest..size[axis]).find(|&n| is_smooth(n)).unwrap_or(size[axis])
    });
    // The spectrum has only half of the frequencies of the last axis, which cannot be folded unless the axis lies in
    // the planes; then only one of y and x can be reduced.
    if along[2].abs() > 1e-12 {
        small[2] = size[2];
    } else {
        small[1] = size[1];
    }
    small
}

fn is_smooth(mut n: usize) -> bool {
    for prime in [2, 3, 5] {
        while n.is_multiple_of(prime) {
            n /= prime;
        }
    }
    n == 1
}

/// An orientation in the planes.
struct Direction {
    /// Along the frame's two directions.
    along: [f64; 2],
    power: i32,
    sign: f32,
    odd: bool,
}

/// The filters of one band on the planes of a normal, as 3D filters.
struct Filter<'a> {
    large: [usize; 3],
    small: [usize; 3],
    frame: Frame,
    /// Radius beyond which there is no response.
    ends: f64,
    /// The factor common to all orientations, on the large grid: the response, or its root divided by the radius.
    radial: &'a mut [f32],
}

impl Filter<'_> {
    fn fill_radial(&mut self, table: &[f32], over_radius: bool) {
        let size = self.large;
        let (half, n) = (size[2] / 2 + 1, self.frame.normal);
        // A bin at the Nyquist frequency of an axis represents both signs: see `cuts`.
        let oblique = |along: f64| along.abs() < 1.0 - 1e-12;
        let frame = &self.frame;
        let ends = self.ends;
        self.radial.par_chunks_mut(half).enumerate().for_each(|(row, radial)| {
            let (z, y) = (row / size[1], row % size[1]);
            let range = row_range(frame, ends, size, z, y);
            let ambiguous = (2 * z == size[0] && oblique(n.z)) || (2 * y == size[1] && oblique(n.y));
            let [a, b] = along_row(frame, size, z, y);
            for x in range {
                let (ka, kb) = (a.at(x), b.at(x));
                let radius = (ka * ka + kb * kb).sqrt();
                let alone = ambiguous || (2 * x == size[2] && oblique(n.x));
                let response = at(table, if alone { radius.max(1.0) } else { radius });
                radial[x] = if over_radius {
                    response / radius.max(1e-9)
                } else {
                    response
                };
            }
        });
    }

    /// The filtered spectrum, folded onto a smaller grid.
    fn take(&self, spectrum: &[Complex<f32>], bins: &mut [Complex<f32>], direction: Option<&Direction>) {
        let (large, small) = (self.large, self.small);
        let (half, small_half) = (large[2] / 2 + 1, small[2] / 2 + 1);
        bins.par_chunks_mut(small[1] * small_half)
            .enumerate()
            .for_each(|(z, plane)| {
                plane.fill(Complex::new(0.0, 0.0));
                for z in unfolded(z, small[0], large[0]) {
                    for (y, bins) in plane.chunks_exact_mut(small_half).enumerate() {
                        for y in unfolded(y, small[1], large[1]) {
                            let row = z * large[1] + y;
                            let range = row_range(&self.frame, self.ends, large, z, y);
                            let from = &spectrum[row * half..][..half];
                            let pairs = bins[range.clone()].iter_mut().zip(&from[range.clone()]);
                            self.row(
                                z,
                                y,
                                range,
                                direction,
                                pairs,
                                |(out, v), f| *out += v * f,
                                |(out, v), f| {
                                    *out += Complex::new(-v.im * f, v.re * f);
                                },
                            );
                        }
                    }
                }
            });
    }

    /// Unfolds the transform of a band on the smaller grid, filters it by the conjugate, and adds it.
    fn add(&self, sum: &mut [Complex<f32>], bins: &[Complex<f32>], direction: Option<&Direction>) {
        let (large, small) = (self.large, self.small);
        let (half, small_half) = (large[2] / 2 + 1, small[2] / 2 + 1);
        let scale = 1.0 / small.iter().product::<usize>() as f32;
        sum.par_chunks_mut(half).enumerate().for_each(|(row, sum)| {
            let (z, y) = (row / large[1], row % large[1]);
            let from = folded(z, small[0], large[0]) * small[1] + folded(y, small[1], large[1]);
            let range = row_range(&self.frame, self.ends, large, z, y);
            let bins = &bins[from * small_half..][..small_half];
            let pairs = sum[range.clone()].iter_mut().zip(&bins[range.clone()]);
            self.row(
                z,
                y,
                range,
                direction,
                pairs,
                |(out, v), f| *out += v * (f * scale),
                |(out, v), f| {
                    let f = f * scale;
                    *out += Complex::new(v.im * f, -v.re * f);
                },
            );
        });
    }

    /// Calls `even(item, response)`, or `odd` for an odd filter, along the bins of a row of the large grid.
    #[allow(
        clippy::too_many_arguments,
        clippy::cast_possible_truncation,
        reason = "an inner loop; kept in f32"
    )]
    fn row<I>(
        &self,
        z: usize,
        y: usize,
        range: std::ops::Range<usize>,
        direction: Option<&Direction>,
        items: impl Iterator<Item = I>,
        even: impl Fn(I, f32),
        odd: impl Fn(I, f32),
    ) {
        let radial = &self.radial[(z * self.large[1] + y) * (self.large[2] / 2 + 1)..];
        let items = items.zip(&radial[range.clone()]);
        let Some(direction) = direction else {
            items.for_each(|(item, &f)| even(item, f));
            return;
        };
        let [a, b] = along_row(&self.frame, self.large, z, y);
        let [cos, sin] = direction.along.map(|v| v as f32);
        let along = Line {
            start: a.start * cos + b.start * sin,
            step: a.step * cos + b.step * sin,
        };
        let items = items.zip(range);
        let sign = direction.sign;
        match (direction.power, direction.odd) {
            (3, true) => items.for_each(|((item, &f), x)| {
                let t = f * along.at(x);
                odd(item, sign * t * t * t);
            }),
            (power, true) => items.for_each(|((item, &f), x)| odd(item, sign * (f * along.at(x)).powi(power))),
            (power, false) => items.for_each(|((item, &f), x)| even(item, sign * (f * along.at(x)).powi(power))),
        }
    }
}

/// A linear function along the bins of a row.
#[derive(Clone, Copy)]
struct Line {
    start: f32,
    step: f32,
}

impl Line {
    fn at(self, x: usize) -> f32 {
        self.start + x as f32 * self.step
    }
}

/// Tangential frequency of the bins of a row along the two directions of the frame, Nyquist 1.
#[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
fn along_row(frame: &Frame, size: [usize; 3], z: usize, y: usize) -> [Line; 2] {
    let start = Vector3::new(0.0, frequency(y, size[1]), frequency(z, size[0]));
    frame.along.map(|direction| Line {
        start: (2.0 * start.dot(&direction)) as f32,
        step: (2.0 / size[2] as f64 * direction.x) as f32,
    })
}

/// The bins of a row whose tangential frequency is below `ends`: κ² = a + 2 b x + c x² along the row.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the bins of a row"
)]
fn row_range(frame: &Frame, ends: f64, size: [usize; 3], z: usize, y: usize) -> std::ops::Range<usize> {
    let half = size[2] / 2 + 1;
    if ends.is_infinite() {
        return 0..half;
    }
    let step = 2.0 / size[2] as f64;
    let start = 2.0 * Vector3::new(0.0, frequency(y, size[1]), frequency(z, size[0]));
    let n = frame.normal;
    let a = start.norm_squared() - start.dot(&n).powi(2);
    let b = -start.dot(&n) * n.x * step;
    let c = (1.0 - n.x * n.x) * step * step;
    if c < 1e-12 * step * step {
        return if a < ends * ends { 0..half } else { 0..0 };
    }
    let root = b * b - c * (a - ends * ends);
    if root <= 0.0 {
        return 0..0;
    }
    let (low, high) = ((-b - root.sqrt()) / c, (-b + root.sqrt()) / c);
    let first = low.max(0.0).ceil() as usize;
    let end = (high.min(half as f64 - 1.0).max(-1.0).floor() + 1.0) as usize;
    first.min(end)..end
}

/// Index among `small` bins onto which a bin of an axis of `large` samples is folded.
fn folded(k: usize, small: usize, large: usize) -> usize {
    if small == large {
        k
    } else if 2 * k < large {
        k % small
    } else {
        (small - (large - k) % small) % small
    }
}

/// The bins of an axis of `large` samples that are folded onto one of `small` bins.
fn unfolded(k: usize, small: usize, large: usize) -> impl Iterator<Item = usize> {
    let whole = small == large;
    let (below, above) = (large.div_ceil(2), large - large.div_ceil(2));
    let positive = (k..if whole { k + 1 } else { below }).step_by(small);
    let back = if k == 0 { small } else { small - k };
    let negative = (back..if whole { 0 } else { above + 1 })
        .step_by(small)
        .map(move |back| large - back);
    positive.chain(negative)
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
    use crate::cuts::{Cuts, face_diagonals, space_diagonals};
    use crate::plan::white_noise;
    use crate::targets::BandTargets;

    /// Without targets the field is reconstructed from its oblique bands, at odd and unequal sides: the squares of the
    /// filters sum to one and the reduced grids lose nothing.
    #[test]
    fn oblique_bands_reconstruct_the_field() {
        for (size, levels, orientations) in [
            ([16, 16, 16], 2, 4),
            ([19, 24, 33], 2, 4),
            ([48, 40, 64], 3, 3),
            ([33, 65, 47], 3, 9),
        ] {
            let samples: usize = size.iter().product();
            let noise = white_noise(samples, size[2], 1, 0);
            for normal in face_diagonals().into_iter().chain(space_diagonals()) {
                let mut field = noise.clone();
                let nothing = BandTargets {
                    targets: Vec::new(),
                    of_band: vec![None; 2 + levels * orientations],
                };
                Oblique::new(size, levels, orientations).match_cuts(&mut field, &normal, &nothing, Matching::Exact);
                let worst = field.iter().zip(&noise).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 4e-5, "{size:?}, {normal:?}: {worst}");
            }
        }
    }

    /// The band variances of cuts of isotropic noise that was smoothed along one axis are restored.
    #[test]
    fn band_variances_of_cuts_are_corrected() {
        let (n, levels) = (24, 2);
        let smoothed = |field: &[f32], stride: usize| -> Vec<f32> {
            let next = |i: usize| i / (stride * n) * stride * n + (i + stride) % (stride * n);
            (0..field.len()).map(|i| 0.5 * (field[i] + field[next(i)])).collect()
        };
        let mut model = white_noise(n * n * n, n, 1, 0);
        for stride in [1, n, n * n] {
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
        Cuts::new([n; 3], levels).reweight(&mut field, &wanted, &mut None);
        let after = error(&field);
        assert!(after < 0.25 * before, "{before} {after}");
    }
}
