//! Figure 12: synthetic photographs of three materials, and objects carved from the solids made from them.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::RgbImage;
use image::imageops::crop_imm;
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::anneal::{Grain, PackOptions, lognormal_sizes, pack, populate, scale_to_fraction};
use stereology::pipeline::{Extent, ParticleTypes, SynthesisOptions, synthesize};
use stereology::render::{BlockOptions, Camera, RenderOptions};
use stereology::renderings::render_solid;
use stereology::sample;
use stereology::shape::{Arrangement, PeriodicBox, TriangleMesh};
use stereology::volume::{Axis, SlicePlane, Solid, turned};

use super::carvings;
use super::solids::{row, sample_types};
use crate::sample::photograph;

/// Side of each image in pixels.
const SIDE: u32 = 420;
/// Width and height of the synthetic photographs, and depth of the packing.
const PHOTO: u32 = 640;
const DEPTH: f64 = 160.0;

/// A material whose solid is known.
struct Material {
    shape: &'static str,
    fraction: f64,
    median_size: f64,
    sigma: f64,
    /// The colours; one is drawn for each particle.
    colours: &'static [[f32; 3]],
    binder: [f32; 3],
    void: bool,
}

/// Crushed stone in bitumen.
const ASPHALT: Material = Material {
    shape: "rock:11",
    fraction: 0.48,
    median_size: 26.0,
    sigma: 0.35,
    colours: &[
        [0.55, 0.54, 0.52],
        [0.68, 0.66, 0.62],
        [0.47, 0.45, 0.46],
        [0.60, 0.55, 0.49],
    ],
    binder: [0.13, 0.13, 0.14],
    void: false,
};

/// Bubbles, dark as they are deep.
const FOAM: Material = Material {
    shape: "sphere",
    fraction: 0.40,
    median_size: 30.0,
    sigma: 0.40,
    colours: &[[0.36, 0.27, 0.14], [0.42, 0.32, 0.17]],
    binder: [0.90, 0.80, 0.52],
    void: true,
};

/// A synthetic photograph, and the solid made from it.
pub struct Made {
    pub photo: RgbImage,
    pub solid: Solid,
}

pub fn terrazzo() -> Result<Made> {
    made(sample::photo()?, &sample_types()?, false)
}

pub fn asphalt() -> Result<Made> {
    ASPHALT.made()
}

pub fn foam() -> Result<Made> {
    FOAM.made()
}

fn made(photo: RgbImage, types: &ParticleTypes, void: bool) -> Result<Made> {
    let options = SynthesisOptions {
        voids: if void { vec![0] } else { Vec::new() },
        extent: Extent::Count(3000),
        ..SynthesisOptions::default()
    };
    let solid = synthesize(&photo, None, types, &options, &|_, _| ControlFlow::Continue(()))?.solid;
    Ok(Made { photo, solid })
}

/// Rows: the synthetic photograph, a block of the solid, a vase carved from it.
pub fn draw(folder: &Path) -> Result<()> {
    for (name, made) in [("terrazzo", terrazzo()?), ("asphalt", asphalt()?), ("foam", foam()?)] {
        let part = crop_imm(&made.photo, 100, 100, SIDE, SIDE).to_image();
        row(&[part, block(&made.solid)?, vase(&made.solid)?])
            .save(folder.join(format!("figure-12-{name}.png")))
            .context("figure 12 cannot be written")?;
    }
    Ok(())
}

impl Material {
    fn made(&self) -> Result<Made> {
        made(self.photograph()?, &ParticleTypes::parse(&[self.shape])?, self.void)
    }

    /// A synthetic photograph of a section through a packing of such particles.
    fn photograph(&self) -> Result<RgbImage> {
        let types = ParticleTypes::parse(&[self.shape])?;
        let bodies = types.unit_bodies();
        let side = f64::from(PHOTO);
        let period = PeriodicBox::new(Vector3::new(side, side, DEPTH))?;
        let mean_volume = bodies[0].volume() * self.median_size.powi(3) * (4.5 * self.sigma * self.sigma).exp();
        let count = self.fraction * period.volume() / mean_volume;
        let mut grains: Vec<Grain> = lognormal_sizes(count as usize, self.sigma, 12)?
            .into_iter()
            .map(|size| Grain {
                shape: 0,
                size,
                category: 0,
            })
            .collect();
        scale_to_fraction(&bodies, &mut grains, &period, self.fraction)?;
        let start = populate(&grains, &period, 12);
        let packing = pack(
            &Arrangement::new(bodies, start, period)?,
            &PackOptions::default(),
            &|_| ControlFlow::Continue(()),
        )?;
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let colours = packing.particles().iter().map(|_| {
            let light = 0.08 * (rng.random::<f32>() - 0.5);
            self.colours[rng.random_range(0..self.colours.len())].map(|c| c + light)
        });
        let colours = colours.collect();
        let solid = Solid::new(packing.arrangement().clone(), colours, self.binder, None)?;
        let plane = SlicePlane::across(Axis::Z, 0.5 * DEPTH);
        let ids = solid.slice_ids(&plane, PHOTO, PHOTO, 1.0)?;
        photograph(&solid.slice(&plane, PHOTO, PHOTO, 1.0)?, &ids)
    }
}

fn block(solid: &Solid) -> Result<RgbImage> {
    let block = TriangleMesh::cuboid([300.0; 3]).mapped(|p| p + Vector3::repeat(150.0));
    let BlockOptions {
        camera,
        render: picture,
    } = BlockOptions::default();
    let picture = picture.with_size(SIDE, SIDE);
    let place = |p: &Point3<f64>| *p;
    Ok(render_solid(solid, &block, &place, &camera, &picture, &|_| {
        ControlFlow::Continue(())
    })?)
}

fn vase(solid: &Solid) -> Result<RgbImage> {
    let camera = Camera {
        up: Vector3::z_axis(),
        elevation: 26.0,
        ..Camera::default()
    };
    let options = RenderOptions::default().with_size(SIDE, SIDE).with_samples(4);
    let mesh = carvings::vase(520.0);
    Ok(render_solid(solid, &mesh, &turned, &camera, &options, &|_| {
        ControlFlow::Continue(())
    })?)
}
