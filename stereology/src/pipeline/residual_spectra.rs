//! Is the fine detail of the solid as coarse or fine as the photograph's? Their power spectra.

#![allow(clippy::cast_possible_truncation, reason = "pictures are at most 512 pixels wide")]

use image::RgbImage;
use ndarray::{Array2, ArrayView3};
use stereology_spectrum::{SpectrumError, periodic_component, radial_spectrum};
use stereology_volume::{Axis, SlicePlane, Solid, SolidError};

/// Power spectra of the residual, over all directions in the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualSpectra {
    /// Cycles per pixel, up to one half.
    pub frequency: Vec<f64>,
    /// Power in the photograph's residual.
    pub photo: Vec<f64>,
    /// Power in sections of the solid less their mean colours, mean over the three axes.
    pub sections: Vec<f64>,
}

/// Spectra that cannot be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpectraError {
    /// A field too small.
    #[error(transparent)]
    Spectrum(#[from] SpectrumError),
    /// A section that cannot be drawn.
    #[error(transparent)]
    Solid(#[from] SolidError),
}

const RADIAL_BINS: usize = 32;
/// The weights of red, green and blue in luminance.
const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];
/// Sections are at most so many pixels wide.
const MOST_PIXELS: f64 = 512.0;

/// Radial power spectra of the photograph's residual (y, x, channel) and of that of three sections of the solid.
///
/// # Errors
///
/// [`SpectraError`] for pictures too small to have a spectrum.
pub fn residual_spectra(
    residual: ArrayView3<'_, f32>,
    solid: &Solid,
    pixel: f64,
) -> Result<ResidualSpectra, SpectraError> {
    let (height, width, _) = residual.dim();
    let photo = Array2::from_shape_fn((height, width), |(y, x)| {
        (0..3)
            .map(|channel| LUMINANCE[channel] * f64::from(residual[[y, x, channel]]))
            .sum::<f64>()
    });
    let photo = radial_spectrum(periodic_component(photo.view())?.view(), RADIAL_BINS)?;
    let plain = solid.without_residual().with_border_samples(1);
    let detailed = solid.clone().with_border_samples(1);
    let mut sections = vec![0.0; RADIAL_BINS];
    for axis in [Axis::X, Axis::Y, Axis::Z] {
        let side = solid.period().sides()[axis.index()];
        let pixels = (solid.period().sides().min() / pixel).round().clamp(16.0, MOST_PIXELS) as u32;
        let plane = SlicePlane::across(axis, 0.3 * side);
        let drawn = difference(
            &detailed.slice(&plane, pixels, pixels, pixel)?,
            &plain.slice(&plane, pixels, pixels, pixel)?,
        );
        let spectrum = radial_spectrum(periodic_component(drawn.view())?.view(), RADIAL_BINS)?;
        for (sum, power) in sections.iter_mut().zip(&spectrum.power) {
            *sum += power / 3.0;
        }
    }
    // Beyond Nyquist there are only the corners of the square of frequencies.
    let upto = |values: Vec<f64>| values.into_iter().take(RADIAL_BINS).collect();
    Ok(ResidualSpectra {
        frequency: upto(photo.frequency),
        photo: upto(photo.power),
        sections,
    })
}

/// Luminance of `a` less that of `b`, encoded values / 255.
fn difference(a: &RgbImage, b: &RgbImage) -> Array2<f64> {
    Array2::from_shape_fn((a.height() as usize, a.width() as usize), |(y, x)| {
        let (p, q) = (a.get_pixel(x as u32, y as u32).0, b.get_pixel(x as u32, y as u32).0);
        (0..3)
            .map(|channel| LUMINANCE[channel] * (f64::from(p[channel]) - f64::from(q[channel])) / 255.0)
            .sum()
    })
}
