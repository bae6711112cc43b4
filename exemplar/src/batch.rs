//! All voxels at once: first every neighbourhood looks for its like in the exemplars, then every voxel is chosen from what the
//! neighbourhoods that cover it say.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::field::{Field, Plane, VIEWS, sheet_of};
use crate::level::{Atlas, Level, NONE};
use crate::recipe::{Combine, Recipe};
use crate::similar::Similar;
use crate::tallies::{Colours, Usage};
use crate::window::Window;

/// Parts a search or a round of votes is cut into; histograms are brought up to date after each.
const PARTS: usize = 16;
/// Side of the blocks in which votes are gathered.
const BLOCK: usize = 8;
/// Exponent of the energy: |difference|^r.
pub(crate) const R: f32 = 0.8;

/// What stays the same during the iterations at one level.
pub(crate) struct Batch<'a> {
    pub(crate) level: &'a Level,
    pub(crate) atlas: &'a Atlas,
    pub(crate) window: &'a Window,
    pub(crate) similar: &'a Similar,
    pub(crate) recipe: &'a Recipe,
    pub(crate) colours: usize,
    pub(crate) exhaustive: bool,
    /// Expected squared distance of two windows, half of it.
    pub(crate) spread: f32,
    pub(crate) seed: u64,
}

/// Histograms of the solid as it stands.
pub(crate) struct Tallies {
    positions: Usage,
    indices: Vec<Usage>,
    prices: Vec<Vec<f32>>,
    colours: Colours,
}

/// Votes for a voxel: places and their weights.
#[derive(Default)]
struct Votes {
    places: Vec<u32>,
    weights: Vec<f32>,
}

