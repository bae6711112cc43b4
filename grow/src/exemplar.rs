//! Checks of an exemplar.

use ndarray::{ArrayView3, Axis};

use crate::error::GrowError;
use crate::numbers::MOST;

/// Half the side of the window, if windows can be taken from the exemplar.
pub(crate) fn check_exemplar(exemplar: ArrayView3<'_, f32>, window: usize) -> Result<usize, GrowError> {
    if window != 0 && !(window % 2 == 1 && (3..=15).contains(&window)) {
        return Err(GrowError::Window { window });
    }
    let (height, width, _) = exemplar.dim();
    let least = window.max(1);
    if height < least || width < least || exemplar.is_empty() {
        return Err(GrowError::ExemplarTooSmall { width, height, window });
    }
    if exemplar.len() >= MOST {
        return Err(GrowError::TooLarge);
    }
    if let Some(((row, column, _), _)) = exemplar.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(GrowError::NotFinite { row, column });
    }
    let first = exemplar.index_axis(Axis(0), 0);
    let first = first.index_axis(Axis(0), 0);
    if exemplar.lanes(Axis(2)).into_iter().all(|pixel| pixel == first) {
        return Err(GrowError::ConstantExemplar);
    }
    Ok(window / 2)
}
