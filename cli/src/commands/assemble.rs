//! `stereology assemble`: a solid from a packing, colours and a texture.

use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::{colour_table, solid, texture_source};
use stereology::grid::LengthUnit;
use stereology::pipeline::particle_colours;
use stereology::volume::Solid;

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_json};
use crate::progress::go_on;
use crate::values::BinderArgument;
use stereology_report::{counted, significant};

/// Assembles a solid from a packing, colours and a texture
///
/// PACKING is a packing.json of `stereology pack` or `synthesize`. The solid has the same particles with the same
/// numbers; `slice`, `render`, `export` and `carve` open DIR.
///
/// Without --colours each category has a colour of its own. Without --texture colours are uniform. A texture is either
/// the texture.npy of a solid, or a volume of `stereology texture`, whose differences from its mean colour are added to
/// particles and binder. Its voxels have the side --scale, adjusted so that the texture repeats with the box; those of
/// the texture.npy of a solid keep their side.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology pack --densities densities.csv --box 40 -o packing.json\n         stereology assemble packing.json --colours seg/profiles.csv --binder 200,195,180 -o solid"
)]
pub struct Assemble {
    /// Packing of `stereology pack` or `synthesize`
    #[arg(value_name = "PACKING.json")]
    pub packing: PathBuf,
    /// Texture of particles and binder: texture.npy of a solid, or a volume (.npy, .nrrd, .tif)
    #[arg(long, value_name = "FILE")]
    pub texture: Option<PathBuf>,
    /// Colour of the binder, 0 to 255
    #[arg(long, value_name = "R,G,B")]
    pub binder: Option<BinderArgument>,
    /// Table of colours (CSV): r, g, b from 0 to 255, category, size; a profiles.csv of `stereology segment`, from
    /// which each particle gets the colour of a profile of its category and of similar size, or one row per category
    #[arg(long, value_name = "CSV")]
    pub colours: Option<PathBuf>,
    /// Index, from 0, of a shape whose particles are voids; may be repeated
    #[arg(long = "void", value_name = "K")]
    pub voids: Vec<usize>,
    /// Folder for the solid
    #[arg(short, long, value_name = "DIR")]
    pub output: Output,
}

/// JSON of `stereology assemble`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AssembleFields {
    /// Number of particles.
    particles: usize,
    /// Sides of the periodic box.
    #[serde(rename = "box")]
    sides: [f64; 3],
    /// Unit of all lengths; null if it is not known.
    unit: Option<&'static str>,
    /// Fraction of the volume inside particles, if they do not overlap.
    fraction: f64,
    /// Side of a voxel of the texture; null without a texture.
    texture_voxel: Option<f64>,
}

impl Fields for AssembleFields {
    const COMMAND: &'static str = "assemble";
}

impl Assemble {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let binder = match self.binder {
            None => solid::PLAIN_BINDER,
            Some(BinderArgument::Colour(rgb)) => rgb.map(|channel| f32::from(channel) / 255.0),
            Some(BinderArgument::MainColour(_)) => {
                return Err(Failure::usage(
                    "--binder: without a photograph a colour R,G,B is needed",
                ));
            }
        };
        let folder = everywhere.outputs.folder(&self.output)?;
        let opened = solid::read_packing(&self.packing).at(&self.packing)?;
        let bare = opened.solid;
        let mut notes = Notes::default();
        let colours = match &self.colours {
            None => bare.colours().to_vec(),
            Some(path) => {
                let table = colour_table::read(path).or_fail()?;
                table.findings.into_iter().for_each(|finding| {
                    notes.warn(finding);
                });
                particle_colours(bare.particles(), &table.rows, everywhere.seed)
            }
        };
        let sides = bare.period().sides();
        let texture = self
            .texture
            .as_ref()
            .map(|path| texture_source::read(path, everywhere.scale, sides.max()).at(path))
            .transpose()?;
        let made = Solid::new(bare.arrangement().clone(), colours, binder, texture.clone())
            .and_then(|made| made.with_voids(&self.voids))
            .or_fail()?;
        go_on()?;
        let unit = opened.unit.or(everywhere.unit);
        solid::write_parts(folder.file(""), &made, texture.as_ref(), &opened.shapes, unit).or_fail()?;
        let bodies = made.bodies();
        let volume: f64 = made
            .particles()
            .iter()
            .map(|particle| bodies[particle.shape].volume() * particle.size.powi(3))
            .sum();
        notes.line(format!(
            "{} particles in a box of {}{} written to {}",
            counted(made.particles().len() as u64),
            [sides.x, sides.y, sides.z].map(significant).join(" x "),
            unit.map_or(String::new(), |unit| format!(" {}", unit.printed())),
            self.output.display()
        ));
        let fields = AssembleFields {
            particles: made.particles().len(),
            sides: sides.into(),
            unit: unit.map(LengthUnit::symbol),
            fraction: volume / made.period().volume(),
            texture_voxel: texture.map(|texture| texture.voxel),
        };
        let answer = Answer::new(&fields, notes)?;
        write_json(&folder.file("summary.json"), &answer.summary())?;
        Ok(answer)
    }
}
