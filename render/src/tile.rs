//! A tile of the picture: places looked at, light gathered and averaged over near places of the same surface, pixels.

#![allow(
    clippy::cast_possible_truncation,
    reason = "light is f32 where it is seen; places are numbered within squares"
)]

use crate::camera::View;
use crate::light::{Studio, about, encoded_byte, linear};
use crate::scene::Scene;
use nalgebra::{Point3, UnitVector3, Vector3};

/// Light is averaged over squares of this many places each way.
const SQUARE: usize = 8;
/// Places before a place in its square; one less behind it.
const REACH: usize = SQUARE / 2;
/// Rays to the sky at each place.
const SKY_RAYS: u32 = 3;
/// Normals of places that are averaged together agree to this cosine.
const SAME_NORMAL: f64 = 0.95;
/// A ray of light starts this share of the scene's size above the surface.
const LIFT: f64 = 1e-6;

pub(crate) type Colour<'a> = &'a (dyn Fn(&Point3<f64>) -> [f32; 3] + Sync);

/// All that a picture is made of.
pub(crate) struct Picture<'a> {
    pub(crate) scene: Scene,
    pub(crate) view: View,
    pub(crate) studio: Studio,
    pub(crate) colour: Colour<'a>,
    /// Places each way in a pixel.
    pub(crate) samples: usize,
    /// Height of the ground along `up`, if there is one.
    pub(crate) ground: Option<f64>,
    pub(crate) up: UnitVector3<f64>,
    /// Largest extent of the object.
    pub(crate) extent: f64,
    pub(crate) middle: Point3<f64>,
    /// Linear light of the background and the ground.
    pub(crate) background: [f32; 3],
    pub(crate) gloss: f64,
}

/// What is seen at a place of the picture.
#[derive(Clone, Copy)]
struct Place {
    kind: Kind,
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// Linear.
    colour: [f32; 3],
    /// Key and sky together, grainy.
    light: f64,
    shine: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Background,
    Ground,
    Object,
}

