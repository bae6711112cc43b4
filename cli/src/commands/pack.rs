//! `stereology pack`: particles without overlap in a box that repeats.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{ShapeShare, count, positive, share};

/// Packs particles of given sizes into a box that repeats in x, y and z, until a separate pass certifies that none overlap
///
/// Sizes come from a table of number densities (`stereology unfold -o`), from a lognormal law, are all one, or are listed. The number of particles and the
/// fraction of the volume they fill are met exactly; a fraction that cannot be reached is refused, with the overlap that was left.
///
/// Writes packing.json: the box, the shapes, and for each particle its shape, size, category, position (centre of volume) and orientation (quaternion w,x,y,z).
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology pack --lognormal 0.3 --count 1000 --fraction 0.5 -o packing.json --also packing.vtp"
)]
pub struct Pack {
    #[command(flatten)]
    pub sizes: Sizes,
    /// Number of particles [default: 1000]
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<usize>,
    /// Side of the box, instead of --count; needs --densities
    #[arg(long = "box", value_name = "L", value_parser = positive, conflicts_with = "count")]
    pub side: Option<f64>,
    /// Fraction of the volume inside particles [default: what the densities say, otherwise 0.5]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// Shape of the particles and its share of them; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// How overlaps are removed
    #[arg(long, value_enum, default_value_t = Mode::Fast)]
    pub mode: Mode,
    /// File for the packing (JSON)
    #[arg(short, long, value_name = "packing.json")]
    pub output: PathBuf,
    /// Also write packing.csv, packing.xyz (OVITO) or packing.vtp (ParaView); may be repeated
    #[arg(long, value_name = "FILE")]
    pub also: Vec<PathBuf>,
}

/// Where sizes come from.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct Sizes {
    /// Table of number densities, as `stereology unfold -o` writes it
    #[arg(long, value_name = "FILE")]
    pub densities: Option<PathBuf>,
    /// Lognormal sizes of median 1 and this standard deviation of the logarithm
    #[arg(long, value_name = "SIGMA", value_parser = positive)]
    pub lognormal: Option<f64>,
    /// All sizes 1
    #[arg(long)]
    pub constant: bool,
    /// Table with a column `size`, one row a particle (CSV)
    #[arg(long, value_name = "CSV")]
    pub sizes: Option<PathBuf>,
}

/// How overlaps are removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Overlap energy minimised by FIRE
    Fast,
    /// The paper's relaxation
    Paper,
    /// Simulated annealing (not available yet)
    Anneal,
    /// One particle at a time at random (not available yet)
    Sequential,
}

impl Pack {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        if matches!(self.mode, Mode::Anneal | Mode::Sequential) {
            return Err(Failure::not_available("this --mode"));
        }
        Err(Failure::not_available("the command `pack`"))
    }
}
