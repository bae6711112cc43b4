//! `stereology export`: one period of the solid as voxels.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stereology::grid::Format;
use stereology::volume::{self, VoxelGrid};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::commands::slice::open_solid;
use crate::failure::{Explain, Failure};
use crate::outputs::check_volume;
use crate::progress::Step;
use crate::values::count;

/// Writes one period of a finished solid as voxels
///
/// DIR is an output folder of `stereology synthesize`. N voxels along the box's longest side, of: rgb (colours, u8), id (particle number, u32, 0 = binder),
/// category (number of the colour category, u8,
/// 0 = binder), distance (signed distance to the nearest particle surface, f32, negative inside). All formats hold the same values of the same voxels; axes
/// are (z, y, x, channel).
///
/// .h5 is a DREAM.3D file (ids as FeatureIds), .zarr a folder of OME-Zarr 0.5 with axes (c, z, y, x), several resolutions in shards of 32 planes.
///
/// The file is written plane by plane, whatever its size. With --resume it goes on from FILE.partial if there is one, and FILE.partial stays if it is stopped:
/// give the same command until it is done.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology export out --voxels 256 --channel rgb -o solid.nrrd")]
pub struct Export {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Voxels along the box's longest side
    #[arg(long, value_name = "N", value_parser = count)]
    pub voxels: usize,
    /// Points along each axis of a voxel whose mean is its colour: 1 for the colour of its centre, 4 for smooth borders
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = samples)]
    pub samples: usize,
    /// What to write
    #[arg(long, value_enum, default_value_t = Channel::Rgb)]
    pub channel: Channel,
    /// Go on from FILE.partial, and keep it when stopped
    #[arg(long)]
    pub resume: bool,
    /// File: .npy, .nrrd, .vti, .tif, .h5 or .zarr
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// What a voxel holds.
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
        .ok_or_else(|| "a number of points from 1 to 16 is needed".to_owned())
}

impl Export {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let format = Format::from_path(&self.output).or_usage("-o")?;
        check_volume(&self.output, format, everywhere.force)?;
        let solid = open_solid(&self.solid)?.solid;
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
            ..solid.voxel_grid(self.voxels)
        };
        if self.resume {
            solid.resume_voxels(&self.output, format, &grid, channel, &progress)
        } else {
            solid.write_voxels(&self.output, format, &grid, channel, &progress)
        }
        .at(&self.output)?;
        drop(step);
        let [nx, ny, nz] = grid.counts;
        let mut answer = Answer::new("export");
        answer
            .field("shape", vec![nz, ny, nx])
            .field("spacing", grid.spacing.to_vec())
            .field("channel", name)
            .line(format!(
                "{nx} x {ny} x {nz} voxels ({name}) written to {}",
                self.output.display()
            ));
        Ok(answer)
    }
}
