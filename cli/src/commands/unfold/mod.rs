//! `stereology unfold`: profiles per area -> particles per volume.

mod choices;
mod figures;

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use stereology::files::DensityRows;
use stereology::pipeline::{
    Capping, DensityOptions, MeasuredProfiles, ParticleTypes, capping_angle, largest_particle, particle_densities,
    type_shares,
};
use stereology::unfold::{
    self, Estimate, Interval, ProfileCounts, UnfoldOptions, Unfolding, equal_edges, unfold_types_with_progress,
};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::{percent, significant};
use crate::outputs::check_file;
use crate::profile_table::{TableProfile, read_profiles};
use crate::progress::{Step, go_on};
use crate::values::positive;
use crate::warnings::Warning;

pub use choices::{Choices, Spacing, types};
pub use figures::figures;

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
    /// Find the shares of several --shape from the profiles; refused where these do not tell
    #[arg(long, help_heading = "Unfolding")]
    pub unknown_fractions: bool,
    /// Also write the densities as a table: lower_edge,upper_edge,number_density,lower,upper,type,category
    #[arg(short, long, value_name = "densities.csv")]
    pub output: Option<PathBuf>,
}

/// The slice of every profile, if all have one.
fn slices(profiles: &[TableProfile]) -> Vec<usize> {
    let slices: Option<Vec<usize>> = profiles.iter().map(|profile| profile.slice).collect();
    slices.unwrap_or_default()
}

/// As many equal bins as there are profiles, if more were asked for.
fn fewer_bins(edges: &[f64], profiles: &MeasuredProfiles, choices: &Choices) -> Option<Vec<f64>> {
    let counted = profiles.weights.iter().filter(|weight| **weight > 0.0).count();
    let equal = choices.edges.is_none() && choices.spacing == Spacing::Equal;
    (equal && edges.len() - 1 > counted).then(|| equal_edges(edges[edges.len() - 1], counted.max(1)))
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
        let mut types = choices.types()?;
        let area = self.area * scale * scale;
        let measured = MeasuredProfiles {
            sizes: profiles.iter().map(|profile| profile.size).collect(),
            weights: profiles.iter().map(|profile| profile.weight).collect(),
            categories: profiles.iter().map(|profile| profile.category.unwrap_or(0)).collect(),
            slices: slices(&profiles),
            area,
            min_size: 0.0,
        };
        let (largest, likely_size) =
            largest_particle(&measured, &types, choices.largest(scale), &options).at(&self.profiles)?;
        let edges = choices.size_edges(&profiles, largest, scale)?;
        let fewer = fewer_bins(&edges, &measured, choices);
        let edges = fewer.clone().unwrap_or(edges);
        let (angle, likely_angle) =
            capping_angle(&measured, &types, choices.capping(), &edges, &options).at(&self.profiles)?;
        if self.unknown_fractions && types.types().len() < 2 {
            return Err(Failure::usage("--unknown-fractions needs two or more --shape"));
        }
        let fractions = if self.unknown_fractions {
            let found = type_shares(&measured, &types, &edges, &options).at(&self.profiles)?;
            types = types.with_shares(&found.fractions).or_fail()?;
            Some(found)
        } else {
            None
        };
        let step = Step::begin("unfolding", everywhere.quiet);
        let progress = |done: f64| step.at(done);

        let labelled = types.types().len() > 1 && profiles.iter().all(|profile| profile.kind.is_some());
        let found = if labelled {
            self.labelled(&profiles, &types, &edges, area, &options, &progress)?
        } else {
            let options = DensityOptions {
                edges: Some(edges.clone()),
                sizes: choices.sizes(),
                capping: Capping::Angle(angle),
                unfold: options,
                ..DensityOptions::default()
            };
            self.together(&profiles, &measured, &types, &options, &progress)?
        };
        drop(step);
        go_on()?;
        if let Some(output) = &self.output {
            found.rows.write(output).at(output)?;
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

    /// All types share one size distribution: eqs. (10)-(12).
    fn together(
        &self,
        profiles: &[TableProfile],
        measured: &MeasuredProfiles,
        types: &ParticleTypes,
        options: &DensityOptions,
        progress: unfold::Progress<'_>,
    ) -> Result<Found, Failure> {
        if let Some(profile) = profiles
            .iter()
            .find(|profile| profile.kind.is_some_and(|kind| kind >= types.types().len()))
        {
            return Err(self.no_such_type(profile, types));
        }
        let densities = particle_densities(measured, types, options, progress).at(&self.profiles)?;
        let mut rows = DensityRows::default();
        rows.unfolding(&densities.all, None, None);
        if densities.by_category.len() > 1 {
            for (category, density) in densities.by_category.iter().enumerate() {
                rows.densities(&densities.all.edges, density, None, Some(category));
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
        let threshold = options.min_size.unwrap_or(0.0);
        let bins = types.unfolding_bins(edges, threshold, options.method, self.choices.sizes());
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
            let own_slices: Vec<usize> = own().filter_map(|profile| profile.slice).collect();
            let counts = if own_slices.len() == sizes.len() {
                ProfileCounts::from_slices(&sizes, Some(&weights), &own_slices, &bins.profile_edges, area)
            } else {
                ProfileCounts::from_sizes(&sizes, Some(&weights), &bins.profile_edges, area)
            };
            let kernel = of
                .kernel(&bins.profile_edges, &bins.size_edges, self.choices.sizes())
                .or_fail()?;
            parts.push((counts.at(&self.profiles)?, kernel.reported_in(edges).or_fail()?));
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
        (sum.surface_density, sum.distribution) = (found.surface_density, found.distribution);
        (sum.observed, sum.refolded) = (found.observed, found.refolded);
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
