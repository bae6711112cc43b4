//! The studio's light as a picture of the sky, for other renderers.

use crate::camera::Camera;
use crate::light::Studio;
use crate::mesh_picture::{RenderError, check_camera};
use image::{Rgb, Rgb32FImage};
use std::f64::consts::{PI, TAU};

/// Places each way in a pixel: the key light's rim is sharp.
const SAMPLES: u32 = 8;

/// The light of a picture taken with `camera`, without its ground, as an equirectangular map of linear radiance.
///
/// The column at share u of the width looks to azimuth 360° u as the camera counts it (of where it stands), the row at share v of the height to 90° − 180° v above the horizon. A face that looks up gets 1, which is ∫ L cos θ dω / π, as
/// in Blender, Mitsuba, pbrt. Those then show what [`render_mesh`](crate::render_mesh) shows with `ground` false and `gloss` 0. Cost: 64 looks a pixel.
///
/// # Errors
///
/// [`RenderError::Options`] if the camera cannot be, or the map is empty or has more than 2²⁴ pixels.
///
/// # Examples
///
/// ```
/// use stereology_render::{Camera, sky_map};
/// let map = sky_map(&Camera::default(), 64, 32)?;
/// assert_eq!(map.get_pixel(5, 31).0, [0.36; 3]); // what the ground throws back
/// let brightest = map.pixels().map(|p| p.0[0]).fold(0.0, f32::max);
/// assert!(brightest > 10.0); // the key light
/// # Ok::<(), stereology_render::RenderError>(())
/// ```
#[allow(clippy::cast_possible_truncation, reason = "light is f32 where it is seen")]
pub fn sky_map(camera: &Camera, width: u32, height: u32) -> Result<Rgb32FImage, RenderError> {
    check_camera(camera)?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > 1 << 24 {
        return Err(RenderError::Options {
            what: "a map of the sky has 1 to 2^24 pixels",
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
        let places = (0..SAMPLES * SAMPLES).map(|i| {
            let [within_x, within_y] = [i % SAMPLES, i / SAMPLES].map(|n| (f64::from(n) + 0.5) / f64::from(SAMPLES));
            radiance(f64::from(x) + within_x, f64::from(y) + within_y)
        });
        Rgb([(places.sum::<f64>() / f64::from(SAMPLES * SAMPLES)) as f32; 3])
    }))
}
