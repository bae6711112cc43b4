//! From exemplars to a solid: levels from coarse to fine.

use std::ops::ControlFlow;

use ndarray::{Array3, Array4};

use crate::batch::Batch;
use crate::field::Field;
use crate::level::{Atlas, Level, smoothed};
use crate::recipe::{Combine, Recipe};
use crate::similar::Similar;
use crate::window::Window;
use crate::{Domain, Exemplar, Search, SolidError, SolidOptions};

/// What happened at one level.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LevelReport {
    /// Voxels along z, y, x.
    pub size: [usize; 3],
    /// Mean over the neighbourhoods of |difference to the exemplar's nearest|^0.8, after each iteration's search.
    pub energies: Vec<f64>,
}

/// A solid and how it was made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Solid {
    /// Values (z, y, x, channel); 0 outside the mask. Phases are their numbers.
    pub values: Array4<f32>,
    /// Which pixel each voxel shows or is nearest to: exemplars one after the other, row by row.
    pub sources: Array3<u32>,
    /// Levels, the coarsest first.
    pub levels: Vec<LevelReport>,
    /// Share of the exemplars' pixels that the solid shows.
    pub coverage: f64,
    /// exp(entropy) of the use of the exemplars' pixels, over their number: 1 if all are used alike.
    pub perplexity: f64,
    /// Voxels written, over all iterations and levels.
    pub voxel_iterations: u64,
}

/// A solid.
pub fn synthesize_solid(
    exemplars: &[Exemplar],
    domain: &Domain,
    options: &SolidOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Solid, SolidError> {
    let recipe = Recipe::new(options);
    let views = options.views.count();
    let atlas = Atlas::new(exemplars);
    let colours = exemplars[0].inner_colours();
    let window = Window::new(options.neighbourhood, exemplars[0].channels(), options.causal);
    let levels = options.levels.unwrap_or(3);
    let stacks: Vec<Vec<Vec<f32>>> = exemplars.iter().map(|exemplar| smoothed(exemplar, levels)).collect();
    let mut before: Option<(Field, Level)> = None;
    let mut reports = Vec::new();
    let mut voxel_iterations = 0;
    for number in (0..levels).rev() {
        let level = Level::new(exemplars, &stacks, &atlas, number, window.half, recipe.thinned);
        let t = std::time::Instant::now();
        let similar = Similar::learn(&level, &atlas, &window, recipe.similar);
        if std::env::var("VERB").is_ok() {
            eprintln!("level {number} learn {:?}", t.elapsed());
        }
        let mut field = field_at(domain, number, exemplars[0].channels());
        match &before {
            None => field.begin(&level, views, options.seed),
            Some((coarse, from)) => field.refine(coarse, from, &level, &atlas, recipe.combine != Combine::Discrete),
        }
        let batch = Batch {
            level: &level,
            atlas: &atlas,
            window: &window,
            similar: &similar,
            recipe: &recipe,
            colours,
            spread: spread(&level, &window),
            exhaustive: options.search == Search::Exact,
            seed: options.seed.wrapping_add(number as u64),
        };
        let mut tallies = batch.tally(&field);
        let mut energies = Vec::new();
        let iterations = options.iterations;
        for iteration in 0..iterations {
            let t = std::time::Instant::now();
            energies.push(batch.search(&mut field, &mut tallies, iteration));
            let t1 = t.elapsed();
            batch.vote(&mut field, &mut tallies, recipe.radius(iteration, iterations));
            if std::env::var("VERB").is_ok() && number == 0 {
                eprintln!("it {iteration} search {:?} vote {:?} e {}", t1, t.elapsed() - t1, energies[iteration]);
            }
            voxel_iterations += field.voxels() as u64;
            if progress(0.5).is_break() {
                return Err(SolidError::Cancelled);
            }
        }
        reports.push(LevelReport {
            size: field.size,
            energies,
        });
        before = Some((field, level));
    }
    let (field, level) = before.expect("at least one level");
    let [nz, ny, nx] = field.size;
    let values = Array4::from_shape_fn((nz, ny, nx, colours), |(z, y, x, c)| field.values[c][field.index([z, y, x])]);
    let sources = Array3::from_shape_fn((nz, ny, nx), |(z, y, x)| level.pixel[field.sources[field.index([z, y, x])] as usize]);
    let mut uses = vec![0_u32; atlas.pixels()];
    for &s in &sources {
        uses[s as usize] += 1;
    }
    let n = sources.len() as f64;
    let entropy: f64 = uses
        .iter()
        .filter(|u| **u > 0)
        .map(|&u| -(f64::from(u) / n) * (f64::from(u) / n).ln())
        .sum();
    Ok(Solid {
        values,
        sources,
        levels: reports,
        coverage: uses.iter().filter(|u| **u > 0).count() as f64 / uses.len() as f64,
        perplexity: entropy.exp() / uses.len() as f64,
        voxel_iterations,
    })
}

/// The solid at a level, before anything is in it.
fn field_at(domain: &Domain, level: usize, channels: usize) -> Field {
    let size = domain.size().map(|n| n.div_ceil(1 << level));
    let n: usize = size.iter().product();
    Field {
        size,
        periodic: domain.is_periodic(),
        values: vec![vec![0.0; n]; channels],
        sources: vec![0; n],
        matches: Vec::new(),
        gaps: Vec::new(),
        inside: None,
        fixed: Vec::new(),
        is_fixed: Vec::new(),
    }
}

/// Sum over a window and its channels of the exemplars' variance.
fn spread(level: &Level, window: &Window) -> f32 {
    let mut sum = 0.0;
    for channel in 0..window.channels {
        let values = || level.places.iter().flatten().map(|&p| f64::from(level.values[channel * level.stride + p as usize]));
        let n = values().count() as f64;
        let mean = values().sum::<f64>() / n;
        sum += values().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    }
    sum as f32 * window.count()
}
