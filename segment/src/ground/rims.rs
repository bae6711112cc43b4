//! Rims: pixels whose difference from the binder is blur of a particle beside them.

use ndarray::{Array2, Zip};
use stereology_imaging::gaussian_dilation;

/// Distances from the binder, with 0 where a pixel's distance can be blur of a particle beside it. `spread` is the
/// standard deviation of the image's point spread, pixels.
///
/// Where particles differ from the binder by many standard deviations, their blur alone reaches thresholds of a few
/// standard deviations far outside them. A pixel outside a particle is rim if its distance is less than a Gaussian of
/// the point spread's width gives around a pixel with a larger distance. At δ from a straight edge, blur leaves less
/// than this bound, which begins at the half contrast of the edge itself:
///
/// ```text
/// 1 − Φ(δ / s)  <  ½ exp(−δ² / 2s²)      for every δ > 0
/// ```
///
/// # Complexity
///
/// Pixels times spread.
pub(crate) fn without_rims(distance: &Array2<f32>, spread: f32) -> Array2<f32> {
    let reach = gaussian_dilation(distance.view(), spread);
    let mut out = distance.clone();
    // The dilation is the distance itself where nothing beside it reaches farther.
    Zip::from(&mut out).and(&reach).for_each(|z, &r| {
        if r > *z {
            *z = 0.0;
        }
    });
    out
}

/// Pixels that hide faint particles: those of the mask, those at a distance of at least `clear` from the binder, and
/// those around both to which their blur reaches with a standard deviation of the binder or more.
pub(crate) fn hidden_by_blur(distance: &Array2<f32>, mask: &Array2<bool>, clear: f32, spread: f32) -> Array2<bool> {
    let strong = Zip::from(distance)
        .and(mask)
        .map_collect(|&z, &m| if m || z >= clear { z } else { 0.0 });
    let reach = gaussian_dilation(strong.view(), spread);
    Zip::from(&reach).and(mask).map_collect(|&r, &m| m || r >= 1.0)
}
