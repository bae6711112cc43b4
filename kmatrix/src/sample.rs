//! What one set of random sections measured.

use crate::depth_measure::{DepthMeasure, Moments};

/// What one set of directions, or one batch of random sections, saw: means over directions of lengths of offsets.
pub(crate) struct Sample {
    /// Offsets with a profile up to each node's area.
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