impl Picture<'_> {
    /// Bytes of the pixels from `corner` on, row by row.
    pub(crate) fn tile(&self, corner: [usize; 2], size: [usize; 2]) -> Vec<[u8; 3]> {
        let [wide, high] = size.map(|n| n * self.samples + 2 * REACH);
        let from = corner.map(|n| (n * self.samples) as i64 - REACH as i64);
        let places: Vec<Place> = (0..wide * high)
            .map(|i| self.look([from[0] + (i % wide) as i64, from[1] + (i / wide) as i64]))
            .collect();
        let mut pixels = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let mut sum = [0.0; 3];
                for i in 0..self.samples * self.samples {
                    let x = REACH + column * self.samples + i % self.samples;
                    let y = REACH + row * self.samples + i / self.samples;
                    let seen = self.lit(&places, wide, [x, y]);
                    (0..3).for_each(|c| sum[c] += seen[c]);
                }
                let share = 1.0 / (self.samples * self.samples) as f32;
                pixels.push(sum.map(|light| encoded_byte(light * share)));
            }
        }
        pixels
    }

    /// What is seen at a place, and its light in a few directions that belong to this place alone.
    fn look(&self, place: [i64; 2]) -> Place {
        let [x, y] = place.map(|n| (n as f64 + 0.5) / self.samples as f64);
        let direction = self.view.direction(x, y).normalize();
        let eye = &self.view.eye;
        let ground = self.ground.and_then(|height| {
            let distance = (height - eye.coords.dot(&self.up)) / direction.dot(&self.up);
            (distance > 0.0).then_some(distance)
        });
        let hit = self.scene.first_hit(eye, &direction, ground.unwrap_or(f64::INFINITY));
        let mut seen = Place {
            kind: Kind::Background,
            point: *eye,
            normal: self.up.into_inner(),
            colour: self.background,
            light: 1.0,
            shine: 0.0,
        };
        if let Some(hit) = hit {
            let surface = self.scene.surface(&hit, &direction);
            seen.kind = Kind::Object;
            seen.point = surface.point;
            seen.normal = surface.normal;
            seen.colour = (self.colour)(&surface.point).map(linear);
            let start = surface.start + LIFT * self.extent * surface.normal;
            let sky = self.sky_light(&start, &surface.normal, place);
            seen.light = sky + self.key_light(&start, &surface.normal, place);
            if self.gloss > 0.0 {
                seen.shine = self.gloss * self.shine(&start, &surface.normal, &direction, place);
            }
        } else if let Some(distance) = ground {
            let point = eye + distance * direction;
            // Far from the object nothing hides the light; and the horizon must not show.
            if (point - self.middle).norm() < 4.0 * self.extent {
                let start = point + LIFT * self.extent * self.up.into_inner();
                seen.kind = Kind::Ground;
                seen.point = point;
                seen.light = self.sky_light(&start, &seen.normal, place) + self.key_light(&start, &seen.normal, place);
            }
        }
        seen
    }

    fn sky_light(&self, start: &Point3<f64>, normal: &Vector3<f64>, place: [i64; 2]) -> f64 {
        let rays = (0..SKY_RAYS).map(|ray| {
            let direction = about(normal, spread(place, ray, SKY_RAYS));
            if self.scene.is_hidden(start, &direction) {
                self.studio.hollow()
            } else {
                self.studio.sky(&direction)
            }
        });
        rays.sum::<f64>() / f64::from(SKY_RAYS)
    }

    fn key_light(&self, start: &Point3<f64>, normal: &Vector3<f64>, place: [i64; 2]) -> f64 {
        let direction = self.studio.key_direction(spread(place, 0, 1));
        let light = self.studio.key_light(normal, &direction);
        if light > 0.0 && !self.scene.is_hidden(start, &direction) {
            light
        } else {
            0.0
        }
    }

    /// What a clear coat mirrors: the sky, and the key light as a soft spot (Schlick's Fresnel term, 4 % straight on).
    fn shine(&self, start: &Point3<f64>, normal: &Vector3<f64>, direction: &Vector3<f64>, place: [i64; 2]) -> f64 {
        let cosine = -direction.dot(normal);
        let mirrored = (direction + 2.0 * cosine * normal).normalize();
        let about_mirrored = about(&mirrored, {
            let [u, v] = spread(place, 0, 1);
            [0.01 * u, v]
        });
        if self.scene.is_hidden(start, &about_mirrored) {
            return 0.0;
        }
        let fresnel = 0.04 + 0.96 * (1.0 - cosine.clamp(0.0, 1.0)).powi(5);
        let spot = 6.0 * mirrored.dot(&self.studio.key).max(0.0).powi(120);
        fresnel * (self.studio.sky(&mirrored) + spot)
    }

    /// Linear light that leaves a place towards the camera: its own colour, the light of its neighbourhood.
    fn lit(&self, places: &[Place], wide: usize, [x, y]: [usize; 2]) -> [f32; 3] {
        let own = &places[y * wide + x];
        if own.kind == Kind::Background {
            return own.colour;
        }
        // Two places of one surface lie across its normal from each other, as far as it is flat.
        let far = 0.02 * self.extent;
        let (mut light, mut shine, mut count) = (0.0, 0.0, 0.0);
        for row in y - REACH..y + REACH {
            for other in &places[row * wide + x - REACH..row * wide + x + REACH] {
                let apart = other.point - own.point;
                let same = other.kind == own.kind
                    && other.normal.dot(&own.normal) > SAME_NORMAL
                    && apart.dot(&own.normal).abs() < 0.2 * apart.norm() + 1e-9 * self.extent
                    && apart.norm() < far;
                if same || std::ptr::eq(other, own) {
                    light += other.light;
                    shine += other.shine;
                    count += 1.0;
                }
            }
        }
        let (light, shine) = ((light / count) as f32, (shine / count) as f32);
        if own.kind == Kind::Ground {
            // The ground is a shadow on the background: full light is the background itself, and far away there is no shadow.
            let away = ((own.point - self.middle).norm() / (4.0 * self.extent)) as f32;
            let fade = (1.0 - away * away).max(0.0);
            return own.colour.map(|colour| colour * (1.0 + (light.min(1.0) - 1.0) * fade));
        }
        own.colour.map(|colour| colour * light + shine)
    }
}

/// A point of the unit square that belongs to a place and a ray.
///
/// The places of a square of 8 × 8 are numbered as in a dither matrix and take the points of one evenly spread sequence (R₂, additive recurrence with the plastic number) in turn. Whatever 8 × 8 places the light is averaged over, every point of
/// the sequence occurs once: no grain where the light changes slowly.
fn spread(place: [i64; 2], ray: u32, rays: u32) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let [x, y] = place.map(|n| n.rem_euclid(SQUARE as i64) as u32);
    let number = (0..3).fold(0, |number, bit| {
        number << 2 | ((x ^ y) >> bit & 1) << 1 | (y >> bit & 1)
    });
    STEPS.map(|step| (0.5 + f64::from(number * rays + ray) * step).fract())
}
