//! The periodic images of the particles, sorted by height.

use crate::narrow::floor;
use nalgebra::Point3;
use stereology_shape::{Particle, PeriodicBox};

/// No particle.
pub(crate) const NONE: u32 = u32::MAX;

/// One of the periodic images of a particle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Image {
    pub(crate) centre: Point3<f64>,
    pub(crate) outer_squared: f64,
    pub(crate) particle: u32,
}

impl Image {
    pub(crate) fn new(centre: Point3<f64>, outer: f64, particle: u32) -> Self {
        Self {
            centre,
            outer_squared: outer * outer,
            particle,
        }
    }
}

/// All images of the particles that reach into the box, sorted by height.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    /// Sorted by the z of their centres, ascending.
    images: Vec<Image>,
    /// The largest radius.
    reach: f64,
}

impl Images {
    /// The images of particles with these radii about their centres.
    pub(crate) fn new(particles: &[Particle], outer: impl Fn(usize) -> f64, period: &PeriodicBox) -> Self {
        let sides = period.sides();
        let mut images = Vec::with_capacity(particles.len());
        let mut reach = 0.0_f64;
        for (index, particle) in (0..).zip(particles) {
            let (home, radius) = (period.wrap(&particle.position), outer(index as usize));
            reach = reach.max(radius);
            let along = |k: usize| {
                let turns = floor((radius / sides[k]).ceil());
                (-turns..=turns)
                    .map(move |turn| home[k] + turn as f64 * sides[k])
                    .filter(move |x| x + radius > 0.0 && x - radius < sides[k])
            };
            for z in along(2) {
                for y in along(1) {
                    images.extend(along(0).map(|x| Image::new(Point3::new(x, y, z), radius, index)));
                }
            }
        }
        images.sort_by(|a, b| a.centre.z.total_cmp(&b.centre.z));
        Self { images, reach }
    }

    /// The images that can contain a point at this z.
    pub(crate) fn near(&self, z: f64) -> &[Image] {
        let first = self.images.partition_point(|image| image.centre.z < z - self.reach);
        let end = self.images.partition_point(|image| image.centre.z <= z + self.reach);
        &self.images[first..end]
    }
}
