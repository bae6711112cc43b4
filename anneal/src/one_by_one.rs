//! Moving particles one at a time: overlaps of one particle at its position.

use crate::assembly::Assembly;
use crate::conversions::floor;
use crate::occupancy::Occupancy;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, UnitBall};
use std::ops::ControlFlow;
use stereology_shape::PeriodicBox;

/// An assembly in which one particle is moved at a time.
pub(crate) struct OneByOne<'a, 'b> {
    pub(crate) assembly: &'a mut Assembly<'b>,
    occupancy: Occupancy,
    period: PeriodicBox,
    swelling: f64,
}

impl<'a, 'b> OneByOne<'a, 'b> {
    /// No particle is in the box yet.
    pub(crate) fn empty(assembly: &'a mut Assembly<'b>, period: &PeriodicBox, swelling: f64) -> Self {
        assembly.wrap(period);
        let reach: Vec<f64> = (0..assembly.len()).map(|i| assembly.reach(i) * swelling).collect();
        Self {
            occupancy: Occupancy::new(&reach, period.sides()),
            assembly,
            period: *period,
            swelling,
        }
    }

    /// All particles are in the box.
    pub(crate) fn full(assembly: &'a mut Assembly<'b>, period: &PeriodicBox, swelling: f64) -> Self {
        let mut all = Self::empty(assembly, period, swelling);
        (0..all.assembly.len()).for_each(|i| all.settle(i));
        all
    }

    /// Records the position of a particle in the grid.
    pub(crate) fn settle(&mut self, i: usize) {
        self.occupancy.place(i, &self.assembly.centre[i]);
    }

    /// Sets a pose, wrapped into the box; [`settle`](Self::settle) makes it final.
    pub(crate) fn try_pose(&mut self, i: usize, centre: Vector3<f64>, rotation: UnitQuaternion<f64>) {
        let centre = self.period.wrap(&Point3::from(centre)).coords;
        self.assembly.set_pose(i, (centre, rotation));
    }

    /// Energy of all overlaps of a particle with others in the box and with its own images; the latter count half,
    /// since each is found from both sides.
    pub(crate) fn energy(&self, i: usize) -> f64 {
        let mut energy = 0.0;
        let _ = self.each_overlap(i, |j, overlap| {
            energy += if i == j { 0.5 * overlap } else { overlap };
            ControlFlow::Continue(())
        });
        energy
    }

    /// Whether a particle overlaps no particle in the box.
    pub(crate) fn vacant(&self, i: usize) -> bool {
        self.each_overlap(i, |_, overlap| {
            if overlap > 0.0 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .is_continue()
    }

    /// Visits the energy of each pair of a particle with another one in the box, and with images of itself.
    pub(crate) fn each_overlap(
        &self,
        i: usize,
        mut visitor: impl FnMut(usize, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let assembly = &*self.assembly;
        let own = self.own_images(i, &mut visitor);
        own?;
        self.occupancy
            .visit(&assembly.centre[i], self.swelling * assembly.reach(i), |j, shift| {
                if i == j {
                    return ControlFlow::Continue(());
                }
                visitor(j, assembly.pair_energy(i, j, shift, self.swelling))
            })
    }

    /// The images of a particle move with it, so they follow its current position, not the position in the grid.
    fn own_images(&self, i: usize, visitor: &mut impl FnMut(usize, f64) -> ControlFlow<()>) -> ControlFlow<()> {
        let sides = self.period.sides();
        let longest = 2.0 * self.swelling * self.assembly.reach(i);
        if longest <= sides.min() {
            return ControlFlow::Continue(());
        }
        let most = sides.map(|side| floor(longest / side));
        for x in -most.x..=most.x {
            for y in -most.y..=most.y {
                for z in -most.z..=most.z {
                    if [x, y, z] != [0; 3] {
                        let shift = Vector3::new(x as f64, y as f64, z as f64).component_mul(&sides);
                        visitor(i, self.assembly.pair_energy(i, i, &shift, self.swelling))?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// A random point of the unit ball.
pub(crate) fn in_ball(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::from(UnitBall.sample(rng))
}

/// A random point of the box.
pub(crate) fn anywhere(rng: &mut impl Rng, period: &PeriodicBox) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random::<f64>()).component_mul(&period.sides())
}
