//! Power spectra of the fine detail: whether that of the solid is as coarse as that of the photograph.

use crate::pipeline::narrowing::pixels_between;
use image::RgbImage;
use ndarray::Array2;
use stereology_segment::Segmentation;
use stereology_spectrum::{RadialSpectrum, SpectrumError, periodic_component, radial_spectrum};
use stereology_volume::{Axis, SlicePlane, Solid, SolidError};

/// Radial power spectra of the residual.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualSpectra {
    /// Cycles per pixel, up to one half.
    pub frequency: Vec<f64>,
    /// Power in the photograph's residual.
    pub photo: Vec<f64>,
    /// Power in sections of the solid less their mean colours, mean over the three axes.
    pub sections: Vec<f64>,
}

impl ResidualSpectra {
    /// Root mean square of log10 of the ratio of the powers, each frequency weighted by its part of the photograph's
    /// variance: 0.3 is a factor of two.
    #[must_use]
    pub fn log_error(&self) -> f64 {
        let mut sums = [0.0; 2];
        for (frequency, photo, ratio) in self.ratios() {
            // The number of frequencies on a ring is proportional to its radius.
            let weight = frequency * photo;
            sums[0] += weight * ratio.log10().powi(2);
            sums[1] += weight;
        }
        (sums[0] / sums[1]).sqrt()
    }

    /// The frequency at which the powers differ most, and the power in sections over that in the photograph there.
    #[must_use]
    pub fn worst(&self) -> Option<(f64, f64)> {
        let by_distance = |ratio: &f64| ratio.log10().abs();
        self.ratios()
            .map(|(frequency, _, ratio)| (frequency, ratio))
            .max_by(|a, b| by_distance(&a.1).total_cmp(&by_distance(&b.1)))
    }

    /// Frequency, power in the photograph, and power in sections over it, where both are positive.
    fn ratios(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let powers = self.photo.iter().zip(&self.sections);
        self.frequency
            .iter()
            .zip(powers)
            .filter(|(_, (photo, sections))| **photo > 0.0 && **sections > 0.0)
            .map(|(&frequency, (&photo, &sections))| (frequency, photo, sections / photo))
    }
}

/// Why there are no spectra.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpectraError {
    /// A field that is too small.
    #[error(transparent)]
    Spectrum(#[from] SpectrumError),
    /// A section that cannot be drawn.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// Particles and gaps are too narrow to show a texture.
    #[error("only {:.1} % of an image lie away from the outlines of profiles: too little for a spectrum", 100.0 * .share)]
    AllOutline {
        /// Fraction of the image away from outlines.
        share: f64,
    },
}

const RADIAL_BINS: usize = 32;
/// The weights of red, green and blue in luminance.
const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];
/// Largest width of a section in pixels.
const MOST_PIXELS: f64 = 512.0;

/// Pixels nearer than this to an outline are left out: blurred outlines of a photograph are not texture.
const OUTLINE: usize = 3;
/// Smallest fraction of an image that gives a spectrum.
const LEAST_SHARE: f64 = 0.02;

/// Radial power spectra of the residual of the photograph and of three sections of the solid, both away from the
/// outlines of profiles.
///
/// Pixels near outlines are set to zero, and the power is divided by the fraction of the others, in photograph and
/// sections alike.
///
/// # Errors
///
/// [`SpectraError`]: images that are too small, or with outlines nearly everywhere.
///
/// # Examples
///
/// A plain sphere in a binder with a fine ripple. The photograph is itself a section, so both spectra have the same
/// peak.
///
/// ```
/// use stereology::pipeline::residual_spectra;
/// use stereology::segment::{SegmentOptions, Segmentation};
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology::pipeline::ParticleTypes;
/// use stereology::shape::{Arrangement, Particle, PeriodicBox};
/// use stereology::volume::{Axis, Residual, SlicePlane, Solid};
///
/// // A sphere of diameter 40 in a box of side 64.
/// let spheres = ParticleTypes::parse(&["sphere"])?;
/// let particle = Particle { shape: 0, size: 40.0, category: 0, position: Point3::new(32.0, 32.0, 32.0), orientation: UnitQuaternion::identity() };
/// let period = PeriodicBox::new(Vector3::repeat(64.0))?;
/// let ripple = ndarray::Array4::from_shape_fn((64, 64, 64, 3), |(z, y, x, _)| 0.05 * (0.8 * (x + y + z) as f32).sin());
/// let residual = Residual { particles: 0.0 * &ripple, binder: ripple, voxel: 1.0 };
/// let solid = Solid::new(Arrangement::new(spheres.unit_bodies(), vec![particle], period)?, vec![[0.7, 0.3, 0.2]], [0.8; 3], Some(residual))?;
/// let middle = SlicePlane::across(Axis::Z, 32.0);
/// let photo = Segmentation::from_labels(&solid.slice(&middle, 64, 64, 1.0)?, solid.slice_ids(&middle, 64, 64, 1.0)?, &SegmentOptions::default())?;
/// let spectra = residual_spectra(&photo, &solid, 1.0)?;
/// let peak = |power: &[f64]| (0..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]));
/// assert_eq!(peak(&spectra.photo), peak(&spectra.sections));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn residual_spectra(
    segmentation: &Segmentation,
    solid: &Solid,
    pixel: f64,
) -> Result<ResidualSpectra, SpectraError> {
    let residual = segmentation.residual();
    let photo = Array2::from_shape_fn(segmentation.labels.dim(), |(y, x)| {
        (0..3)
            .map(|channel| LUMINANCE[channel] * f64::from(residual[[y, x, channel]]))
            .sum::<f64>()
    });
    let photo = inner_spectrum(photo, &segmentation.labels)?;
    let plain = solid.without_residual().with_border_samples(1)?;
    let detailed = solid.clone().with_border_samples(1)?;
    let mut sections = vec![0.0; RADIAL_BINS];
    for axis in [Axis::X, Axis::Y, Axis::Z] {
        let side = solid.period().sides()[axis.index()];
        let pixels = pixels_between(solid.period().sides().min() / pixel, 16.0, MOST_PIXELS);
        let plane = SlicePlane::across(axis, 0.3 * side);
        let drawn = difference(
            &detailed.slice(&plane, pixels, pixels, pixel)?,
            &plain.slice(&plane, pixels, pixels, pixel)?,
        );
        let spectrum = inner_spectrum(drawn, &solid.slice_ids(&plane, pixels, pixels, pixel)?)?;
        for (sum, power) in sections.iter_mut().zip(&spectrum.power) {
            *sum += power / 3.0;
        }
    }
    // Beyond the Nyquist frequency only the corners of the square of frequencies remain.
    let upto = |values: Vec<f64>| values.into_iter().take(RADIAL_BINS).collect();
    Ok(ResidualSpectra {
        frequency: upto(photo.frequency),
        photo: upto(photo.power),
        sections,
    })
}

