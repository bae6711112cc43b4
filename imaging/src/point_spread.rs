//! The resolution of an image: the standard deviation of the blur at its sharpest strong edges.

use ndarray::{Array2, ArrayView2};

use crate::{area_average_rgb, gaussian_filter_rgb};

/// Standard deviations of the two blurs that are compared, pixels.
const BLURS: [f32; 2] = [1.0, 2.0];
/// An edge is a pixel whose gradient is at least this fraction of the gradient that one pixel in a hundred exceeds.
const STRONG: f32 = 0.5;
/// Blur above which the image is halved before it is measured again: the second blur would hardly change its edges.
const COARSE: f32 = 2.2;
/// Least width and height.
const LEAST: usize = 16;

/// Standard deviation of an image's point spread, in pixels: how far blur, enlargement or noise removal has smeared its
/// edges. `None` of an image without edges or of fewer than 16 pixels' width or height.
///
/// An edge of any height, blurred by σ, has a gradient in proportion to 1 / σ. Two more blurs s₁ and s₂ change it by a
/// known ratio, so that the height is not needed (Zhuo & Sim 2011):
///
/// ```text
/// r = g₁ / g₂,    r² = (σ² + s₂²) / (σ² + s₁²),    σ² = (s₂² − r² s₁²) / (r² − 1)
/// ```
///
/// The result is the median over edges: local maxima of the gradient, in the channel where it is largest, of at least
/// half of its 99th percentile. An image with more blur than 2.2 pixels is halved until it has less. The sampling of
/// pixels counts as blur of 0.29 pixels. Compression as JPEG changes the result by less than a tenth.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # References
///
/// Zhuo & Sim 2011, Defocus map estimation from a single image, Pattern Recognition 44, eqs. (3) to (5).
///
/// # Examples
///
/// ```
/// use stereology_imaging::{gaussian_filter_rgb, point_spread};
///
/// let disc = ndarray::Array2::from_shape_fn((80, 80), |(y, x)| [f32::from((x as f32 - 40.0).hypot(y as f32 - 40.0) < 20.0); 3]);
/// let blurred = gaussian_filter_rgb(disc.view(), 1.5);
/// assert!((point_spread(blurred.view()).unwrap() - 1.5).abs() < 0.15);
/// ```
#[must_use]
pub fn point_spread(image: ArrayView2<'_, [f32; 3]>) -> Option<f32> {
    let mut reduced: Option<Array2<[f32; 3]>> = None;
    let mut factor = 1.0;
    loop {
        let here = reduced.as_ref().map_or(image, |r| r.view());
        let (height, width) = here.dim();
        if height < LEAST || width < LEAST {
            return None;
        }
        let found = spread_of_edges(here)?;
        if found <= COARSE || height < 4 * LEAST || width < 4 * LEAST {
            return Some(factor * found);
        }
        reduced = Some(area_average_rgb(here, (height / 2, width / 2)));
        factor *= 2.0;
    }
}

fn spread_of_edges(image: ArrayView2<'_, [f32; 3]>) -> Option<f32> {
    let [sharp, blunt] = BLURS.map(|s| gaussian_filter_rgb(image, s));
    let (height, width) = image.dim();
    // The gradients of the channel with the largest blunt one; 0 at the image's edges.
    let gradients = Array2::from_shape_fn((height, width), |(y, x)| {
        if y == 0 || x == 0 || y + 1 == height || x + 1 == width {
            return [0.0; 2];
        }
        let of = |image: &Array2<[f32; 3]>, c: usize| {
            let across = image[[y, x + 1]][c] - image[[y, x - 1]][c];
            let down = image[[y + 1, x]][c] - image[[y - 1, x]][c];
            across.hypot(down)
        };
        let strengths = [0, 1, 2].map(|c| of(&blunt, c));
        let (channel, strength) = (0..3)
            .map(|c| (c, strengths[c]))
            .fold((0, 0.0), |best, next| if next.1 > best.1 { next } else { best });
        [of(&sharp, channel), strength]
    });
    let mut sorted: Vec<f32> = gradients.iter().map(|g| g[1]).collect();
    let high = sorted.len() * 99 / 100;
    let least = STRONG * *sorted.select_nth_unstable_by(high, f32::total_cmp).1;
    if least <= f32::EPSILON {
        return None;
    }
    let mut squares = Vec::new();
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let [sharp, blunt] = gradients[[y, x]];
            let is_highest = || (y - 1..=y + 1).all(|j| (x - 1..=x + 1).all(|i| gradients[[j, i]][1] <= blunt));
            if blunt >= least && is_highest() {
                let ratio = (sharp / blunt).powi(2).max(1.0 + 1e-4);
                squares.push((BLURS[1].powi(2) - ratio * BLURS[0].powi(2)) / (ratio - 1.0));
            }
        }
    }
    if squares.is_empty() {
        return None;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f32::total_cmp);
    Some(median.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Discs of several grey levels under noise.
    fn discs(side: usize, blur: f32, noise: f32) -> Array2<[f32; 3]> {
        let image = Array2::from_shape_fn((side, side), |(y, x)| {
            let [v, u] = [y, x].map(|i| (i % 60) as f32 - 29.5);
            let level = 0.2 + 0.15 * ((x / 60 + 2 * (y / 60)) % 4) as f32;
            [if u.hypot(v) < 18.0 { level } else { 0.9 }; 3]
        });
        let mut image = gaussian_filter_rgb(image.view(), blur);
        for ((y, x), p) in image.indexed_iter_mut() {
            let mixed = (x * 7919 + 31) ^ (y * 104_729 + x * y * 17);
            p.iter_mut()
                .for_each(|c| *c += noise * ((mixed % 97) as f32 / 48.0 - 1.0));
        }
        image
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        /// The blur that was applied is found, also under noise.
        #[test]
        fn blur_is_found(blur in 0.6..5.0_f32, noise in 0.0..0.02_f32) {
            let found = point_spread(discs(240, blur, noise).view()).unwrap();
            prop_assert!((found / blur).ln().abs() < 0.15, "{found} for {blur}");
        }
    }

    #[test]
    fn one_colour_has_no_edges() {
        assert_eq!(point_spread(Array2::from_elem((40, 40), [0.5; 3]).view()), None);
        assert_eq!(point_spread(Array2::from_elem((8, 40), [0.5; 3]).view()), None);
    }
}
