//! The sequential solver: voxel by voxel along a scan, each using the values written before it.

use std::ops::ControlFlow;

use crate::batch::{NEIGHBOURS, within};
use crate::field::{Field, VIEWS, sheet_of};
use crate::numbers::{number, single};
use crate::search::Query;
use crate::stage::{R, Stage, Tallies, Votes};

/// Voxels between two progress reports.
const STRIDE: usize = 1 << 14;

impl Stage<'_> {
    /// Runs one iteration and returns the mean energy of a neighbourhood when it was visited and the number of matches
    /// that changed. `go_on` receives the completed fraction and can cancel the iteration.
    ///
    /// # References
    ///
    /// urs-2012, sections 2.1 to 2.4.
    pub(crate) fn sweep(
        &self,
        field: &mut Field,
        tallies: &mut Tallies,
        order: &[u32],
        go_on: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> ControlFlow<(), (f64, usize)> {
        let views = field.matches.len();
        let exemplars = self.level.windows.len();
        let voxels = field.voxels() as f64;
        let [_, ny, nx] = field.size;
        let mut buffer = vec![0.0; self.window.len()];
        let mut weights = self.window.weights.clone();
        let mut bases = Vec::with_capacity(8);
        let mut value = vec![0.0; self.window.channels];
        let mut votes = Votes::default();
        let (mut energy, mut visited, mut changed) = (0.0, 0_usize, 0);
        let full = self.window.count();
        for (step, &voxel) in order.iter().enumerate() {
            if step % STRIDE == 0 {
                go_on(step as f64 / order.len() as f64)?;
            }
            let voxel = voxel as usize;
            if !field.holds(voxel) {
                continue;
            }
            let at = [voxel / (ny * nx), voxel / nx % ny, voxel % nx];
            votes.clear();
            for view in 0..views {
                let sheet = sheet_of(view, exemplars);
                let counted = self.look(field, view, at, &mut buffer, &mut weights);
                let query = Query {
                    window: &buffer,
                    weights: &weights,
                    scale: counted.map_or(1.0, |counted| full / counted.max(1.0)),
                    sheet,
                };
                let here = field.in_view(view, at);
                self.continued(field, view, at, &mut bases);
                let usage = &tallies.indices[view];
                // The price is proportional to the overuse.
                let price = |place: usize| match usage.of(number(place)) {
                    Some((count, target)) if self.recipe.index > 0.0 => {
                        self.recipe.index * self.spread * single((count / target - 1.0).clamp(0.0, 20.0))
                    }
                    _ => 0.0,
                };
                let (place, distance) = self.finder.nearest(&query, &bases, price);
                let old = std::mem::replace(&mut field.matches[view][here], number(place));
                if old as usize != place {
                    changed += 1;
                    tallies.indices[view].add(old, -1);
                    tallies.indices[view].add(number(place), 1);
                }
                field.gaps[view][here] = distance;
                energy += f64::from(distance.powf(R / 2.0));
                visited += 1;
                let weight = (distance + 1e-3 * self.spread).powf(R / 2.0 - 1.0);
                votes.push(number(place), weight * self.multiplier(tallies, voxels, number(place)));
            }
            let source = self.combine(&votes, &mut value);
            self.write(field, tallies, voxel, source, &value);
        }
        ControlFlow::Continue((energy / visited.max(1) as f64, changed))
    }

    /// The present match, and the continuations of the neighbours' matches.
    fn continued(&self, field: &Field, view: usize, at: [usize; 3], bases: &mut Vec<usize>) {
        let [_, rows, columns] = VIEWS[view];
        let sheet = sheet_of(view, self.level.windows.len());
        bases.clear();
        bases.push(field.matches[view][field.in_view(view, at)] as usize);
        for (dr, dc) in NEIGHBOURS {
            let row = within(at[rows], dr, field.size[rows], field.periodic);
            let column = within(at[columns], dc, field.size[columns], field.periodic);
            if let (Some(row), Some(column)) = (row, column) {
                let mut other = at;
                (other[rows], other[columns]) = (row, column);
                let shifted =
                    field.matches[view][field.in_view(view, other)] as isize - dr * self.level.width as isize - dc;
                let place = usize::try_from(shifted)
                    .ok()
                    .filter(|&place| self.level.fits(place, sheet));
                if let Some(place) = place.filter(|place| !bases.contains(place)) {
                    bases.push(place);
                }
            }
        }
    }

    /// Copies the window about a voxel; in a bounded solid it returns the number of its pixels that count.
    fn look(&self, field: &Field, view: usize, at: [usize; 3], into: &mut [f32], weights: &mut [f32]) -> Option<f32> {
        let window = self.window;
        let half = window.half as isize;
        let [_, rows, columns] = VIEWS[view];
        let bounded = !field.periodic || field.inside.is_some();
        for r in 0..window.side {
            let row = within(at[rows], r as isize - half, field.size[rows], field.periodic);
            for c in 0..window.side {
                let column = within(at[columns], c as isize - half, field.size[columns], field.periodic);
                let slot = r * window.row + c;
                let voxel = row.zip(column).map(|(row, column)| {
                    let mut other = at;
                    (other[rows], other[columns]) = (row, column);
                    field.index(other)
                });
                let voxel = voxel.filter(|&voxel| field.holds(voxel));
                for (channel, values) in field.values.iter().enumerate() {
                    into[channel * window.side * window.row + slot] = voxel.map_or(0.0, |voxel| values[voxel]);
                }
                if bounded {
                    weights[slot] = if voxel.is_some() { window.weights[slot] } else { 0.0 };
                }
            }
        }
        bounded.then(|| weights.iter().sum())
    }
}
