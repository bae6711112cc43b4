//! `stereology export`: one period of the solid as voxels.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::solid::SavedSolid;
use stereology::grid::{Format, LengthUnit};
use stereology::volume::{self, VoxelGrid};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::solid_files::open_solid;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::Output;
use crate::progress::Step;
use crate::values::count;

/// Writes one period of a finished solid as voxels
///
/// DIR is an output folder of `stereology synthesize` or `assemble`, or a packing.json. The grid has N voxels along the
/// box's longest side. Each voxel holds one channel: rgb (colour, u8), id (particle number, u32, 0 = binder), category
/// (number of the colour category, u8, 0 = binder), distance (signed distance to the nearest particle surface, f32,
/// negative inside) or alpha (mask, u8, 0 in voids). All formats store the same values; the axes are (z, y, x,
/// channel).
///
/// The unit of length of the solid is stored in .nrrd (space units), .vti (field `unit`), .tif (resolution per cm or
/// inch) and .zarr (unit of the axes).
///
/// .h5 is a DREAM.3D file (ids as FeatureIds). .zarr is an OME-Zarr 0.5 folder with axes (c, z, y, x), several
/// resolutions and shards of 32 planes.
///
/// The file is written plane by plane, so memory does not limit its size. With --resume an interrupted write keeps
/// FILE.partial, and the same command continues from it.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology export out --voxels 256 --channel rgb -o solid.nrrd")]
pub struct Export {
    /// Folder of a solid, written by `stereology synthesize` or `assemble`, or a packing.json
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Voxels along the box's longest side
    #[arg(long, value_name = "N", value_parser = count)]
    pub voxels: usize,
    /// Samples per voxel along each axis, averaged into its colour: 1 takes the colour of the centre, 4 gives smooth
    /// borders
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = samples)]
    pub samples: usize,
    /// Channel to write
    #[arg(long, value_enum, default_value_t = Channel::Rgb)]
    pub channel: Channel,
    /// Continue from FILE.partial, and keep it when interrupted
    #[arg(long)]
    pub resume: bool,
    /// File: .npy, .nrrd, .vti, .tif, .h5 or .zarr
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// Content of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Channel {
    /// Colour, u8
    Rgb,
    /// Number of the particle from 1, u32; 0 is binder
    Id,
    /// Colour category of the particle from 1, u8; 0 is binder
    Category,
    /// Signed distance to the nearest particle surface, f32
    Distance,
    /// Mask: 0 in voids, else 255, u8
    Alpha,
}

fn samples(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=16).contains(n))
        .ok_or_else(|| "a whole number of samples from 1 to 16 is needed".to_owned())
}

/// JSON of `stereology export`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExportFields {
    /// Voxels along z, y and x.
    shape: [usize; 3],
    /// Side of a voxel along x, y and z.
    spacing: [f64; 3],
    /// Unit of the sides; null if it is not known, or pixels of the photograph.
    unit: Option<&'static str>,
    /// Content of the voxels: rgb, id, category, distance or alpha.
    channel: &'static str,
}

impl Fields for ExportFields {
    const COMMAND: &'static str = "export";
}

impl Export {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let format = Format::from_path(self.output.name()).or_usage("-o")?;
        let file = if self.resume {
            everywhere.outputs.resumed_volume(&self.output, format)?
        } else {
            everywhere.outputs.volume(&self.output, format)?
        };
        let SavedSolid { solid, unit, .. } = open_solid(&self.solid, everywhere)?;
        let (channel, name) = match self.channel {
            Channel::Rgb => (volume::Channel::Rgb, "rgb"),
            Channel::Id => (volume::Channel::Id, "id"),
            Channel::Category => (volume::Channel::Category, "category"),
            Channel::Distance => (volume::Channel::Distance, "distance"),
            Channel::Alpha => (volume::Channel::Alpha, "alpha"),
        };
        let step = Step::begin("voxels", everywhere.quiet);
        let progress = |done: f64| step.at(done);
        let grid = VoxelGrid {
            samples: self.samples,
            unit,
            ..solid.voxel_grid(self.voxels)
        };
        if self.resume {
            solid.resume_voxels(&file, format, &grid, channel, &progress)
        } else {
            solid.write_voxels(&file, format, &grid, channel, &progress)
        }
        .at(&file)?;
        drop(step);
        let [nx, ny, nz] = grid.counts;
        let mut notes = Notes::default();
        notes.line(format!(
            "{nx} x {ny} x {nz} voxels ({name}) written to {}",
            self.output.display()
        ));
        let fields = ExportFields {
            shape: [nz, ny, nx],
            spacing: grid.spacing,
            unit: unit.map(LengthUnit::symbol),
            channel: name,
        };
        Answer::new(&fields, notes)
    }
}
