//! Figures 7 and 8: known distributions of spheres, packed, cut by ten planes, and recovered from the profiles.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use image::RgbImage;
use image::imageops::replace;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use stereology::anneal::{
    Grain, PackOptions, Packing, SizeDensities, SizeInBin, grains_from_densities, pack, populate,
};
use stereology::kmatrix::Sizes;
use stereology::pipeline::{ParticleTypes, UnfoldingBins};
use stereology::render::{BlockOptions, render_block};
use stereology::shape::{Arrangement, PeriodicBox};
use stereology::unfold::{Bootstrap, Method, ProfileCounts, UnfoldOptions, Unfolding, equal_edges, unfold};
use stereology::volume::{Axis, Solid};

use super::bars::{BLUE, GREEN, GREY, Panel, RED, Series, draw as draw_bars, table};
use super::grain_size_tools::saltykov;
use super::sphere_samples::{AREA, FIGURE_7, PLANES, SIDE};

const BINS: usize = 10;

/// A packing, its true densities and the sizes of the profiles on its planes.
struct Experiment {
    name: &'static str,
    packing: Packing,
    actual: Vec<f64>,
    paper: Unfolding,
    auto: Unfolding,
    /// Fractions of the classes times the total of `auto`, as GrainSizeTools estimates no total.
    grain_size_tools: Vec<f64>,
}

fn experiment(index: usize) -> Result<Experiment> {
    let of = &FIGURE_7[index];
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    rng.set_stream(index as u64);
    let population = of.population();
    let count = population.number_density * SIDE.powi(3);
    let grains: Vec<Grain> = (0..count.round() as usize)
        .map(|_| Grain {
            shape: 0,
            size: population.draw(&mut rng),
            category: 0,
        })
        .collect();
    let types = ParticleTypes::parse(&["sphere"])?;
    let packing = packed(&types, &grains, 70 + index as u64)?;

    let solid = coloured(&packing)?;
    let offset: f64 = rng.random();
    let sizes: Vec<f64> = (0..PLANES)
        .flat_map(|plane| solid.section_profiles(Axis::Z, (plane as f64 + offset) * SIDE / PLANES as f64))
        .map(|(_, area)| (4.0 * area / PI).sqrt())
        .collect();
    let edges = equal_edges(1.0, BINS);
    let smallest = sizes.iter().copied().fold(1.0, f64::min);
    let estimate = |method: Method, spread: Sizes| -> Result<Unfolding> {
        let bins = UnfoldingBins::for_profiles(&edges, smallest, 0.0, 1.0, method, spread);
        let counts = ProfileCounts::from_sizes(&sizes, None, &bins.profile_edges, AREA)?;
        let kernel = types
            .kernel(&bins.profile_edges, &bins.size_edges, spread)?
            .reported_in(&edges)?;
        let options = UnfoldOptions::default()
            .with_method(method)
            .with_bootstrap(Bootstrap::default());
        Ok(unfold(&counts, &kernel, &options)?)
    };
    let mut actual = vec![0.0; BINS];
    for grain in &grains {
        actual[(edges.partition_point(|edge| *edge < grain.size) - 1).min(BINS - 1)] += SIDE.powi(-3);
    }
    let auto = estimate(Method::Auto, Sizes::Integrated)?;
    let shares = saltykov(&sizes, 1.0, BINS);
    Ok(Experiment {
        name: of.name,
        paper: estimate(Method::Paper, Sizes::UpperEdge)?,
        grain_size_tools: shares.iter().map(|share| share * auto.total.value).collect(),
        auto,
        packing,
        actual,
    })
}

