//! Particles that are voids: the pores of a sponge, the bubbles of a foam.

use crate::cells::Cells;
use crate::solid_error::SolidError;
use crate::strip::Strip;
use nalgebra::Point3;
use stereology_shape::{Arrangement, Particle, UnitBody};

/// The shapes that are voids, and their positions.
#[derive(Debug)]
pub(crate) struct Voids {
    shapes: Vec<usize>,
    cells: Cells,
}

impl Voids {
    /// The particles of these shapes; `None` without shapes.
    pub(crate) fn new(arrangement: &Arrangement, shapes: &[usize]) -> Result<Option<Self>, SolidError> {
        let bodies = arrangement.bodies().len();
        if let Some(&shape) = shapes.iter().find(|&&shape| shape >= bodies) {
            return Err(SolidError::Void { shape, bodies });
        }
        if shapes.is_empty() {
            return Ok(None);
        }
        let mut shapes = shapes.to_vec();
        shapes.sort_unstable();
        shapes.dedup();
        let hollow: Vec<Particle> = arrangement
            .particles()
            .iter()
            .filter(|particle| shapes.contains(&particle.shape))
            .copied()
            .collect();
        let cells = Cells::new(arrangement.bodies(), &hollow, arrangement.period());
        Ok(Some(Self { shapes, cells }))
    }

    /// In ascending order.
    pub(crate) fn shapes(&self) -> &[usize] {
        &self.shapes
    }

    /// Whether a point of the box is in a void.
    pub(crate) fn contain(&self, bodies: &[UnitBody], p: &Point3<f64>) -> bool {
        self.cells.particle_at(bodies, p).is_some()
    }

    /// The voids met by some rows.
    pub(crate) fn strip<'a>(&'a self, bodies: &'a [UnitBody], z: f64, ys: [f64; 2]) -> Strip<'a> {
        self.cells.strip(bodies, z, ys)
    }

    /// Signed distance from a point of the box to the nearest surface of a void.
    pub(crate) fn distance(&self, bodies: &[UnitBody], p: &Point3<f64>) -> f64 {
        self.cells.distance(bodies, p)
    }
}
