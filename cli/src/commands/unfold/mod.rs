//! `stereology unfold`: from profiles per area to particles per volume.

mod choices;
mod edge_rule;
mod figures;
mod input;

use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::profiles::{Headless, ProfileReading, ProfileRow};
use stereology::files::{densities, size_columns};
use stereology::grid::LengthUnit;
use stereology::pipeline::{
    Clusters, DensityError, DensityOptions, Finding, MeasuredProfiles, ParticleDensities, TypeFractions,
    unfold_profiles,
};
use stereology::unfold::{Estimate, Fractions, Interval, LikelyParameter, Resampling};

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::Output;
use crate::progress::{Step, go_on};
use crate::values::{Window, count, positive, size_error};
use stereology_report::{percent, significant};

pub use choices::{Choices, Defaults, types};
pub use edge_rule::EdgeRule;
pub use figures::{CategoryFields, UnfoldingFields};
use input::{Given, Input};

/// Ten bins, and no confidence intervals unless requested.
const DEFAULTS: Defaults = Defaults {
    bins: 10,
    replicates: None,
};

/// For tables of `segment` as many bins as `synthesize` takes, so that both give the same numbers.
const OF_SEGMENT: Defaults = Defaults {
    bins: 16,
    replicates: None,
};

/// Estimates the number and sizes of particles in a solid from the profiles on a plane section
///
/// Reads a table of profiles (CSV with a header) and reports the number of particles per unit volume in each size bin.
/// The expected profile counts (refolded) are reported beside the observed counts, so that the fit can be examined.
///
/// INPUT is a table of profiles, or a folder of `stereology segment` (or `synthesize`), whose profiles.csv is read. The
/// table may begin with lines `# key=value`: area, min_size, unit, edge_rule, width, height. `segment` writes them, and
/// unfolding takes area, threshold, unit and edge rule from them. An option that contradicts them is an error.
///
/// The table has a column `size` (equivalent circular diameter) or `area`, or another name of these that ImageJ,
/// scikit-image, CellProfiler, DREAM.3D, GrainSizeTools or QuPath gives them. Separator, encoding and decimal mark are
/// found, and reported unless the table is plain; units in the header are converted to --unit. The columns `type`
/// (0-based index of --shape), `category`, `weight` (multiplies the count) and `slice` are used if present; types,
/// categories and slices may be words. Other columns are ignored.
/// --area is the total area examined, which absolute numbers require. Profiles at the edges of a slice count by their
/// `weight`, or by --edge-rule, which needs the bounding box of each profile in the columns `left`, `top`, `right`,
/// `bottom`, and the size of a slice.
///
/// --scale multiplies all lengths, in the table and in the options.
///
/// Several --shape without a `type` column share one size distribution in the given fractions (eqs. 10-12); with a
/// `type` column each type has its own (eq. 9). Categories are labels of the particles of one fit of all profiles, so
/// their densities sum to those of all particles; the fraction of a category depends on the size of the particle.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology unfold seg --bins 10 --shape rock:1 -o densities.csv\n         stereology unfold profiles.csv --area 307200 --min-size 6 --shape rock:1"
)]
pub struct Unfold {
    /// Table of profiles, or a folder of `stereology segment`
    #[arg(value_name = "INPUT")]
    pub profiles: PathBuf,
    /// Total area examined, in the squared unit of the sizes [default: that of the table]
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    pub area: Option<f64>,
    #[command(flatten)]
    pub choices: Choices,
    /// Tolerance of em: stop when the log-likelihood is within this bound of its maximum [default: 0.01]
    #[arg(long, value_name = "T", value_parser = positive, help_heading = "Unfolding")]
    pub tolerance: Option<f64>,
    /// Maximum number of iterations of em and ems [default: 100000]
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Unfolding")]
    pub iterations: Option<usize>,
    /// Rule for profiles at the edges, instead of the column `weight`; needs the columns left, top, right, bottom and
    /// --window (for all and inside the column touches_edge suffices)
    #[arg(long, value_enum, help_heading = "Unfolding")]
    pub edge_rule: Option<EdgeRule>,
    /// Width and height of a slice, for --edge-rule [default: those of the table]
    #[arg(long, value_name = "WIDTH,HEIGHT", help_heading = "Unfolding")]
    pub window: Option<Window>,
    /// Relative standard deviation of the errors of the measured sizes, for example 0.1: measured sizes scatter about
    /// the true ones, which would otherwise be interpreted as more large and small particles
    #[arg(long, value_name = "R", value_parser = size_error, help_heading = "Unfolding")]
    pub size_error: Option<f64>,
    /// Estimate the fractions of several --shape from the profiles; refused if the profiles do not determine them
    #[arg(long, help_heading = "Unfolding")]
    pub unknown_fractions: bool,
    /// Leave out rows with invalid values (empty, words, not above zero), which are counted in a warning, instead of
    /// refusing the table; rows whose size is NaN are always left out
    #[arg(long)]
    pub skip_invalid: bool,
    /// Also write the densities as a table: lower_edge,upper_edge,number_density,lower,upper,type,category
    #[arg(short, long, value_name = "densities.csv")]
    pub output: Option<Output>,
}

