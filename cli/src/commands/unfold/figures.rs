//! What an unfolding is in JSON.

use serde_json::{Value, json};
use stereology::pipeline::CategoryDensities;
use stereology::unfold::{CrossCheck, Estimate, Interval, Percentiles, SHARES, TypesUnfolding, Unfolding};

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
    let surface = found.surface_density.map(|surface| {
        let names = ["surface_density", "surface_density_lower", "surface_density_upper"];
        (names, surface)
    });
    let scalars = [
        (["total", "total_lower", "total_upper"], found.total),
        (["mean_size", "mean_size_lower", "mean_size_upper"], found.mean_size),
        (
            ["volume_fraction", "volume_fraction_lower", "volume_fraction_upper"],
            found.volume_fraction,
        ),
    ];
    for (names, estimate) in scalars.into_iter().chain(surface) {
        fields.push((names[0], json!(estimate.value)));
        if let Some(interval) = estimate.interval {
            fields.push((names[1], json!(interval.lower)));
            fields.push((names[2], json!(interval.upper)));
        }
    }
    fields.extend([
        ("profiles", json!(found.profiles)),
        ("observed", json!(found.profiles_in(&found.edges, &found.observed))),
        ("refolded", json!(found.profiles_in(&found.edges, &found.refolded))),
        ("deviance", json!(found.deviance)),
        ("degrees_of_freedom", json!(found.degrees_of_freedom)),
        ("condition_number", json!(found.condition_number)),
        ("penalty", json!(found.penalty.map(|penalty| penalty.weight))),
        ("penalty_order", json!(found.penalty.map(|penalty| penalty.order))),
        ("penalty_bend", json!(found.penalty.and_then(|penalty| penalty.bend))),
        ("evidence", json!(found.evidence)),
        ("evidence_for_sparse", json!(found.evidence_for_sparse)),
        ("method", json!(found.method.name())),
        ("kernel", json!(kernel)),
        ("threshold", json!(found.threshold)),
        ("clamped_bins", json!(found.clamped_bins.len())),
        ("by_number", percentiles(&found.distribution.by_number)),
        ("by_volume", percentiles(&found.distribution.by_volume)),
        ("passing", ranged(&found.distribution.passing)),
        (
            "checks",
            json!({ "profiles_per_area": check(found.profiles_per_area), "area_fraction": check(found.area_fraction) }),
        ),
    ]);
    fields
}

/// What is told of a group of profiles, or of all groups together.
pub struct Group<'a> {
    number_density: &'a [Option<f64>],
    intervals: Option<&'a [Option<Interval>]>,
    scalars: [(&'static str, Estimate); 3],
}

impl<'a> Group<'a> {
    /// One of them.
    fn of(found: &'a Unfolding) -> Self {
        Self {
            number_density: &found.number_density,
            intervals: found.intervals.as_deref(),
            scalars: [
                ("total", found.total),
                ("mean_size", found.mean_size),
                ("volume_fraction", found.volume_fraction),
            ],
        }
    }

    /// All together.
    pub fn sum(found: &'a TypesUnfolding) -> Self {
        Self {
            number_density: &found.number_density,
            intervals: found.intervals.as_deref(),
            scalars: [
                ("total", found.total),
                ("mean_size", found.mean_size),
                ("volume_fraction", found.volume_fraction),
            ],
        }
    }
}

/// Densities and totals of a group.
pub fn group_figures(of: &Group<'_>) -> Value {
    let ends = |end: fn(&Interval) -> f64| -> Option<Vec<Option<f64>>> {
        of.intervals
            .map(|intervals| intervals.iter().map(|interval| interval.as_ref().map(end)).collect())
    };
    let mut fields = json!({
        "number_density": of.number_density,
        "lower": ends(|interval| interval.lower),
        "upper": ends(|interval| interval.upper),
    });
    for (name, estimate) in of.scalars {
        fields[name] = json!(estimate.value);
        if let Some(interval) = estimate.interval {
            fields[format!("{name}_lower")] = json!(interval.lower);
            fields[format!("{name}_upper")] = json!(interval.upper);
        }
    }
    fields
}

/// Every category, and every type of it where types are told apart.
pub fn categories(of: &CategoryDensities) -> Vec<Value> {
    let groups = of.categories.iter().zip(&of.kinds).zip(&of.found.types);
    groups
        .map(|((category, kind), found)| {
            let mut fields = group_figures(&Group::of(found));
            fields["category"] = json!(category);
            fields["type"] = json!(kind);
            fields["profiles"] = json!(found.profiles);
            fields["method"] = json!(found.method.name());
            fields["findings"] = found
                .findings
                .iter()
                .map(|finding| json!({ "code": finding.code, "message": finding.message }))
                .collect();
            fields
        })
        .collect()
}

/// Mean and percentiles.
fn percentiles(of: &Percentiles) -> Value {
    json!({ "mean": ranged(&[of.mean]), "shares": SHARES, "percentiles": ranged(&of.percentiles) })
}

/// Values, with their intervals if they have them.
fn ranged(estimates: &[Estimate]) -> Value {
    let values: Vec<f64> = estimates.iter().map(|estimate| estimate.value).collect();
    let ends: Option<Vec<Interval>> = estimates.iter().map(|estimate| estimate.interval).collect();
    match ends {
        None => json!({ "value": values }),
        Some(ends) => json!({
            "value": values,
            "lower": ends.iter().map(|end| end.lower).collect::<Vec<_>>(),
            "upper": ends.iter().map(|end| end.upper).collect::<Vec<_>>(),
        }),
    }
}

fn check(of: CrossCheck) -> Value {
    json!({ "observed": of.observed, "expected": of.expected })
}
