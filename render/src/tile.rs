//! Rendering of a tile: samples are traced, light is averaged over nearby samples of the same surface, samples become
//! pixels.

use crate::camera::View;
use crate::light::single;
use crate::object::Start;
use crate::paths::{Chance, GROUND_REACH, Met, Rgb, World};
use nalgebra::{Point3, Vector3};
use stereology_imaging::encoded_byte;

/// Light is averaged over squares of this many samples along each axis.
const SQUARE: usize = 8;
/// Rays to the sky per pixel; at least one per sample.
const SKY_RAYS: u32 = 18;
/// Light is averaged over samples whose normals differ by an angle of at least this cosine.
const SAME_NORMAL: f64 = 0.95;

/// A scene with its camera and sampling.
pub(crate) struct Rendering<'a> {
    pub(crate) world: World<'a>,
    pub(crate) view: View,
    /// Samples per pixel along each axis.
    pub(crate) samples: u32,
    /// Linear light of the background and the ground.
    pub(crate) background: [f32; 3],
}

/// What is visible at a point of the image.
#[derive(Clone, Copy)]
struct Sample {
    kind: Kind,
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// Linear.
    colour: Rgb,
    /// Light that falls on the surface, with sampling noise.
    light: Rgb,
    /// Light that a clear coat reflects.
    shine: Rgb,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Background,
    Ground,
    Object,
}

impl Rendering<'_> {
    /// Bytes of the pixels of a tile at `corner`, row by row.
    pub(crate) fn tile(&self, corner: [usize; 2], size: [usize; 2]) -> Vec<[u8; 3]> {
        let (reach, per_axis) = (self.reach(), self.samples as usize);
        let [wide, high] = size.map(|n| n * per_axis + 2 * reach);
        let from = corner.map(|n| (n * per_axis) as i64 - reach as i64);
        let samples: Vec<Sample> = (0..wide * high)
            .map(|i| self.trace([from[0] + (i % wide) as i64, from[1] + (i / wide) as i64]))
            .collect();
        let mut pixels = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let mut sum = Rgb::zeros();
                for i in 0..per_axis * per_axis {
                    let x = reach + column * per_axis + i % per_axis;
                    let y = reach + row * per_axis + i / per_axis;
                    sum += self.lit(&samples, wide, [x, y]);
                }
                let weight = 1.0 / (per_axis * per_axis) as f32;
                pixels.push(sum.map(|light| encoded_byte(light * weight)).into());
            }
        }
        pixels
    }

    /// Number of samples before a sample in its square; the square has one fewer after it. A pixel with a full square
    /// needs no neighbours.
    fn reach(&self) -> usize {
        if (self.samples as usize) < SQUARE {
            SQUARE / 2
        } else {
            0
        }
    }

    /// Traces one sample: the visible surface, and its light from a few directions that only this sample uses.
    fn trace(&self, index: [i64; 2]) -> Sample {
        let [x, y] = index.map(|n| (n as f64 + 0.5) / f64::from(self.samples));
        let (eye, direction) = (self.view.eye, self.view.direction(x, y).normalize());
        let world = &self.world;
        let mut seen = Sample {
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
        let rays = (SKY_RAYS / (self.samples * self.samples)).max(1);
        let mut chance = Chance::new(index);
        let sky: Vec<[f64; 2]> = (0..rays).map(|ray| spread(index, ray, rays)).collect();
        seen.light = world.light_on(&start, &seen.normal, spread(index, 0, 1), sky.into_iter(), &mut chance);
        if seen.kind == Kind::Object && world.gloss > 0.0 {
            let (shine, kept) = world.coat(&start, &seen.normal, &direction, spread(index, 0, 1), &mut chance);
            seen.shine = shine;
            seen.light *= 1.0 - kept;
        }
        seen
    }

    /// Linear light from a sample to the camera: its own colour, times the light averaged over its neighbourhood.
    fn lit(&self, samples: &[Sample], wide: usize, [x, y]: [usize; 2]) -> Rgb {
        let own = &samples[y * wide + x];
        if own.kind == Kind::Background {
            return own.colour;
        }
        // Two points of a nearly flat surface differ by a vector perpendicular to its normal.
        let extent = self.world.object.extent;
        let far = 0.02 * extent;
        let reach = self.reach();
        let (mut light, mut shine, mut count) = (Rgb::zeros(), Rgb::zeros(), 0.0);
        for row in y - reach..(y + reach).max(y + 1) {
            for other in &samples[row * wide + x - reach..(row * wide + x + reach).max(row * wide + x + 1)] {
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
            // The ground shows only a shadow on the background: in full light it is the background, and far away there
            // is no shadow.
            let away = single((own.point - self.world.middle).norm() / (GROUND_REACH * extent));
            let fade = (1.0 - away * away).max(0.0);
            return own
                .colour
                .component_mul(&light.map(|light| 1.0 + (light.min(1.0) - 1.0) * fade));
        }
        own.colour.component_mul(&light) + shine
    }
}

/// Point of the unit square for a ray of a sample.
///
/// The samples of a square of 8 × 8 are numbered as in a dither matrix and take successive points of one
/// low-discrepancy sequence (R₂, additive recurrence with the plastic number). Every square of 8 × 8 samples contains
/// each point of the sequence once, so there is no noise where the light changes slowly.
fn spread(index: [i64; 2], ray: u32, rays: u32) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let [x, y] = index.map(|n| n.rem_euclid(SQUARE as i64));
    let number = (0..3).fold(0_u8, |number, bit| {
        let odd = |n: i64| u8::from(n >> bit & 1 == 1);
        number << 2 | odd(x ^ y) << 1 | odd(y)
    });
    STEPS.map(|step| (0.5 + f64::from(u32::from(number) * rays + ray) * step).fract())
}
