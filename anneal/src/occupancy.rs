//! Who is near a point while particles come, go and move one at a time: the hierarchical grid of [`neighbours`](crate::neighbours), kept up to date.

use crate::neighbours::levels;
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// Bodies in cells, those of about the same reach on a level of their own.
pub(crate) struct Occupancy {
    sides: Vector3<f64>,
    levels: Vec<Level>,
    level_of: Vec<u8>,
    cell_of: Vec<u32>,
}

struct Level {
    longest_reach: f64,
    cells: [i64; 3],
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
        let mean_side = sides.product().cbrt();
        let levels = longest
            .into_iter()
            .zip(bodies)
            .map(|(longest_reach, bodies)| {
                let most = ((2 * bodies + 8) as f64).cbrt();
                let cells: [i64; 3] = std::array::from_fn(|axis| {
                    let fit = (sides[axis] / (2.0 * longest_reach).max(f64::MIN_POSITIVE))
                        .min(most * sides[axis] / mean_side);
                    (fit.floor() as i64).clamp(1, 1024)
                });
                Level {
                    longest_reach,
                    cells,
                    members: vec![Vec::new(); (cells[0] * cells[1] * cells[2]) as usize],
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

    /// Puts a body where it is; its centre is in the box.
    pub(crate) fn place(&mut self, body: usize, centre: &Vector3<f64>) {
        let level = &mut self.levels[self.level_of[body] as usize];
        let at: [i64; 3] = std::array::from_fn(|axis| {
            let cell = (centre[axis] * (level.cells[axis] as f64 / self.sides[axis])).floor() as i64;
            cell.clamp(0, level.cells[axis] - 1)
        });
        let cell = ((at[0] * level.cells[1] + at[1]) * level.cells[2] + at[2]) as u32;
        if self.cell_of[body] == cell {
            return;
        }
        if let Some(members) = level.members.get_mut(self.cell_of[body] as usize)
            && let Some(place) = members.iter().position(|&member| member as usize == body)
        {
            members.swap_remove(place);
        }
        level.members[cell as usize].push(body as u32);
        self.cell_of[body] = cell;
    }

    /// Visits every body (and every image of it, the asking body's own too) in the cells within `reach` of a point of the box, with the displacement of its image.
    ///
    /// Each image is met once, however few cells there are along an axis.
    pub(crate) fn visit<B>(
        &self,
        centre: &Vector3<f64>,
        reach: f64,
        mut visitor: impl FnMut(usize, &Vector3<f64>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        for level in &self.levels {
            let far = (reach + level.longest_reach) * (1.0 + 1e-9);
            let range = |axis: usize| {
                let scale = level.cells[axis] as f64 / self.sides[axis];
                ((centre[axis] - far) * scale).floor() as i64..=((centre[axis] + far) * scale).floor() as i64
            };
            let [nx, ny, nz] = level.cells;
            for kx in range(0) {
                let (cx, px) = (kx.rem_euclid(nx), kx.div_euclid(nx));
                for ky in range(1) {
                    let (cy, py) = (ky.rem_euclid(ny), ky.div_euclid(ny));
                    for kz in range(2) {
                        let (cz, pz) = (kz.rem_euclid(nz), kz.div_euclid(nz));
                        let shift = Vector3::new(px as f64, py as f64, pz as f64).component_mul(&self.sides);
                        for &body in &level.members[((cx * ny + cy) * nz + cz) as usize] {
                            visitor(body as usize, &shift)?;
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}
