//! The measurements of one set of random sections.

use crate::depth_measure::{DepthMeasure, Moments};

/// Means over the directions of one set, or over one batch of random sections; lengths of offsets.
pub(crate) struct Sample {
    /// Length of the offsets with a profile up to the area of each node.
    pub(crate) below: Vec<f64>,
    pub(crate) moments: Moments,
}

impl Sample {
    pub(crate) fn mean(measure: &DepthMeasure, count: f64) -> Self {
        let moments = measure.moments;
        Self {
            below: measure.cumulative().iter().map(|length| length / count).collect(),
            moments: Moments {
                profiles: moments.profiles / count,
                holes: moments.holes / count,
                area: moments.area / count,
                area_squared: moments.area_squared / count,
                total_squared: moments.total_squared / count,
                largest: moments.largest,
            },
        }
    }
}
