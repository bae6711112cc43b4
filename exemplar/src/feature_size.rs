//! The size of an exemplar's features, and the number of levels that it requires.

use ndarray::Array2;
use stereology_spectrum::{autocorrelation, periodic_component};

use crate::exemplar::Exemplar;

/// Feature sizes that a neighbourhood at the coarsest level should span.
const SPAN: f64 = 6.0;

/// Geometric mean of the lags along rows and along columns at which the autocorrelation of an exemplar's channels has
/// fallen to 1/e, pixels.
pub(crate) fn feature_size(exemplar: &Exemplar) -> f64 {
    let (height, width) = exemplar.shape();
    let mut correlation = Array2::<f64>::zeros((height, width));
    let planes = exemplar.planes();
    for plane in planes.chunks_exact(height * width).take(exemplar.inner_colours()) {
        let image = Array2::from_shape_fn((height, width), |(y, x)| f64::from(plane[y * width + x]));
        let found = periodic_component(image.view())
            .ok()
            .and_then(|p| autocorrelation(p.view()).ok());
        if let Some(found) = found {
            correlation += &found;
        }
    }
    let at_zero = correlation[[0, 0]];
    if at_zero <= 0.0 {
        return 1.0;
    }
    let decay = |values: &[f64]| {
        let level = at_zero / std::f64::consts::E;
        let half = values.len() / 2 + 1;
        match (1..half).find(|&lag| values[lag] < level) {
            Some(lag) => (lag - 1) as f64 + (values[lag - 1] - level) / (values[lag - 1] - values[lag]),
            None => half as f64,
        }
    };
    let rows: Vec<f64> = correlation.column(0).to_vec();
    let columns: Vec<f64> = correlation.row(0).to_vec();
    (decay(&rows) * decay(&columns)).sqrt()
}

/// Levels at which a window of `side` pixels spans the largest exemplar's features, at most `most`.
pub(crate) fn levels_for(exemplars: &[Exemplar], side: usize, most: usize) -> usize {
    let size = exemplars.iter().map(feature_size).fold(0.0, f64::max);
    (1..most)
        .find(|&levels| (side << (levels - 1)) as f64 >= SPAN * size)
        .unwrap_or(most)
}
