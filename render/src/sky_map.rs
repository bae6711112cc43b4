//! The studio lighting as an environment map, for other renderers.

use crate::camera::Camera;
use crate::light::{Studio, single};
use crate::render::{RenderError, check_camera};
use image::{Rgb, Rgb32FImage};
use std::f64::consts::{PI, TAU};

/// Samples per pixel along each axis, because the rim of the key light is sharp.
const SAMPLES: u32 = 8;

/// The light around an object seen by `camera`, without the ground plane, as an equirectangular map of linear radiance.
///
/// A column at fraction u of the width has azimuth 360° u, counted as for the position of the camera; a row at fraction
/// v of the height has elevation 90° − 180° v. A face that points up receives ∫ L cos θ dω / π = 1, as in Blender,
/// Mitsuba and pbrt, which then show what [`render_mesh`](crate::render_mesh) shows with `ground` false and `gloss` 0.
/// Cost: 64 samples per pixel.
///
/// # Errors
///
/// [`RenderError::Options`] if the camera is invalid, or the map is empty or has more than 2²⁴ pixels.
///
/// # Examples
///
/// ```
/// use stereology_render::{Camera, sky_map};
/// let map = sky_map(&Camera::default(), 64, 32)?;
/// assert_eq!(map.get_pixel(5, 31).0, [0.36; 3]); // light reflected by the ground
/// let brightest = map.pixels().map(|p| p.0[0]).fold(0.0, f32::max);
/// assert!(brightest > 10.0); // the key light
/// # Ok::<(), stereology_render::RenderError>(())
/// ```
pub fn sky_map(camera: &Camera, width: u32, height: u32) -> Result<Rgb32FImage, RenderError> {
    check_camera(camera)?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > 1 << 24 {
        return Err(RenderError::Options {
            what: "an environment map has 1 to 2^24 pixels",
        });
    }
    let (out, [front, side]) = camera.out();
    let studio = Studio::new(camera.up, &-out);
    let radiance = |column: f64, row: f64| {
        let (azimuth, height) = (TAU * column / f64::from(width), (PI * row / f64::from(height)).cos());
        let level = azimuth.cos() * front + azimuth.sin() * side;
        let direction = (1.0 - height * height).max(0.0).sqrt() * level + height * camera.up.into_inner();
        let key = if studio.is_in_key(&direction) {
            studio.key_radiance()
        } else {
            0.0
        };
        studio.sky(&direction) + key
    };
    Ok(Rgb32FImage::from_fn(width, height, |x, y| {
        let samples = (0..SAMPLES * SAMPLES).map(|i| {
            let [within_x, within_y] = [i % SAMPLES, i / SAMPLES].map(|n| (f64::from(n) + 0.5) / f64::from(SAMPLES));
            radiance(f64::from(x) + within_x, f64::from(y) + within_y)
        });
        Rgb([single(samples.sum::<f64>() / f64::from(SAMPLES * SAMPLES)); 3])
    }))
}
