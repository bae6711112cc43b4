//! `stereology unfold`: profiles per area -> particles per volume.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use stereology::files::DensityRows;
use stereology::kmatrix::Sizes;
use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, particle_densities};
use stereology::unfold::{
    self, Bootstrap, Estimate, Interval, ProfileCounts, UnfoldOptions, Unfolding, equal_edges, geometric_edges,
    unfold_types_with_progress,
};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure, body};
use crate::numbers::{percent, significant};
use crate::outputs::check_file;
use crate::profile_table::{TableProfile, read_profiles};
use crate::progress::{Step, go_on};
use crate::values::{Edges, ShapeShare, bins, count, positive, share, shares};
use crate::warnings::Warning;

/// From the sizes of the profiles on a cut to the number and sizes of the particles in the solid
///
/// Reads a table of profiles (CSV with a header) and tells how many particles of each size a unit of volume holds, as absolute numbers, with the refolded
/// profile counts beside the observed ones, so that the fit can be judged.
///
/// PROFILES.csv has a column `size` (diameter of the circle with the profile's area) or `area`; if present, `type` (0-based index of --shape), `category`,
/// `weight` (multiplies the count) and `slice` are used too. Other columns are ignored; the `profiles.csv` of `stereology segment` is such a table. --area is
/// the total area examined: without it there are no absolute numbers.
///
/// With --scale all lengths given here, in the table and in options, are multiplied by it.
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

/// Size bins if not given.
const BINS: usize = 10;

/// How to unfold.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Unfolding")]
#[group(id = "unfold-choices")]
pub struct Choices {
    /// Number of size bins between 0 and the largest size [default: 10; 16 for synthesize, whose sections show the steps of coarser bins]
    #[arg(long, value_name = "N", value_parser = bins, conflicts_with = "edges")]
    pub bins: Option<usize>,
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
    /// Bootstrap replicates for intervals [default: none; synthesize: 200]
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

impl Method {
    /// The estimator; what is chosen automatically is `em`.
    pub fn estimator(self) -> Result<unfold::Method, Failure> {
        match self {
            Self::Auto | Self::Em => Ok(unfold::Method::Em),
            Self::Nnls => Ok(unfold::Method::Nnls),
            Self::Paper => Ok(unfold::Method::Paper),
            Self::Penalised => Err(Failure::not_available("--method penalised")),
            Self::Ems => Err(Failure::not_available("--method ems")),
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
        let mut options = UnfoldOptions::default().with_method(self.method.estimator()?);
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
            options = options.with_bootstrap(bootstrap);
        }
        Ok(options)
    }

