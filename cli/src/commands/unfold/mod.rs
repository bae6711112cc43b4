//! `stereology unfold`: profiles per area -> particles per volume.

mod choices;
mod edge_rule;
mod figures;

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use stereology::files::DensityRows;
use stereology::pipeline::{
    Capping, CategoryDensities, DensityOptions, MeasuredProfiles, Spacing, capping_angle, category_densities,
    largest_particle, particle_densities, size_edges, type_densities, type_shares,
};
use stereology::unfold::{Estimate, Interval, TypesUnfolding, Unfolding, equal_edges};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::{percent, significant};
use crate::outputs::check_file;
use crate::profile_table::{TableProfile, read_profiles};
use crate::progress::{Step, go_on};
use crate::values::{Window, count, positive};
use crate::warnings::Warning;

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

/// What the table tells of every profile; nothing if it does not of some.
fn all(profiles: &[TableProfile], of: impl Fn(&TableProfile) -> Option<usize>) -> Vec<usize> {
    let told: Option<Vec<usize>> = profiles.iter().map(of).collect();
    told.unwrap_or_default()
}

/// Several types as one unfolding: eq. (9). Method, penalty and threshold are those of the first; findings stay with their types.
fn summed(found: &TypesUnfolding) -> Unfolding {
    let mut sum = found.types[0].clone();
    sum.number_density.clone_from(&found.number_density);
    sum.intervals.clone_from(&found.intervals);
    (sum.total, sum.mean_size, sum.volume_fraction) = (found.total, found.mean_size, found.volume_fraction);
    (sum.surface_density, sum.distribution) = (found.surface_density, found.distribution.clone());
    sum.observed.clone_from(&found.observed);
    sum.refolded.clone_from(&found.refolded);
    sum.findings.clear();
    for part in &found.types[1..] {
        sum.profiles += part.profiles;
        for (sum, part) in [
            (&mut sum.profiles_per_area, part.profiles_per_area),
            (&mut sum.area_fraction, part.area_fraction),
        ] {
            sum.observed += part.observed;
            sum.expected += part.expected;
        }
        sum.deviance += part.deviance;
        sum.degrees_of_freedom += part.degrees_of_freedom;
        sum.condition_number = sum.condition_number.max(part.condition_number);
        sum.clamped_bins.extend(&part.clamped_bins);
    }
    sum
}

/// As many equal bins as there are profiles, if more were asked for.
fn fewer_bins(edges: &[f64], profiles: &MeasuredProfiles, options: &DensityOptions) -> Option<Vec<f64>> {
    let counted = profiles.weights.iter().filter(|weight| **weight > 0.0).count();
    let equal = options.edges.is_none() && options.spacing == Spacing::Equal;
    (equal && edges.len() - 1 > counted).then(|| equal_edges(edges[edges.len() - 1], counted.max(1)))
}

/// What was found, of one type or of several together.
struct Found {
    sum: Unfolding,
    by_type: Vec<Unfolding>,
    by_category: Option<CategoryDensities>,
}

impl Found {
    /// densities.csv: all together, each type, each category.
    fn rows(&self) -> DensityRows {
        let mut rows = DensityRows::default();
        rows.unfolding(&self.sum, None, None);
        for (kind, part) in self.by_type.iter().enumerate() {
            rows.unfolding(part, Some(kind), None);
        }
        if let Some(CategoryDensities {
            categories,
            kinds,
            found,
        }) = &self.by_category
        {
            for ((category, kind), part) in categories.iter().zip(kinds).zip(&found.types) {
                rows.unfolding(part, *kind, Some(usize::from(*category)));
            }
        }
        rows
    }
}

