//! Particles that are voids: the pores of a sponge, the bubbles of a foam.

use crate::cells::Cells;
use crate::strip::Strip;
use crate::{Solid, SolidError};
use nalgebra::Point3;
use std::sync::Arc;
use stereology_shape::Particle;

/// Which shapes are voids, and where they are.
#[derive(Debug)]
pub(crate) struct Voids {
    shapes: Vec<usize>,
    cells: Cells,
}

impl Solid {
    /// The same solid whose particles of these shapes (indices of [`Self::bodies`]) are voids.
    ///
    /// They keep the colour that their profiles have on a photograph, which slices and voxels show; their alpha is 0, and pictures and carved meshes show holes.
    ///
    /// # Errors
    ///
    /// [`SolidError::Void`] if there is no such shape.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// # use stereology_volume::Solid;
    /// # let bubble = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 4.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// let foam = Solid::new(Arrangement::new(vec![bubble], vec![particle], period)?, vec![[0.2; 3]], [0.8; 3], None)?.with_voids(&[0])?;
    /// assert!(foam.is_void_at(&Point3::new(9.0, 0.0, 0.0)));
    /// assert_eq!(foam.void_distance_at(&Point3::new(0.0, 5.0, 0.0)), 3.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_voids(mut self, shapes: &[usize]) -> Result<Self, SolidError> {
        let bodies = self.bodies().len();
        if let Some(&shape) = shapes.iter().find(|&&shape| shape >= bodies) {
            return Err(SolidError::Void { shape, bodies });
        }
        if shapes.is_empty() {
            self.voids = None;
            return Ok(self);
        }
        let mut shapes = shapes.to_vec();
        shapes.sort_unstable();
        shapes.dedup();
        let hollow: Vec<Particle> = self
            .particles()
            .iter()
            .filter(|particle| shapes.contains(&particle.shape))
            .copied()
            .collect();
        let cells = Cells::new(self.bodies(), &hollow, self.period());
        self.voids = Some(Arc::new(Voids { shapes, cells }));
        Ok(self)
    }

    /// The shapes that are voids, in ascending order.
    #[must_use]
    pub fn voids(&self) -> &[usize] {
        self.voids.as_ref().map_or(&[], |voids| &voids.shapes)
    }

    /// Whether a point is in a void: its alpha is 0.
    #[must_use]
    pub fn is_void_at(&self, p: &Point3<f64>) -> bool {
        let p = self.period().wrap(p);
        self.voids
            .as_ref()
            .is_some_and(|voids| voids.cells.particle_at(self.bodies(), &p).is_some())
    }

    /// The voids that some rows meet, none of a solid without.
    pub(crate) fn strip_of_voids(&self, z: f64, ys: [f64; 2]) -> Option<Strip<'_>> {
        self.voids.as_ref().map(|voids| voids.cells.strip(self.bodies(), z, ys))
    }

    /// Distance to the nearest surface of a void, negative in one; infinite without voids.
    #[must_use]
    pub fn void_distance_at(&self, p: &Point3<f64>) -> f64 {
        let p = self.period().wrap(p);
        self.voids
            .as_ref()
            .map_or(f64::INFINITY, |voids| voids.cells.distance(self.bodies(), &p))
    }
}
