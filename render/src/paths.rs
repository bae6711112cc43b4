//! Path tracing: the light that falls on a surface from the key light, the sky and other surfaces.

use crate::light::{Studio, about, single};
use crate::object::{Object, Start};
use crate::scene::Surface;
use nalgebra::{Point3, UnitVector3, Vector3};
use stereology_imaging::linear;

pub(crate) type Colour<'a> = &'a (dyn Fn(&Point3<f64>) -> [f32; 3] + Sync);

/// Linear light, three primaries.
pub(crate) type Rgb = Vector3<f32>;

/// A ray of light starts this fraction of the extent above the surface.
const LIFT: f64 = 1e-6;
/// The ground is visible, receives shadows and reflects light within this many extents of the object.
pub(crate) const GROUND_REACH: f64 = 4.0;
/// Largest probability that a path continues at a surface, so that every path ends.
const MOST_LIKELY: f32 = 0.95;

/// The scene: object, ground and light.
pub(crate) struct World<'a> {
    pub(crate) object: Object<'a>,
    pub(crate) studio: Studio,
    pub(crate) colour: Colour<'a>,
    /// Height of the ground along `up`, if there is one.
    pub(crate) ground: Option<f64>,
    pub(crate) up: UnitVector3<f64>,
    /// Centre of the object's bounding box.
    pub(crate) middle: Point3<f64>,
    pub(crate) gloss: f64,
}

/// The first thing that a ray meets.
pub(crate) enum Met {
    Sky,
    Ground(Point3<f64>),
    Object(Surface),
}

impl World<'_> {
    /// The first thing that a ray meets.
    pub(crate) fn meet(&self, from: &Start, direction: &Vector3<f64>) -> Met {
        let ground = self.ground.and_then(|height| {
            let distance = (height - from.point.coords.dot(&self.up)) / direction.dot(&self.up);
            (distance > 0.0).then_some(distance)
        });
        if let Some(surface) = self
            .object
            .first_surface(from, direction, ground.unwrap_or(f64::INFINITY))
        {
            return Met::Object(surface);
        }
        ground
            .map(|distance| from.point + distance * direction)
            .filter(|point| (point - self.middle).norm() < GROUND_REACH * self.object.extent)
            .map_or(Met::Sky, Met::Ground)
    }

    /// Origin of rays that leave a surface.
    pub(crate) fn above(&self, surface: &Surface) -> Start {
        Start {
            point: surface.start + LIFT * self.object.extent * surface.normal,
            inside: surface.inside,
        }
    }

    /// Origin of rays that leave the ground.
    pub(crate) fn above_ground(&self, point: &Point3<f64>) -> Start {
        Start {
            point: point + LIFT * self.object.extent * self.up.into_inner(),
            inside: false,
        }
    }

    /// Linear colour of the object, at most 1 in each primary.
    pub(crate) fn colour_at(&self, point: &Point3<f64>) -> Rgb {
        Rgb::from((self.colour)(point).map(|encoded| linear(encoded).min(1.0)))
    }

    /// Light on a surface: from the key light in one direction, and from the directions of `sky` about the normal.
    ///
    /// An unobstructed face that points up receives 1 on average.
    pub(crate) fn light_on(
        &self,
        start: &Start,
        normal: &Vector3<f64>,
        key: [f64; 2],
        sky: impl ExactSizeIterator<Item = [f64; 2]>,
        chance: &mut Chance,
    ) -> Rgb {
        let weight = 1.0 / sky.len() as f32;
        let gathered: Rgb = sky
            .map(|sample| self.radiance(*start, about(normal, sample), chance))
            .sum();
        Rgb::repeat(self.key_light(start, normal, key)) + weight * gathered
    }

    fn key_light(&self, start: &Start, normal: &Vector3<f64>, sample: [f64; 2]) -> f32 {
        let direction = self.studio.key_direction(sample);
        let light = self.studio.key_light(normal, &direction);
        if light > 0.0 && !self.object.blocks(start, &direction) {
            single(light)
        } else {
            0.0
        }
    }

    /// Radiance from a direction without the key light itself: the sky, or a surface lit by the key light and by other
    /// surfaces.
    ///
    /// One path of the rendering equation (Kajiya 1986), ended by Russian roulette.
    fn radiance(&self, mut start: Start, mut direction: Vector3<f64>, chance: &mut Chance) -> Rgb {
        let (mut sum, mut carried) = (Rgb::zeros(), Rgb::repeat(1.0));
        loop {
            let (normal, colour);
            match self.meet(&start, &direction) {
                Met::Sky => return sum + single(self.studio.sky(&direction)) * carried,
                Met::Ground(point) => {
                    normal = self.up.into_inner();
                    colour = Rgb::repeat(single(self.studio.ground()));
                    start = self.above_ground(&point);
                }
                Met::Object(surface) => {
                    normal = surface.normal;
                    colour = self.colour_at(&surface.point);
                    start = self.above(&surface);
                }
            }
            carried.component_mul_assign(&colour);
            sum += self.key_light(&start, &normal, chance.pair()) * carried;
            let survival = carried.max().min(MOST_LIKELY);
            if chance.next() >= f64::from(survival) {
                return sum;
            }
            carried /= survival;
            direction = about(&normal, chance.pair());
        }
    }

    /// Light that a clear coat reflects towards the viewer, and the fraction of light that it keeps from the surface
    /// below.
    ///
    /// Schlick's approximation of the Fresnel term, 4 % at normal incidence; the disc of the key light is slightly
    /// blurred.
    pub(crate) fn coat(
        &self,
        start: &Start,
        normal: &Vector3<f64>,
        direction: &Vector3<f64>,
        [u, v]: [f64; 2],
        chance: &mut Chance,
    ) -> (Rgb, f32) {
        let cosine = -direction.dot(normal);
        let mirrored = about(&(direction + 2.0 * cosine * normal).normalize(), [COAT_BLUR * u, v]);
        let fresnel = single(self.gloss * (0.04 + 0.96 * (1.0 - cosine.clamp(0.0, 1.0)).powi(5)));
        if mirrored.dot(normal) <= 0.0 {
            return (Rgb::zeros(), fresnel);
        }
        let mut light = self.radiance(*start, mirrored, chance);
        if self.studio.is_in_key(&mirrored) && !self.object.blocks(start, &mirrored) {
            light.add_scalar_mut(single(self.studio.key_radiance()));
        }
        (fresnel * light, fresnel)
    }
}

