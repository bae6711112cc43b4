//! The object that is rendered: a mesh, and the voids that it cuts open.
//!
//! A ray that enters the mesh inside a void goes on to the wall of the void, or leaves through another opening.

use crate::scene::{Scene, Surface};
use nalgebra::{Point3, Vector3};

/// Signed distance from a point to the nearest surface of a void, negative inside.
pub(crate) type Voids<'a> = &'a (dyn Fn(&Point3<f64>) -> f64 + Sync);

/// Origin of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) point: Point3<f64>,
    /// Inside the mesh, in a void.
    pub(crate) inside: bool,
}

/// A mesh and its voids.
pub(crate) struct Object<'a> {
    pub(crate) scene: Scene,
    pub(crate) voids: Option<Voids<'a>>,
    /// Largest side of the bounding box.
    pub(crate) extent: f64,
}

/// A ray stops this fraction of the extent before a wall.
const NEAR: f64 = 1e-5;
/// Maximum number of steps to a wall. Each step is the distance to the nearest wall, so only rays along a wall need
/// many.
const MOST_STEPS: usize = 256;
/// Maximum number of openings of voids that one ray passes.
const MOST_OPENINGS: usize = 64;

impl Object<'_> {
    /// The first surface along a ray, before `far`.
    pub(crate) fn first_surface(&self, start: &Start, direction: &Vector3<f64>, far: f64) -> Option<Surface> {
        let Some(voids) = self.voids else {
            let hit = self.scene.first_hit(&start.point, direction, far)?;
            return Some(self.scene.surface(&hit, direction));
        };
        let (mut from, mut inside, mut gone) = (start.point, start.inside, 0.0);
        for _ in 0..MOST_OPENINGS {
            let hit = self.scene.first_hit(&from, direction, far - gone);
            if inside {
                // The inside of an open mesh is unbounded.
                let reach = hit.as_ref().map_or(4.0 * self.extent, |hit| hit.distance);
                if let Some(distance) = self.wall(voids, &from, direction, reach) {
                    return Some(self.wall_surface(voids, &(from + distance * direction)));
                }
            }
            let hit = hit?;
            let surface = self.scene.surface(&hit, direction);
            if !inside && voids(&surface.point) > 0.0 {
                return Some(surface);
            }
            inside = !inside;
            let beyond = hit.distance + 0.1 * NEAR * self.extent;
            gone += beyond;
            from += beyond * direction;
        }
        None
    }

    /// Whether a surface blocks a ray.
    pub(crate) fn blocks(&self, start: &Start, direction: &Vector3<f64>) -> bool {
        match self.voids {
            None => self.scene.blocks(&start.point, direction),
            Some(_) => self.first_surface(start, direction, f64::INFINITY).is_some(),
        }
    }

    /// Distance along a ray in a void to the wall, by sphere tracing (Hart 1996).
    fn wall(&self, voids: Voids<'_>, from: &Point3<f64>, direction: &Vector3<f64>, reach: f64) -> Option<f64> {
        let near = NEAR * self.extent;
        let (mut gone, mut before) = (0.0, f64::INFINITY);
        for _ in 0..MOST_STEPS {
            let depth = -self.distance(voids, &(from + gone * direction));
            // A ray that leaves a wall starts near it: only a wall that it approaches stops it.
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

    /// Distance to the nearest void, limited to the extent so that differences of it are finite.
    fn distance(&self, voids: Voids<'_>, at: &Point3<f64>) -> f64 {
        voids(at).clamp(-self.extent, self.extent)
    }

    fn wall_surface(&self, voids: Voids<'_>, at: &Point3<f64>) -> Surface {
        let step = 2.0 * NEAR * self.extent;
        let slope = |axis: usize| {
            let aside = step * Vector3::ith(axis, 1.0);
            self.distance(voids, &(at - aside)) - self.distance(voids, &(at + aside))
        };
        let normal = Vector3::new(slope(0), slope(1), slope(2))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::z);
        Surface {
            // The colour is taken a little inside the wall.
            point: at - step * normal,
            normal,
            start: at + step * normal,
            inside: true,
        }
    }
}
