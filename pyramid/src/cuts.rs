//! The bands of cuts of a periodic volume by planes of any direction, exactly and without interpolation.
//!
//! On a plane with unit normal n, a wave k of the volume appears with the tangential frequency κ = k − (k · n) n.
//! Filtering every plane of that normal in 2D is therefore a 3D filter that depends on κ only, and the mean square of a
//! band over all these planes follows from the power of the volume:
//!
//! ```text
//! band(p) on the planes normal to n = FT⁻¹[ G(|κ|) A_b(angle of κ) v̂ ](p)        mean square = Σ_k |v̂(k)|² G²(|κ|) A_b²
//! ```

use nalgebra::{Unit, Vector3};
use ndarray::{Array3, ArrayView3};
use rayon::prelude::*;
use stereology_spectrum::{Complex, RealFft, frequency};

use crate::PyramidError;
use crate::bank::most_levels;
use crate::filters::{Directions, band_response};
use crate::matching::whole_and_part;
use crate::wave_change::Change;

/// Number of steps of the tables of responses, up to the corner of the cube of frequencies.
pub(crate) const STEPS: usize = 1 << 12;
/// Number of blocks in which planes of frequencies are summed.
const BLOCKS: usize = 16;

/// Mean squares of the pyramid bands of all cuts of a periodic volume (z, y, x) by planes of each normal (x, y, z).
///
/// For every normal: the high-pass, each level with its orientations summed, and the low-pass (including the mean of
/// the volume). `O(N log N)`, plus `O(N)` per normal. Shows whether a texture looks the same on cuts of all directions.
///
/// # Errors
///
/// [`PyramidError::VolumeLevels`] for a side under 8 samples or levels that do not fit,
/// [`PyramidError::VolumeNotFinite`].
///
/// # Examples
///
/// A wave along x appears on planes normal to y, and is constant on planes normal to x:
///
/// ```
/// use nalgebra::Vector3;
/// use ndarray::Array3;
/// use stereology_pyramid::cut_variances;
///
/// let wave = Array3::from_shape_fn((16, 16, 16), |(_, _, x)| (x as f32 * std::f32::consts::TAU / 4.0).cos());
/// let bands = cut_variances(wave.view(), &[Vector3::y_axis(), Vector3::x_axis()], 1)?;
/// assert!((bands[0][1] - 0.5).abs() < 1e-5, "all power is at the finest level");
/// assert!((bands[1][2] - 0.5).abs() < 1e-5, "all power is in the low-pass");
/// # Ok::<(), stereology_pyramid::PyramidError>(())
/// ```
pub fn cut_variances(
    volume: ArrayView3<'_, f32>,
    normals: &[Unit<Vector3<f64>>],
    levels: usize,
) -> Result<Vec<Vec<f64>>, PyramidError> {
    let size = checked(volume, levels)?;
    let values: Vec<f32> = volume.iter().copied().collect();
    Ok(Cuts::new(size, levels).variances(&values, normals))
}

