//! One level of the synthesis: its constants, and the histograms that its iterations update.

use crate::field::{Field, sheet_of};
use crate::level::{Atlas, Level, NONE};
use crate::numbers::single;
use crate::options::Search;
use crate::recipe::{Combine, Recipe};
use crate::search::Finder;
use crate::tallies::{Colours, Usage};
use crate::window::Window;

/// Exponent of the energy: |difference|^r.
pub(crate) const R: f32 = 0.8;

/// The constants of a level.
pub(crate) struct Stage<'a> {
    pub(crate) level: &'a Level,
    pub(crate) atlas: &'a Atlas,
    pub(crate) window: &'a Window,
    pub(crate) finder: Finder<'a>,
    pub(crate) recipe: &'a Recipe,
    /// Channels that are not features.
    pub(crate) colours: usize,
    /// Sum over a window and its channels of the exemplars' variance.
    pub(crate) spread: f32,
}

/// Histograms of the present solid.
pub(crate) struct Tallies {
    /// Use of the exemplars' pixels by voxels.
    pub(crate) positions: Usage,
    /// Use of the exemplars' windows by the neighbourhoods of each view.
    pub(crate) indices: Vec<Usage>,
    /// Price of a window, by bin of its usage.
    pub(crate) prices: Vec<Vec<f32>>,
    pub(crate) colours: Colours,
}

/// Votes for a voxel: places and their weights.
#[derive(Default)]
pub(crate) struct Votes {
    pub(crate) places: Vec<u32>,
    pub(crate) weights: Vec<f32>,
}

impl Votes {
    pub(crate) fn clear(&mut self) {
        self.places.clear();
        self.weights.clear();
    }

    pub(crate) fn push(&mut self, place: u32, weight: f32) {
        self.places.push(place);
        self.weights.push(weight);
    }
}

impl<'a> Stage<'a> {
    pub(crate) fn new(
        level: &'a Level,
        atlas: &'a Atlas,
        window: &'a Window,
        recipe: &'a Recipe,
        search: Search,
        colours: usize,
    ) -> Self {
        Self {
            level,
            atlas,
            window,
            finder: Finder::new(search, level, atlas, window, recipe.similar),
            recipe,
            colours,
            spread: spread(level, window),
        }
    }

    /// The histograms of the present solid.
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
        for (voxel, &source) in field
            .sources
            .iter()
            .enumerate()
            .filter(|(voxel, _)| field.holds(*voxel))
        {
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
                field.each_held_in_view(view, |at| usage.add(field.matches[view][at], 1));
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

    /// Factors by which the histograms multiply a vote for each place.
    pub(crate) fn multipliers(&self, tallies: &Tallies, voxels: f64) -> Vec<f32> {
        let mut made = if self.recipe.position > 0.0 {
            tallies
                .positions
                .each(|count, target| self.overused(count, target), 1.0)
        } else {
            vec![1.0; self.level.pixel.len()]
        };
        if self.recipe.colour > 0.0 {
            let lack = tallies.colours.lack(voxels, self.recipe.colour);
            for &place in self.level.places.iter().flatten() {
                for channel in 0..self.colours {
                    made[place as usize] *= lack[tallies.colours.bin(channel, self.level.value(channel, place))];
                }
            }
        }
        made
    }

    /// The factor for one place.
    pub(crate) fn multiplier(&self, tallies: &Tallies, voxels: f64, place: u32) -> f32 {
        let mut made = 1.0;
        if let Some((count, target)) = tallies.positions.of(place).filter(|_| self.recipe.position > 0.0) {
            made = self.overused(count, target);
        }
        if self.recipe.colour > 0.0 {
            for channel in 0..self.colours {
                let bin = tallies.colours.bin(channel, self.level.value(channel, place));
                made *= tallies.colours.lack_of(bin, voxels, self.recipe.colour);
            }
        }
        made
    }

    fn overused(&self, count: f64, target: f64) -> f32 {
        single(1.0 / (1.0 + f64::from(self.recipe.position) * (count / target - 1.0).max(0.0)))
    }

    /// Computes one voxel's value from its votes and returns the place it is copied from, or nearest to.
    pub(crate) fn combine(&self, votes: &Votes, made: &mut [f32]) -> u32 {
        let level = self.level;
        let plain = self.recipe.combine == Combine::Mean;
        let total: f32 = if plain {
            votes.places.len() as f32
        } else {
            votes.weights.iter().sum()
        };
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
            if distance < best.0 || (distance <= best.0 && weight > best.1) {
                best = (distance, weight, place);
            }
        }
        if self.recipe.combine == Combine::Discrete {
            for (channel, made) in made.iter_mut().enumerate() {
                *made = level.value(channel, best.2);
            }
        }
        best.2
    }

    /// Writes a voxel and updates the histograms; fixed voxels are kept.
    pub(crate) fn write(&self, field: &mut Field, tallies: &mut Tallies, voxel: usize, source: u32, value: &[f32]) {
        if !field.is_fixed.is_empty() && field.is_fixed[voxel] {
            return;
        }
        let old = std::mem::replace(&mut field.sources[voxel], source);
        if old != source {
            tallies.positions.add(old, -1);
            tallies.positions.add(source, 1);
        }
        for (channel, &new) in value.iter().enumerate() {
            let old = std::mem::replace(&mut field.values[channel][voxel], new);
            if channel < self.colours {
                tallies.colours.add(channel, old, -1);
                tallies.colours.add(channel, new, 1);
            }
        }
    }
}

fn spread(level: &Level, window: &Window) -> f32 {
    let mut sum = 0.0;
    for channel in 0..window.channels {
        let values = || {
            let places = level.places.iter().flatten();
            places.map(|&place| f64::from(level.value(channel, place)))
        };
        let n = values().count() as f64;
        let mean = values().sum::<f64>() / n;
        sum += values().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    }
    single(sum) * window.count()
}
