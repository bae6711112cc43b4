//! Figures 7 and 8: known distributions of spheres, packed, cut by ten planes, and recovered from what the planes show.

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
use stereology::pipeline::ParticleTypes;
use stereology::render::{BlockOptions, render_block};
use stereology::shape::{PeriodicBox, UnitBody};
use stereology::unfold::{Method, ProfileCounts, UnfoldOptions, Unfolding, equal_edges, unfold};
use stereology::volume::{Axis, Solid};

use super::bars::{BLUE, GREEN, Panel, RED, Series, draw as draw_bars, table};

const BINS: usize = 10;
/// Side of the box in largest diameters; planes are farther apart than any sphere is wide.
const SIDE: f64 = 12.0;
const PLANES: usize = 10;

struct Distribution {
    name: &'static str,
    /// Density of diameters on (0, 1], not scaled.
    density: fn(f64) -> f64,
    /// Profiles to be expected.
    profiles: f64,
}

const DISTRIBUTIONS: [Distribution; 4] = [
    Distribution {
        name: "single mode",
        density: |d| gauss(d, 0.55, 0.15),
        profiles: 1200.0,
    },
    Distribution {
        name: "bimodal",
        density: |d| gauss(d, 0.30, 0.08) + gauss(d, 0.75, 0.08),
        profiles: 1250.0,
    },
    Distribution {
        name: "lognormal",
        density: |d| gauss(d.ln(), 0.30_f64.ln(), 0.45) / d,
        profiles: 1150.0,
    },
    Distribution {
        name: "constant",
        density: |_| 1.0,
        profiles: 1300.0,
    },
];

fn gauss(x: f64, mean: f64, deviation: f64) -> f64 {
    (-0.5 * ((x - mean) / deviation).powi(2)).exp()
}

/// A packing, its true densities and the sizes of the profiles on its planes.
struct Experiment {
    name: &'static str,
    packing: Packing,
    actual: Vec<f64>,
    paper: Unfolding,
    em: Unfolding,
}

fn experiment(index: usize) -> Result<Experiment> {
    let of = &DISTRIBUTIONS[index];
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    rng.set_stream(index as u64);
    // Inverse of the cumulative distribution on a fine grid.
    let steps = 20_000;
    let at = |i: usize| (i as f64 + 0.5) / steps as f64;
    let whole: f64 = (0..steps).map(|i| (of.density)(at(i))).sum();
    let mean: f64 = (0..steps).map(|i| at(i) * (of.density)(at(i))).sum::<f64>() / whole;
    let cumulative: Vec<f64> = (0..steps)
        .scan(0.0, |sum, i| {
            *sum += (of.density)(at(i)) / whole;
            Some(*sum)
        })
        .collect();
    // N_A = N_V × mean diameter, eq. (1).
    let count = of.profiles / (PLANES as f64 * SIDE * SIDE * mean) * SIDE.powi(3);
    let draw = |place: f64| (cumulative.partition_point(|c| *c < place).min(steps - 1) + 1) as f64 / steps as f64;
    let grains: Vec<Grain> = (0..count.round() as usize)
        .map(|_| Grain {
            shape: 0,
            size: draw(rng.random()),
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
    let area = PLANES as f64 * SIDE * SIDE;
    let counts = ProfileCounts::from_sizes(&sizes, None, &edges, area)?;
    let estimate = |method: Method, spread: Sizes| -> Result<Unfolding> {
        let kernel = types.kernel(&edges, &edges, spread)?;
        Ok(unfold(&counts, &kernel, &UnfoldOptions::default().with_method(method))?)
    };
    let mut actual = vec![0.0; BINS];
    for grain in &grains {
        actual[(edges.partition_point(|edge| *edge < grain.size) - 1).min(BINS - 1)] += SIDE.powi(-3);
    }
    Ok(Experiment {
        name: of.name,
        paper: estimate(Method::Paper, Sizes::UpperEdge)?,
        em: estimate(Method::Em, Sizes::Integrated)?,
        packing,
        actual,
    })
}

fn packed(types: &ParticleTypes, grains: &[Grain], seed: u64) -> Result<Packing> {
    let bodies: Vec<UnitBody> = types.unit_bodies();
    let period = PeriodicBox::new(Vector3::repeat(SIDE))?;
    Ok(pack(
        &bodies,
        populate(grains, &period, seed),
        &period,
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?)
}

/// Every sphere in its own colour, in grey.
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
        packing.bodies().to_vec(),
        packing.particles().to_vec(),
        colours,
        *packing.period(),
        [0.78, 0.77, 0.74],
        None,
    )?)
}

fn values(unfolding: &Unfolding) -> Vec<f64> {
    unfolding.number_density.iter().map(|n| n.unwrap_or(0.0)).collect()
}

pub fn draw(folder: &Path) -> Result<()> {
    let experiments = (0..DISTRIBUTIONS.len())
        .into_par_iter()
        .map(experiment)
        .collect::<Result<Vec<_>>>()?;
    let bars: Vec<(String, Vec<f64>, Vec<f64>)> = experiments
        .iter()
        .map(|of| {
            (
                format!("{} ({} profiles)", of.name, of.em.profiles),
                values(&of.paper),
                values(&of.em),
            )
        })
        .collect();
    let panels: Vec<Panel<'_>> = experiments
        .iter()
        .zip(&bars)
        .map(|(of, (title, paper, em))| Panel {
            title,
            across: "diameter over the largest",
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
                    name: "expectation maximisation",
                    values: em,
                    errors: None,
                    colour: GREEN,
                },
            ],
        })
        .collect();
    draw_bars(&folder.join("figure-07-density-recovery.svg"), &panels, 2)?;
    let rows: Vec<Vec<String>> = experiments
        .iter()
        .zip(&bars)
        .flat_map(|(of, (_, paper, em))| {
            (0..BINS).map(move |i| {
                let numbers = [(i + 1) as f64 / BINS as f64, of.actual[i], paper[i], em[i]];
                std::iter::once(of.name.to_owned())
                    .chain(numbers.map(|n| format!("{n:.5}")))
                    .collect()
            })
        })
        .collect();
    table(
        &folder.join("figure-07-density-recovery.csv"),
        &["distribution", "upper_edge", "actual", "paper", "em"],
        &rows,
    )
}

/// Figure 8: part of the single-mode volume beside one packed from the recovered densities.
pub fn draw_volumes(folder: &Path) -> Result<()> {
    let of = experiment(0)?;
    let types = ParticleTypes::parse(&["sphere"])?;
    let edges = equal_edges(1.0, BINS);
    let number_density = values(&of.em);
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