/// A column of the table; empty if it is missing.
fn column(profiles: &[ProfileRow], of: impl Fn(&ProfileRow) -> Option<usize>) -> Vec<usize> {
    let values: Option<Vec<usize>> = profiles.iter().map(of).collect();
    values.unwrap_or_default()
}

/// Mean colour of the profiles of each category; empty if the table has no colours.
fn category_colours(profiles: &[ProfileRow]) -> Vec<[f64; 3]> {
    let categories = profiles
        .iter()
        .map(|profile| usize::from(profile.category.unwrap_or(0)) + 1);
    let mut sums = vec![([0.0; 3], 0.0_f64); categories.max().unwrap_or(0)];
    for profile in profiles {
        let Some(colour) = profile.colour else {
            return Vec::new();
        };
        let (sum, count) = &mut sums[usize::from(profile.category.unwrap_or(0))];
        sum.iter_mut().zip(colour).for_each(|(sum, value)| *sum += value);
        *count += 1.0;
    }
    sums.into_iter()
        .map(|(sum, count)| sum.map(|value| value / count.max(1.0)))
        .collect()
}

/// JSON of `stereology unfold`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct UnfoldFields {
    #[serde(flatten)]
    all: UnfoldingFields,
    /// Densities of each particle type; only if the table has types.
    #[serde(skip_serializing_if = "Option::is_none")]
    types: Option<Vec<TypeFields>>,
    /// Unit of all lengths; null if it is not known, or pixels.
    unit: Option<&'static str>,
    /// Clustering of the profiles; null without positions or several slices, and for few profiles.
    clustering: Option<ClusteringFields>,
    /// Densities of each colour category, which sum to those of all particles.
    by_category: Vec<CategoryFields>,
    /// Largest particle size; with --max-size likelihood.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_size: Option<LikelihoodFields>,
    /// Capping angle in degrees; with --capping-angle fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    capping_angle: Option<LikelihoodFields>,
    #[serde(flatten)]
    fractions: Option<FractionFields>,
}

/// How clustered the profiles are.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ClusteringFields {
    /// Variance of the number of profiles over its mean, if they are clustered; independent profiles have 1.
    dispersion: f64,
    /// Probability of such a pattern if profiles are not clustered.
    p_value: f64,
    /// What the intervals resample: counts, slices or blocks; null without a bootstrap.
    resampled: Option<&'static str>,
}

impl ClusteringFields {
    fn of(clusters: &Clusters) -> Option<Self> {
        let of = clusters.clustering?;
        Some(Self {
            dispersion: of.dispersion,
            p_value: of.p_value,
            resampled: clusters.resampling.map(Resampling::name),
        })
    }
}

/// Densities of a particle type.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TypeFields {
    /// Description of the shape, as on the command line.
    shape: String,
    /// Particles per unit volume in each bin; null where a bin lies wholly below the detection limit.
    number_density: Vec<Option<f64>>,
}

/// A value of greatest likelihood.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LikelihoodFields {
    /// Most likely value.
    value: f64,
    /// Lower end of its confidence interval.
    lower: f64,
    /// Upper end of its confidence interval.
    upper: f64,
    /// Whether the likelihood does not bound the value.
    unbounded: bool,
}

/// Fractions of the particle types; with --unknown-fractions.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FractionFields {
    /// Fraction of each shape, by number.
    fractions: Vec<f64>,
    /// Lower ends of the confidence intervals.
    fractions_lower: Vec<f64>,
    /// Upper ends of the confidence intervals.
    fractions_upper: Vec<f64>,
    /// Condition number of the estimation of fractions.
    fractions_condition_number: f64,
}

impl Fields for UnfoldFields {
    const COMMAND: &'static str = "unfold";
}

