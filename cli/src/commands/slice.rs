//! `stereology slice`: a picture of a cut through a solid.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{Triple, count, finite};

/// Cuts a finished solid by a plane and writes the picture of the cut
///
/// DIR is an output folder of `stereology synthesize`. The plane stands across an axis, --at a fraction of the box's side (0.3 is 30 %), or is any plane
/// with a --normal at --offset from the origin along it.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology slice out --axis z --at 0.3 --size 512 -o cut.png")]
pub struct Slice {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Axis the plane stands across [default: z]
    #[arg(long, value_enum, conflicts_with = "normal")]
    pub axis: Option<Axis>,
    /// Where along the axis, as a fraction of the box's side [default: 0.5]
    #[arg(long, value_name = "F", value_parser = finite, allow_negative_numbers = true, conflicts_with = "normal")]
    pub at: Option<f64>,
    /// Normal of the plane, of any length, instead of --axis
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub normal: Option<Triple>,
    /// Distance of the plane from the origin along the normal [default: 0]
    #[arg(long, value_name = "D", value_parser = finite, allow_negative_numbers = true, requires = "normal")]
    pub offset: Option<f64>,
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = count)]
    pub size: usize,
    /// File for the picture
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
}

/// An axis of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Slice {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `slice`"))
    }
}
