//! The kernel of spheres on the bins that `stereology unfold` takes.

use std::error::Error;
use std::f64::consts::PI;
use stereology_unfold::{
    Kernel, SizeBins, capped_kernel, equal_edges, fitting_edges, fitting_profile_edges, smallest_size,
};

/// Particles may be larger than the largest profile by this factor, if their largest size is not given.
const REACH: f64 = 1.5;

/// Edges of the profile bins, and the kernel. Ten bins are reported up to the largest profile or `largest`.
pub(crate) fn spheres(profiles: &[f64], largest: Option<f64>) -> Result<(Vec<f64>, Kernel), Box<dyn Error>> {
    let last = largest.unwrap_or(profiles.iter().copied().fold(0.0, f64::max));
    let top = largest.unwrap_or(REACH * last);
    let edges = equal_edges(last, 10);
    let smallest = smallest_size(profiles);
    let bins = SizeBins::integrated(&fitting_edges(&edges, smallest, 0.0, top))?.reported_in(&edges)?;
    let profile_edges = fitting_profile_edges(&edges, 100, smallest, 0.0, top);
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let kernel = capped_kernel(&law, 1.0, 0.0, &profile_edges, bins, PI / 6.0)?.with_profile_law(law);
    Ok((profile_edges, kernel))
}
