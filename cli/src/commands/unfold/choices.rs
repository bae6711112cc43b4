//! How to unfold: the options that `unfold` and `synthesize` share.

use std::path::Path;

use clap::{Args, ValueEnum};
use stereology::kmatrix::Sizes;
use stereology::pipeline::{
    self, Capping, DensityOptions, LargestSize, ParticleTypes, SeparateCategories, TypeFractions,
};
use stereology::unfold::{self, Bootstrap, Resampling, UnfoldOptions};

use crate::failure::{Explain, Failure, body};
use crate::values::{BinCount, CappingAngle, Edges, MaxSize, ShapeShare, count, positive, share, shares};

/// What a command takes if it is not told.
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

    /// All of them but the types; `defaults` where neither bins nor replicates are given. Lengths of the options are multiplied by `scale`.
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
            categories: SeparateCategories::WhereSizesDiffer,
            unfold: UnfoldOptions {
                method: self.method.estimator(),
                min_size: self.min_size.map(|size| size * scale),
                bootstrap: self.bootstrap.or(defaults.replicates).map(|replicates| Bootstrap {
                    replicates,
                    level: self.level,
                    seed,
                    resampling: match self.resample {
                        Resample::Counts => Resampling::Counts,
                        Resample::Slices => Resampling::Slices,
                    },
                }),
                ..UnfoldOptions::default()
            },
        }
    }

    /// The largest size, lengths multiplied by `scale`.
    fn largest(&self, scale: f64) -> LargestSize {
        match self.max_size {
            None | Some(MaxSize::Profile) => LargestSize::Profile,
            Some(MaxSize::Corrected) => LargestSize::Corrected,
            Some(MaxSize::Likelihood) => LargestSize::Likelihood,
            Some(MaxSize::Length(size)) => LargestSize::Given(size * scale),
        }
    }

    /// What is lost at the rims.
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

/// Outputs hold no paths: a mesh file goes by its name.
fn file_name(shape: &str) -> String {
    Path::new(shape)
        .file_name()
        .map_or_else(|| shape.to_owned(), |name| name.to_string_lossy().into_owned())
}
