//! `stereology render`: a picture of the solid, or of a mesh carved from it.

use std::path::PathBuf;

use clap::Args;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{Triple, count};

/// Renders a finished solid: one period of it as a block, or a mesh carved from it
///
/// DIR is an output folder of `stereology synthesize`. Without --mesh the block is drawn as the paper shows it, with three faces seen. A mesh (.obj, .stl,
/// .ply) is placed with its longest side on one period of the solid, and its surface shows the solid's colours there.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology render out --mesh bunny.obj --camera 2,-3,1.5 -o bunny.png")]
pub struct Render {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Mesh to carve and show
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// Direction from the centre to the camera (z is up)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera: Option<Triple>,
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "PX", default_value_t = 768, value_parser = count)]
    pub size: usize,
    /// File for the picture
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
}

impl Render {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `render`"))
    }
}
