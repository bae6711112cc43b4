//! How to unfold: the options that `unfold` and `synthesize` share.

use std::path::Path;

use clap::{Args, ValueEnum};
use stereology::kmatrix::Sizes;
use stereology::pipeline::{Capping, LargestSize, ParticleTypes};
use stereology::unfold::{
    self, Bootstrap, Resampling, UnfoldOptions, automatic_bins, equal_edges, geometric_edges, phi_edges,
};

use crate::failure::{Explain, Failure, body};
use crate::profile_table::TableProfile;
use crate::values::{BinCount, CappingAngle, Edges, MaxSize, ShapeShare, count, positive, share, shares};

/// Size bins if not given.
pub const BINS: usize = 10;

/// More bins than this are not chosen automatically.
const MOST_AUTOMATIC_BINS: usize = 50;

/// How to unfold.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Unfolding")]
#[group(id = "unfold-choices")]
pub struct Choices {
    /// Number of size bins between 0 and the largest size; auto: the most that hold five profiles each, and no more than 2 n^(1/3) [default: 10; 16 for synthesize, whose sections show the steps of coarser bins]
    #[arg(long, value_name = "N|auto", conflicts_with = "edges")]
    pub bins: Option<BinCount>,
    /// Edges of the size bins, instead of --bins
    #[arg(long, value_name = "a,b,...")]
    pub edges: Option<Edges>,
    /// Bins of equal width, of equal ratio, or Krumbein's half phi classes (sizes 2^(k/2) of the unit)
    #[arg(long, value_enum, default_value_t = Spacing::Equal, conflicts_with = "edges")]
    pub spacing: Spacing,
    /// Shape of the particles and its share of them; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// Largest particle size; or `corrected`, the largest profile and what it falls short of; or `likelihood` [default: `profile`, the largest profile]
    #[arg(long, value_name = "D", conflicts_with = "edges")]
    pub max_size: Option<MaxSize>,
    /// Profiles up to this size are not observed: nothing is said about particles below it
    #[arg(long, value_name = "T", value_parser = positive)]
    pub min_size: Option<f64>,
    /// Particles of size D show no profile below D sin of this angle in degrees (Keiding & Jensen's capping angle); fit: the most likely angle
    #[arg(long, value_name = "DEGREES|fit")]
    pub capping_angle: Option<CappingAngle>,
    /// How to solve
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// Sizes spread over each bin, or all at its upper edge (the paper's) [default: integrated; with --method paper: upper-edge]
    #[arg(long, value_enum)]
    pub kernel: Option<Kernel>,
    /// Bootstrap replicates for intervals [default: none; synthesize: 200]
    #[arg(long, value_name = "B", value_parser = count)]
    pub bootstrap: Option<usize>,
    /// What the bootstrap draws again: counts, or whole slices (column `slice`) where profiles of a slice go together
    #[arg(long, value_enum, default_value_t = Resample::Counts)]
    pub resample: Resample,
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
    /// Half phi: edges at powers of √2, whatever --bins
    Phi,
}

/// What a bootstrap draws again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Resample {
    /// Poisson counts with the means of the fit
    Counts,
    /// Slices, with repetition
    Slices,
}

/// How the densities are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Chosen from the data: penalised, or sparse where its evidence is far greater
    Auto,
    /// Penalised likelihood: as smooth as the counts say
    Penalised,
    /// Likelihood on as few size bins as the counts bear
    Sparse,
    /// Expectation maximisation: positive by construction
    Em,
    /// Expectation maximisation with a little smoothing
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

impl Method {
    /// The estimator.
    pub fn estimator(self) -> unfold::Method {
        match self {
            Self::Auto => unfold::Method::Auto,
            Self::Penalised => unfold::Method::Penalised,
            Self::Sparse => unfold::Method::Sparse,
            Self::Em => unfold::Method::Em,
            Self::Ems => unfold::Method::Ems,
            Self::Nnls => unfold::Method::Nnls,
            Self::Paper => unfold::Method::Paper,
        }
    }
}

impl Choices {
    /// Where in its bin a particle's size lies.
    pub fn sizes(&self) -> Sizes {
        match (self.kernel, self.method) {
            (Some(Kernel::UpperEdge), _) | (None, Method::Paper) => Sizes::UpperEdge,
            _ => Sizes::Integrated,
        }
    }

