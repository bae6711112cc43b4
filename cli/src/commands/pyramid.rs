//! `stereology pyramid`: the bands of a picture.

use std::path::PathBuf;

use clap::Args;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::count;

/// Takes a picture apart into the bands of a steerable pyramid and tells their statistics
///
/// Works on the stored grey values / 255 (colour: 0.299 R + 0.587 G + 0.114 B), as one period of a picture that repeats. For each band: level (0 is the
/// finest), orientation (null for the two residual bands), shape, mean square, minimum and maximum; and how exactly the bands rebuild the picture.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology pyramid granite.png --levels 4 --orientations 4 --json")]
pub struct Pyramid {
    /// Picture
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Levels of the pyramid [default: by size]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
}

impl Pyramid {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `pyramid`"))
    }
}