    /// Edges of the size bins, for profiles of these sizes.
    pub fn size_edges(&self, profiles: &[TableProfile], scale: f64) -> Result<Vec<f64>, Failure> {
        if let Some(Edges(edges)) = &self.edges {
            return Ok(edges.iter().map(|edge| edge * scale).collect());
        }
        let counted = || {
            profiles
                .iter()
                .filter(|profile| profile.weight > 0.0)
                .map(|profile| profile.size)
        };
        let largest = self
            .max_size
            .map_or_else(|| counted().fold(0.0, f64::max), |size| size * scale);
        let count = self.bins.unwrap_or(BINS);
        match self.spacing {
            Spacing::Equal => Ok(equal_edges(largest, count)),
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

/// What was found, of one type or of several together.
struct Found {
    sum: Unfolding,
    by_type: Vec<Unfolding>,
    rows: DensityRows,
}

impl Unfold {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(output) = &self.output {
            check_file(output, everywhere.force)?;
        }
        let choices = &self.choices;
        let scale = everywhere.scale;
        let options = choices.unfold_options(scale, everywhere.seed)?;
        let mut profiles = read_profiles(&self.profiles).at(&self.profiles)?;
        profiles.iter_mut().for_each(|profile| profile.size *= scale);
        let types = choices.types()?;
        let edges = choices.size_edges(&profiles, scale)?;
        let area = self.area * scale * scale;
        let step = Step::begin("unfolding", everywhere.quiet);
        let progress = |done: f64| step.at(done);

        let labelled = types.types().len() > 1 && profiles.iter().all(|profile| profile.kind.is_some());
        let found = if labelled {
            self.labelled(&profiles, &types, &edges, area, &options, &progress)?
        } else {
            self.together(&profiles, &types, &edges, area, &options, &progress)?
        };
        drop(step);
        go_on()?;
        if let Some(output) = &self.output {
            found.rows.write(output).at(output)?;
        }
        Ok(self.answer(&found, &profiles))
    }

    /// All types share one size distribution: eqs. (10)-(12).
    fn together(
        &self,
        profiles: &[TableProfile],
        types: &ParticleTypes,
        edges: &[f64],
        area: f64,
        options: &UnfoldOptions,
        progress: unfold::Progress<'_>,
    ) -> Result<Found, Failure> {
        if let Some(profile) = profiles
            .iter()
            .find(|profile| profile.kind.is_some_and(|kind| kind >= types.types().len()))
        {
            return Err(self.no_such_type(profile, types));
        }
        let measured = MeasuredProfiles {
            sizes: profiles.iter().map(|profile| profile.size).collect(),
            weights: profiles.iter().map(|profile| profile.weight).collect(),
            categories: profiles.iter().map(|profile| profile.category.unwrap_or(0)).collect(),
            area,
            min_size: 0.0,
        };
        let options = DensityOptions {
            edges: Some(edges.to_vec()),
            sizes: self.choices.sizes(),
            unfold: *options,
            ..DensityOptions::default()
        };
        let densities = particle_densities(&measured, types, &options, progress).at(&self.profiles)?;
        let mut rows = DensityRows::default();
        rows.unfolding(&densities.all, None, None);
        if densities.by_category.len() > 1 {
            for (category, density) in densities.by_category.iter().enumerate() {
                rows.densities(edges, density, None, Some(category));
            }
        }
        Ok(Found {
            sum: densities.all,
            by_type: Vec::new(),
            rows,
        })
    }

    /// Each type has its own profiles: eq. (9).
    fn labelled(
        &self,
        profiles: &[TableProfile],
        types: &ParticleTypes,
        edges: &[f64],
        area: f64,
        options: &UnfoldOptions,
        progress: unfold::Progress<'_>,
    ) -> Result<Found, Failure> {
        let mut parts = Vec::new();
        for (kind, of) in types.types().iter().enumerate() {
            let own = || profiles.iter().filter(|profile| profile.kind == Some(kind));
            let sizes: Vec<f64> = own().map(|profile| profile.size).collect();
            let weights: Vec<f64> = own().map(|profile| profile.weight).collect();
            if weights.iter().sum::<f64>() <= 0.0 {
                return Err(Failure::run(format!(
                    "{}: no profile of type {kind} ({}) counts; leave that --shape out",
                    self.profiles.display(),
                    of.name
                )));
            }
            let counts = ProfileCounts::from_sizes(&sizes, Some(&weights), edges, area).at(&self.profiles)?;
            parts.push((counts, of.kernel(edges, edges, self.choices.sizes()).or_fail()?));
        }
        if let Some(profile) = profiles
            .iter()
            .find(|profile| profile.kind.is_some_and(|kind| kind >= parts.len()))
        {
            return Err(self.no_such_type(profile, types));
        }
        let found = unfold_types_with_progress(&parts, options, progress).at(&self.profiles)?;
        let mut sum = found.types[0].clone();
        sum.number_density = found.number_density;
        sum.intervals = found.intervals;
        (sum.total, sum.mean_size, sum.volume_fraction) = (found.total, found.mean_size, found.volume_fraction);
        (sum.observed, sum.refolded) = (found.observed, found.refolded);
        for part in &found.types[1..] {
            sum.profiles += part.profiles;
            sum.deviance += part.deviance;
            sum.degrees_of_freedom += part.degrees_of_freedom;
            sum.condition_number = sum.condition_number.max(part.condition_number);
            sum.clamped_bins.extend(&part.clamped_bins);
            sum.findings.extend(part.findings.iter().cloned());
        }
        let mut rows = DensityRows::default();
        rows.unfolding(&sum, None, None);
        for (kind, part) in found.types.iter().enumerate() {
            rows.unfolding(part, Some(kind), None);
        }
        Ok(Found {
            sum,
            by_type: found.types,
            rows,
        })
    }

    fn no_such_type(&self, profile: &TableProfile, types: &ParticleTypes) -> Failure {
        Failure::run(format!(
            "{}: a profile has type {}, but there are {} --shape (types are numbered from 0)",
            self.profiles.display(),
            profile.kind.unwrap_or(0),
            types.types().len()
        ))
    }

    fn answer(&self, found: &Found, profiles: &[TableProfile]) -> Answer {
        let Found { sum, by_type, .. } = found;
        let mut answer = Answer::new("unfold");
        for (name, value) in figures(sum, self.choices.kernel_name()) {
            answer.field(name, value);
        }
        if !by_type.is_empty() {
            let names = self.choices.shape.iter().map(|shape| &shape.shape);
            let types: Vec<Value> = names
                .zip(by_type)
                .map(|(shape, part)| json!({ "shape": shape, "number_density": part.number_density }))
                .collect();
            answer.field("types", types);
        }
        for finding in &sum.findings {
            answer.warn(Warning::new(finding.code(), finding.to_string()));
        }
        let unlabelled = profiles.iter().filter(|profile| profile.kind.is_none()).count();
        if unlabelled > 0 && unlabelled < profiles.len() {
            answer.warn(Warning::new(
                "types-ignored",
                format!(
                    "{unlabelled} of {} profiles have no type, so types were not used",
                    profiles.len()
                ),
            ));
        }
        let ranged = |estimate: Estimate, shown: fn(f64) -> String| match estimate.interval {
            Some(Interval { lower, upper }) => {
                format!("{} ({} to {})", shown(estimate.value), shown(lower), shown(upper))
            }
            None => shown(estimate.value),
        };
        answer
            .line(format!(
                "{} profiles, method {}, {} kernel",
                sum.profiles,
                sum.method.name(),
                self.choices.kernel_name()
            ))
            .line(format!(
                "particles per unit volume   {}",
                ranged(sum.total, significant)
            ))
            .line(format!(
                "mean size                   {}",
                ranged(sum.mean_size, significant)
            ))
            .line(format!(
                "volume fraction             {}",
                ranged(sum.volume_fraction, percent)
            ))
            .line(format!(
                "deviance                    {} for {} degrees of freedom",
                significant(sum.deviance),
                sum.degrees_of_freedom
            ))
            .line("size bin               particles per unit volume");
        for (bin, density) in sum.edges.windows(2).zip(&sum.number_density) {
            let density = density.map_or("unknown".to_owned(), significant);
            answer.line(format!(
                "({:>8}, {:>8}]   {density}",
                significant(bin[0]),
                significant(bin[1])
            ));
        }
        answer
    }
}

/// Fields of the JSON object that an unfolding fills.
pub fn figures(found: &Unfolding, kernel: &str) -> Vec<(&'static str, Value)> {
    let ends = |end: fn(&Interval) -> f64| -> Option<Vec<Option<f64>>> {
        let intervals = found.intervals.as_ref()?;
        Some(intervals.iter().map(|interval| interval.as_ref().map(end)).collect())
    };
    let mut fields = vec![
        ("edges", json!(found.edges)),
        ("number_density", json!(found.number_density)),
        ("lower", json!(ends(|interval| interval.lower))),
        ("upper", json!(ends(|interval| interval.upper))),
    ];
    for (names, estimate) in [
        (["total", "total_lower", "total_upper"], found.total),
        (["mean_size", "mean_size_lower", "mean_size_upper"], found.mean_size),
        (
            ["volume_fraction", "volume_fraction_lower", "volume_fraction_upper"],
            found.volume_fraction,
        ),
    ] {
        fields.push((names[0], json!(estimate.value)));
        if let Some(interval) = estimate.interval {
            fields.push((names[1], json!(interval.lower)));
            fields.push((names[2], json!(interval.upper)));
        }
    }
    fields.extend([
        ("profiles", json!(found.profiles)),
        ("observed", json!(found.observed)),
        ("refolded", json!(found.refolded)),
        ("deviance", json!(found.deviance)),
        ("degrees_of_freedom", json!(found.degrees_of_freedom)),
        ("condition_number", json!(found.condition_number)),
        ("penalty", Value::Null),
        ("method", json!(found.method.name())),
        ("kernel", json!(kernel)),
        ("threshold", json!(found.threshold)),
        ("clamped_bins", json!(found.clamped_bins.len())),
    ]);
    fields
}
