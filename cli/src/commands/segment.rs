//! `stereology segment`: a photograph -> profiles.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{Colour, count, positive};

/// Finds the profiles of particles on a photograph of a cut
///
/// Tells particles from the binder between them, outlines each profile, measures it, and takes the photograph apart into mean colours and residual texture.
/// A photograph without separable particles (no binder colour, or nothing in it) is refused or warned of: outline such particles with another tool and import
/// its label map with --labels.
///
/// Writes into DIR: labels.tif (0 = binder), profiles.csv (id, x, y, area, size, r, g, b, category, touches_edge, weight), overlay.png (look at this first),
/// binder.png, means.png, residual.tif (f32, photo / 255 - means, exact), residual.png (its picture) and summary.json.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology segment photo.jpg -o out --min-area 30 --categories 3")]
pub struct Segment {
    /// Photograph (PNG, JPEG, TIFF; 8 or 16 bits, grey or colour, with or without alpha)
    #[arg(value_name = "PHOTO")]
    pub photo: PathBuf,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
}

/// How to segment.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Segmentation")]
#[group(id = "segment-choices")]
pub struct Choices {
    /// Label map of another tool (TIFF or PNG, 0 = binder) instead of segmenting
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Colour of the binder, 0 to 255 [default: found in the photograph]
    #[arg(long, value_name = "R,G,B")]
    pub binder: Option<Colour>,
    /// Smallest area of a profile in pixels
    #[arg(long, value_name = "PX", value_parser = positive)]
    pub min_area: Option<f64>,
    /// Number of colour categories of the particles
    #[arg(long, value_name = "K", value_parser = count)]
    pub categories: Option<usize>,
    /// Holes in profiles: filled, or kept (for particles with annular sections)
    #[arg(long, value_enum, default_value_t = Holes::Fill)]
    pub holes: Holes,
    /// Which profiles at the photograph's edge count, and how much
    #[arg(long, value_enum, default_value_t = EdgeRule::Frame)]
    pub edge_rule: EdgeRule,
}

/// What becomes of holes in profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Holes {
    /// Part of the profile
    Fill,
    /// Binder
    Keep,
}

/// How profiles at the photograph's edge are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EdgeRule {
    /// Unbiased counting frame: profiles that touch two of the sides are left out
    Frame,
    /// Profiles wholly inside, weighted by the chance to be so
    MilesLantuejoul,
    /// All, cut ones as they are: biased, for comparison
    All,
}

impl Segment {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `segment`"))
    }
}
