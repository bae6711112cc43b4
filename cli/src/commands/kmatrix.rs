//! `stereology kmatrix`: the section law of a body.

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{bins, count, positive};

/// How often a random plane shows a body of each size as a profile of each size
///
/// Cuts SHAPE by isotropic uniform random planes and tells the law of the profile sizes: the K matrix of the paper (eq. 5), the mean caliper and the
/// largest section. Spheres and ellipsoids have closed forms; for meshes the areas are exact in depth for each direction, and an error bar tells what the
/// finite number of directions leaves open. SHAPE is `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED` or a closed mesh (.obj, .stl,
/// .ply); an open mesh is refused.
///
/// Row i, column j of `matrix`: relative to one plane hit by a particle of the largest size, how many profiles of bin i a particle at the upper edge of
/// bin j shows. Column j sums to j/N.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology kmatrix box:1,1,2 --bins 10 --tolerance 0.001 --json")]
pub struct Kmatrix {
    /// Body: sphere, ellipsoid:A,B,C, box:A,B,C, cylinder:D,L, rock:SEED or a mesh file
    pub shape: String,
    /// Number of profile bins, and of size bins
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = bins)]
    pub bins: usize,
    /// Largest standard error of the matrix to stop at [default: 0.001]
    #[arg(long, value_name = "T", value_parser = positive, conflicts_with = "directions")]
    pub tolerance: Option<f64>,
    /// Number of directions, instead of a tolerance
    #[arg(long, value_name = "N", value_parser = count)]
    pub directions: Option<usize>,
    /// Exact in depth for each direction, or the paper's random sections
    #[arg(long, value_enum, default_value_t = Method::Exact)]
    pub method: Method,
    /// The paper's normalisation: profiles per particle hit are not counted (the same for convex bodies)
    #[arg(long)]
    pub paper: bool,
}

/// How the section law is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Exact in depth for each of many directions
    Exact,
    /// 100,000 random sections, as in the paper
    MonteCarlo,
}

impl Kmatrix {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `kmatrix`"))
    }
}