impl Unfold {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(output) = &self.output {
            check_file(output, everywhere.force)?;
        }
        let choices = &self.choices;
        let scale = everywhere.scale;
        let mut options = choices.density_options(scale, everywhere.seed, &DEFAULTS);
        let of = &mut options.unfold;
        of.tolerance = self.tolerance.unwrap_or(of.tolerance);
        of.max_iterations = self.iterations.unwrap_or(of.max_iterations);
        let mut profiles = read_profiles(&self.profiles).at(&self.profiles)?;
        if let Some(rule) = self.edge_rule {
            // Boxes and window in the unit of the table: weights have none.
            rule.weigh(&mut profiles, self.window.map(|Window(sides)| sides))?;
        }
        profiles.iter_mut().for_each(|profile| profile.size *= scale);
        let mut types = choices.types()?;
        let area = self.area * scale * scale;
        let measured = MeasuredProfiles {
            sizes: profiles.iter().map(|profile| profile.size).collect(),
            weights: profiles.iter().map(|profile| profile.weight).collect(),
            categories: profiles.iter().map(|profile| profile.category.unwrap_or(0)).collect(),
            slices: all(&profiles, |profile| profile.slice),
            types: all(&profiles, |profile| profile.kind),
            area,
            min_size: 0.0,
        };
        let (largest, likely_size) =
            largest_particle(&measured, &types, options.max_size, &options.unfold).at(&self.profiles)?;
        let edges = size_edges(&measured, largest, &options).at(&self.profiles)?;
        let fewer = fewer_bins(&edges, &measured, &options);
        let edges = fewer.clone().unwrap_or(edges);
        let (angle, likely_angle) =
            capping_angle(&measured, &types, options.capping, &edges, &options.unfold).at(&self.profiles)?;
        if self.unknown_fractions && types.types().len() < 2 {
            return Err(Failure::usage("--unknown-fractions needs two or more --shape"));
        }
        let fractions = if self.unknown_fractions {
            let found = type_shares(&measured, &types, &edges, &options.unfold).at(&self.profiles)?;
            types = types.with_shares(&found.fractions).or_fail()?;
            Some(found)
        } else {
            None
        };
        let step = Step::begin("unfolding", everywhere.quiet);
        let progress = |done: f64| step.at(done);

        let options = DensityOptions {
            edges: Some(edges.clone()),
            capping: Capping::Angle(angle),
            ..options
        };
        let kinds = types.types().len();
        if let Some(kind) = profiles.iter().find_map(|of| of.kind.filter(|kind| *kind >= kinds)) {
            return Err(Failure::run(format!(
                "{}: a profile has type {kind}, but there are {kinds} --shape (types are numbered from 0)",
                self.profiles.display(),
            )));
        }
        let by_category = category_densities(&measured, &types, &options, &progress).at(&self.profiles)?;
        let found = if kinds > 1 && !measured.types.is_empty() {
            let found = type_densities(&measured, &types, &options, &progress).at(&self.profiles)?;
            Found {
                sum: summed(&found),
                by_type: found.types,
                by_category,
            }
        } else {
            let found = particle_densities(&measured, &types, &options, &progress).at(&self.profiles)?;
            Found {
                sum: found.all,
                by_type: Vec::new(),
                by_category,
            }
        };
        drop(step);
        go_on()?;
        if let Some(output) = &self.output {
            found.rows().write(output).at(output)?;
        }
        let mut answer = self.answer(&found, &profiles);
        if fewer.is_some() {
            let (bins, count) = (edges.len() - 1, profiles.len());
            answer.warn(Warning::new(
                "fewer-bins",
                format!("{count} profiles do not bear more bins than profiles: {bins} equal bins were used"),
            ));
        }
        for (name, likely) in [("max_size", likely_size), ("capping_angle", likely_angle)] {
            if let Some(likely) = likely {
                let (scale, unit) = if name == "max_size" {
                    (1.0, "")
                } else {
                    (1.0_f64.to_degrees(), " degrees")
                };
                let [value, lower, upper] =
                    [likely.value, likely.interval.lower, likely.interval.upper].map(|v| v * scale);
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
        }
        if let Some(fractions) = fractions {
            answer.field("fractions", json!(fractions.fractions));
            answer.field(
                "fractions_lower",
                fractions.intervals.iter().map(|of| of.lower).collect::<Vec<_>>(),
            );
            answer.field(
                "fractions_upper",
                fractions.intervals.iter().map(|of| of.upper).collect::<Vec<_>>(),
            );
            answer.field("fractions_condition_number", json!(fractions.condition_number));
            let shown: Vec<String> = fractions.fractions.iter().map(|&share| percent(share)).collect();
            answer.line(format!("shares of the shapes        {}", shown.join(", ")));
        }
        Ok(answer)
    }

    fn answer(&self, found: &Found, profiles: &[TableProfile]) -> Answer {
        let Found {
            sum,
            by_type,
            by_category,
        } = found;
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
        if let Some(of) = by_category {
            answer.field("categories", categories(of));
            answer.field("categories_sum", group_figures(&Group::sum(&of.found)));
        }
        for finding in &sum.findings {
            answer.warn(Warning::new(finding.code, finding.message.clone()));
        }
        for (kind, part) in by_type.iter().enumerate() {
            for finding in &part.findings {
                answer.warn(Warning::new(finding.code, format!("type {kind}: {}", finding.message)));
            }
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
