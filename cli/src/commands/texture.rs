//! `stereology texture`: Heeger-Bergen synthesis.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{Extent, count};

/// Makes a picture or a volume with the texture of a picture, of any size, that repeats without a seam
///
/// Heeger-Bergen synthesis with a steerable pyramid. --size N or NZ,NY,NX makes a volume every slice of which looks like IMAGE; H,W makes a picture. Good for
/// textures without large forms (stone, sand, paste); particles are the business of `stereology synthesize`.
///
/// Writes u8 colours: .png (picture), .npy, .nrrd, .vti or .tif (volume).
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology texture granite.png --size 128 -o granite.npy")]
pub struct Texture {
    /// Picture of the texture (three pictures, one an axis: not available yet)
    #[arg(value_name = "IMAGE", required = true, num_args = 1..=3)]
    pub images: Vec<PathBuf>,
    /// Samples: N or NZ,NY,NX (volume), H,W (picture)
    #[arg(long, value_name = "N[,N[,N]]")]
    pub size: Extent,
    #[command(flatten)]
    pub choices: Choices,
    /// How a volume is made
    #[arg(long, value_enum, default_value_t = Mode::Slices)]
    pub mode: Mode,
    /// File for the result; its ending tells the format
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// How to synthesise.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Texture")]
#[group(id = "texture-choices")]
pub struct Choices {
    /// Rounds of matching
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = count)]
    pub iterations: usize,
    /// Levels of the pyramid [default: by size]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
}

/// How a volume is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Every slice of the three axes matches the picture
    Slices,
    /// One picture an axis (not available yet)
    Oriented,
    /// The spectrum a slice should show, and corrected band variances: faster
    Spectrum,
    /// The plain method of 1995 and 2004 in three dimensions, whose slices lose contrast
    Volume,
}

impl Texture {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        if self.mode == Mode::Oriented || self.images.len() > 1 {
            return Err(Failure::not_available(
                "texture from one picture an axis (--mode oriented)",
            ));
        }
        Err(Failure::not_available("the command `texture`"))
    }
}