impl Batch<'_> {
    /// Counts the solid as it stands.
    pub(crate) fn tally(&self, field: &Field) -> Tallies {
        let views = field.matches.len();
        let exemplars = self.level.windows.len();
        let voxels = field.voxels() as f64;
        let mut uses = vec![0.0; exemplars];
        for view in 0..views {
            uses[sheet_of(view, exemplars)] += voxels / views as f64;
        }
        let mut positions = Usage::new(self.level, self.atlas, &self.level.places, &uses);
        let mut colours = Colours::new(self.level, self.colours);
        for (voxel, &source) in field.sources.iter().enumerate().filter(|(voxel, _)| field.holds(*voxel)) {
            positions.add(source, 1);
            for channel in 0..self.colours {
                colours.add(channel, field.values[channel][voxel], 1);
            }
        }
        let indices: Vec<Usage> = (0..views)
            .map(|view| {
                let sheet = sheet_of(view, exemplars);
                let mut members = vec![Vec::new(); exemplars];
                members[sheet].clone_from(&self.level.windows[sheet]);
                let mut usage = Usage::new(self.level, self.atlas, &members, &vec![voxels; exemplars]);
                for &place in &field.matches[view] {
                    usage.add(place, 1);
                }
                usage
            })
            .collect();
        let prices = indices.iter().map(|usage| vec![0.0; usage.targets.len()]).collect();
        Tallies {
            positions,
            indices,
            prices,
            colours,
        }
    }

    /// Every neighbourhood's like; the mean energy of a neighbourhood.
    pub(crate) fn search(&self, field: &mut Field, tallies: &mut Tallies, iteration: usize) -> f64 {
        let (mut energy, mut count) = (0.0, 0_usize);
        for view in 0..field.matches.len() {
            let [slices, rows, columns] = field.view_shape(view);
            let area = rows * columns;
            let parts = slices.min(PARTS);
            for part in 0..parts {
                let priced = self.priced(&tallies.indices[view], &tallies.prices[view]);
                let mine: Vec<usize> = (part..slices).step_by(parts).collect();
                let found: Vec<(Vec<u32>, Vec<f32>, f64, usize)> = mine
                    .par_iter()
                    .map(|&slice| self.search_slice(field, view, slice, iteration, &priced))
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
                if self.recipe.index > 0.0 {
                    let step = self.recipe.index * self.spread / (1.0 + self.recipe.settling * iteration as f32);
                    let usage = &tallies.indices[view];
                    for ((price, &count), &target) in
                        tallies.prices[view].iter_mut().zip(&usage.counts).zip(&usage.targets)
                    {
                        let excess = (count as f64 / target - 1.0).clamp(-1.0, 2.0);
                        *price += step * excess as f32;
                    }
                }
            }
        }
        energy / count.max(1) as f64
    }

    fn priced(&self, usage: &Usage, prices: &[f32]) -> Vec<f32> {
        if self.recipe.index == 0.0 {
            return Vec::new();
        }
        usage
            .bins()
            .iter()
            .map(|&bin| if bin == NONE { 0.0 } else { prices[bin as usize] })
            .collect()
    }

    fn search_slice(
        &self,
        field: &Field,
        view: usize,
        slice: usize,
        iteration: usize,
        prices: &[f32],
    ) -> (Vec<u32>, Vec<f32>, f64, usize) {
        let (level, window) = (self.level, self.window);
        let plane = Plane::cut(field, view, slice, window);
        let area = plane.rows * plane.columns;
        let sheet = sheet_of(view, level.windows.len());
        let windows = &level.windows[sheet];
        let mut matches = field.matches[view][slice * area..(slice + 1) * area].to_vec();
        let mut gaps = vec![0.0; area];
        let mut buffer = vec![0.0; window.len()];
        let mut weights = window.weights.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(((iteration * 3 + view) << 32 | slice) as u64);
        let price = |place: usize| if prices.is_empty() { 0.0 } else { prices[place] };
        let mut bases: Vec<usize> = Vec::with_capacity(8);
        let (mut energy, mut count) = (0.0, 0);
        let forward = iteration % 2 == 0;
        let full = window.count();
        let axes = VIEWS[view];
        for step in 0..area {
            let i = if forward { step } else { area - 1 - step };
            let (row, column) = (i / plane.columns, i % plane.columns);
            if field.inside.is_some() {
                let mut at = [0; 3];
                (at[axes[0]], at[axes[1]], at[axes[2]]) = (slice, row, column);
                if !field.holds(field.index(at)) {
                    continue;
                }
            }
            let counted = plane.window(window, row, column, &mut buffer, &mut weights);
            let scale = counted.map_or(1.0, |counted| full / counted.max(1.0));
            let own = matches[i] as usize;
            let mut best = (own, window.distance(level, own, &buffer, &weights, f32::INFINITY) * scale);
            let mut cost = best.1 + price(own);
            let mut consider = |place: usize, best: &mut (usize, f32)| {
                if place == best.0 {
                    return;
                }
                let extra = price(place);
                let bound = (cost - extra) / scale;
                if bound <= 0.0 {
                    return;
                }
                let distance = window.distance(level, place, &buffer, &weights, bound) * scale;
                if distance + extra < cost {
                    cost = distance + extra;
                    *best = (place, distance);
                }
            };
            if self.exhaustive {
                for &place in windows {
                    consider(place as usize, &mut best);
                }
            } else {
                bases.clear();
                bases.push(own);
                for (dr, dc) in [(0_isize, -1_isize), (-1, 0), (0, 1), (1, 0)] {
                    let (r, c) = (row as isize + dr, column as isize + dc);
                    let (rows, columns) = (plane.rows as isize, plane.columns as isize);
                    if !field.periodic && (r < 0 || c < 0 || r >= rows || c >= columns) {
                        continue;
                    }
                    let neighbour = (r.rem_euclid(rows) * columns + c.rem_euclid(columns)) as usize;
                    let place = matches[neighbour] as isize - dr * level.width as isize - dc;
                    if place >= 0 && level.fits(place as usize, sheet) && !bases.contains(&(place as usize)) {
                        bases.push(place as usize);
                    }
                }
                for &place in &bases {
                    consider(place, &mut best);
                }
                let root = best.0;
                {
                    for &place in self.similar.of(root) {
                        if place != NONE {
                            consider(place as usize, &mut best);
                        }
                    }
                }
                for _ in 0..self.recipe.random {
                    consider(windows[rng.random_range(0..windows.len())] as usize, &mut best);
                }
            }
            matches[i] = best.0 as u32;
            gaps[i] = best.1;
            energy += f64::from(best.1.powf(R / 2.0));
            count += 1;
        }
        (matches, gaps, energy, count)
    }

    /// Every voxel from the votes of the neighbourhoods within `radius` of it.
    pub(crate) fn vote(&self, field: &mut Field, tallies: &mut Tallies, radius: usize) {
        let [nz, ny, nx] = field.size;
        // Weight of a neighbourhood's vote, d^(r - 2), in the place of its squared distance.
        for gaps in &mut field.gaps {
            let mean = gaps.iter().map(|&g| f64::from(g)).sum::<f64>() / gaps.len() as f64;
            let floor = mean as f32 + 1e-9;
            gaps.par_iter_mut().for_each(|g| *g = (*g + floor).powf(R / 2.0 - 1.0));
        }
        let parts = nz.min(2 * PARTS);
        let voxels = field.voxels() as f64;
        for part in 0..parts {
            let multipliers = self.multipliers(tallies, voxels);
            let mine: Vec<usize> = (part..nz).step_by(parts).collect();
            let field_now = &*field;
            let chosen: Vec<(Vec<u32>, Vec<f32>)> = mine
                .par_iter()
                .map(|&z| self.vote_slice(field_now, &multipliers, z, radius))
                .collect();
            for (&z, (sources, values)) in mine.iter().zip(chosen) {
                self.write(field, tallies, z * ny * nx, &sources, &values);
            }
        }
        field.restore_fixed();
    }

    /// Sources and values of the voxels of one slice of constant z.
    fn vote_slice(&self, field: &Field, multipliers: &[f32], z: usize, radius: usize) -> (Vec<u32>, Vec<f32>) {
        let [_, ny, nx] = field.size;
        let channels = self.window.channels;
        let mut sources = vec![0; ny * nx];
        let mut values = vec![0.0; ny * nx * channels];
        let mut votes = Votes::default();
        // Blocks, because the slices of constant x lie far apart in memory.
        for y0 in (0..ny).step_by(BLOCK) {
            for x0 in (0..nx).step_by(BLOCK) {
                for y in y0..ny.min(y0 + BLOCK) {
                    for x in x0..nx.min(x0 + BLOCK) {
                        let voxel = field.index([z, y, x]);
                        let at = y * nx + x;
                        let value = &mut values[at * channels..(at + 1) * channels];
                        sources[at] = if field.holds(voxel) {
                            self.gather(field, multipliers, [z, y, x], radius, &mut votes);
                            self.combine(&votes, value)
                        } else {
                            for (value, values) in value.iter_mut().zip(&field.values) {
                                *value = values[voxel];
                            }
                            field.sources[voxel]
                        };
                    }
                }
            }
        }
        (sources, values)
    }

    /// Writes voxels from `first` on and keeps the tallies; given voxels stay.
    fn write(&self, field: &mut Field, tallies: &mut Tallies, first: usize, sources: &[u32], values: &[f32]) {
        let channels = field.values.len();
        for (i, (&source, value)) in sources.iter().zip(values.chunks_exact(channels)).enumerate() {
            let voxel = first + i;
            if !field.holds(voxel) || (!field.is_fixed.is_empty() && field.is_fixed[voxel]) {
                continue;
            }
            let old = std::mem::replace(&mut field.sources[voxel], source);
            if old != source {
                tallies.positions.add(old, -1);
                tallies.positions.add(source, 1);
            }
            for channel in 0..channels {
                let old = std::mem::replace(&mut field.values[channel][voxel], value[channel]);
                if channel < self.colours && old != value[channel] {
                    tallies.colours.add(channel, old, -1);
                    tallies.colours.add(channel, value[channel], 1);
                }
            }
        }
    }

    /// What the histograms make of a vote for each place.
    fn multipliers(&self, tallies: &Tallies, voxels: f64) -> Vec<f32> {
        let recipe = self.recipe;
        let mut made = if recipe.position > 0.0 {
            let strength = f64::from(recipe.position);
            let of = |count: f64, target: f64| (1.0 / (1.0 + strength * (count / target - 1.0).max(0.0))) as f32;
            tallies.positions.each(of, 1.0)
        } else {
            vec![1.0; self.level.pixel.len()]
        };
        if recipe.colour > 0.0 {
            let lack = tallies.colours.lack(voxels, self.recipe.colour);
            for &place in self.level.places.iter().flatten() {
                let place = place as usize;
                for channel in 0..self.colours {
                    let value = self.level.values[channel * self.level.stride + place];
                    made[place] *= lack[tallies.colours.bin(channel, value)];
                }
            }
        }
        made
    }

    /// The votes for one voxel: of every neighbourhood within `radius` the pixel that its match has there.
    fn gather(&self, field: &Field, multipliers: &[f32], at: [usize; 3], radius: usize, votes: &mut Votes) {
        votes.places.clear();
        votes.weights.clear();
        let reach = radius as isize;
        // With few voters the middle one counts most: the result stays sharp.
        let edge = if radius == 1 { self.recipe.edge } else { 1.0 };
        let falls = [1.0, edge, edge * edge];
        let mut vote = |matched: u32, weight: f32, dr: isize, dc: isize| {
            let place = (matched as isize - dr * self.level.width as isize - dc) as u32;
            let fall = if radius == 1 { falls[(dr * dr + dc * dc) as usize] } else { 1.0 };
            votes.places.push(place);
            votes.weights.push(fall * weight * multipliers[place as usize]);
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
                let Some(row) = within(row, dr, n_rows, field.periodic) else { continue };
                for dc in -reach..=reach {
                    let Some(column) = within(column, dc, n_columns, field.periodic) else { continue };
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

    /// One voxel's value from its votes; the place it shows, or is nearest to.
    fn combine(&self, votes: &Votes, made: &mut [f32]) -> u32 {
        let level = self.level;
        let plain = self.recipe.combine == Combine::Mean;
        let total: f32 = if plain { votes.places.len() as f32 } else { votes.weights.iter().sum() };
        for (channel, made) in made.iter_mut().enumerate() {
            let theirs = &level.values[channel * level.stride..(channel + 1) * level.stride];
            let mut sum = 0.0;
            for (&place, &weight) in votes.places.iter().zip(&votes.weights) {
                sum += if plain { 1.0 } else { weight } * theirs[place as usize];
            }
            *made = sum / total;
        }
        let mut best = (f32::INFINITY, 0.0, NONE);
        for (&place, &weight) in votes.places.iter().zip(&votes.weights) {
            let mut distance = 0.0;
            for (channel, mean) in made.iter().enumerate() {
                let d = mean - level.values[channel * level.stride + place as usize];
                distance += d * d;
            }
            if distance < best.0 || (distance == best.0 && weight > best.1) {
                best = (distance, weight, place);
            }
        }
        if self.recipe.combine == Combine::Discrete {
            for (channel, made) in made.iter_mut().enumerate() {
                *made = level.values[channel * level.stride + best.2 as usize];
            }
        }
        best.2
    }
}

/// `i + d` on an axis of `n` voxels.
#[inline]
fn within(i: usize, d: isize, n: usize, periodic: bool) -> Option<usize> {
    let j = i as isize + d;
    if j >= 0 && j < n as isize {
        Some(j as usize)
    } else if periodic {
        Some(j.rem_euclid(n as isize) as usize)
    } else {
        None
    }
}