/// Squared sine of the largest angle between a ray that the coat reflects and the mirror direction.
const COAT_BLUR: f64 = 0.01;

/// Random numbers of one sample of the image (splitmix64).
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new([x, y]: [i64; 2]) -> Self {
        let mut chance = Self((x as u64) << 32 ^ (y as u64 & 0xFFFF_FFFF));
        chance.next();
        chance
    }

    /// Uniform in [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 * f64::EPSILON / 2.0
    }

    fn pair(&mut self) -> [f64; 2] {
        [self.next(), self.next()]
    }
}

#[cfg(test)]
mod tests {
    use super::{Chance, Object, Start, Studio, World};
    use crate::scene::Scene;
    use nalgebra::{Point3, Vector3};
    use std::f64::consts::PI;
    use stereology_shape::TriangleMesh;

    /// Unobstructed light on faces that point up, down and away from the key light equals its integral.
    #[test]
    fn light_in_the_open_is_the_integral_of_the_sky() {
        let world = world(&TriangleMesh::icosphere(1.0, 0), &|_| [0.5; 3]);
        let start = outside(Point3::new(0.0, 0.0, 5.0));
        let n = 400_u32;
        let light = |normal: Vector3<f64>| {
            let sky = (0..n * n).map(|i| [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n)));
            let sky: Vec<[f64; 2]> = sky.collect();
            f64::from(
                world
                    .light_on(&start, &normal, [0.0, 0.0], sky.into_iter(), &mut Chance::new([0, 0]))
                    .x,
            )
        };
        let away = -(world.studio.key.into_inner() - world.studio.key.z * Vector3::z()).normalize();
        // Half of the light of the horizon, (z − h) ∫ sin² of the elevation over half of the sky, half of the light of
        // the ground.
        let (horizon, zenith, ground) = (0.42, 0.5, 0.36);
        let level = 0.5 * horizon + (zenith - horizon) * 2.0 / (3.0 * PI) + 0.5 * ground;
        for (normal, expected) in [(Vector3::z(), 1.0), (-Vector3::z(), ground), (away, level)] {
            assert!((light(normal) - expected).abs() < 2e-3, "{normal} {}", light(normal));
        }
    }

    /// Light reflected once or more reaches the floor of a deep well in the colour of its walls, and not at all if they
    /// are black.
    #[test]
    fn walls_colour_the_light_of_a_cavity() {
        let slab = |low: [f64; 3], high: [f64; 3]| {
            let (low, high) = (Vector3::from(low), Vector3::from(high));
            TriangleMesh::cuboid((high - low).into()).mapped(|p| p + 0.5 * (low + high))
        };
        let well = slab([-2.0, 1.0, 0.0], [2.0, 2.0, 3.0])
            .with(&slab([-2.0, -2.0, 0.0], [2.0, -1.0, 3.0]))
            .with(&slab([1.0, -1.0, 0.0], [2.0, 1.0, 3.0]))
            .with(&slab([-2.0, -1.0, 0.0], [-1.0, 1.0, 3.0]));
        let light = |colour: [f32; 3]| {
            let walls = |_: &Point3<f64>| colour;
            let world = world(&well, &walls);
            let sky: Vec<[f64; 2]> = (0..40_000_u32)
                .map(|i| [i % 200, i / 200].map(|k| (f64::from(k) + 0.5) / 200.0))
                .collect();
            let middle = outside(Point3::new(0.0, 0.0, 0.1));
            world.light_on(
                &middle,
                &Vector3::z(),
                [0.0, 0.0],
                sky.into_iter(),
                &mut Chance::new([1, 2]),
            )
        };
        let (black, red) = (light([0.0; 3]), light([0.9, 0.0, 0.0]));
        assert!((black.x - black.y).abs() < 1e-6 && (red.y - black.y).abs() < 1e-6);
        assert!(red.x > 1.3 * black.x, "{} {}", red.x, black.x);
    }

    fn outside(point: Point3<f64>) -> Start {
        Start { point, inside: false }
    }

    fn world<'a>(mesh: &TriangleMesh, colour: super::Colour<'a>) -> World<'a> {
        World {
            object: Object {
                scene: Scene::new(mesh),
                voids: None,
                extent: 2.0,
            },
            studio: Studio::new(Vector3::z_axis(), &Vector3::new(-1.0, -1.0, -0.5)),
            colour,
            ground: None,
            up: Vector3::z_axis(),
            middle: Point3::origin(),
            gloss: 0.0,
        }
    }
}
