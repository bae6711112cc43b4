//! Options of the unfolding, shared by `unfold` and `synthesize`.

use std::path::Path;

use clap::{Args, ValueEnum};
use stereology::kmatrix::Sizes;
use stereology::pipeline::{self, Capping, DensityOptions, LargestSize, ParticleTypes, TypeFractions};
use stereology::unfold::{self, Bootstrap, Resampling, UnfoldOptions};

use crate::failure::{Explain, Failure, body};
use crate::values::{BinCount, CappingAngle, Edges, MaxSize, ShapeShare, count, positive, share, shares};

/// Defaults that differ between commands.
#[derive(Clone, Copy, Debug)]
pub struct Defaults {
    /// Size bins.
    pub bins: usize,
    /// Bootstrap replicates.
    pub replicates: Option<usize>,
}

/// How to unfold.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Unfolding")]
#[group(id = "unfold-choices")]
pub struct Choices {
    /// Number of size bins between 0 and the largest size; auto: as many as have five profiles each, at most 2 n^(1/3)
    /// for n profiles [default: 10; 16 for synthesize and for tables of segment, because sections of the solid show the
    /// steps of coarser bins]
    #[arg(long, value_name = "N|auto", conflicts_with = "edges")]
    pub bins: Option<BinCount>,
    /// Edges of the size bins, instead of --bins
    #[arg(long, value_name = "a,b,...")]
    pub edges: Option<Edges>,
    /// Spacing of the size bins
    #[arg(long, value_enum, default_value_t = Spacing::Equal, conflicts_with = "edges")]
    pub spacing: Spacing,
    /// Shape of the particles, and its fraction of their number; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// Largest particle size: a length, `profile` (size of the largest profile), `corrected` (the same, corrected for
    /// its bias) or `likelihood` (maximum-likelihood size) [default: profile]
    #[arg(long, value_name = "D", conflicts_with = "edges")]
    pub max_size: Option<MaxSize>,
    /// Detection limit: smaller profiles are ignored and smaller particles are not estimated
    #[arg(long, value_name = "T", value_parser = positive)]
    pub min_size: Option<f64>,
    /// Capping angle in degrees (Keiding and Jensen): a particle of size D shows no profile smaller than D times the
    /// sine of this angle; fit: the maximum-likelihood angle
    #[arg(long, value_name = "DEGREES|fit")]
    pub capping_angle: Option<CappingAngle>,
    /// Method of estimation
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// Position of particle sizes within their bin [default: integrated; with --method paper: upper-edge]
    #[arg(long, value_enum)]
    pub kernel: Option<Kernel>,
    /// Number of bootstrap replicates for confidence intervals [default: none; synthesize: 200]
    #[arg(long, value_name = "B", value_parser = replicates)]
    pub bootstrap: Option<usize>,
    /// What the bootstrap resamples [default: auto]
    #[arg(long, value_enum)]
    pub resample: Option<Resample>,
    /// Nominal coverage of the confidence intervals [default: 0.9]
    #[arg(long, value_name = "P", value_parser = share)]
    pub level: Option<f64>,
}

/// How bins are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Spacing {
    /// Equal widths
    Equal,
    /// Equal ratios
    Geometric,
    /// Krumbein's half-phi classes: edges at powers of √2 of the unit; --bins has no effect
    Phi,
}

/// A spread needs two replicates.
fn replicates(text: &str) -> Result<usize, String> {
    match count(text) {
        Ok(1) => Err("an interval needs at least 2 replicates, and 200 for its ends to be steady".to_owned()),
        other => other,
    }
}

/// What a bootstrap resamples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Resample {
    /// Blocks (or slices, if there are several) if the profiles are clustered, otherwise counts
    Auto,
    /// Counts: Poisson numbers with the means of the fit
    Counts,
    /// Whole slices (column `slice`), for profiles that are correlated within a slice
    Slices,
    /// Tiles of the photograph (columns `x`, `y`, or bounding boxes), for clustered profiles
    Blocks,
}

/// How the densities are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Selected from the data: penalised, or sparse if its evidence is much greater
    Auto,
    /// Penalised likelihood, with the smoothness that the counts support
    Penalised,
    /// Maximum likelihood with as few size bins as the counts support
    Sparse,
    /// Expectation maximisation; densities are positive by construction
    Em,
    /// Expectation maximisation with slight smoothing
    Ems,
    /// Non-negative least squares
    Nnls,
    /// Inverse of K, as in the paper; negative densities are set to zero and counted
    Paper,
}

/// Position of particle sizes within their bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kernel {
    /// Uniformly distributed over the bin
    Integrated,
    /// At the upper edge of the bin, as in the paper
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
    /// Position of particle sizes within their bin.
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

    /// The particle types; spheres by default.
    pub fn types(&self) -> Result<ParticleTypes, Failure> {
        types(&self.shape)
    }

    /// All options except the types. Lengths are multiplied by `scale`.
    pub fn density_options(&self, scale: f64, seed: u64, defaults: &Defaults) -> DensityOptions {
        DensityOptions {
            bins: match self.bins {
                None => defaults.bins,
                Some(BinCount::Number(bins)) => bins,
                Some(BinCount::Auto) => 0,
            },
            spacing: match self.spacing {
                Spacing::Equal => pipeline::Spacing::Equal,
                Spacing::Geometric => pipeline::Spacing::Geometric,
                Spacing::Phi => pipeline::Spacing::Phi,
            },
            edges: self
                .edges
                .as_ref()
                .map(|Edges(edges)| edges.iter().map(|edge| edge * scale).collect()),
            max_size: self.largest(scale),
            capping: self.capping(),
            sizes: self.sizes(),
            fractions: TypeFractions::Given,
            unfold: UnfoldOptions {
                method: self.method.estimator(),
                min_size: self.min_size.map(|size| size * scale),
                bootstrap: self.bootstrap.or(defaults.replicates).map(|replicates| Bootstrap {
                    replicates,
                    level: self.level.unwrap_or(0.9),
                    seed,
                    resampling: match self.resample.unwrap_or(Resample::Auto) {
                        Resample::Auto => Resampling::Auto,
                        Resample::Counts => Resampling::Counts,
                        Resample::Slices => Resampling::Slices,
                        Resample::Blocks => Resampling::Blocks,
                    },
                }),
                ..UnfoldOptions::default()
            },
        }
    }

    /// The largest size; lengths are multiplied by `scale`.
    fn largest(&self, scale: f64) -> LargestSize {
        match self.max_size {
            None | Some(MaxSize::Profile) => LargestSize::Profile,
            Some(MaxSize::Corrected) => LargestSize::Corrected,
            Some(MaxSize::Likelihood) => LargestSize::Likelihood,
            Some(MaxSize::Length(size)) => LargestSize::Given(size * scale),
        }
    }

    /// The capping angle.
    fn capping(&self) -> Capping {
        match self.capping_angle {
            None => Capping::None,
            Some(CappingAngle::Degrees(angle)) => Capping::Angle(angle.to_radians()),
            Some(CappingAngle::Fit) => Capping::Likelihood,
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

/// Outputs contain no folders, so a mesh file is identified by its name.
fn file_name(shape: &str) -> String {
    Path::new(shape)
        .file_name()
        .map_or_else(|| shape.to_owned(), |name| name.to_string_lossy().into_owned())
}
