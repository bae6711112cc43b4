//! Voids in what is seen: a ray that enters the mesh in a void goes on to the void's wall, or out again.

use crate::paths::World;
use crate::scene::Surface;
use nalgebra::{Point3, Vector3};

/// Signed distance from a point to the nearest surface of a void, negative in one.
pub(crate) type Hollows<'a> = &'a (dyn Fn(&Point3<f64>) -> f64 + Sync);

/// Where a ray begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) point: Point3<f64>,
    /// Inside the mesh, in a void.
    pub(crate) inside: bool,
}

/// A wall is met this share of the object's extent before it.
const NEAR: f64 = 1e-5;
/// Steps to a wall: each is as long as no wall is nearer, so few are needed but along a wall.
const MOST_STEPS: usize = 256;
/// Times that a ray goes in or out through the openings of voids.
const MOST_OPENINGS: usize = 64;

impl World<'_> {
    /// The first surface along a ray, before `far`.
    pub(crate) fn object_along(&self, start: &Start, direction: &Vector3<f64>, far: f64) -> Option<Surface> {
        let Some(hollows) = self.hollows else {
            let hit = self.scene.first_hit(&start.point, direction, far)?;
            return Some(self.scene.surface(&hit, direction));
        };
        let (mut from, mut inside, mut gone) = (start.point, start.inside, 0.0);
        for _ in 0..MOST_OPENINGS {
            let hit = self.scene.first_hit(&from, direction, far - gone);
            if inside {
                // An open mesh has an inside without end.
                let reach = hit.as_ref().map_or(4.0 * self.extent, |hit| hit.distance);
                if let Some(distance) = self.wall(hollows, &from, direction, reach) {
                    return Some(self.wall_surface(hollows, &(from + distance * direction)));
                }
            }
            let hit = hit?;
            let surface = self.scene.surface(&hit, direction);
            if !inside && hollows(&surface.point) > 0.0 {
                return Some(surface);
            }
            inside = !inside;
            let beyond = hit.distance + 0.1 * NEAR * self.extent;
            gone += beyond;
            from += beyond * direction;
        }
        None
    }

    /// Whether anything is in the way.
    pub(crate) fn is_hidden(&self, start: &Start, direction: &Vector3<f64>) -> bool {
        match self.hollows {
            None => self.scene.is_hidden(&start.point, direction),
            Some(_) => self.object_along(start, direction, f64::INFINITY).is_some(),
        }
    }

    /// How far a ray in a void is from the wall (Hart 1996: steps of the distance to it).
    fn wall(&self, hollows: Hollows<'_>, from: &Point3<f64>, direction: &Vector3<f64>, reach: f64) -> Option<f64> {
        let near = NEAR * self.extent;
        let (mut gone, mut before) = (0.0, f64::INFINITY);
        for _ in 0..MOST_STEPS {
            let depth = -self.distance(hollows, &(from + gone * direction));
            // Rays begin near a wall, and leave it.
            if depth < near && depth <= before && gone > 0.0 || depth < 0.0 {
                return Some(gone);
            }
            before = depth;
            gone += depth.max(0.5 * near);
            if gone >= reach {
                return None;
            }
        }
        Some(gone)
    }

    /// To the nearest void, as far as it matters here: infinity less infinity is no slope.
    fn distance(&self, hollows: Hollows<'_>, at: &Point3<f64>) -> f64 {
        hollows(at).clamp(-self.extent, self.extent)
    }

    fn wall_surface(&self, hollows: Hollows<'_>, at: &Point3<f64>) -> Surface {
        let step = 2.0 * NEAR * self.extent;
        let slope = |axis: usize| {
            let aside = step * Vector3::ith(axis, 1.0);
            self.distance(hollows, &(at - aside)) - self.distance(hollows, &(at + aside))
        };
        let normal = Vector3::new(slope(0), slope(1), slope(2))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::z);
        Surface {
            // The colour is that of the wall, a little inside it.
            point: at - step * normal,
            normal,
            start: at + step * normal,
            inside: true,
        }
    }
}
