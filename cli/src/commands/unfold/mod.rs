//! `stereology unfold`: profiles per area -> particles per volume.

mod choices;
mod edge_rule;
mod figures;

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use stereology::files::densities::DensityRows;
use stereology::files::profiles::{self, ProfileRow};
use stereology::pipeline::{
    DensityError, DensityOptions, MeasuredProfiles, ParticleDensities, SeparateCategories, TypeFractions,
    unfold_profiles,
};
use stereology::unfold::{Estimate, Fractions, Interval, LikelyParameter};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::{percent, significant};
use crate::outputs::check_file;
use crate::progress::{Step, go_on};
use crate::values::{Window, count, positive};

pub use choices::{Choices, Defaults, types};
pub use edge_rule::EdgeRule;
pub use figures::figures;
use figures::{Group, categories, group_figures};

/// Ten bins, and no intervals unless asked.
const DEFAULTS: Defaults = Defaults {
    bins: 10,
    replicates: None,
};

/// From the sizes of the profiles on a cut to the number and sizes of the particles in the solid
///
/// Reads a table of profiles (CSV with a header) and tells how many particles of each size a unit of volume holds, as absolute numbers, with the refolded
/// profile counts beside the observed ones, so that the fit can be judged.
///
/// PROFILES.csv has a column `size` (diameter of the circle with the profile's area) or `area`; if present, `type` (0-based index of --shape), `category`,
/// `weight` (multiplies the count) and `slice` are used too. Other columns are ignored; the `profiles.csv` of `stereology segment` is such a table. --area is
/// the total area examined: without it there are no absolute numbers. Profiles at the edges of a slice count by their `weight`, or by --edge-rule, which needs
/// the box around each profile in columns `left`, `top`, `right`, `bottom` and the size of a slice.
///
/// With --scale all lengths given here, in the table and in options, are multiplied by it.
///
/// With several --shape and no `type` column all types share one size distribution in the given fractions (eqs. 10-12); with types each has its own (eq. 9).
/// With several categories each is unfolded by itself too, on the same bins, and their sum.
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
    /// em stops when no densities could have a log-likelihood higher by more than this [default: 0.01]
    #[arg(long, value_name = "T", value_parser = positive, help_heading = "Unfolding")]
    pub tolerance: Option<f64>,
    /// em and ems stop after so many steps in any case [default: 100000]
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Unfolding")]
    pub iterations: Option<usize>,
    /// Weigh profiles at the edges by this rule instead of the column `weight`; needs the columns left, top, right, bottom and --window (all and inside: touches_edge will do)
    #[arg(long, value_enum, help_heading = "Unfolding")]
    pub edge_rule: Option<EdgeRule>,
    /// Width and height of a slice, for --edge-rule
    #[arg(long, value_name = "WIDTH,HEIGHT", help_heading = "Unfolding")]
    pub window: Option<Window>,
    /// Find the shares of several --shape from the profiles; refused where these do not tell
    #[arg(long, help_heading = "Unfolding")]
    pub unknown_fractions: bool,
    /// Also write the densities as a table: lower_edge,upper_edge,number_density,lower,upper,type,category
    #[arg(short, long, value_name = "densities.csv")]
    pub output: Option<PathBuf>,
}

/// A column of the table; empty if it is missing.
fn column(profiles: &[ProfileRow], of: impl Fn(&ProfileRow) -> Option<usize>) -> Vec<usize> {
    let values: Option<Vec<usize>> = profiles.iter().map(of).collect();
    values.unwrap_or_default()
}

/// densities.csv: all together, each type, each category.
fn rows(found: &ParticleDensities) -> DensityRows {
    let mut rows = DensityRows::default();
    rows.unfolding(&found.all, None, None);
    for (kind, part) in found.by_type.iter().enumerate() {
        rows.unfolding(part, Some(kind), None);
    }
    if let Some(of) = &found.categories {
        for ((category, kind), part) in of.categories.iter().zip(&of.kinds).zip(&of.found.types) {
            rows.unfolding(part, *kind, Some(usize::from(*category)));
        }
    }
    rows
}

