//! Measures of labels: violated bounds, distances to the interface, distribution.

use crate::contact::ContactDistribution;
use crate::dual::DualGraph;
use crate::error::MicrogeometryError;

/// Rounding of distances, as a fraction of the largest label.
const ROUNDING: f64 = 1e-9;

/// Edges of the graph on which labels differ by more than their length: |xₐ − x_b| > w. Zero means that the labels of
/// any two triangles differ by at most their distance, because paths are sums of edges.
///
/// # Panics
///
/// If there is not one label per triangle.
#[must_use]
pub fn violations(graph: &DualGraph, labels: &[f64]) -> usize {
    assert_eq!(labels.len(), graph.len(), "one label per triangle");
    let allowed = ROUNDING * labels.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let beyond = |a: usize| {
        graph
            .neighbours(a)
            .filter(|&(b, w)| a < b && (labels[a] - labels[b]).abs() > w + allowed)
            .count()
    };
    (0..graph.len()).map(beyond).sum()
}

/// Distances of all triangles to the interface, measured over the graph: from the midpoints of the edges between
/// triangles of different sign, with the sign of the triangle's label. Infinite if there is one sign only.
#[must_use]
pub fn interface_distances(graph: &DualGraph, labels: &[f64]) -> Vec<f64> {
    let mut near = Vec::new();
    for a in 0..graph.len() {
        let other = graph
            .neighbours(a)
            .filter(|&(b, _)| labels[a].is_sign_negative() != labels[b].is_sign_negative());
        let nearest = other.map(|(_, w)| 0.5 * w).fold(f64::INFINITY, f64::min);
        if nearest.is_finite() {
            near.push((a, nearest));
        }
    }
    let mut distances = graph.distances(&near);
    for (d, x) in distances.iter_mut().zip(labels) {
        *d = d.copysign(*x);
    }
    distances
}

/// The contact distribution that a labelled mesh has; triangles count by `weights`.
///
/// # Errors
///
/// [`MicrogeometryError::TooManyBins`] if a label is too large or not finite.
pub fn distribution_of(
    labels: &[f64],
    weights: &[f64],
    bin_width: f64,
) -> Result<ContactDistribution, MicrogeometryError> {
    ContactDistribution::from_distances(bin_width, labels.iter().copied().zip(weights.iter().copied()))
}
