//! `stereology unfold`: profiles per area -> particles per volume.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::values::{Edges, ShapeShare, bins, count, positive, share};

/// From the sizes of the profiles on a cut to the number and sizes of the particles in the solid
///
/// Reads a table of profiles (CSV with a header) and tells how many particles of each size a unit of volume holds, as absolute numbers, with the refolded
/// profile counts beside the observed ones, so that the fit can be judged.
///
/// PROFILES.csv has a column `size` (diameter of the circle with the profile's area) or `area`; if present, `type` (0-based index of --shape), `category`,
/// `weight` (multiplies the count) and `slice` are used too. Other columns are ignored; the `profiles.csv` of `stereology segment` is such a table. --area is
/// the total area examined: without it there are no absolute numbers.
///
/// With several --shape and no `type` column all types share one size distribution in the given fractions (eqs. 10-12); with types each has its own (eq. 9).
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology unfold out/profiles.csv --area 307200 --bins 10 --shape rock:1 -o densities.csv"
)]
pub struct Unfold {
    /// Table of profiles
    #[arg(value_name = "PROFILES.csv")]
    pub profiles: PathBuf,
    /// Total area examined, in the unit of length of the sizes, squared
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    pub area: f64,
    #[command(flatten)]
    pub choices: Choices,
    /// Also write the densities as a table: lower_edge,upper_edge,number_density,lower,upper,type,category
    #[arg(short, long, value_name = "densities.csv")]
    pub output: Option<PathBuf>,
}

/// How to unfold.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Unfolding")]
#[group(id = "unfold-choices")]
pub struct Choices {
    /// Number of size bins between 0 and the largest size
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = bins, conflicts_with = "edges")]
    pub bins: usize,
    /// Edges of the size bins, instead of --bins
    #[arg(long, value_name = "a,b,...")]
    pub edges: Option<Edges>,
    /// Bins of equal width, or of equal ratio
    #[arg(long, value_enum, default_value_t = Spacing::Equal, conflicts_with = "edges")]
    pub spacing: Spacing,
    /// Shape of the particles and its share of them; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// Largest particle size [default: the largest profile]
    #[arg(long, value_name = "D", value_parser = positive, conflicts_with = "edges")]
    pub max_size: Option<f64>,
    /// Profiles up to this size are not observed: nothing is said about particles below it
    #[arg(long, value_name = "T", value_parser = positive)]
    pub min_size: Option<f64>,
    /// How to solve
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// Sizes spread over each bin, or all at its upper edge (the paper's) [default: integrated; with --method paper: upper-edge]
    #[arg(long, value_enum)]
    pub kernel: Option<Kernel>,
    /// Bootstrap replicates for intervals
    #[arg(long, value_name = "B", value_parser = count)]
    pub bootstrap: Option<usize>,
    /// Nominal coverage of the intervals
    #[arg(long, value_name = "P", default_value_t = 0.9, value_parser = share)]
    pub level: f64,
}

/// How bins are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Spacing {
    /// Equal widths
    Equal,
    /// Equal ratios
    Geometric,
}

/// How the densities are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Chosen from the data
    Auto,
    /// Penalised likelihood (not available yet)
    Penalised,
    /// Expectation maximisation: positive by construction
    Em,
    /// Expectation maximisation with smoothing (not available yet)
    Ems,
    /// Least squares with densities not below zero
    Nnls,
    /// The paper's inverse of K; negative densities are set to zero and counted
    Paper,
}

/// Where in its bin a particle's size lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kernel {
    /// Anywhere in the bin
    Integrated,
    /// At the bin's upper edge
    UpperEdge,
}

impl Unfold {
    pub fn run(&self, _everywhere: &Everywhere) -> Result<Answer, Failure> {
        Err(Failure::not_available("the command `unfold`"))
    }
}
