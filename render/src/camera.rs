//! The position of the camera.

use nalgebra::{Point3, UnitVector3, Vector3};
use stereology_shape::TriangleMesh;

/// A camera directed at the centre of the object.
///
/// ```
/// use stereology_render::Camera;
/// let from_above = Camera { elevation: 60.0, ..Camera::default() };
/// assert!(from_above.distance.is_none()); // automatic: the whole object is visible
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Degrees around the vertical axis: 0 is the side of +z if y is up and of −y if z is up; 90 is the side of +x.
    pub azimuth: f64,
    /// Degrees above the horizon, −89 to 89.
    pub elevation: f64,
    /// Distance from the camera to the centre of the object, in its unit of length; `None`: the nearest from which all
    /// of it is visible.
    pub distance: Option<f64>,
    /// Field of view along the shorter side of the image, in degrees, 1 to 120; with automatic distance small angles
    /// place the camera far away.
    pub field_of_view: f64,
    /// The direction that is up in the image; y in most mesh files, z in a solid.
    pub up: UnitVector3<f64>,
}

impl Camera {
    /// Places the camera on the side of the object to which `direction` points, with `up` up.
    ///
    /// A zero or infinite direction gives the direction of [`Camera::default`].
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use stereology_render::Camera;
    /// let camera = Camera::from_side(&Vector3::new(1.0, 0.0, 1.0), Vector3::z_axis());
    /// assert!((camera.azimuth - 90.0).abs() < 1e-9 && (camera.elevation - 45.0).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn from_side(direction: &Vector3<f64>, up: UnitVector3<f64>) -> Self {
        let camera = Self { up, ..Self::default() };
        let Some(direction) = direction.try_normalize(0.0).filter(|d| d.norm().is_finite()) else {
            return camera;
        };
        let (_, [front, side]) = camera.out();
        Self {
            azimuth: direction.dot(&side).atan2(direction.dot(&front)).to_degrees(),
            elevation: direction
                .dot(&up)
                .clamp(-1.0, 1.0)
                .asin()
                .to_degrees()
                .clamp(-89.0, 89.0),
            ..camera
        }
    }

    /// Sets the smallest distance from which all of the mesh is visible from every side: for turntables.
    ///
    /// ```
    /// use stereology_render::Camera;
    /// use stereology_shape::TriangleMesh;
    /// let camera = Camera::default().clear_of(&TriangleMesh::icosphere(2.0, 2));
    /// assert!(camera.distance.is_some_and(|distance| distance > 4.0));
    /// ```
    #[must_use]
    pub fn clear_of(self, mesh: &TriangleMesh) -> Self {
        let used = || {
            mesh.triangles
                .iter()
                .flatten()
                .filter_map(|&i| mesh.vertices.get(i as usize))
        };
        let Some(&first) = used().next() else { return self };
        let (low, high) = used().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let middle = nalgebra::center(&low, &high);
        let radius = used().map(|p| (p - middle).norm()).fold(0.0, f64::max);
        let half = (FILL * (0.5 * self.field_of_view.to_radians()).tan()).atan();
        Self {
            distance: Some(radius / half.sin()),
            ..self
        }
    }

    /// Direction from the object to the camera, and the horizontal directions of azimuth 0 and 90.
    pub(crate) fn out(&self) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let front = if self.up.y.abs() > 0.9 {
            Vector3::z()
        } else {
            -Vector3::y()
        };
        let front = (front - self.up.dot(&front) * self.up.into_inner()).normalize();
        let side = self.up.cross(&front);
        let level = azimuth.cos() * front + azimuth.sin() * side;
        (
            elevation.cos() * level + elevation.sin() * self.up.into_inner(),
            [front, side],
        )
    }
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            azimuth: 35.0,
            elevation: 22.0,
            distance: None,
            field_of_view: 28.0,
            up: Vector3::y_axis(),
        }
    }
}

/// A camera at its position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub(crate) eye: Point3<f64>,
    pub(crate) forward: Vector3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// Half the shorter side of the image at distance 1.
    half: f64,
    size: [f64; 2],
}

/// Fraction of the image that the object may fill, along each axis.
const FILL: f64 = 0.84;

