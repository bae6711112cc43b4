//! The verdict on a solid and the table of shapes in JSON.

use schemars::JsonSchema;
use serde::Serialize;
use stereology::pipeline::{
    Check, CheckName, Level, Opinion, OutlineComparison, OutlineDistance, ShapeDensity, Verdict,
};

/// Whether a solid can be trusted.
#[derive(Debug, Serialize, JsonSchema)]
pub struct VerdictFields {
    /// Reliability of densities, sizes and fractions.
    numbers: OpinionFields,
    /// Similarity of sections of the solid to the photograph.
    appearance: OpinionFields,
    /// All checks.
    checks: Vec<VerdictCheck>,
}

/// The worst level of several checks.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OpinionFields {
    /// good, care or bad.
    #[schemars(with = "String")]
    level: Level,
    /// The check farthest beyond its limit.
    #[schemars(with = "String")]
    worst: CheckName,
}

/// A check of the solid.
#[derive(Debug, Serialize, JsonSchema)]
pub struct VerdictCheck {
    /// What is examined.
    #[schemars(with = "String")]
    name: CheckName,
    /// What was found; null if it is not a number.
    value: Option<f64>,
    /// Limit of the level good.
    limit: f64,
    /// good (within the limit), care or bad.
    #[schemars(with = "String")]
    level: Level,
}

impl VerdictFields {
    /// The verdict's fields.
    pub fn of(verdict: &Verdict) -> Self {
        let opinion = |of: Opinion| OpinionFields {
            level: of.level,
            worst: of.worst,
        };
        let check = |of: &Check| VerdictCheck {
            name: of.name,
            value: Some(of.value).filter(|value| value.is_finite()),
            limit: of.limit,
            level: of.level,
        };
        Self {
            numbers: opinion(verdict.numbers),
            appearance: opinion(verdict.appearance),
            checks: verdict.checks.iter().map(check).collect(),
        }
    }
}

/// Particles per volume under one shape.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ShapeFields {
    /// The shape.
    shape: String,
    /// Particles per volume; null if the profiles cannot be unfolded with this shape.
    total: Option<f64>,
    /// Mean size; null as above.
    mean_size: Option<f64>,
    /// Volume fraction; null as above.
    volume_fraction: Option<f64>,
    /// Goodness of fit; null as above, or without degrees of freedom.
    p_value: Option<f64>,
}

impl ShapeFields {
    /// A row of the table.
    pub fn of(row: &ShapeDensity) -> Self {
        let of = row.estimates;
        Self {
            shape: row.shape.clone(),
            total: of.map(|of| of.total),
            mean_size: of.map(|of| of.mean_size),
            volume_fraction: of.map(|of| of.volume_fraction),
            p_value: of.and_then(|of| of.p_value),
        }
    }
}

/// Outlines of the profiles on sections compared with the photograph.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OutlineFields {
    /// Profiles of known shape on the photograph.
    profiles_photo: usize,
    /// Profiles of known shape on the sections.
    profiles_synthetic: usize,
    /// Minor over major axis of the ellipse of equal second moments.
    axis_ratio: OutlineDistanceFields,
    /// Area over that of the convex hull.
    solidity: OutlineDistanceFields,
}

/// Distributions of a quantity of outlines.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OutlineDistanceFields {
    /// Mean on the photograph.
    photo: f64,
    /// Mean on the sections.
    synthetic: f64,
    /// Wasserstein-1 distance of both distributions.
    distance: f64,
    /// Expected distance of two samples of as many profiles of one distribution.
    expected: f64,
}

impl OutlineFields {
    /// The comparison's fields.
    pub fn of(found: &OutlineComparison) -> Self {
        let distance = |of: &OutlineDistance| OutlineDistanceFields {
            photo: of.photo,
            synthetic: of.synthetic,
            distance: of.distance,
            expected: of.expected,
        };
        Self {
            profiles_photo: found.profiles_photo,
            profiles_synthetic: found.profiles_synthetic,
            axis_ratio: distance(&found.axis_ratio),
            solidity: distance(&found.solidity),
        }
    }
}
