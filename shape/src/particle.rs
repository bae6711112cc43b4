//! A particle: its body, size, position and orientation.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// One particle of a material: a [`UnitBody`](crate::UnitBody) scaled by `size`, rotated by `orientation` and moved to
/// `position`.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_shape::Particle;
///
/// let orientation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
/// let particle = Particle { shape: 0, size: 2.0, category: 0, position: Point3::new(1.0, 0.0, 0.0), orientation };
/// let world = particle.to_world(&Point3::new(0.5, 0.0, 0.0));
/// assert!((world - Point3::new(1.0, 1.0, 0.0)).norm() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Index of its body in the list of bodies.
    pub shape: usize,
    /// Equivalent circular diameter of the particle's largest section.
    pub size: f64,
    /// Colour category.
    pub category: u8,
    /// Centre of volume.
    pub position: Point3<f64>,
    /// Rotation from the body's axes to the world's.
    pub orientation: UnitQuaternion<f64>,
}

impl Particle {
    /// World to unit-body coordinates: R⁻¹ (p − position) / size.
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion};
    /// # use stereology_shape::Particle;
    /// let particle =
    ///     Particle { shape: 0, size: 4.0, category: 0, position: Point3::new(1.0, 1.0, 1.0), orientation: UnitQuaternion::identity() };
    /// assert_eq!(particle.to_local(&Point3::new(3.0, 1.0, 1.0)), Point3::new(0.5, 0.0, 0.0));
    /// ```
    #[must_use]
    pub fn to_local(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.orientation.inverse_transform_vector(&(p - self.position)) / self.size)
    }

    /// Unit-body to world coordinates: position + size R u.
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion};
    /// # use stereology_shape::Particle;
    /// let particle =
    ///     Particle { shape: 0, size: 4.0, category: 0, position: Point3::new(1.0, 1.0, 1.0), orientation: UnitQuaternion::identity() };
    /// assert_eq!(particle.to_world(&Point3::new(0.5, 0.0, 0.0)), Point3::new(3.0, 1.0, 1.0));
    /// ```
    #[must_use]
    pub fn to_world(&self, u: &Point3<f64>) -> Point3<f64> {
        self.position + self.orientation * u.coords * self.size
    }
}

/// A rotation drawn uniformly from all rotations (Shoemake 1992); it takes three random numbers.
///
/// ```
/// use rand::SeedableRng;
/// use rand_chacha::ChaCha8Rng;
/// use stereology_shape::isotropic_rotation;
///
/// let turn = isotropic_rotation(&mut ChaCha8Rng::seed_from_u64(7));
/// assert_eq!(turn, isotropic_rotation(&mut ChaCha8Rng::seed_from_u64(7)));
/// ```
pub fn isotropic_rotation<R: Rng + ?Sized>(rng: &mut R) -> UnitQuaternion<f64> {
    let part: f64 = rng.random();
    let (sin1, cos1) = (TAU * rng.random::<f64>()).sin_cos();
    let (sin2, cos2) = (TAU * rng.random::<f64>()).sin_cos();
    let (first, second) = ((1.0 - part).sqrt(), part.sqrt());
    let q = nalgebra::Quaternion::from_parts(second * cos2, Vector3::new(first * sin1, first * cos1, second * sin2));
    UnitQuaternion::from_quaternion(q)
}
