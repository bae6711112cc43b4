//! Exact sections: the profiles on a plane perpendicular to an axis.

use crate::solid::Solid;
use nalgebra::{Unit, UnitVector3, Vector3};

/// An axis of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Along x, the fastest axis of an array (z, y, x).
    X,
    /// Along y.
    Y,
    /// Along z, the slowest axis of an array (z, y, x).
    Z,
}

impl Axis {
    /// Its index in a point: 0, 1, 2.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// The unit vector along it.
    #[must_use]
    pub fn direction(self) -> UnitVector3<f64> {
        match self {
            Self::X => Vector3::x_axis(),
            Self::Y => Vector3::y_axis(),
            Self::Z => Vector3::z_axis(),
        }
    }
}

impl Solid {
    /// The profiles on one period of the plane perpendicular to `axis` at `depth`, as (particle, area): exact, from the
    /// bodies, not from pixels.
    ///
    /// A particle that is not convex may have several. A profile divided by the side of the box is one profile.
    /// Profiles are ordered by particle; the area of the period is the product of the two other sides. Cost: one test
    /// per particle, and one section of each that is cut.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// # use stereology_volume::{Axis, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(9.0, 5.0, 9.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// # let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[1.0, 0.0, 0.0]], [0.0; 3], None)?;
    /// // A sphere of diameter 6 about z = 9, cut 2 units from the centre of its image: π (3² − 2²).
    /// let profiles = solid.section_profiles(Axis::Z, 1.0);
    /// assert_eq!(profiles.len(), 1);
    /// assert!((profiles[0].1 - 5.0 * std::f64::consts::PI).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn section_profiles(&self, axis: Axis, depth: f64) -> Vec<(usize, f64)> {
        let side = self.period().sides()[axis.index()];
        let mut profiles = Vec::new();
        for (index, particle) in self.particles().iter().enumerate() {
            let body = &self.bodies()[particle.shape];
            let reach = body.bounding_radius() * particle.size;
            let normal = Unit::new_unchecked(particle.orientation.inverse_transform_vector(&axis.direction()));
            // The planes at depth + i side that can meet the particle.
            let above = depth - particle.position[axis.index()];
            let first = ((-reach - above) / side).ceil();
            let last = ((reach - above) / side).floor();
            let mut turn = first;
            while turn <= last {
                let areas = body.profile_areas(&normal, (above + turn * side) / particle.size);
                profiles.extend(
                    areas
                        .into_iter()
                        .map(|area| (index, area * particle.size * particle.size)),
                );
                turn += 1.0;
            }
        }
        profiles
    }
}