impl Unfold {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(output) = &self.output {
            check_file(output, everywhere.force)?;
        }
        let measured = self.measured(everywhere.scale)?;
        let types = self.choices.types()?;
        let options = self.options(everywhere);
        let step = Step::begin("unfolding", everywhere.quiet);
        let found = unfold_profiles(&measured, &types, &options, &|done| step.at(done))
            .map_err(|error| self.failure(&error))?;
        drop(step);
        go_on()?;
        if let Some(output) = &self.output {
            rows(&found).write(output).at(output)?;
        }
        Ok(self.answer(&found))
    }

    /// The table, in the unit of the run.
    fn measured(&self, scale: f64) -> Result<MeasuredProfiles, Failure> {
        let mut profiles = profiles::read(&self.profiles).at(&self.profiles)?;
        if let Some(rule) = self.edge_rule {
            // Boxes and window in the unit of the table: weights have none.
            rule.weigh(&mut profiles, self.window.map(|Window(sides)| sides))?;
        }
        Ok(MeasuredProfiles {
            sizes: profiles.iter().map(|profile| profile.size * scale).collect(),
            weights: profiles.iter().map(|profile| profile.weight).collect(),
            categories: profiles.iter().map(|profile| profile.category.unwrap_or(0)).collect(),
            slices: column(&profiles, |profile| profile.slice),
            types: column(&profiles, |profile| profile.kind),
            area: self.area * scale * scale,
            min_size: 0.0,
        })
    }

    fn options(&self, everywhere: &Everywhere) -> DensityOptions {
        let mut options = self
            .choices
            .density_options(everywhere.scale, everywhere.seed, &DEFAULTS);
        options.categories = SeparateCategories::Always;
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

    fn answer(&self, found: &ParticleDensities) -> Answer {
        let sum = &found.all;
        let mut answer = Answer::new("unfold");
        for (name, value) in figures(sum, self.choices.kernel_name()) {
            answer.field(name, value);
        }
        if !found.by_type.is_empty() {
            let names = self.choices.shape.iter().map(|shape| &shape.shape);
            let types: Vec<Value> = names
                .zip(&found.by_type)
                .map(|(shape, part)| json!({ "shape": shape, "number_density": part.number_density }))
                .collect();
            answer.field("types", types);
        }
        if let Some(of) = &found.categories {
            answer.field("categories", categories(of));
            answer.field("categories_sum", group_figures(&Group::sum(&of.found)));
        }
        for finding in &found.findings {
            answer.warn(finding.clone());
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
        let largest = found.settled.largest.as_ref().and_then(|of| of.likelihood.as_ref());
        if let Some(likely) = largest {
            estimated(&mut answer, "max_size", likely, 1.0, "");
        }
        if let Some(likely) = &found.settled.capping {
            estimated(&mut answer, "capping_angle", likely, 1.0_f64.to_degrees(), " degrees");
        }
        if let Some(found) = &found.settled.fractions {
            fractions(&mut answer, found);
        }
        answer
    }
}

/// A parameter of highest likelihood, in units of 1 / `scale`.
fn estimated(answer: &mut Answer, name: &str, likely: &LikelyParameter, scale: f64, unit: &str) {
    let [value, lower, upper] = [likely.value, likely.interval.lower, likely.interval.upper].map(|v| v * scale);
    answer.field(
        name,
        json!({ "value": value, "lower": lower, "upper": upper, "unbounded": likely.unbounded }),
    );
    answer.line(format!(
        "{} by likelihood    {} ({} to {}){unit}",
        name.replace('_', " "),
        significant(value),
        significant(lower),
        significant(upper)
    ));
}

/// Fractions of the particle types of highest likelihood.
fn fractions(answer: &mut Answer, found: &Fractions) {
    let ends = |end: fn(&Interval) -> f64| found.intervals.iter().map(end).collect::<Vec<_>>();
    answer
        .field("fractions", json!(found.fractions))
        .field("fractions_lower", ends(|of| of.lower))
        .field("fractions_upper", ends(|of| of.upper))
        .field("fractions_condition_number", json!(found.condition_number));
    let shown: Vec<String> = found.fractions.iter().map(|&fraction| percent(fraction)).collect();
    answer.line(format!("fractions of the shapes     {}", shown.join(", ")));
}
