//! The batch solver: first the most similar window of the exemplars is found for every neighbourhood, then every voxel
//! is chosen from the votes of the neighbourhoods that contain it.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::field::{Field, Plane, VIEWS, sheet_of};
use crate::level::NONE;
use crate::numbers::{number, single};
use crate::search::Query;
use crate::stage::{R, Stage, Tallies, Votes};
use crate::tallies::Usage;

/// Number of parts of a search or a voting pass; the histograms are updated after each part.
const PARTS: usize = 16;
/// Side of the blocks in which votes are gathered.
const BLOCK: usize = 8;

/// Result of one slice: matches, squared distances, energy, number of neighbourhoods.
type Found = (Vec<u32>, Vec<f32>, f64, usize);

impl Stage<'_> {
    /// Finds the most similar window for every neighbourhood and returns the mean energy of a neighbourhood. `go_on`
    /// receives the completed fraction of the search and can cancel it.
    ///
    /// With an index histogram, the price of a window that is used too often rises after each part, and that of a
    /// window used too seldom falls. The prices are the dual variables of the assignment that uses all windows equally
    /// often, and their steps decrease from iteration to iteration.
    pub(crate) fn search(
        &self,
        field: &mut Field,
        tallies: &mut Tallies,
        iteration: usize,
        go_on: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> ControlFlow<(), f64> {
        let (mut energy, mut count) = (0.0, 0_usize);
        let views = field.matches.len();
        let step = self.recipe.index * self.spread / (1.0 + 0.5 * iteration as f32);
        for view in 0..views {
            let [slices, rows, columns] = field.view_shape(view);
            let area = rows * columns;
            let parts = slices.min(PARTS);
            for part in 0..parts {
                go_on((view as f64 + part as f64 / parts as f64) / views as f64)?;
                let prices = self.prices(&tallies.indices[view], &tallies.prices[view]);
                let mine: Vec<usize> = (part..slices).step_by(parts).collect();
                let found: Vec<Found> = mine
                    .par_iter()
                    .map(|&slice| self.search_slice(field, view, slice, iteration, &prices))
                    .collect();
                for (&slice, (matches, gaps, part_energy, n)) in mine.iter().zip(found) {
                    let range = slice * area..(slice + 1) * area;
                    let usage = &mut tallies.indices[view];
                    for (&old, &new) in field.matches[view][range.clone()].iter().zip(&matches) {
                        if old != new {
                            usage.add(old, -1);
                            usage.add(new, 1);
                        }
                    }
                    field.matches[view][range.clone()].copy_from_slice(&matches);
                    field.gaps[view][range].copy_from_slice(&gaps);
                    energy += part_energy;
                    count += n;
                }
                if step > 0.0 {
                    tallies.indices[view].charge(&mut tallies.prices[view], step);
                }
            }
        }
        ControlFlow::Continue(energy / count.max(1) as f64)
    }

    /// Price of each place; empty without an index histogram.
    fn prices(&self, usage: &Usage, prices: &[f32]) -> Vec<f32> {
        if self.recipe.index == 0.0 {
            return Vec::new();
        }
        let price = |&bin: &u32| if bin == NONE { 0.0 } else { prices[bin as usize] };
        usage.bins().iter().map(price).collect()
    }

    /// Searches one slice row by row, alternately forwards and backwards, so that each neighbourhood can continue the
    /// matches of those before it.
    fn search_slice(&self, field: &Field, view: usize, slice: usize, iteration: usize, prices: &[f32]) -> Found {
        let (level, window) = (self.level, self.window);
        let plane = Plane::cut(field, view, slice, window);
        let area = plane.rows * plane.columns;
        let sheet = sheet_of(view, level.windows.len());
        let mut matches = field.matches[view][slice * area..(slice + 1) * area].to_vec();
        let mut gaps = vec![0.0; area];
        let mut buffer = vec![0.0; window.len()];
        let mut weights = window.weights.clone();
        let mut bases: Vec<usize> = Vec::with_capacity(8);
        let (mut energy, mut count) = (0.0, 0);
        let full = window.count();
        let [slices, rows, columns] = VIEWS[view];
        for step in 0..area {
            let i = if iteration.is_multiple_of(2) {
                step
            } else {
                area - 1 - step
            };
            let (row, column) = (i / plane.columns, i % plane.columns);
            if field.inside.is_some() {
                let mut at = [0; 3];
                (at[slices], at[rows], at[columns]) = (slice, row, column);
                if !field.holds(field.index(at)) {
                    continue;
                }
            }
            let counted = plane.window(window, row, column, &mut buffer, &mut weights);
            let query = Query {
                window: &buffer,
                weights: &weights,
                scale: counted.map_or(1.0, |counted| full / counted.max(1.0)),
                sheet,
            };
            bases.clear();
            bases.push(matches[i] as usize);
            for (dr, dc) in NEIGHBOURS {
                let near_row = within(row, dr, plane.rows, field.periodic);
                let near_column = within(column, dc, plane.columns, field.periodic);
                if let (Some(r), Some(c)) = (near_row, near_column) {
                    let shifted = matches[r * plane.columns + c] as isize - dr * level.width as isize - dc;
                    let place = usize::try_from(shifted).ok();
                    if let Some(place) = place.filter(|place| level.fits(*place, sheet) && !bases.contains(place)) {
                        bases.push(place);
                    }
                }
            }
            let price = |place: usize| if prices.is_empty() { 0.0 } else { prices[place] };
            let (place, distance) = self.finder.nearest(&query, &bases, price);
            matches[i] = number(place);
            gaps[i] = distance;
            energy += f64::from(distance.powf(R / 2.0));
            count += 1;
        }
        (matches, gaps, energy, count)
    }

    /// Chooses every voxel from the votes of the neighbourhoods within `radius` of it.
    pub(crate) fn vote(&self, field: &mut Field, tallies: &mut Tallies, radius: usize) {
        self.weigh(field);
        let [nz, ny, nx] = field.size;
        let channels = self.window.channels;
        let parts = nz.min(2 * PARTS);
        let voxels = field.voxels() as f64;
        for part in 0..parts {
            let multipliers = self.multipliers(tallies, voxels);
            let mine: Vec<usize> = (part..nz).step_by(parts).collect();
            let seen = &*field;
            let chosen: Vec<(Vec<u32>, Vec<f32>)> = mine
                .par_iter()
                .map(|&z| self.vote_slice(seen, &multipliers, z, radius))
                .collect();
            for (&z, (sources, values)) in mine.iter().zip(chosen) {
                for (i, (&source, value)) in sources.iter().zip(values.chunks_exact(channels)).enumerate() {
                    if source != NONE {
                        self.write(field, tallies, z * ny * nx + i, source, value);
                    }
                }
            }
        }
    }

    /// Replaces squared distances by the weights of votes, d^(r - 2), with the mean distance added so that they stay
    /// finite.
    pub(crate) fn weigh(&self, field: &mut Field) {
        for gaps in &mut field.gaps {
            let mean = gaps.iter().map(|&g| f64::from(g)).sum::<f64>() / gaps.len() as f64;
            let floor = single(mean) + 1e-9;
            gaps.par_iter_mut().for_each(|g| *g = (*g + floor).powf(R / 2.0 - 1.0));
        }
    }

    /// Sources and values of the voxels of one slice of constant z; no source outside the mask.
    fn vote_slice(&self, field: &Field, multipliers: &[f32], z: usize, radius: usize) -> (Vec<u32>, Vec<f32>) {
        let [_, ny, nx] = field.size;
        let channels = self.window.channels;
        let mut sources = vec![NONE; ny * nx];
        let mut values = vec![0.0; ny * nx * channels];
        let mut votes = Votes::default();
        // In blocks, because slices of constant x are far apart in memory.
        for y0 in (0..ny).step_by(BLOCK) {
            for x0 in (0..nx).step_by(BLOCK) {
                for y in y0..ny.min(y0 + BLOCK) {
                    for x in x0..nx.min(x0 + BLOCK) {
                        if field.holds(field.index([z, y, x])) {
                            self.gather(field, multipliers, [z, y, x], radius, &mut votes);
                            let at = y * nx + x;
                            sources[at] = self.combine(&votes, &mut values[at * channels..(at + 1) * channels]);
                        }
                    }
                }
            }
        }
        (sources, values)
    }

    /// The votes for one voxel: for every neighbourhood within `radius`, the pixel of its match at the voxel's
    /// position.
    pub(crate) fn gather(&self, field: &Field, multipliers: &[f32], at: [usize; 3], radius: usize, votes: &mut Votes) {
        votes.clear();
        let reach = radius as isize;
        // With few votes the central one counts most, which keeps the result sharp.
        let edge = if radius == 1 { self.recipe.edge } else { 1.0 };
        let factors = [1.0, edge, edge * edge];
        let mut vote = |matched: u32, weight: f32, dr: isize, dc: isize| {
            let place = number((matched as isize - dr * self.level.width as isize - dc) as usize);
            let factor = if radius == 1 {
                factors[(dr * dr + dc * dc) as usize]
            } else {
                1.0
            };
            votes.push(place, factor * weight * multipliers[place as usize]);
        };
        for (view, (matches, weights)) in field.matches.iter().zip(&field.gaps).enumerate() {
            let [slices, rows, columns] = VIEWS[view];
            let (n_rows, n_columns) = (field.size[rows], field.size[columns]);
            let base = at[slices] * n_rows * n_columns;
            let (row, column) = (at[rows], at[columns]);
            let whole = |i: usize, n: usize| i >= radius && i + radius < n;
            if field.inside.is_none() && whole(row, n_rows) && whole(column, n_columns) {
                for dr in -reach..=reach {
                    let from = base + (row as isize + dr) as usize * n_columns + column - radius;
                    let line = from..from + 2 * radius + 1;
                    let both = matches[line.clone()].iter().zip(&weights[line]);
                    for (dc, (&matched, &weight)) in (-reach..).zip(both) {
                        vote(matched, weight, dr, dc);
                    }
                }
                continue;
            }
            for dr in -reach..=reach {
                let Some(row) = within(row, dr, n_rows, field.periodic) else {
                    continue;
                };
                for dc in -reach..=reach {
                    let Some(column) = within(column, dc, n_columns, field.periodic) else {
                        continue;
                    };
                    let mut other = at;
                    (other[rows], other[columns]) = (row, column);
                    if field.inside.is_none() || field.holds(field.index(other)) {
                        let from = base + row * n_columns + column;
                        vote(matches[from], weights[from], dr, dc);
                    }
                }
            }
        }
    }
}

/// Steps to the neighbours whose matches are continued: rows, columns.
pub(crate) const NEIGHBOURS: [(isize, isize); 4] = [(0, -1), (-1, 0), (0, 1), (1, 0)];

/// `i + d` on an axis of `n` voxels.
#[inline]
pub(crate) fn within(i: usize, d: isize, n: usize, periodic: bool) -> Option<usize> {
    let j = i as isize + d;
    if j >= 0 && j < n as isize {
        Some(j as usize)
    } else if periodic {
        Some(j.rem_euclid(n as isize) as usize)
    } else {
        None
    }
}
