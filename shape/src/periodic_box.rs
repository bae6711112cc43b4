//! A box that repeats in all three directions.

use nalgebra::{Point3, Vector3};

/// The period of a repeating material: the box [0, Lx) × [0, Ly) × [0, Lz).
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use stereology_shape::PeriodicBox;
///
/// let period = PeriodicBox::new(Vector3::new(10.0, 10.0, 5.0))?;
/// assert_eq!(period.wrap(&Point3::new(-1.0, 12.0, 5.0)), Point3::new(9.0, 2.0, 0.0));
/// assert_eq!(period.nearest(Vector3::new(9.0, 0.0, 0.0)), Vector3::new(-1.0, 0.0, 0.0));
/// # Ok::<(), stereology_shape::BoxError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeriodicBox {
    sides: Vector3<f64>,
}

/// A side of the box is not a positive finite length.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the sides of a periodic box are positive finite lengths, not {x} × {y} × {z}")]
#[non_exhaustive]
pub struct BoxError {
    /// Side along x.
    pub x: f64,
    /// Side along y.
    pub y: f64,
    /// Side along z.
    pub z: f64,
}

impl PeriodicBox {
    /// A box with these sides along x, y, z.
    ///
    /// # Errors
    ///
    /// [`BoxError`] unless all three are positive and finite.
    pub fn new(sides: Vector3<f64>) -> Result<Self, BoxError> {
        if sides.iter().all(|side| side.is_finite() && *side > 0.0) {
            Ok(Self { sides })
        } else {
            Err(BoxError {
                x: sides.x,
                y: sides.y,
                z: sides.z,
            })
        }
    }

    /// Lengths along x, y, z.
    #[must_use]
    pub fn sides(&self) -> Vector3<f64> {
        self.sides
    }

    /// Volume of one period.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.sides.product()
    }

    /// The copy of `p` inside the box: coordinates in [0, L).
    #[must_use]
    pub fn wrap(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(p.coords.zip_map(&self.sides, |x, side| {
            if (0.0..side).contains(&x) {
                return x;
            }
            let wrapped = x - side * (x / side).floor();
            // Rounding may give the far side for a coordinate just below 0, or a value just below 0.
            if (0.0..side).contains(&wrapped) { wrapped } else { 0.0 }
        }))
    }

    /// Position of a point along a Z-curve through the box (Morton 1966), with 1024 steps along each side. Points near
    /// each other along the curve are near each other in space.
    ///
    /// ```
    /// # use nalgebra::{Point3, Vector3};
    /// # use stereology_shape::PeriodicBox;
    /// let period = PeriodicBox::new(Vector3::repeat(1024.0))?;
    /// let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// assert_eq!(places.map(|p| period.curve_place(&Point3::from(p))), [0, 1, 2, 3, 4]);
    /// # Ok::<(), stereology_shape::BoxError>(())
    /// ```
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a wrapped point is in the box; NaN becomes 0"
    )]
    pub fn curve_place(&self, p: &Point3<f64>) -> u32 {
        const STEPS: f64 = 1024.0;
        let spread = |step: u32| (0..10).fold(0, |sum, bit| sum | (step >> bit & 1) << (3 * bit));
        let at = self.wrap(p).coords.component_div(&self.sides()) * STEPS;
        let [x, y, z] = [at.x, at.y, at.z].map(|x| spread(x as u32));
        x | y << 1 | z << 2
    }

    /// The shortest of all copies of an offset between two points (minimum image): components in [-L/2, L/2].
    #[must_use]
    pub fn nearest(&self, offset: Vector3<f64>) -> Vector3<f64> {
        offset.zip_map(&self.sides, |x, side| x - side * (x / side).round())
    }
}