    /// Name of the kernel.
    pub fn kernel_name(&self) -> &'static str {
        match self.sizes() {
            Sizes::UpperEdge => "upper-edge",
            Sizes::Integrated => "integrated",
        }
    }

    /// The particle types; spheres if none are named.
    pub fn types(&self) -> Result<ParticleTypes, Failure> {
        types(&self.shape)
    }

    /// The estimator with its threshold and intervals; lengths of the options are multiplied by `scale`.
    pub fn unfold_options(&self, scale: f64, seed: u64) -> Result<UnfoldOptions, Failure> {
        let mut options = UnfoldOptions::default().with_method(self.method.estimator());
        if let Some(min_size) = self.min_size {
            options = options.with_min_size(min_size * scale);
        }
        if let Some(replicates) = self.bootstrap {
            let mut bootstrap = Bootstrap {
                replicates,
                ..Bootstrap::default()
            };
            bootstrap.level = self.level;
            bootstrap.seed = seed;
            bootstrap.resampling = match self.resample {
                Resample::Counts => Resampling::Counts,
                Resample::Slices => Resampling::Slices,
            };
            options = options.with_bootstrap(bootstrap);
        }
        Ok(options)
    }

    /// The largest size, lengths multiplied by `scale`.
    pub fn largest(&self, scale: f64) -> LargestSize {
        match self.max_size {
            None | Some(MaxSize::Profile) => LargestSize::Profile,
            Some(MaxSize::Corrected) => LargestSize::Corrected,
            Some(MaxSize::Likelihood) => LargestSize::Likelihood,
            Some(MaxSize::Length(size)) => LargestSize::Given(size * scale),
        }
    }

    /// What is lost at the rims.
    pub fn capping(&self) -> Capping {
        match self.capping_angle {
            None => Capping::None,
            Some(CappingAngle::Degrees(angle)) => Capping::Angle(angle.to_radians()),
            Some(CappingAngle::Fit) => Capping::Likelihood,
        }
    }

    /// Edges of the size bins up to the largest size, for profiles of these sizes.
    pub fn size_edges(&self, profiles: &[TableProfile], largest: f64, scale: f64) -> Result<Vec<f64>, Failure> {
        if let Some(Edges(edges)) = &self.edges {
            return Ok(edges.iter().map(|edge| edge * scale).collect());
        }
        let counted = || {
            profiles
                .iter()
                .filter(|profile| profile.weight > 0.0)
                .map(|profile| profile.size)
        };
        let count = match self.bins {
            None => BINS,
            Some(BinCount::Number(count)) => count,
            Some(BinCount::Auto) => automatic_bins(&counted().collect::<Vec<_>>(), largest, MOST_AUTOMATIC_BINS),
        };
        match self.spacing {
            Spacing::Equal => Ok(equal_edges(largest, count)),
            Spacing::Phi => {
                let smallest = self
                    .min_size
                    .map_or_else(|| counted().fold(f64::INFINITY, f64::min), |size| size * scale);
                if !(smallest.is_finite() && largest > 0.0) {
                    return Err(Failure::usage("--spacing phi needs --min-size and --max-size here"));
                }
                Ok(phi_edges(smallest, largest, 0.5))
            }
            Spacing::Geometric => {
                // The first bin is everything up to the smallest size that is seen.
                let smallest = self
                    .min_size
                    .map_or_else(|| counted().fold(f64::INFINITY, f64::min), |size| size * scale);
                if count < 2 || smallest.is_nan() || smallest >= largest {
                    return Err(Failure::usage(
                        "--spacing geometric needs two or more bins, and sizes that differ; give --min-size and --max-size, or --spacing equal",
                    ));
                }
                Ok(geometric_edges(smallest, largest, count - 1))
            }
        }
    }
}

/// Particle types of `--shape` options; spheres if there are none.
pub fn types(shapes: &[ShapeShare]) -> Result<ParticleTypes, Failure> {
    let sphere = [ShapeShare {
        shape: "sphere".to_owned(),
        fraction: None,
    }];
    let shapes = if shapes.is_empty() { &sphere } else { shapes };
    let shares = shares(shapes).or_usage("--shape")?;
    let bodies = shapes
        .iter()
        .zip(shares)
        .map(|(shape, share)| Ok((file_name(&shape.shape), body(&shape.shape)?, share)))
        .collect::<Result<_, Failure>>()?;
    ParticleTypes::new(bodies).or_fail()
}

/// Outputs hold no paths: a mesh file goes by its name.
fn file_name(shape: &str) -> String {
    Path::new(shape)
        .file_name()
        .map_or_else(|| shape.to_owned(), |name| name.to_string_lossy().into_owned())
}
