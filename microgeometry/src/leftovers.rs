//! Labels within the bounds for the triangles for which the histogram has none left.

use crate::conversions::index;
use crate::dual::{DualGraph, spread};

/// Bounds that the labelled triangles impose on all others: x is at least max(xₐ − d) and at most min(xₐ + d), by two
/// searches from all of them at once.
///
/// Any mixture (1 − m) low + m high with one m obeys the bounds between the others too, because neither function
/// changes by more than the distance; so does max(low, min(high, f)) of any such function f.
pub(crate) fn bounds(graph: &DualGraph, labelled: &[bool], labels: &[f64]) -> (Vec<f64>, Vec<f64>) {
    // Only labels beside unlabelled triangles can bound them.
    let beside: Vec<usize> = (0..graph.len())
        .filter(|&t| labelled[t] && graph.links(t).iter().any(|link| !labelled[link.to as usize]))
        .collect();
    let from = |sign: f64| {
        let given = labelled.iter().zip(labels);
        let mut bound: Vec<f64> = given
            .map(|(&known, x)| if known { sign * x } else { f64::NEG_INFINITY })
            .collect();
        let sources: Vec<(u32, f64)> = beside.iter().map(|&t| (index(t), bound[t])).collect();
        spread(graph, &mut bound, &sources);
        bound
    };
    let upper = from(-1.0).into_iter().map(|bound| -bound).collect();
    (from(1.0), upper)
}

/// Iterations in which leftovers take the mean of their neighbours.
const ROUNDS: usize = 8;

/// Leftovers as in the paper (section 4.4): the average of the neighbours, as far as the bounds allow. They start half
/// way between their bounds; then each moves to its neighbours' mean within its current bounds.
pub(crate) fn average(graph: &DualGraph, labelled: &[bool], labels: &mut [f64]) {
    if !labelled.contains(&true) {
        labels.fill(0.0);
        return;
    }
    let (low, high) = bounds(graph, labelled, labels);
    let open: Vec<usize> = (0..graph.len()).filter(|&t| !labelled[t]).collect();
    for &t in &open {
        // Components without any label have no bounds.
        labels[t] = if low[t].is_finite() {
            0.5 * (low[t] + high[t])
        } else {
            0.0
        };
    }
    for _ in 0..ROUNDS {
        for &t in &open {
            let (mut low, mut high, mut sum, mut count) = (f64::NEG_INFINITY, f64::INFINITY, 0.0, 0_u32);
            for (near, length) in graph.neighbours(t) {
                low = low.max(labels[near] - length);
                high = high.min(labels[near] + length);
                sum += labels[near];
                count += 1;
            }
            if count > 0 {
                // Rounding may leave no interval between the bounds; then the value stays.
                let mean = sum / f64::from(count);
                if low <= high {
                    labels[t] = mean.clamp(low, high);
                }
            }
        }
    }
}
