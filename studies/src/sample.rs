//! The built-in sample: a synthetic photograph of a section through a packing whose particles are all known.
//!
//! Dark chips, red chips and larger ochre pebbles in a pale binder: two shapes, three colour categories, a textured
//! binder, uneven light, blur, sensor noise.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::{Rgb, RgbImage};
use nalgebra::Vector3;
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;
use stereology::anneal::{Grain, PackOptions, pack, populate, scale_to_fraction, total_volume};
use stereology::pipeline::ParticleTypes;
use stereology::shape::{Arrangement, PeriodicBox, UnitBody};
use stereology::spectrum::{RealFft, frequency};
use stereology::volume::{Axis, SlicePlane, Solid};

/// Width and height of the image and depth of the box, in pixels.
const SIDES: [f64; 3] = [912.0, 672.0, 224.0];
const FRACTION: f64 = 0.32;
const SEED: u64 = 2004;
const BINDER: [f32; 3] = [0.80, 0.78, 0.73];

struct Category {
    name: &'static str,
    colour: [f32; 3],
    median_size: f64,
    sigma: f64,
    share: f64,
}

const CATEGORIES: [Category; 3] = [
    Category {
        name: "slate",
        colour: [0.24, 0.28, 0.33],
        median_size: 21.0,
        sigma: 0.28,
        share: 0.48,
    },
    Category {
        name: "brick",
        colour: [0.60, 0.27, 0.20],
        median_size: 21.0,
        sigma: 0.28,
        share: 0.37,
    },
    Category {
        name: "ochre",
        colour: [0.79, 0.56, 0.24],
        median_size: 39.0,
        sigma: 0.18,
        share: 0.15,
    },
];

/// Sizes are truncated here, so that the true distribution has a largest particle.
const SIZE_LIMITS: [f64; 2] = [9.0, 60.0];