impl Unfold {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let output = &self.output;
        let output = output
            .as_ref()
            .map(|output| everywhere.outputs.file(output))
            .transpose()?;
        let reading = ProfileReading {
            // A length per pixel is no unit of the table.
            unit: everywhere.unit.filter(|_| everywhere.scale_given.is_none()),
            skip_invalid: self.skip_invalid,
            headless: Headless::Refused,
        };
        let mut input = Input::read(&self.profiles, &reading)?;
        let unit = input.unit(everywhere)?;
        let stated = input.head.min_size;
        let mut remarks = std::mem::take(&mut input.findings);
        remarks.extend(size_columns::findings(&input.rows));
        remarks.extend(self.without_effect());
        let measured = self.measured(input, everywhere.scale)?;
        let types = self.choices.types()?;
        if self.size_error.is_some() && self.choices.method == choices::Method::Paper {
            return Err(Failure::usage(
                "--size-error needs profile bins beyond the largest size, which --method paper cannot use; use --method auto",
            ));
        }
        let options = self.options(everywhere, stated);
        let step = Step::begin("unfolding", everywhere.quiet);
        let found = unfold_profiles(&measured, &types, &options, &|done| step.at(done))
            .map_err(|error| self.failure(&error))?;
        drop(step);
        go_on()?;
        if let Some(output) = &output {
            densities::write(output, &found, unit).at(output)?;
        }
        self.answer(&found, remarks, unit)
    }

    /// A warning of options that have no effect beside the others.
    fn without_effect(&self) -> Option<Finding> {
        let of = &self.choices;
        let without_bootstrap = of.bootstrap.is_none();
        let iterates = matches!(of.method, choices::Method::Em | choices::Method::Ems);
        let unused = [
            (
                "--resample",
                of.resample.is_some() && without_bootstrap,
                "without --bootstrap",
            ),
            (
                "--level",
                of.level.is_some() && without_bootstrap,
                "without --bootstrap",
            ),
            (
                "--tolerance",
                self.tolerance.is_some() && of.method != choices::Method::Em,
                "except with --method em",
            ),
            (
                "--iterations",
                self.iterations.is_some() && !iterates,
                "except with --method em or ems",
            ),
            (
                "--window",
                self.window.is_some() && self.edge_rule.is_none(),
                "without --edge-rule",
            ),
            (
                "--bins",
                of.bins.is_some() && of.spacing == choices::Spacing::Phi,
                "with --spacing phi",
            ),
        ];
        let unused = unused.into_iter().filter(|of| of.1);
        let texts: Vec<String> = unused
            .map(|(option, _, why)| format!("{option} has no effect {why}"))
            .collect();
        (!texts.is_empty()).then(|| Finding::new("unused-option", texts.join("; ")))
    }

    /// The table, in the unit of the run.
    fn measured(&self, input: Input, scale: f64) -> Result<MeasuredProfiles, Failure> {
        let window = self.window.map(|Window(sides)| sides);
        input.check(&Given {
            area: self.area,
            min_size: self.choices.min_size,
            edge_rule: self.edge_rule.map(EdgeRule::name),
            window,
        })?;
        let area = input.area(self.area)?;
        let Input { rows, head, .. } = input;
        let mut profiles = rows;
        // The weights of a table that states its rule are those of the rule.
        if let Some(rule) = self.edge_rule.filter(|_| head.edge_rule.is_none()) {
            // Bounding boxes and window are both in the unit of the table, and weights have no unit.
            rule.weigh(&mut profiles, window.or(head.window))?;
        }
        Ok(MeasuredProfiles {
            sizes: profiles.iter().map(|profile| profile.size * scale).collect(),
            weights: profiles.iter().map(|profile| profile.weight).collect(),
            categories: profiles.iter().map(|profile| profile.category.unwrap_or(0)).collect(),
            colours: category_colours(&profiles),
            slices: column(&profiles, |profile| profile.slice),
            positions: profiles
                .iter()
                .map(|profile| profile.position.map(|at| at.map(|of| of * scale)))
                .collect::<Option<Vec<_>>>()
                .unwrap_or_default(),
            types: column(&profiles, |profile| profile.kind),
            area: area * scale * scale,
            min_size: head
                .min_size
                .map_or(0.0, |smallest| MeasuredProfiles::limit_below(smallest * scale)),
            size_error: self.size_error.unwrap_or(0.0),
        })
    }

    /// The options, for a table that states this size of its smallest profiles.
    fn options(&self, everywhere: &Everywhere, stated: Option<f64>) -> DensityOptions {
        let defaults = if stated.is_some() { &OF_SEGMENT } else { &DEFAULTS };
        let mut options = self
            .choices
            .density_options(everywhere.scale, everywhere.seed, defaults);
        // The same threshold in other digits is that of the table.
        if input::repeats(self.choices.min_size, stated) {
            options.unfold.min_size = None;
        }
        if self.unknown_fractions {
            options.fractions = TypeFractions::Likelihood;
        }
        let of = &mut options.unfold;
        of.tolerance = self.tolerance.unwrap_or(of.tolerance);
        of.max_iterations = self.iterations.unwrap_or(of.max_iterations);
        options
    }

    fn failure(&self, error: &DensityError) -> Failure {
        let advice = match error {
            DensityError::OneType => return Failure::usage("--unknown-fractions needs two or more --shape"),
            DensityError::UnknownType { .. } => ": give a --shape for every type",
            DensityError::EmptyType { .. } => ", with its --shape",
            DensityError::NoProfiles(_) => " (--edge-rule)",
            _ => "",
        };
        Failure::run(format!("{}: {error}{advice}", self.profiles.display()))
    }

    fn answer(
        &self,
        found: &ParticleDensities,
        remarks: Vec<Finding>,
        unit: Option<LengthUnit>,
    ) -> Result<Answer, Failure> {
        let sum = &found.all;
        let (mut notes, settled) = (Notes::default(), &found.settled);
        for finding in found.findings.iter().cloned().chain(remarks) {
            notes.warn(finding);
        }
        let ranged = |estimate: Estimate, shown: fn(f64) -> String| match estimate.interval {
            Some(Interval { lower, upper }) => {
                format!("{} ({} to {})", shown(estimate.value), shown(lower), shown(upper))
            }
            None => shown(estimate.value),
        };
        notes
            .line(format!(
                "{} profiles, method {}, {} kernel",
                sum.profiles,
                sum.method.name(),
                self.choices.kernel_name()
            ))
            .line(format!(
                "particles per {:<13} {}",
                unit.map_or("unit volume".to_owned(), |unit| format!("{}\u{b3}", unit.printed())),
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
            .line(match unit {
                Some(unit) => format!("size bin ({0})          particles per {0}\u{b3}", unit.printed()),
                None => "size bin               particles per unit volume".to_owned(),
            });
        for (bin, density) in sum.edges.windows(2).zip(&sum.number_density) {
            let density = density.map_or("unknown".to_owned(), significant);
            notes.line(format!(
                "({:>8}, {:>8}]   {density}",
                significant(bin[0]),
                significant(bin[1])
            ));
        }
        let types = self
            .choices
            .shape
            .iter()
            .zip(&found.by_type)
            .map(|(shape, part)| TypeFields {
                shape: shape.shape.clone(),
                number_density: part.number_density.clone(),
            });
        let largest = settled.largest.as_ref().and_then(|of| of.likelihood.as_ref());
        let fields = UnfoldFields {
            all: UnfoldingFields::of(sum, self.choices.kernel_name()),
            types: (!found.by_type.is_empty()).then(|| types.collect()),
            unit: unit.map(LengthUnit::symbol),
            clustering: ClusteringFields::of(&found.clusters),
            by_category: CategoryFields::of(found),
            max_size: largest.map(|likely| estimated(&mut notes, "max size", likely, 1.0, "")),
            capping_angle: settled
                .capping
                .as_ref()
                .map(|likely| estimated(&mut notes, "capping angle", likely, 1.0_f64.to_degrees(), " degrees")),
            fractions: settled.fractions.as_ref().map(|found| fractions(&mut notes, found)),
        };
        Answer::new(&fields, notes)
    }
}

/// A parameter of greatest likelihood, multiplied by `scale`.
fn estimated(notes: &mut Notes, name: &str, likely: &LikelyParameter, scale: f64, unit: &str) -> LikelihoodFields {
    let [value, lower, upper] = [likely.value, likely.interval.lower, likely.interval.upper].map(|v| v * scale);
    notes.line(format!(
        "{name} by likelihood    {} ({} to {}){unit}",
        significant(value),
        significant(lower),
        significant(upper)
    ));
    LikelihoodFields {
        value,
        lower,
        upper,
        unbounded: likely.unbounded,
    }
}

/// Fractions of the particle types of greatest likelihood.
fn fractions(notes: &mut Notes, found: &Fractions) -> FractionFields {
    let shown: Vec<String> = found.fractions.iter().map(|&fraction| percent(fraction)).collect();
    notes.line(format!("fractions of the shapes     {}", shown.join(", ")));
    FractionFields {
        fractions: found.fractions.clone(),
        fractions_lower: found.intervals.iter().map(|of| of.lower).collect(),
        fractions_upper: found.intervals.iter().map(|of| of.upper).collect(),
        fractions_condition_number: found.condition_number,
    }
}
