//! Bodies near a point while bodies are inserted and moved one at a time: the hierarchical grid of
//! [`neighbours`](crate::neighbours), updated after each move.

use crate::conversions::compact;
use crate::neighbours::levels;
use crate::periodic_cells::PeriodicCells;
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// Bodies in cells, with a level of cells for bodies of similar reach.
pub(crate) struct Occupancy {
    sides: Vector3<f64>,
    levels: Vec<Level>,
    level_of: Vec<u8>,
    cell_of: Vec<u32>,
}

struct Level {
    longest_reach: f64,
    cells: PeriodicCells,
    members: Vec<Vec<u32>>,
}

impl Occupancy {
    /// An empty grid for bodies of these reaches.
    pub(crate) fn new(reach: &[f64], sides: Vector3<f64>) -> Self {
        let level_of = levels(reach);
        let count = level_of.iter().copied().max().map_or(0, |level| level as usize + 1);
        let mut longest = vec![0.0_f64; count];
        let mut bodies = vec![0_usize; count];
        for (&level, &reach) in level_of.iter().zip(reach) {
            longest[level as usize] = longest[level as usize].max(reach);
            bodies[level as usize] += 1;
        }
        let levels = longest
            .into_iter()
            .zip(bodies)
            .map(|(longest_reach, bodies)| {
                let cells = PeriodicCells::new(sides, 2.0 * longest_reach, 2 * bodies + 8, 1024);
                Level {
                    longest_reach,
                    members: vec![Vec::new(); cells.len()],
                    cells,
                }
            })
            .collect();
        Self {
            sides,
            levels,
            cell_of: vec![u32::MAX; level_of.len()],
            level_of,
        }
    }

    /// Records the position of a body; `centre` is in the box.
    pub(crate) fn place(&mut self, body: usize, centre: &Vector3<f64>) {
        let level = &mut self.levels[self.level_of[body] as usize];
        let cell = compact(level.cells.of(centre));
        if self.cell_of[body] == cell {
            return;
        }
        if let Some(members) = level.members.get_mut(self.cell_of[body] as usize)
            && let Some(place) = members.iter().position(|&member| member as usize == body)
        {
            members.swap_remove(place);
        }
        level.members[cell as usize].push(compact(body));
        self.cell_of[body] = cell;
    }

    /// Visits every body in the cells within `reach` of a point of the box, with the displacement of its image.
    ///
    /// All images are visited, those of a body at the point itself included, and each once, however few cells an axis
    /// has.
    pub(crate) fn visit<B>(
        &self,
        centre: &Vector3<f64>,
        reach: f64,
        mut visitor: impl FnMut(usize, &Vector3<f64>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        for level in &self.levels {
            let far = (reach + level.longest_reach) * (1.0 + 1e-9);
            level.cells.visit(centre, far, |cell, period| {
                let shift = Vector3::from(period.map(|p| p as f64)).component_mul(&self.sides);
                for &body in &level.members[cell] {
                    visitor(body as usize, &shift)?;
                }
                ControlFlow::Continue(())
            })?;
        }
        ControlFlow::Continue(())
    }
}
