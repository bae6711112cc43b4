//! `stereology synthesize`: a photograph in, a solid out.

use std::path::PathBuf;

use clap::Args;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::commands::{pack, segment, texture, unfold};
use crate::failure::Failure;
use crate::values::{count, positive, share};

/// From a photograph of a cut to the solid it came from, and a report that tells whether to trust it
///
/// Segments PHOTO, unfolds its profiles to particles per volume, packs such particles without overlap into a box that repeats, gives them the photograph's
/// colours, and resynthesises the residual texture in three dimensions. Then sections of the solid are measured and segmented like the photograph and
/// compared with it. Without PHOTO a built-in sample is used: `stereology synthesize -o out` shows all there is to see.
///
/// Writes into DIR: all files of `stereology segment`; densities.csv; packing.json; solid.json and texture.npy (the solid, opened again by slice, render and
/// export); volume.npy (one period, u8 colours); cube.png; comparison.png (photograph beside a section at the same scale); summary.json; and report.html,
/// which is the file to open first.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology synthesize photo.jpg -o out --shape rock:1 --scale 0.05")]
pub struct Synthesize {
    /// Photograph of a cut [default: the built-in sample]
    #[arg(value_name = "PHOTO")]
    pub photo: Option<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub segment: segment::Choices,
    #[command(flatten)]
    pub unfold: unfold::Choices,
    #[command(flatten)]
    pub solid: Solid,
    #[command(flatten)]
    pub texture: texture::Choices,
    /// How the residual volume is made
    #[arg(long, value_enum, default_value_t = texture::Mode::Slices, help_heading = "Texture")]
    pub texture_mode: texture::Mode,
}

/// How large the solid is and how it is packed.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Solid")]
#[group(id = "solid-choices")]
pub struct Solid {
    /// Side of the box that repeats [default: 4 x the largest particle, or more: enough for 5000 particles]
    #[arg(long = "box", value_name = "L", value_parser = positive, conflicts_with = "count")]
    pub side: Option<f64>,
    /// Number of particles, instead of --box
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<usize>,
    /// Fraction of the volume inside particles [default: the photograph's area fraction]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// How overlaps are removed
    #[arg(long, value_enum, default_value_t = pack::Mode::Fast)]
    pub pack_mode: pack::Mode,
    /// Voxels of volume.npy along the box's longest side
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub voxels: usize,
    /// Voxels of the residual volume's side, at the photograph's pixel scale
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub texture_voxels: usize,
}

impl Synthesize {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `synthesize`"))
    }
}
