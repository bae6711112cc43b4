//! Figures 5 and 6: a block of the sample's solid in mean colours and with its residual.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::RgbImage;
use image::imageops::{crop_imm, replace};
use nalgebra::Vector3;
use stereology::pipeline::{ParticleTypes, Synthesis, SynthesisOptions, synthesize};
use stereology::render::{BlockOptions, RenderOptions, render_block};
use stereology::sample;
use stereology::shape::Body;
use stereology::volume::SlicePlane;

/// The particles of the built-in sample.
pub fn sample_types() -> Result<ParticleTypes> {
    let shapes = sample::truth()?.shapes;
    let bodies = shapes
        .iter()
        .map(|of| Ok((of.shape.clone(), Body::parse(&of.shape)?, of.share)))
        .collect::<Result<Vec<_>>>()?;
    Ok(ParticleTypes::new(bodies)?)
}

fn solid() -> Result<Synthesis> {
    Ok(synthesize(
        &sample::photo()?,
        None,
        &sample_types()?,
        &SynthesisOptions::default(),
        &|_, _| ControlFlow::Continue(()),
    )?)
}

/// Blocks: mean colours (a), with the residual (b).
pub fn draw_blocks(folder: &Path) -> Result<()> {
    let made = solid()?;
    let sides = Vector3::repeat(256.0);
    let block = |colour: &(dyn Fn(&nalgebra::Point3<f64>) -> [f32; 3] + Sync)| {
        render_block(colour, sides, &BlockOptions::default())
    };
    let plain = made.solid.without_residual();
    block(&|p| plain.colour_at(p))?.save(folder.join("figure-05a-mean-colours.png"))?;
    block(&|p| made.solid.colour_at(p))?.save(folder.join("figure-05b-with-residual.png"))?;
    Ok(())
}

/// The image of README: the sample, a section of its solid at the same scale, a block of it.
pub fn draw_readme(folder: &Path) -> Result<()> {
    let made = solid()?;
    let side = 420;
    let photo = crop_imm(&sample::photo()?, 200, 120, side, side).to_image();
    let plane = SlicePlane::oblique(Vector3::new(1.0, 2.0, 3.0), 90.0)?;
    let section = made.solid.slice(&plane, side, side, 1.0)?;
    let options = BlockOptions {
        render: RenderOptions::default().with_size(side, side),
        ..BlockOptions::default()
    };
    let block = render_block(&|p| made.solid.colour_at(p), Vector3::repeat(320.0), &options)?;
    row(&[photo, section, block])
        .save(folder.join("readme.png"))
        .context("README's picture cannot be written")
}

/// Images of one size side by side.
pub fn row(parts: &[RgbImage]) -> RgbImage {
    let (width, height) = parts.first().map_or((0, 0), RgbImage::dimensions);
    let count = parts.len() as u32;
    let mut row = RgbImage::from_pixel(count * width + (count - 1) * GAP, height, image::Rgb([255; 3]));
    for (place, part) in (0_i64..).zip(parts) {
        replace(&mut row, part, place * i64::from(width + GAP), 0);
    }
    row
}

const GAP: u32 = 8;

/// Figure 6: (a) part of the image, (b) its mean colours, (c) the residual, (d) a slice of its synthesis in 3D.
pub fn draw_residual(folder: &Path) -> Result<()> {
    let made = solid()?;
    let side = 320;
    let part = |picture: &RgbImage| crop_imm(picture, 120, 80, side, side).to_image();
    let binder = made.segmentation.binder.colour;
    let volume = &made.details.residual.binder;
    let (_, height, width, _) = volume.dim();
    let synthesised = RgbImage::from_fn(side, side, |x, y| {
        image::Rgb([0, 1, 2].map(|channel| {
            let detail = f64::from(volume[[0, y as usize % height, x as usize % width, channel]]);
            ((binder[channel] + detail) * 255.0).round().clamp(0.0, 255.0) as u8
        }))
    });
    let parts = [
        part(&sample::photo()?),
        part(&made.segmentation.means()),
        part(&made.segmentation.residual_image()),
        synthesised,
    ];
    row(&parts)
        .save(folder.join("figure-06-residual.png"))
        .context("figure 6 cannot be written")
}