fn packed(types: &ParticleTypes, grains: &[Grain], seed: u64) -> Result<Packing> {
    let period = PeriodicBox::new(Vector3::repeat(SIDE))?;
    Ok(pack(
        &Arrangement::new(types.unit_bodies(), populate(grains, &period, seed), period)?,
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?)
}

/// Every sphere in a grey of its own.
fn coloured(packing: &Packing) -> Result<Solid> {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let hues = [
        [0.75, 0.35, 0.25],
        [0.30, 0.45, 0.60],
        [0.85, 0.70, 0.40],
        [0.35, 0.50, 0.35],
        [0.55, 0.40, 0.55],
    ];
    let colours = packing
        .particles()
        .iter()
        .map(|_| hues[rng.random_range(0..hues.len())])
        .collect();
    Ok(Solid::new(
        packing.arrangement().clone(),
        colours,
        [0.78, 0.77, 0.74],
        None,
    )?)
}

fn values(unfolding: &Unfolding) -> Vec<f64> {
    unfolding.number_density.iter().map(|n| n.unwrap_or(0.0)).collect()
}

/// Ends of each bin's interval.
fn ends(unfolding: &Unfolding) -> Vec<(f64, f64)> {
    let intervals = unfolding.intervals.iter().flatten();
    intervals
        .map(|of| of.map_or((0.0, 0.0), |of| (of.lower, of.upper)))
        .collect()
}

pub fn draw(folder: &Path) -> Result<()> {
    let experiments = (0..FIGURE_7.len())
        .into_par_iter()
        .map(experiment)
        .collect::<Result<Vec<_>>>()?;
    type Bars = (String, Vec<f64>, Vec<f64>, Vec<(f64, f64)>);
    let bars: Vec<Bars> = experiments
        .iter()
        .map(|of| {
            (
                format!("{} ({} profiles)", of.name, of.auto.profiles),
                values(&of.paper),
                values(&of.auto),
                ends(&of.auto),
            )
        })
        .collect();
    let panels: Vec<Panel<'_>> = experiments
        .iter()
        .zip(&bars)
        .map(|(of, (title, paper, auto, ends))| Panel {
            title,
            across: "diameter over the largest",
            span: [0.0, 1.0],
            up: "particles per volume",
            series: vec![
                Series {
                    name: "actual",
                    values: &of.actual,
                    errors: None,
                    colour: BLUE,
                },
                Series {
                    name: "the paper's inverse",
                    values: paper,
                    errors: None,
                    colour: RED,
                },
                Series {
                    name: "GrainSizeTools (no total)",
                    values: &of.grain_size_tools,
                    errors: None,
                    colour: GREY,
                },
                Series {
                    name: "auto, 90 % intervals",
                    values: auto,
                    errors: Some(ends),
                    colour: GREEN,
                },
            ],
        })
        .collect();
    draw_bars(&folder.join("figure-07-density-recovery.svg"), &panels, 2)?;
    let rows: Vec<Vec<String>> = experiments
        .iter()
        .zip(&bars)
        .flat_map(|(of, (_, paper, auto, ends))| {
            (0..BINS).map(move |i| {
                let numbers = [
                    (i + 1) as f64 / BINS as f64,
                    of.actual[i],
                    paper[i],
                    of.grain_size_tools[i],
                    auto[i],
                    ends[i].0,
                    ends[i].1,
                ];
                std::iter::once(of.name.to_owned())
                    .chain(numbers.map(|n| format!("{n:.5}")))
                    .collect()
            })
        })
        .collect();
    table(
        &folder.join("figure-07-density-recovery.csv"),
        &[
            "distribution",
            "upper_edge",
            "actual",
            "paper",
            "grain_size_tools",
            "auto",
            "auto_lower",
            "auto_upper",
        ],
        &rows,
    )
}

/// Figure 8: part of the single-mode volume beside one packed from the recovered densities.
pub fn draw_volumes(folder: &Path) -> Result<()> {
    let of = experiment(0)?;
    let types = ParticleTypes::parse(&["sphere"])?;
    let edges = equal_edges(1.0, BINS);
    let number_density = values(&of.auto);
    let recovered = SizeDensities {
        shape: 0,
        category: 0,
        edges: &edges,
        number_density: &number_density,
    };
    let grains = grains_from_densities(&[recovered], SIDE.powi(3), SizeInBin::Spread, 9)?;
    let copy = packed(&types, &grains, 90)?;
    let part = |packing: &Packing| -> Result<RgbImage> {
        let solid = coloured(packing)?;
        Ok(render_block(
            &|p| solid.colour_at(p),
            Vector3::repeat(0.5 * SIDE),
            &BlockOptions::default(),
        )?)
    };
    let (original, copy) = (part(&of.packing)?, part(&copy)?);
    let mut both = RgbImage::new(original.width() + copy.width(), original.height());
    replace(&mut both, &original, 0, 0);
    replace(&mut both, &copy, i64::from(original.width()), 0);
    Ok(both.save(folder.join("figure-08-recovered-volume.png"))?)
}