/// One band of all cuts of a periodic volume (z, y, x) by planes of a normal (x, y, z), at every sample of the volume:
/// the value of the band of the plane through that sample. `level` counts from 0; orientation `b` of `orientations` has
/// the angle `π b / K` in the plane.
///
/// `O(N log N)`.
///
/// # Errors
///
/// [`PyramidError::VolumeLevels`] if the volume has no such level, [`PyramidError::Orientations`] if there is no such
/// orientation, [`PyramidError::VolumeNotFinite`].
///
/// # Examples
///
/// ```
/// use nalgebra::{Unit, Vector3};
/// use ndarray::Array3;
/// use stereology_pyramid::{cut_band, cut_variances};
///
/// let volume = Array3::from_shape_fn((16, 16, 16), |(z, y, x)| ((7 * z + 5 * y * y + x * x) % 11) as f32);
/// let diagonal = Unit::new_normalize(Vector3::new(1.0, 1.0, 0.0));
/// let mut power = 0.0;
/// for b in 0..4 {
///     let band = cut_band(volume.view(), &diagonal, 0, b, 4)?;
///     power += band.mapv(|v| f64::from(v).powi(2)).mean().unwrap();
/// }
/// let known = cut_variances(volume.view(), &[diagonal], 1)?[0][1];
/// assert!((power / known - 1.0).abs() < 1e-4);
/// # Ok::<(), stereology_pyramid::PyramidError>(())
/// ```
#[allow(clippy::missing_panics_doc, reason = "a band has a value for every sample")]
pub fn cut_band(
    volume: ArrayView3<'_, f32>,
    normal: &Unit<Vector3<f64>>,
    level: usize,
    orientation: usize,
    orientations: usize,
) -> Result<Array3<f32>, PyramidError> {
    let size = checked(volume, level + 1)?;
    if orientation >= orientations || orientations > 32 {
        return Err(PyramidError::Orientations {
            requested: orientations,
        });
    }
    let directions = Directions::plane(orientations);
    let mut cuts = Cuts::new(size, level + 1);
    let values: Vec<f32> = volume.iter().copied().collect();
    cuts.transform(&values);
    let [first, second] = Frame::of(normal).along;
    let table = responses(level + 1, level + 1, f64::sqrt);
    let scale = 1.0 / values.len() as f64;
    let (half, quadrature) = (size[2] / 2 + 1, directions.quadrature());
    cuts.spectrum.par_chunks_mut(half).enumerate().for_each(|(row, bins)| {
        for (x, bin) in bins.iter_mut().enumerate() {
            let k = wave(size, row, x);
            let tangential = k - normal.as_ref() * k.dot(normal);
            let angle = [0.0, tangential.dot(&second), tangential.dot(&first)];
            let response = at(&table, radius(size, row, x, &k, normal));
            #[allow(clippy::cast_possible_truncation, reason = "computed in f64, kept in f32")]
            let factor = (scale * response * directions.amplitude(orientation, &angle)) as f32;
            *bin = if quadrature {
                Complex::new(-bin.im * factor, bin.re * factor)
            } else {
                *bin * factor
            };
        }
    });
    let mut band = vec![0.0; values.len()];
    cuts.fft.inverse_into(&mut cuts.spectrum, &mut band, &mut cuts.work);
    Ok(Array3::from_shape_vec(size, band).expect("a value for every sample"))
}

fn checked(volume: ArrayView3<'_, f32>, levels: usize) -> Result<[usize; 3], PyramidError> {
    let (nz, ny, nx) = volume.dim();
    let most = most_levels(&[nz, ny, nx], &[]);
    if levels == 0 || levels > most {
        return Err(PyramidError::VolumeLevels {
            shape: [nz, ny, nx],
            requested: levels,
            most,
        });
    }
    if let Some((at, _)) = volume.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(PyramidError::VolumeNotFinite { at: [at.0, at.1, at.2] });
    }
    Ok([nz, ny, nx])
}

/// The planes of a normal, with two orthogonal directions in them, (x, y, z).
pub(crate) struct Frame {
    pub(crate) normal: Vector3<f64>,
    pub(crate) along: [Vector3<f64>; 2],
}

impl Frame {
    pub(crate) fn of(normal: &Unit<Vector3<f64>>) -> Self {
        let some = if normal.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let first = normal.cross(&some).normalize();
        Self {
            normal: normal.into_inner(),
            along: [first, normal.cross(&first)],
        }
    }
}

fn normals(of: &[[f64; 3]]) -> Vec<Unit<Vector3<f64>>> {
    of.iter().map(|v| Unit::new_normalize(Vector3::from(*v))).collect()
}

