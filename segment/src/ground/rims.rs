//! Rims: pixels whose difference from the binder is blur of a particle beside them.

use ndarray::{Array2, Zip};
use stereology_imaging::gaussian_dilation;

/// Width of the Gaussian that marks rims, in standard deviations of the point spread.
const WIDTH: f32 = 0.8;

/// Distances from the binder, with 0 where a pixel's distance can be blur of a particle beside it. `spread` is the
/// standard deviation of the image's point spread, pixels.
///
/// Where particles differ from the binder by many standard deviations, their blur alone reaches thresholds of a few
/// standard deviations far outside them. A pixel is rim if its distance z is below that of another pixel times a
/// Gaussian of 0.8 of the point spread's width σ:
///
/// ```text
/// z(p)  <  max over q of z(q) exp(−|p − q|² / 2s²),    s = 0.8 σ
/// ```
///
/// At the half contrast of a straight edge, blurred by 1.4 pixels, z falls to 0.48 of itself over one pixel, and faster
/// farther out. The Gaussian falls to 0.68, so that everything beyond the edge is rim. The image of a point falls to
/// 0.78 from its centre to the next pixel: particles as small as the point spread are not rims of themselves.
///
/// # Complexity
///
/// Pixels times spread.
pub(crate) fn without_rims(distance: &Array2<f32>, spread: f32) -> Array2<f32> {
    let reach = gaussian_dilation(distance.view(), WIDTH * spread);
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

#[cfg(test)]
mod tests {
    use super::without_rims;
    use ndarray::Array2;
    use proptest::prelude::*;
    use stereology_imaging::gaussian_filter;

    proptest! {
        /// A blurred disc keeps its inside, and nothing that blur alone reaches remains, however strong the contrast.
        #[test]
        fn blurred_discs_keep_their_inside(radius in 4.0..12.0_f32, spread in 1.2..2.2_f32, contrast in 20.0..2000.0_f32) {
            let from_centre = |y: usize, x: usize| (x as f32 - 24.3).hypot(y as f32 - 23.8);
            let disc = Array2::from_shape_fn((48, 48), |(y, x)| if from_centre(y, x) < radius { contrast } else { 0.0 });
            let kept = without_rims(&gaussian_filter(disc.view(), spread), spread);
            for ((y, x), z) in kept.indexed_iter() {
                let outside = from_centre(y, x) - radius;
                prop_assert!(outside > -1.0 - 0.6 * spread || *z > 0.0, "{outside} inside");
                prop_assert!(outside < 1.0 + 0.6 * spread || outside > 3.5 * spread || *z == 0.0, "{outside} outside: {z}");
            }
        }
    }

    /// The image of a point keeps its centre and the pixels beside it, so that it survives an opening.
    #[test]
    fn points_are_not_their_own_rims() {
        let mut point = Array2::zeros((15, 15));
        point[[7, 7]] = 5000.0_f32;
        for spread in [1.25, 1.41, 1.6] {
            let kept = without_rims(&gaussian_filter(point.view(), spread), spread);
            assert!(
                [[7, 7], [6, 7], [8, 7], [7, 6], [7, 8]].iter().all(|p| kept[*p] > 0.0),
                "{spread}"
            );
        }
    }
}