/// Spectrum of a field away from the outlines of `labels`.
fn inner_spectrum(mut field: Array2<f64>, labels: &Array2<u32>) -> Result<RadialSpectrum, SpectraError> {
    let inner = far_from_outlines(labels);
    let kept = inner.iter().filter(|inner| **inner).count();
    let share = kept as f64 / inner.len().max(1) as f64;
    if share < LEAST_SHARE {
        return Err(SpectraError::AllOutline { share });
    }
    let sum: f64 = field
        .iter()
        .zip(&inner)
        .filter(|(_, inner)| **inner)
        .map(|(value, _)| value)
        .sum();
    let mean = sum / kept as f64;
    field.zip_mut_with(&inner, |value, &inner| *value = if inner { *value - mean } else { 0.0 });
    let mut spectrum = radial_spectrum(periodic_component(field.view())?.view(), RADIAL_BINS)?;
    spectrum.power.iter_mut().for_each(|power| *power /= share);
    Ok(spectrum)
}

/// Pixels whose neighbours up to [`OUTLINE`] rows and columns away all have the same label.
fn far_from_outlines(labels: &Array2<u32>) -> Array2<bool> {
    // Along rows, then along columns: together a square.
    let like_neighbours = |inner: &Array2<bool>, along: Axis2| {
        Array2::from_shape_fn(labels.dim(), |(y, x)| {
            let (place, length) = match along {
                Axis2::Rows => (y, labels.nrows()),
                Axis2::Columns => (x, labels.ncols()),
            };
            (place.saturating_sub(OUTLINE)..(place + OUTLINE + 1).min(length)).all(|other| {
                let there = match along {
                    Axis2::Rows => [other, x],
                    Axis2::Columns => [y, other],
                };
                inner[there] && labels[there] == labels[[y, x]]
            })
        })
    };
    let all = Array2::from_elem(labels.dim(), true);
    like_neighbours(&like_neighbours(&all, Axis2::Columns), Axis2::Rows)
}

#[derive(Clone, Copy)]
enum Axis2 {
    Rows,
    Columns,
}

/// Luminance of `a` less that of `b`, encoded values / 255.
fn difference(a: &RgbImage, b: &RgbImage) -> Array2<f64> {
    let (height, width) = (a.height() as usize, a.width() as usize);
    let of = |p: &image::Rgb<u8>, q: &image::Rgb<u8>| -> f64 {
        (0..3)
            .map(|channel| LUMINANCE[channel] * (f64::from(p.0[channel]) - f64::from(q.0[channel])) / 255.0)
            .sum()
    };
    let values: Vec<f64> = a.pixels().zip(b.pixels()).map(|(p, q)| of(p, q)).collect();
    Array2::from_shape_fn((height, width), |(y, x)| values[y * width + x])
}

#[cfg(test)]
mod tests {
    use super::{OUTLINE, far_from_outlines};
    use ndarray::Array2;

    #[test]
    fn outlines_are_left_out_on_both_sides() {
        let labels = Array2::from_shape_fn((30, 40), |(y, x)| u32::from(y >= 10 && x >= 20));
        let inner = far_from_outlines(&labels);
        for ((y, x), &inner) in inner.indexed_iter() {
            let near = |place: usize, edge: usize| place + OUTLINE >= edge && place < edge + OUTLINE;
            // Near the edge of the marked quarter, which continues along the lines y = 10 (x >= 20) and x = 20 (y >=
            // 10).
            let touched = (near(y, 10) && x + OUTLINE >= 20) || (near(x, 20) && y + OUTLINE >= 10);
            assert_eq!(inner, !touched, "{y} {x}");
        }
    }
}
