//! Figure 10: a volume whose particles are all known, sliced in one part and carved in the other; and the same object
//! carved from the volume recovered from the slices.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::RgbImage;
use image::imageops::{blur, replace, resize};
use nalgebra::{Point3, Vector3};
use ndarray::{Array3, Array4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stereology::anneal::{Grain, PackOptions, Packing, lognormal_sizes, pack, populate, scale_to_fraction};
use stereology::pipeline::{
    ColourSample, DensityOptions, Extent, MeasuredProfiles, ParticleDensities, ParticleTypes, fine_details,
    measured_profiles, particle_colours, population, unfold_profiles,
};
use stereology::pyramid::{Exemplar, Mode, TextureOptions, synthesize_volume};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::segment::{SegmentOptions, Segmentation, segment};
use stereology::shape::{Arrangement, PeriodicBox};
use stereology::unfold::{Bootstrap, UnfoldOptions};
use stereology::volume::{Axis, Residual, SlicePlane, Solid};

use super::bars::table;
use super::carvings::knot;
use super::solids::row;

/// Side of the known volume.
const SIDE: f64 = 480.0;
/// Heights of the slices, farther apart than the largest particle; the part above is carved.
const SLICES: [f64; 6] = [10.0, 50.0, 90.0, 130.0, 170.0, 210.0];
/// Side of an image in pixels.
const PICTURE: u32 = 400;

const SHAPE: &str = "rock:5";
const MEDIAN_SIZE: f64 = 22.0;
const SIGMA: f64 = 0.22;
const FRACTION: f64 = 0.36;
const BINDER: [f32; 3] = [0.86, 0.84, 0.79];
const STONES: [[f32; 3]; 3] = [[0.30, 0.35, 0.42], [0.58, 0.33, 0.26], [0.34, 0.40, 0.28]];
/// Standard deviation of the grain in binder and stones.
const GRAIN: [f32; 2] = [0.035, 0.045];
const SEED: u64 = 10;

/// The known volume.
fn known(types: &ParticleTypes) -> Result<Solid> {
    let bodies = types.unit_bodies();
    let period = PeriodicBox::new(Vector3::repeat(SIDE))?;
    let mean_volume = bodies[0].volume() * MEDIAN_SIZE.powi(3) * (4.5 * SIGMA * SIGMA).exp();
    let count = (FRACTION * period.volume() / mean_volume) as usize;
    let mut grains: Vec<Grain> = lognormal_sizes(count, SIGMA, SEED)?
        .into_iter()
        .map(|size| Grain {
            shape: 0,
            size,
            category: 0,
        })
        .collect();
    scale_to_fraction(&bodies, &mut grains, &period, FRACTION)?;
    let packing = packed(types, &grains, &period)?;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let colours = packing.particles().iter().map(|_| {
        let light = 0.06 * (rng.random::<f32>() - 0.5);
        STONES[rng.random_range(0..STONES.len())].map(|c| c + light)
    });
    let colours = colours.collect();
    let mut grain = |strength: f32| {
        let mut values = Array4::zeros((96, 96, 96, 3));
        for mut voxel in values.rows_mut() {
            let light: f32 = StandardNormal.sample(&mut rng);
            voxel.fill(strength * light);
        }
        values
    };
    let residual = Residual {
        binder: grain(GRAIN[0]),
        particles: grain(GRAIN[1]),
        voxel: 2.5,
    };
    Ok(Solid::new(
        packing.arrangement().clone(),
        colours,
        BINDER,
        Some(residual),
    )?)
}

fn packed(types: &ParticleTypes, grains: &[Grain], period: &PeriodicBox) -> Result<Packing> {
    let start = populate(grains, period, SEED);
    Ok(pack(
        &Arrangement::new(types.unit_bodies(), start, *period)?,
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?)
}

/// Slices as synthetic photographs.
fn slices(solid: &Solid) -> Result<Vec<RgbImage>> {
    let side = SIDE as u32;
    SLICES
        .iter()
        .map(|&z| {
            let seen = solid.slice(&SlicePlane::across(Axis::Z, z), side, side, 1.0)?;
            Ok(blur(&seen, 0.6))
        })
        .collect()
}

/// The profiles of all slices, slice by slice.
fn pooled(found: &[Segmentation]) -> MeasuredProfiles {
    let mut all = MeasuredProfiles::default();
    for (slice, segmentation) in found.iter().enumerate() {
        let of = measured_profiles(segmentation, 1.0);
        all.slices.extend(std::iter::repeat_n(slice, of.sizes.len()));
        all.sizes.extend(of.sizes);
        all.weights.extend(of.weights);
        // Categories are numbered separately on each slice, so all particles are treated as one population here.
        all.categories.extend(std::iter::repeat_n(0, of.categories.len()));
        all.area += of.area;
        all.min_size = all.min_size.max(of.min_size);
    }
    all
}

/// The solid recovered from the slices.
fn copy(types: &ParticleTypes, found: &[Segmentation], densities: &ParticleDensities) -> Result<Solid> {
    let fraction = found.iter().map(|of| of.area_fraction).sum::<f64>() / found.len() as f64;
    let voxels = 128;
    let drawn = population(densities, types, fraction, Extent::Count(6000), f64::from(voxels), SEED)?;
    let packing = packed(types, &drawn.grains, &drawn.period)?;
    let profiles: Vec<ColourSample> = found
        .iter()
        .flat_map(|of| of.profiles.iter().map(|profile| ColourSample::of(profile, 1.0)))
        .map(|sample| ColourSample { category: 0, ..sample })
        .collect();
    let first = &found[0];
    let details = fine_details(
        first,
        &first.residual(),
        voxels as usize,
        1.0,
        &TextureOptions::default(),
        &|_| ControlFlow::Continue(()),
    )?;
    Ok(Solid::new(
        packing.arrangement().clone(),
        particle_colours(packing.particles(), &profiles, SEED),
        first.binder.colour.map(|c| c as f32),
        Some(details.residual),
    )?)
}

/// The knot in the part of the known volume that is not sliced.
fn carved(colour: &(dyn Fn(&Point3<f64>) -> [f32; 3] + Sync)) -> Result<RgbImage> {
    let sliced = SLICES[SLICES.len() - 1];
    let middle = Vector3::new(0.5 * SIDE, 0.5 * SIDE, 0.5 * (sliced + SIDE));
    let mesh = knot(64.0, 38.0).mapped(|p| p + middle);
    let camera = Camera {
        up: Vector3::y_axis(),
        azimuth: 24.0,
        elevation: 20.0,
        ..Camera::default()
    };
    let options = RenderOptions::default().with_size(PICTURE, PICTURE).with_samples(5);
    Ok(render_mesh(&mesh, colour, &camera, &options)?)
}

/// Four slices in two rows, at half their size.
fn sheet(slices: &[RgbImage]) -> RgbImage {
    let (half, gap) = ((PICTURE - 8) / 2, 8);
    let mut sheet = RgbImage::from_pixel(PICTURE, PICTURE, image::Rgb([255; 3]));
    for (i, slice) in (0_u32..4).zip(slices) {
        let small = resize(slice, half, half, image::imageops::FilterType::Triangle);
        let [x, y] = [i % 2, i / 2].map(|k| i64::from(k * (half + gap)));
        replace(&mut sheet, &small, x, y);
    }
    sheet
}

/// (a) slices, (b) the knot of the known volume, (c) of the recovered one, (d) in mean colours, (e) of the photograph
/// synthesised in 3D; and a table of densities.
pub fn draw(folder: &Path) -> Result<()> {
    let types = ParticleTypes::parse(&[SHAPE])?;
    let known = known(&types)?;
    let slices = slices(&known)?;
    let found: Vec<Segmentation> = slices
        .iter()
        .map(|slice| segment(slice, &SegmentOptions::default(), &|_| ControlFlow::Continue(())))
        .collect::<Result<_, _>>()?;
    let options = DensityOptions {
        unfold: UnfoldOptions::default().with_bootstrap(Bootstrap::default()),
        ..DensityOptions::default()
    };
    let densities = unfold_profiles(&pooled(&found), &types, &options, &|_| ControlFlow::Continue(()))?;
    write_densities(&known, &densities, &folder.join("figure-10-controlled.csv"))?;
    let copy = copy(&types, &found, &densities)?;
    let plain = copy.without_residual();
    let texture = heeger_bergen(&slices[0])?;
    row(&[
        sheet(&slices),
        carved(&|p| known.colour_at(p))?,
        carved(&|p| copy.colour_at(p))?,
        carved(&|p| plain.colour_at(p))?,
        carved(&|p| voxel(&texture, p))?,
    ])
    .save(folder.join("figure-10-controlled.png"))
    .context("figure 10 cannot be written")
}

fn write_densities(known: &Solid, densities: &ParticleDensities, path: &Path) -> Result<()> {
    let found = &densities.all;
    let rows: Vec<Vec<String>> = found
        .edges
        .windows(2)
        .enumerate()
        .map(|(bin, edges)| {
            let inside = |size: f64| size > edges[0] && size <= edges[1];
            let actual = known.particles().iter().filter(|of| inside(of.size)).count() as f64 / SIDE.powi(3);
            let interval = found.intervals.as_ref().and_then(|of| of[bin]);
            let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{:.4}", 1e6 * v));
            vec![
                format!("{:.3}", edges[1]),
                number(Some(actual)),
                number(found.number_density[bin]),
                number(interval.map(|of| of.lower)),
                number(interval.map(|of| of.upper)),
            ]
        })
        .collect();
    table(
        path,
        &["upper_edge", "actual_per_1e6", "recovered_per_1e6", "lower", "upper"],
        &rows,
    )
}

/// The Heeger-Bergen method of 1995 on an image of the slice.
fn heeger_bergen(slice: &RgbImage) -> Result<Array4<f32>> {
    let shape = (slice.height() as usize, slice.width() as usize, 3);
    let exemplar = Array3::from_shape_fn(shape, |(y, x, channel)| {
        f32::from(slice.get_pixel(x as u32, y as u32).0[channel]) / 255.0
    });
    let options = TextureOptions::default().with_mode(Mode::Volume);
    Ok(synthesize_volume(
        &Exemplar::new(exemplar.view()),
        [128; 3],
        &options,
        &|_| ControlFlow::Continue(()),
    )?)
}

fn voxel(texture: &Array4<f32>, p: &Point3<f64>) -> [f32; 3] {
    let (nz, ny, nx, _) = texture.dim();
    let index = |x: f64, n: usize| (x.max(0.0) as usize) % n;
    [0, 1, 2].map(|channel| texture[[index(p.z, nz), index(p.y, ny), index(p.x, nx), channel]].clamp(0.0, 1.0))
}
