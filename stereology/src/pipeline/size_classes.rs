//! Edges of the size bins.

use crate::pipeline::{DensityError, DensityOptions, MeasuredProfiles, Spacing};
use stereology_unfold::{automatic_bins, equal_edges, geometric_edges, phi_edges};

/// More bins than this are not chosen automatically.
const MOST_BINS: usize = 50;

/// Edges of the size bins of `options` for particles up to the size `largest`.
///
/// The smallest size that is seen is the threshold of the options, or the smallest profile.
///
/// # Errors
///
/// [`DensityError::Spacing`]: sizes that do not bear bins of equal ratio.
///
/// ```
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, Spacing, size_edges};
/// let profiles = MeasuredProfiles { sizes: vec![1.0, 4.0], weights: vec![1.0; 2], ..MeasuredProfiles::default() };
/// let options = DensityOptions { bins: 3, spacing: Spacing::Geometric, ..DensityOptions::default() };
/// let edges = size_edges(&profiles, 4.0, &options)?;
/// assert!((edges[1] - 1.0).abs() < 1e-12 && (edges[2] - 2.0).abs() < 1e-12);
/// # Ok::<(), stereology::pipeline::DensityError>(())
/// ```
pub fn size_edges(
    profiles: &MeasuredProfiles,
    largest: f64,
    options: &DensityOptions,
) -> Result<Vec<f64>, DensityError> {
    if let Some(edges) = &options.edges {
        return Ok(edges.clone());
    }
    let counted: Vec<f64> = profiles
        .sizes
        .iter()
        .zip(&profiles.weights)
        .filter(|(_, weight)| **weight > 0.0)
        .map(|(size, _)| *size)
        .collect();
    let bins = match options.bins {
        0 => automatic_bins(&counted, largest, MOST_BINS),
        bins => bins,
    };
    if options.spacing == Spacing::Equal {
        return Ok(equal_edges(largest, bins));
    }
    let smallest = counted.iter().copied().fold(f64::INFINITY, f64::min);
    let smallest = options.unfold.min_size.unwrap_or(smallest);
    let differ = smallest > 0.0 && smallest < largest && largest.is_finite();
    match options.spacing {
        Spacing::Geometric if differ && bins >= 2 => Ok(geometric_edges(smallest, largest, bins - 1)),
        Spacing::Phi if smallest > 0.0 && smallest <= largest && largest.is_finite() => {
            Ok(phi_edges(smallest, largest, 0.5))
        }
        _ => Err(DensityError::Spacing { smallest, largest }),
    }
}