/// Normals along the face diagonals of the cube.
pub(crate) fn face_diagonals() -> Vec<Unit<Vector3<f64>>> {
    normals(&[
        [1.0, 1.0, 0.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [1.0, -1.0, 0.0],
        [1.0, 0.0, -1.0],
        [0.0, 1.0, -1.0],
    ])
}

/// Normals along the space diagonals.
pub(crate) fn space_diagonals() -> Vec<Unit<Vector3<f64>>> {
    normals(&[[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]])
}

/// Axes (x, y, z), face diagonals and space diagonals.
pub(crate) fn thirteen_normals() -> Vec<Unit<Vector3<f64>>> {
    let mut all = vec![Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    all.extend(face_diagonals());
    all.extend(space_diagonals());
    all
}

/// Power between two steps of a table, and its part that belongs to the upper step.
type Parts = Vec<[f64; 2]>;

/// The transform of volumes of one size, and the squared responses of the bands.
pub(crate) struct Cuts {
    pub(crate) fft: RealFft<f32>,
    size: [usize; 3],
    pub(crate) tables: Vec<Vec<f64>>,
    pub(crate) spectrum: Vec<Complex<f32>>,
    pub(crate) work: stereology_spectrum::Work<f32>,
}

impl Cuts {
    pub(crate) fn new(size: [usize; 3], levels: usize) -> Self {
        let fft = RealFft::<f32>::new(&size).expect("three sides of at least one sample");
        Self {
            tables: (0..levels + 2).map(|band| responses(band, levels, |v| v)).collect(),
            spectrum: vec![Complex::new(0.0, 0.0); fft.spectrum_shape().iter().product()],
            work: fft.work(),
            fft,
            size,
        }
    }

    pub(crate) fn transform(&mut self, field: &[f32]) {
        self.fft.forward_into(field, &mut self.spectrum, &mut self.work);
    }

    /// For each normal: high-pass, levels, low-pass.
    pub(crate) fn variances(&mut self, field: &[f32], normals: &[Unit<Vector3<f64>>]) -> Vec<Vec<f64>> {
        self.transform(field);
        let power = self.power_by_radius(normals, None).0;
        self.band_powers(&power, (field.len() as f64).powi(-2))
    }

    /// Power of the transform by the radius of the tangential frequency, for every normal. If waves are `changed`, also
    /// the products for the Hessian, after the change.
    pub(crate) fn power_by_radius(
        &mut self,
        normals: &[Unit<Vector3<f64>>],
        changed: Option<&Change<'_>>,
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (size, half) = (self.size, self.size[2] / 2 + 1);
        let rows = (size[0] * size[1]).div_ceil(BLOCKS);
        // One sum per block, added in order: the same bits at any number of threads.
        let blocks: Vec<(Vec<Parts>, Vec<f64>)> = self
            .spectrum
            .par_chunks_mut(rows * half)
            .enumerate()
            .map(|(block, bins)| {
                let mut sums = vec![vec![[0.0; 2]; STEPS + 1]; normals.len()];
                let mut products = Vec::new();
                let mut positions = vec![vec![0.0_f32; half]; normals.len()];
                let mut power = vec![0.0_f64; half];
                for (i, bins) in bins.chunks_exact_mut(half).enumerate() {
                    let row = block * rows + i;
                    for (positions, normal) in positions.iter_mut().zip(normals) {
                        positions_of_row(size, row, normal, positions);
                    }
                    if let Some(change) = changed {
                        change.apply(bins, &positions);
                    }
                    for (x, (power, bin)) in power.iter_mut().zip(bins.iter()).enumerate() {
                        let twice = if x == 0 || 2 * x == size[2] { 1.0 } else { 2.0 };
                        *power = twice * f64::from(bin.norm_sqr());
                    }
                    for (sums, positions) in sums.iter_mut().zip(&positions) {
                        for (&position, &power) in positions.iter().zip(&power) {
                            let (below, share) = whole_and_part(position);
                            let sum = &mut sums[below as usize];
                            sum[0] += power;
                            sum[1] += f64::from(share) * power;
                        }
                    }
                    if let Some(change) = changed {
                        change.add_products(size, row, &positions, &power, &mut products);
                    }
                }
                (sums, products)
            })
            .collect();
        let power = (0..normals.len())
            .map(|n| {
                let mut power = vec![0.0; STEPS + 2];
                for (sums, _) in &blocks {
                    for (i, [all, above]) in sums[n].iter().enumerate() {
                        power[i] += all - above;
                        power[i + 1] += above;
                    }
                }
                power
            })
            .collect();
        let mut products = Vec::new();
        for (_, of_block) in &blocks {
            products.resize(of_block.len(), 0.0);
            products.iter_mut().zip(of_block).for_each(|(sum, v)| *sum += v);
        }
        (power, products)
    }

    pub(crate) fn band_powers(&self, power: &[Vec<f64>], scale: f64) -> Vec<Vec<f64>> {
        let dot = |power: &[f64], table: &[f64]| scale * power.iter().zip(table).map(|(p, t)| p * t).sum::<f64>();
        power
            .iter()
            .map(|power| self.tables.iter().map(|table| dot(power, table)).collect())
            .collect()
    }
}

/// Frequency (x, y, z) of a bin, cycles per sample.
fn wave(size: [usize; 3], row: usize, x: usize) -> Vector3<f64> {
    Vector3::new(
        x as f64 / size[2] as f64,
        frequency(row % size[1], size[1]),
        frequency(row / size[1], size[0]),
    )
}

/// Radius of the tangential frequency of a bin, Nyquist 1.
///
/// A bin at the Nyquist frequency of an axis represents both signs. Unless the normal lies along that axis, the two
/// differ on the plane, and the bin belongs to the high-pass.
fn radius(size: [usize; 3], row: usize, x: usize, k: &Vector3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
    let radius = 2.0 * (k.norm_squared() - k.dot(normal).powi(2)).max(0.0).sqrt();
    let bins = [(x, size[2]), (row % size[1], size[1]), (row / size[1], size[0])];
    let along = [normal.x, normal.y, normal.z];
    let ambiguous = bins
        .iter()
        .zip(along)
        .any(|(&(i, n), a)| 2 * i == n && a.abs() < 1.0 - 1e-12);
    if ambiguous { radius.max(1.0) } else { radius }
}

/// Positions in the tables for the radii of the tangential frequencies of a row of bins: see [`radius`].
#[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
fn positions_of_row(size: [usize; 3], row: usize, normal: &Unit<Vector3<f64>>, positions: &mut [f32]) {
    let start = wave(size, row, 0);
    // |κ|² = a + b x + c x² along the row.
    let step = 1.0 / size[2] as f64;
    let a = (start.norm_squared() - start.dot(normal).powi(2)) as f32;
    let b = (-2.0 * start.dot(normal) * normal.x * step) as f32;
    let c = ((1.0 - normal.x.powi(2)) * step * step) as f32;
    for (x, position) in positions.iter_mut().enumerate() {
        let x = x as f32;
        *position = (a + x * (b + x * c)).max(0.0).sqrt() * STEPS as f32;
    }
    let oblique = |along: f64| along.abs() < 1.0 - 1e-12;
    let (y, z) = (row % size[1], row / size[1]);
    let nyquist = 0.5 * STEPS as f32;
    if (2 * y == size[1] && oblique(normal.y)) || (2 * z == size[0] && oblique(normal.z)) {
        positions.iter_mut().for_each(|i| *i = i.max(nyquist));
    } else if size[2].is_multiple_of(2)
        && oblique(normal.x)
        && let Some(last) = positions.last_mut()
    {
        *last = last.max(nyquist);
    }
}

/// A function of the squared response of a band, tabulated over the radius.
fn responses(band: usize, levels: usize, of: fn(f64) -> f64) -> Vec<f64> {
    (0..STEPS + 2)
        .map(|i| of(band_response(2.0 * i as f64 / STEPS as f64, band, levels).powi(2)))
        .collect()
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "radii are at most √3 < 2"
)]
fn at(table: &[f64], radius: f64) -> f64 {
    let position = 0.5 * radius * STEPS as f64;
    let below = position as usize;
    table[below] + (position - below as f64) * (table[below + 1] - table[below])
}