impl View {
    /// Places the camera so that all points are visible; `points` must not be empty.
    pub(crate) fn new(camera: &Camera, points: &[Point3<f64>], [width, height]: [u32; 2]) -> Self {
        let (out, _) = camera.out();
        let forward = -out;
        let right = forward.cross(&camera.up).normalize();
        let up = right.cross(&forward);
        let half = (0.5 * camera.field_of_view.to_radians()).tan();
        let size = [f64::from(width), f64::from(height)];
        let shorter = size[0].min(size[1]);
        let room = [half * FILL * size[0] / shorter, half * FILL * size[1] / shorter];

        let low = points.iter().fold(points[0], |low, p| low.inf(p));
        let high = points.iter().fold(points[0], |high, p| high.sup(p));
        let mut target = nalgebra::center(&low, &high);
        let mut distance = camera.distance.unwrap_or(0.0);
        if camera.distance.is_none() {
            // From `distance`, a point at (x, y) and `near` towards the camera needs |x| <= room (distance - near).
            // The target moves sideways until both sides need the same distance.
            let needs = |axis: &Vector3<f64>, room: f64| {
                points.iter().fold([f64::NEG_INFINITY; 2], |needs, p| {
                    let (across, near) = ((p - target).dot(axis), (p - target).dot(&out));
                    [needs[0].max(near + across / room), needs[1].max(near - across / room)]
                })
            };
            let (x, y) = (needs(&right, room[0]), needs(&up, room[1]));
            let nearest = points
                .iter()
                .map(|p| (p - target).dot(&out))
                .fold(f64::NEG_INFINITY, f64::max);
            target += 0.5 * room[0] * (x[0] - x[1]) * right + 0.5 * room[1] * (y[0] - y[1]) * up;
            // A mesh seen edge-on needs no room, but must not touch the camera.
            let clear = nearest + 0.05 * (high - low).amax();
            distance = (0.5 * (x[0] + x[1])).max(0.5 * (y[0] + y[1])).max(clear);
        }
        Self {
            eye: target + distance * out,
            forward,
            right,
            up,
            half,
            size,
        }
    }

    /// Direction through a point of the image, in pixels from the top left corner; not normalised.
    pub(crate) fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        let shorter = 0.5 * self.size[0].min(self.size[1]) / self.half;
        self.forward + (x - 0.5 * self.size[0]) / shorter * self.right - (y - 0.5 * self.size[1]) / shorter * self.up
    }
}

#[cfg(test)]
mod tests {
    use super::{Camera, View};
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    proptest! {
        /// At the automatic distance every point lies within the fraction of the image that the object may fill, and
        /// reaches it along one axis unless the camera would touch the object.
        #[test]
        fn all_is_visible(
            mut points in prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64).prop_map(Point3::from), 1..20),
            azimuth in 0.0..360.0_f64, elevation in -80.0..80.0_f64, field_of_view in 5.0..90.0_f64, wide in 50_u32..200,
        ) {
            points.extend([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [-1.0, -1.0, -1.0]].map(Point3::from));
            let camera = Camera { azimuth, elevation, field_of_view, ..Camera::default() };
            let view = View::new(&camera, &points, [wide, 100]);
            let (mut fill, mut nearest) = (0.0_f64, f64::INFINITY);
            for p in &points {
                let to = p - view.eye;
                let depth = to.dot(&view.forward);
                prop_assert!(depth > 0.0);
                nearest = nearest.min(depth);
                let centre: Vector3<f64> = view.direction(f64::from(wide) / 2.0, 50.0);
                prop_assert!((centre - view.forward).norm() < 1e-12);
                let half = [view.half * view.size[0] / view.size[0].min(100.0), view.half * 100.0 / view.size[0].min(100.0)];
                fill = fill.max(to.dot(&view.right).abs() / depth / half[0]).max(to.dot(&view.up).abs() / depth / half[1]);
            }
            // Less full only if the camera would touch the object.
            let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
            prop_assert!(fill < 0.85 && (fill > 0.83 || nearest < 0.051 * (high - low).amax()), "{fill} {nearest}");
        }
    }
}
