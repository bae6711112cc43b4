//! A tile of the picture: places looked at, light gathered and averaged over near places of the same surface, pixels.

#![allow(
    clippy::cast_possible_truncation,
    reason = "light is f32 where it is seen; places are numbered within squares"
)]

use crate::camera::View;
use crate::hollows::Start;
use crate::paths::{Chance, GROUND_REACH, Met, Rgb, World};
use nalgebra::{Point3, Vector3};
use stereology_imaging::encoded_byte;

/// Light is averaged over squares of this many places each way.
const SQUARE: usize = 8;
/// Rays to the sky for each pixel, at least one a place.
const SKY_RAYS: usize = 18;
/// Normals of places that are averaged together agree to this cosine.
const SAME_NORMAL: f64 = 0.95;

/// All that a picture is made of.
pub(crate) struct Picture<'a> {
    pub(crate) world: World<'a>,
    pub(crate) view: View,
    /// Places each way in a pixel.
    pub(crate) samples: usize,
    /// Linear light of the background and the ground.
    pub(crate) background: [f32; 3],
}

/// What is seen at a place of the picture.
#[derive(Clone, Copy)]
struct Place {
    kind: Kind,
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// Linear.
    colour: Rgb,
    /// All that falls on the place, grainy.
    light: Rgb,
    /// What a clear coat mirrors.
    shine: Rgb,
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
        let reach = self.reach();
        let [wide, high] = size.map(|n| n * self.samples + 2 * reach);
        let from = corner.map(|n| (n * self.samples) as i64 - reach as i64);
        let places: Vec<Place> = (0..wide * high)
            .map(|i| self.look([from[0] + (i % wide) as i64, from[1] + (i / wide) as i64]))
            .collect();
        let mut pixels = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let mut sum = Rgb::zeros();
                for i in 0..self.samples * self.samples {
                    let x = reach + column * self.samples + i % self.samples;
                    let y = reach + row * self.samples + i / self.samples;
                    sum += self.lit(&places, wide, [x, y]);
                }
                let share = 1.0 / (self.samples * self.samples) as f32;
                pixels.push(sum.map(|light| encoded_byte(light * share)).into());
            }
        }
        pixels
    }

    /// Places before a place in its square; one less behind it. A pixel of a whole square needs no others.
    fn reach(&self) -> usize {
        if self.samples < SQUARE { SQUARE / 2 } else { 0 }
    }

    /// What is seen at a place, and its light in a few directions that belong to this place alone.
    fn look(&self, place: [i64; 2]) -> Place {
        let [x, y] = place.map(|n| (n as f64 + 0.5) / self.samples as f64);
        let (eye, direction) = (self.view.eye, self.view.direction(x, y).normalize());
        let world = &self.world;
        let mut seen = Place {
            kind: Kind::Background,
            point: eye,
            normal: world.up.into_inner(),
            colour: Rgb::from(self.background),
            light: Rgb::repeat(1.0),
            shine: Rgb::zeros(),
        };
        let camera = Start {
            point: eye,
            inside: false,
        };
        let start = match world.meet(&camera, &direction) {
            Met::Sky => return seen,
            Met::Ground(point) => {
                seen.kind = Kind::Ground;
                seen.point = point;
                world.above_ground(&point)
            }
            Met::Object(surface) => {
                seen.kind = Kind::Object;
                seen.point = surface.point;
                seen.normal = surface.normal;
                seen.colour = world.colour_at(&surface.point);
                world.above(&surface)
            }
        };
        let rays = (SKY_RAYS / (self.samples * self.samples)).max(1) as u32;
        let mut chance = Chance::new(place);
        let sky = (0..rays as usize).map(|ray| spread(place, ray as u32, rays));
        seen.light = world.light_on(&start, &seen.normal, spread(place, 0, 1), sky, &mut chance);
        if seen.kind == Kind::Object && world.gloss > 0.0 {
            let (shine, kept) = world.coat(&start, &seen.normal, &direction, spread(place, 0, 1), &mut chance);
            seen.shine = shine;
            seen.light *= 1.0 - kept;
        }
        seen
    }

    /// Linear light that leaves a place towards the camera: its own colour, the light of its neighbourhood.
    fn lit(&self, places: &[Place], wide: usize, [x, y]: [usize; 2]) -> Rgb {
        let own = &places[y * wide + x];
        if own.kind == Kind::Background {
            return own.colour;
        }
        // Two places of one surface lie across its normal from each other, as far as it is flat.
        let extent = self.world.extent;
        let far = 0.02 * extent;
        let reach = self.reach();
        let (mut light, mut shine, mut count) = (Rgb::zeros(), Rgb::zeros(), 0.0);
        for row in y - reach..(y + reach).max(y + 1) {
            for other in &places[row * wide + x - reach..(row * wide + x + reach).max(row * wide + x + 1)] {
                let apart = other.point - own.point;
                let same = other.kind == own.kind
                    && other.normal.dot(&own.normal) > SAME_NORMAL
                    && apart.dot(&own.normal).abs() < 0.2 * apart.norm() + 1e-9 * extent
                    && apart.norm() < far;
                if same || std::ptr::eq(other, own) {
                    light += other.light;
                    shine += other.shine;
                    count += 1.0;
                }
            }
        }
        let (light, shine) = (light / count, shine / count);
        if own.kind == Kind::Ground {
            // The ground is a shadow on the background: full light is the background itself, and far away there is no shadow.
            let away = ((own.point - self.world.middle).norm() / (GROUND_REACH * extent)) as f32;
            let fade = (1.0 - away * away).max(0.0);
            return own
                .colour
                .component_mul(&light.map(|light| 1.0 + (light.min(1.0) - 1.0) * fade));
        }
        own.colour.component_mul(&light) + shine
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
