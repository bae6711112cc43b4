//! JSON of an unfolding.

use schemars::JsonSchema;
use serde::Serialize;
use stereology::pipeline::ParticleDensities;
use stereology::unfold::{CrossCheck, Estimate, Interval, Percentiles, SHARES, Unfolding};

/// Number densities and what follows from them: most of the JSON of `stereology unfold`, and `unfold` in that of
/// `stereology synthesize`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct UnfoldingFields {
    /// Edges of the size bins.
    edges: Vec<f64>,
    /// Particles per unit volume in each bin; null where a bin lies wholly below the detection limit.
    number_density: Vec<Option<f64>>,
    /// Lower ends of the confidence intervals; null without a bootstrap.
    lower: Option<Vec<Option<f64>>>,
    /// Upper ends of the confidence intervals; null without a bootstrap.
    upper: Option<Vec<Option<f64>>>,
    #[serde(flatten)]
    scalars: Scalars,
    /// Surface area per unit volume; absent if the surface of a shape is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface_density: Option<f64>,
    /// Lower end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface_density_lower: Option<f64>,
    /// Upper end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface_density_upper: Option<f64>,
    /// Number of profiles.
    profiles: usize,
    /// Observed profiles per unit area in each bin.
    observed: Vec<f64>,
    /// Expected profiles per unit area in each bin, from the estimated densities.
    refolded: Vec<f64>,
    /// Deviance of the expected from the observed counts.
    deviance: f64,
    /// Degrees of freedom of the deviance.
    degrees_of_freedom: usize,
    /// Goodness of fit: probability of counts at least as far from the expected ones, if the model is right; null
    /// without a degree of freedom.
    p_value: Option<f64>,
    /// Condition number of the kernel.
    condition_number: f64,
    /// Weight of the smoothness penalty; null without one.
    penalty: Option<f64>,
    /// Order of the penalised difference; null without a penalty.
    penalty_order: Option<usize>,
    /// Size below which the penalty is weaker; null without one.
    penalty_bend: Option<f64>,
    /// Logarithm of the evidence of the penalised estimate; null for other methods.
    evidence: Option<f64>,
    /// Logarithm of the evidence of the sparse estimate; null for other methods.
    evidence_for_sparse: Option<f64>,
    /// Method of estimation.
    method: &'static str,
    /// Position of sizes in their bin: integrated or upper-edge.
    kernel: &'static str,
    /// Detection limit; 0 without one.
    threshold: f64,
    /// Number of negative densities that were set to zero.
    clamped_bins: usize,
    /// Mean and percentiles of size by number.
    by_number: PercentileFields,
    /// Mean and percentiles of size by volume.
    by_volume: PercentileFields,
    /// Fraction of the volume in particles up to each edge: the grading curve.
    passing: Ranged,
    /// Observed totals compared with those expected from the densities.
    checks: Checks,
}

/// Totals of an unfolding, with confidence intervals if there is a bootstrap.
#[derive(Debug, Serialize, JsonSchema)]
struct Scalars {
    /// Particles per unit volume.
    total: f64,
    /// Lower end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    total_lower: Option<f64>,
    /// Upper end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    total_upper: Option<f64>,
    /// Mean particle size.
    mean_size: f64,
    /// Lower end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_size_lower: Option<f64>,
    /// Upper end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_size_upper: Option<f64>,
    /// Fraction of the volume inside particles.
    volume_fraction: f64,
    /// Lower end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    volume_fraction_lower: Option<f64>,
    /// Upper end of its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    volume_fraction_upper: Option<f64>,
}

/// Mean and percentiles of a size distribution.
#[derive(Debug, Serialize, JsonSchema)]
struct PercentileFields {
    /// Mean.
    mean: Ranged,
    /// Fractions to which the percentiles belong.
    shares: Vec<f64>,
    /// Sizes below which these fractions lie.
    percentiles: Ranged,
}

/// Values with confidence intervals, if there is a bootstrap.
#[derive(Debug, Serialize, JsonSchema)]
struct Ranged {
    /// Estimates.
    value: Vec<f64>,
    /// Lower ends of the confidence intervals.
    #[serde(skip_serializing_if = "Option::is_none")]
    lower: Option<Vec<f64>>,
    /// Upper ends of the confidence intervals.
    #[serde(skip_serializing_if = "Option::is_none")]
    upper: Option<Vec<f64>>,
}

/// Observed totals compared with those expected from the densities.
#[derive(Debug, Serialize, JsonSchema)]
struct Checks {
    /// Profiles per unit area.
    profiles_per_area: CheckFields,
    /// Fraction of the area inside profiles.
    area_fraction: CheckFields,
}

/// An observed value and its expectation.
#[derive(Debug, Serialize, JsonSchema)]
struct CheckFields {
    /// Observed on the section.
    observed: f64,
    /// Expected from the densities.
    expected: f64,
}