/// Writes `sample.png` and `sample.json` to `folder`.
pub fn run(folder: &Path) -> Result<()> {
    let types = ParticleTypes::new(vec![
        ("rock:7".to_owned(), stereology::shape::Body::rock(7), 0.6),
        (
            "ellipsoid:1,0.85,0.7".to_owned(),
            stereology::shape::Body::ellipsoid([1.0, 0.85, 0.7])?,
            0.4,
        ),
    ])?;
    let bodies = types.unit_bodies();
    let period = PeriodicBox::new(Vector3::from(SIDES))?;
    let grains = grains(&bodies, &types, &period)?;
    let start = populate(&grains, &period, SEED);
    let packing = pack(
        &Arrangement::new(bodies, start, period)?,
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?;
    let mut rng = stream(1);
    let colours = packing.particles().iter().map(|particle| {
        let light = 0.035 * normal(&mut rng) as f32;
        CATEGORIES[usize::from(particle.category)]
            .colour
            .map(|c| (c + light + 0.02 * normal(&mut rng) as f32).clamp(0.02, 0.98))
    });
    let colours: Vec<[f32; 3]> = colours.collect();
    let solid = Solid::new(packing.arrangement().clone(), colours, BINDER, None)?;
    let plane = SlicePlane::across(Axis::Z, 0.5 * SIDES[2]);
    let (width, height) = (SIDES[0] as u32, SIDES[1] as u32);
    let ids = solid.slice_ids(&plane, width, height, 1.0)?;
    let photo = photograph(&solid.slice(&plane, width, height, 1.0)?, &ids)?;
    fs::create_dir_all(folder)?;
    photo
        .save(folder.join("sample.png"))
        .context("the sample cannot be written")?;
    let truth = truth(&solid, &types, &ids);
    fs::write(folder.join("sample.json"), format!("{truth:#}\n"))?;
    println!(
        "{} particles, {} profiles, area fraction {:.4}",
        solid.particles().len(),
        solid.section_profiles(Axis::Z, 0.5 * SIDES[2]).len(),
        covered(&ids)
    );
    Ok(())
}

fn stream(task: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(task);
    rng
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Lognormal sizes by category until the volume fraction is reached, each of a shape drawn by its fraction; then all
/// are scaled slightly to the exact volume fraction.
fn grains(bodies: &[UnitBody], types: &ParticleTypes, period: &PeriodicBox) -> Result<Vec<Grain>> {
    let mut rng = stream(2);
    let mut grains = Vec::new();
    let mut volume = 0.0;
    while volume < FRACTION * period.volume() {
        let mut draw: f64 = rng.random();
        let category = CATEGORIES.iter().position(|of| {
            draw -= of.share;
            draw < 0.0
        });
        let category = category.unwrap_or(CATEGORIES.len() - 1);
        let of = &CATEGORIES[category];
        let size = of.median_size * (of.sigma * normal(&mut rng)).exp();
        let shape = usize::from(rng.random::<f64>() >= types.types()[0].share);
        if !(SIZE_LIMITS[0]..=SIZE_LIMITS[1]).contains(&size) {
            continue;
        }
        let grain = Grain {
            shape,
            size,
            category: category as u8,
        };
        volume += total_volume(bodies, &[grain])?;
        grains.push(grain);
    }
    scale_to_fraction(bodies, &mut grains, period, FRACTION)?;
    Ok(grains)
}

/// Texture, uneven light, lens blur and sensor noise.
pub fn photograph(section: &RgbImage, ids: &Array2<u32>) -> Result<RgbImage> {
    let shape = [section.height() as usize, section.width() as usize];
    // Coarse and fine grain of the binder and of the stones, each with its own amplitude per channel.
    let fields = [(3, 1.1), (4, 5.0), (5, 1.6), (6, 7.0)].map(|(task, scale)| noise(shape, scale, task));
    let fields: Vec<Array2<f64>> = fields.into_iter().collect::<Result<_>>()?;
    let tint = [1.0, 0.95, 0.85];
    let channels = (0..3).map(|channel| {
        let textured = Array2::from_shape_fn((shape[0], shape[1]), |(y, x)| {
            let mean = f64::from(section.get_pixel(x as u32, y as u32).0[channel]) / 255.0;
            let [coarse, fine] = if ids[[y, x]] == 0 {
                [0.012 * fields[1][[y, x]], 0.020 * fields[0][[y, x]]]
            } else {
                [0.022 * fields[3][[y, x]], 0.024 * fields[2][[y, x]]]
            };
            let along = (x as f64 / shape[1] as f64 - 0.5) + 0.6 * (y as f64 / shape[0] as f64 - 0.5);
            (mean + tint[channel] * (coarse + fine)) * (1.0 + 0.04 * along)
        });
        smoothed(&textured, 0.7)
    });
    let channels: Vec<Array2<f64>> = channels.collect::<Result<_>>()?;
    let mut rng = stream(7);
    let mut picture = RgbImage::new(shape[1] as u32, shape[0] as u32);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let value = |channel: usize| channels[channel][[y as usize, x as usize]];
        let noisy = [value(0), value(1), value(2)].map(|v| v + 1.2 / 255.0 * normal(&mut rng));
        *pixel = Rgb(noisy.map(|v| (v * 255.0).round().clamp(0.0, 255.0) as u8));
    }
    Ok(picture)
}

/// Periodic Gaussian noise of standard deviation 1, smooth over `scale` pixels.
fn noise([height, width]: [usize; 2], scale: f64, task: u64) -> Result<Array2<f64>> {
    let mut rng = stream(task);
    let white = Array2::from_shape_simple_fn((height, width), || normal(&mut rng));
    let field = smoothed(&white, scale)?;
    let deviation = field.std(0.0);
    Ok(field / deviation)
}

/// A field convolved with a Gaussian of standard deviation `sigma` pixels.
fn smoothed(field: &Array2<f64>, sigma: f64) -> Result<Array2<f64>> {
    let (height, width) = field.dim();
    let fft = RealFft::new(&[height, width])?;
    let mut spectrum = fft.forward(field.view())?;
    for ((v, u), value) in spectrum.indexed_iter_mut() {
        let squared = frequency(v, height).powi(2) + frequency(u, width).powi(2);
        *value *= (-2.0 * (std::f64::consts::PI * sigma).powi(2) * squared).exp();
    }
    Ok(fft.inverse(spectrum)?)
}

fn covered(ids: &Array2<u32>) -> f64 {
    ids.iter().filter(|&&id| id > 0).count() as f64 / ids.len() as f64
}

fn truth(solid: &Solid, types: &ParticleTypes, ids: &Array2<u32>) -> serde_json::Value {
    let volume = solid.period().volume();
    let edges: Vec<f64> = (0..=10).map(|i| SIZE_LIMITS[1] * f64::from(i) / 10.0).collect();
    let density = |category: Option<u8>| -> Vec<f64> {
        let sizes = solid
            .particles()
            .iter()
            .filter(|particle| category.is_none_or(|c| particle.category == c));
        let mut counts = vec![0.0; edges.len() - 1];
        for particle in sizes {
            let bin = edges.partition_point(|edge| *edge < particle.size) - 1;
            counts[bin.min(edges.len() - 2)] += 1.0 / volume;
        }
        counts
    };
    let categories: Vec<_> = (0..)
        .zip(&CATEGORIES)
        .map(|(index, of)| json!({ "name": of.name, "colour": of.colour, "number_density": density(Some(index)) }))
        .collect();
    let profiles: Vec<f64> = solid
        .section_profiles(Axis::Z, 0.5 * SIDES[2])
        .into_iter()
        .map(|(_, area)| (4.0 * area / std::f64::consts::PI).sqrt())
        .collect();
    json!({
        "schema": "stereology.sample/1",
        "seed": SEED,
        "box": SIDES,
        "shapes": types.types().iter().map(|of| json!({ "shape": of.name, "share": of.share })).collect::<Vec<_>>(),
        "particles": solid.particles().len(),
        "total_number_density": solid.particles().len() as f64 / volume,
        "mean_size": solid.particles().iter().map(|particle| particle.size).sum::<f64>() / solid.particles().len() as f64,
        "volume_fraction": FRACTION,
        "area_fraction": covered(ids),
        "edges": edges,
        "number_density": density(None),
        "categories": categories,
        "binder": BINDER,
        "profiles": profiles.len(),
        "profile_sizes": profiles,
    })
}
