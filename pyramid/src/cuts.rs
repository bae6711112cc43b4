//! The bands of the cuts of a periodic volume by planes of any direction, exactly and without interpolation.
//!
//! A wave k of the volume shows on a plane of unit normal n as a wave of the tangential frequency κ = k − (k · n) n. A 2D
//! filter of every plane of that normal is therefore a 3D filter that depends on κ alone, and the mean square of a band
//! over all these planes follows from the volume's power:
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

/// Steps of the tables of responses, up to the corner of the cube.
const STEPS: usize = 1 << 12;
/// Planes of frequencies are summed in this many blocks.
const BLOCKS: usize = 16;
/// Sweeps of [`Cuts::bring_variances`].
const SWEEPS: usize = 4;
/// Strength of its steps: a step of 1 falls short, since all cuts share the same waves.
const STRENGTH: f64 = 1.5;
/// Weight of the cuts along the axes in it; the others have 1.
const WEIGHT_OF_AXES: f64 = 3.0;

/// Mean squares of the pyramid bands of all cuts of a periodic volume (z, y, x) by planes of each normal (x, y, z): for every
/// normal the high-pass, each level with its orientations added up, and the low-pass (the mean of the volume included).
///
/// `O(N log N)`, and `O(N)` for each normal. Whether a texture looks the same on cuts of all directions can be read off at once.
///
/// # Errors
///
/// [`PyramidError::VolumeLevels`] for a side under 8 samples or levels that do not fit, [`PyramidError::VolumeNotFinite`].
///
/// # Examples
///
/// A wave along x shows on planes normal to y, and is no more than a constant on those normal to x:
///
/// ```
/// use nalgebra::Vector3;
/// use ndarray::Array3;
/// use stereology_pyramid::cut_variances;
///
/// let wave = Array3::from_shape_fn((16, 16, 16), |(_, _, x)| (x as f32 * std::f32::consts::TAU / 4.0).cos());
/// let bands = cut_variances(wave.view(), &[Vector3::y_axis(), Vector3::x_axis()], 1)?;
/// assert!((bands[0][1] - 0.5).abs() < 1e-5, "all of it at the finest level");
/// assert!((bands[1][2] - 0.5).abs() < 1e-5, "all of it in the low-pass");
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

/// One band of all cuts of a periodic volume (z, y, x) by planes of a normal (x, y, z), at every sample of the volume: what
/// the band of the plane through that sample has there. `level` counts from 0; orientation `b` of `orientations` is at the
/// angle `π b / K` in the plane.
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
        return Err(PyramidError::Orientations { asked: orientations });
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
            asked: levels,
            most,
        });
    }
    if let Some((at, _)) = volume.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(PyramidError::VolumeNotFinite { at: [at.0, at.1, at.2] });
    }
    Ok([nz, ny, nx])
}

/// The planes of a normal: two directions at right angles in them, (x, y, z).
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

/// Normals along the diagonals of the cube's faces.
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

/// Axes, face diagonals and space diagonals, each with its weight; the weights add up to one.
fn weighted_normals() -> (Vec<Unit<Vector3<f64>>>, Vec<f64>) {
    let mut all = vec![Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    all.extend(face_diagonals());
    all.extend(normals(&[
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, -1.0],
    ]));
    let weight = |i: usize| if i < 3 { WEIGHT_OF_AXES } else { 1.0 };
    let sum: f64 = (0..all.len()).map(weight).sum();
    let weights = (0..all.len()).map(|i| weight(i) / sum).collect();
    (all, weights)
}

/// The transform of volumes of one size, and the squared responses of the bands.
pub(crate) struct Cuts {
    fft: RealFft<f32>,
    size: [usize; 3],
    tables: Vec<Vec<f64>>,
    spectrum: Vec<Complex<f32>>,
    work: stereology_spectrum::Work<f32>,
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

    fn transform(&mut self, field: &[f32]) {
        self.fft.forward_into(field, &mut self.spectrum, &mut self.work);
    }

    /// For each normal: high-pass, levels, low-pass.
    pub(crate) fn variances(&mut self, field: &[f32], normals: &[Unit<Vector3<f64>>]) -> Vec<Vec<f64>> {
        self.transform(field);
        let power = self.power_by_radius(normals, None);
        self.band_powers(&power, (field.len() as f64).powi(-2))
    }