/// Densities of a colour category, or of one particle type in it.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CategoryFields {
    /// Number of the category.
    category: u8,
    /// Particle type; null if types are not distinguished.
    #[serde(rename = "type")]
    kind: Option<usize>,
    /// Number of profiles.
    profiles: usize,
    /// Particles per unit volume in each bin; null where a bin lies wholly below the detection limit.
    number_density: Vec<Option<f64>>,
    /// Lower ends of the confidence intervals; null without a bootstrap.
    lower: Option<Vec<Option<f64>>>,
    /// Upper ends of the confidence intervals; null without a bootstrap.
    upper: Option<Vec<Option<f64>>>,
    #[serde(flatten)]
    scalars: Scalars,
}

impl UnfoldingFields {
    /// The fields of an unfolding with the kernel of this name.
    pub fn of(found: &Unfolding, kernel: &'static str) -> Self {
        let surface = found.surface_density;
        let interval = surface.and_then(|of| of.interval);
        let intervals = found.intervals.as_deref();
        Self {
            edges: found.edges.clone(),
            number_density: found.number_density.clone(),
            lower: ends(intervals, |interval| interval.lower),
            upper: ends(intervals, |interval| interval.upper),
            scalars: Scalars::of(found.total, found.mean_size, found.volume_fraction),
            surface_density: surface.map(|of| of.value),
            surface_density_lower: interval.map(|of| of.lower),
            surface_density_upper: interval.map(|of| of.upper),
            profiles: found.profiles,
            observed: found.profiles_in(&found.edges, &found.observed),
            refolded: found.profiles_in(&found.edges, &found.refolded),
            deviance: found.deviance,
            degrees_of_freedom: found.degrees_of_freedom,
            p_value: found.p_value,
            condition_number: found.condition_number,
            penalty: found.penalty.map(|penalty| penalty.weight),
            penalty_order: found.penalty.map(|penalty| penalty.order),
            penalty_bend: found.penalty.and_then(|penalty| penalty.bend),
            evidence: found.evidence,
            evidence_for_sparse: found.evidence_for_sparse,
            method: found.method.name(),
            kernel,
            threshold: found.threshold,
            clamped_bins: found.clamped_bins.len(),
            by_number: PercentileFields::of(&found.distribution.by_number),
            by_volume: PercentileFields::of(&found.distribution.by_volume),
            passing: Ranged::of(&found.distribution.passing),
            checks: Checks {
                profiles_per_area: CheckFields::of(found.profiles_per_area),
                area_fraction: CheckFields::of(found.area_fraction),
            },
        }
    }
}

/// One end of each interval.
fn ends(intervals: Option<&[Option<Interval>]>, end: fn(&Interval) -> f64) -> Option<Vec<Option<f64>>> {
    Some(intervals?.iter().map(|interval| interval.as_ref().map(end)).collect())
}

impl Scalars {
    fn of(total: Estimate, mean_size: Estimate, volume_fraction: Estimate) -> Self {
        let lower = |of: Estimate| of.interval.map(|interval| interval.lower);
        let upper = |of: Estimate| of.interval.map(|interval| interval.upper);
        Self {
            total: total.value,
            total_lower: lower(total),
            total_upper: upper(total),
            mean_size: mean_size.value,
            mean_size_lower: lower(mean_size),
            mean_size_upper: upper(mean_size),
            volume_fraction: volume_fraction.value,
            volume_fraction_lower: lower(volume_fraction),
            volume_fraction_upper: upper(volume_fraction),
        }
    }
}

impl CategoryFields {
    /// The parts of the densities; they sum to those of all particles.
    pub fn of(found: &ParticleDensities) -> Vec<Self> {
        let parts = found.by_category.iter();
        parts
            .map(|part| {
                let (of, intervals) = (&part.density, part.density.intervals.as_deref());
                Self {
                    category: part.category,
                    kind: part.kind,
                    profiles: part.profiles,
                    number_density: of.number_density.clone(),
                    lower: ends(intervals, |interval| interval.lower),
                    upper: ends(intervals, |interval| interval.upper),
                    scalars: Scalars::of(of.total, of.mean_size, of.volume_fraction),
                }
            })
            .collect()
    }
}

impl PercentileFields {
    fn of(of: &Percentiles) -> Self {
        Self {
            mean: Ranged::of(&[of.mean]),
            shares: SHARES.to_vec(),
            percentiles: Ranged::of(&of.percentiles),
        }
    }
}

impl Ranged {
    fn of(estimates: &[Estimate]) -> Self {
        let ends: Option<Vec<Interval>> = estimates.iter().map(|estimate| estimate.interval).collect();
        Self {
            value: estimates.iter().map(|estimate| estimate.value).collect(),
            lower: ends.as_ref().map(|ends| ends.iter().map(|end| end.lower).collect()),
            upper: ends.as_ref().map(|ends| ends.iter().map(|end| end.upper).collect()),
        }
    }
}

impl CheckFields {
    fn of(of: CrossCheck) -> Self {
        Self {
            observed: of.observed,
            expected: of.expected,
        }
    }
}
