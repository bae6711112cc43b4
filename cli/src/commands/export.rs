//! `stereology export`: one period of the solid as voxels.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::count;

/// Writes one period of a finished solid as voxels
///
/// DIR is an output folder of `stereology synthesize`. N voxels along the box's longest side, of: rgb (colours, u8), id (particle number, u32, 0 = binder),
/// category (u8), distance (signed distance to the nearest particle surface, f32, negative inside). All formats hold the same values of the same voxels; axes
/// are (z, y, x, channel).
///
/// The file is written plane by plane, whatever its size; if it is killed FILE.partial stays.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology export out --voxels 256 --channel rgb -o solid.nrrd")]
pub struct Export {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Voxels along the box's longest side
    #[arg(long, value_name = "N", value_parser = count)]
    pub voxels: usize,
    /// What to write
    #[arg(long, value_enum, default_value_t = Channel::Rgb)]
    pub channel: Channel,
    /// Go on from FILE.partial (not available yet)
    #[arg(long)]
    pub resume: bool,
    /// File: .npy, .nrrd, .vti or .tif (.h5 and .zarr: not available yet)
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
    /// Colour category of the particle, u8
    Category,
    /// Signed distance to the nearest particle surface, f32
    Distance,
}

impl Export {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        if self.resume {
            return Err(Failure::not_available("--resume"));
        }
        Err(Failure::not_available("the command `export`"))
    }
}