    /// Changes the power of the field's waves as little as brings the band variances of the cuts along the axes, face
    /// diagonals and space diagonals near those wanted (high-pass, levels, low-pass; zero where none is), axes first.
    ///
    /// ```text
    /// P(k) ← P(k) Π_n Π_b (wanted_b / found_{n,b})^(s w_n G_b²(κ_n)),   Σ w_n = 1
    /// ```
    #[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
    pub(crate) fn bring_variances(&mut self, field: &mut [f32], wanted: &[f64]) {
        let (normals, weights) = weighted_normals();
        self.transform(field);
        let per_sample = 1.0 / field.len() as f32;
        self.spectrum.par_iter_mut().for_each(|v| *v *= per_sample);
        let mut power = self.power_by_radius(&normals, None);
        for _ in 0..SWEEPS {
            let found = self.band_powers(&power, 1.0);
            let tables: Vec<Vec<f64>> = found
                .iter()
                .zip(&weights)
                .map(|(found, weight)| {
                    let exponent = |(&found, &wanted): (&f64, &f64)| {
                        let ratio = if found > 0.0 && wanted > 0.0 {
                            wanted / found
                        } else {
                            1.0
                        };
                        0.5 * STRENGTH * weight * ratio.ln()
                    };
                    let exponents: Vec<f64> = found.iter().zip(wanted).map(exponent).collect();
                    let at = |i: usize| exponents.iter().zip(&self.tables).map(|(e, table)| e * table[i]).sum();
                    (0..STEPS + 2).map(at).collect()
                })
                .collect();
            power = self.power_by_radius(&normals, Some(&tables));
        }
        self.fft.inverse_into(&mut self.spectrum, field, &mut self.work);
    }

    /// Power by the radius of the tangential frequency, for every normal, shared out between neighbouring steps; each wave is
    /// first multiplied by the exponential of the sum of the normals' `factors` at its radii.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "radii are at most √3 < 2, factors are kept in f32"
    )]
    fn power_by_radius(&mut self, normals: &[Unit<Vector3<f64>>], factors: Option<&[Vec<f64>]>) -> Vec<Vec<f64>> {
        let (size, half) = (self.size, self.size[2] / 2 + 1);
        let planes = size[0].div_ceil(BLOCKS);
        // One sum a block, added in order: the same bits at any number of threads.
        let blocks: Vec<Vec<Vec<f64>>> = self
            .spectrum
            .par_chunks_mut(planes * half * size[1])
            .enumerate()
            .map(|(block, bins)| {
                let mut sums = vec![vec![0.0; STEPS + 2]; normals.len()];
                let mut positions = vec![(0_usize, 0.0); normals.len()];
                for (i, bin) in bins.iter_mut().enumerate() {
                    let (row, x) = (block * planes * size[1] + i / half, i % half);
                    let k = wave(size, row, x);
                    for (position, normal) in positions.iter_mut().zip(normals) {
                        let exact = 0.5 * radius(size, row, x, &k, normal) * STEPS as f64;
                        *position = (exact as usize, exact - exact.floor());
                    }
                    if let Some(tables) = factors {
                        let log: f64 = tables
                            .iter()
                            .zip(&positions)
                            .map(|(table, &(i, part))| table[i] + part * (table[i + 1] - table[i]))
                            .sum();
                        *bin *= log.exp() as f32;
                    }
                    let twice = if x == 0 || 2 * x == size[2] { 1.0 } else { 2.0 };
                    let power = twice * f64::from(bin.norm_sqr());
                    for (sums, &(i, part)) in sums.iter_mut().zip(&positions) {
                        sums[i] += (1.0 - part) * power;
                        sums[i + 1] += part * power;
                    }
                }
                sums
            })
            .collect();
        (0..normals.len())
            .map(|n| {
                (0..STEPS + 2)
                    .map(|i| blocks.iter().map(|block| block[n][i]).sum())
                    .collect()
            })
            .collect()
    }

    fn band_powers(&self, power: &[Vec<f64>], scale: f64) -> Vec<Vec<f64>> {
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

/// Radius of the tangential frequency of a bin, Nyquist 1. A bin at the Nyquist frequency of an axis stands for both signs;
/// unless the normal lies along that axis, the two differ on the plane: then it belongs to the high-pass.
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

/// A function of a band's squared response, tabulated over the radius.
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
