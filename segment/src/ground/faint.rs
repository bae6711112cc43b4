//! Faint particles, which differ from the binder by less than its texture: found where the texture is averaged out.

use ndarray::Array2;
use stereology_imaging::{connected_components, gaussian_filter, gaussian_filter_rgb};

use crate::files::compression::Compression;
use crate::ground::binder::{BinderModel, length};
use crate::ground::enlarged::enlarged;
use crate::outlines::half_contrast::half_contrast;
use crate::outlines::regions::{hysteresis, neighbours4, neighbours8, open};

/// Side of a cell of the coarse image, pixels.
const CELL: usize = 2;
/// Standard deviation of the coarse smoothing, cells.
const SIGMA: f32 = 1.5;
/// Least fraction of the filter's weight that must lie on binder.
const KNOWN: f32 = 0.25;
/// Least area of a faint region, pixels: about that of the filter.
const LEAST: usize = 60;
/// Fraction of a faint region's outline at the mask beyond which it is the glow of what the mask covers.
const GLOW: f64 = 0.3;

/// Regions outside a mask that differ from the binder only on average over many pixels: their distance from the binder
/// at that scale, 0 elsewhere.
///
/// The image is averaged over about six pixels, without those of the mask and its rim, so that neither texture nor the
/// colours of particles already found hide faint ones. The binder's light and scatter are fitted again at that scale,
/// and the thresholds are standard deviations there, with what remains of the errors of compression: whole blocks of a
/// JPEG have the hue of the step above or below. A region that follows the mask over more than three tenths of its
/// outline is glow of a bright particle and is left out.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_segment::{BinderModel, encoded_image, faint_regions};
///
/// // Texture of ± 12 levels, a square 16 levels lighter.
/// let photo = image::RgbImage::from_fn(120, 120, |x, y| {
///     let inside = (40..80).contains(&x) && (40..80).contains(&y);
///     let texture = (x * 7919 ^ (y * 104_729 + x * y * 31)) % 25;
///     image::Rgb([(if inside { 116 } else { 100 }) + texture as u8; 3])
/// });
/// let image = encoded_image(&photo);
/// let binder = BinderModel::fit(&image, 0);
/// assert!(binder.distance(&image)[[60, 60]] < 5.0);
/// let distance = faint_regions(&image, &binder, &Array2::from_elem((120, 120), false), [5.0, 9.0], None);
/// let found = distance.iter().filter(|z| **z > 0.0).count();
/// assert!(distance[[60, 60]] > 9.0 && (1500..1700).contains(&found), "{found}");
/// ```
#[must_use]
pub fn faint_regions(
    image: &Array2<[f32; 3]>,
    binder: &BinderModel,
    mask: &Array2<bool>,
    [low, high]: [f32; 2],
    compression: Option<Compression>,
) -> Array2<f32> {
    let dim = image.dim();
    let none = Array2::zeros(dim);
    let coarse = averaged(image, binder, mask);
    let known: Array2<[f32; 3]> = coarse.mapv(|c| c.unwrap_or([f32::NAN; 3]));
    let mut model = binder.refit(&known);
    if let Some(compression) = compression {
        model = model.with_errors(&compression.covariance(f64::from(SIGMA) * CELL as f64));
    }
    let deviation = model
        .deviation(&known)
        .mapv(|d| if d[0].is_finite() { d } else { [0.0; 3] });
    let candidates = hysteresis(&deviation.mapv(length), low, high);
    if candidates.iter().all(|c| !c) {
        return none;
    }
    let fine = enlarged(&deviation, dim, [CELL as f32; 2]);
    let mut faint = Array2::from_shape_fn(dim, |(y, x)| {
        let cell = [
            (y / CELL).min(candidates.dim().0 - 1),
            (x / CELL).min(candidates.dim().1 - 1),
        ];
        candidates[cell]
    });
    for _ in 0..2 {
        faint = half_contrast(&fine, &faint, CELL as f32 * SIGMA);
    }
    faint.zip_mut_with(mask, |f, m| *f &= !m);
    open(&mut faint);
    let (components, count) = connected_components(faint.view(), |f| f);
    let mut areas = vec![0_usize; count as usize + 1];
    components.iter().for_each(|&p| areas[p as usize] += 1);
    let glow = follow_the_mask(&components, count, mask);
    Array2::from_shape_fn(dim, |p| {
        let component = components[p] as usize;
        if faint[p] && areas[component] >= LEAST && !glow[component] {
            length(fine[p])
        } else {
            0.0
        }
    })
}

/// Whether each component has more than [`GLOW`] of its outline at the mask: light scattered around a bright particle
/// follows it, particles only touch.
fn follow_the_mask(components: &Array2<u32>, count: u32, mask: &Array2<bool>) -> Vec<bool> {
    let mut sides = vec![(0_usize, 0_usize); count as usize + 1];
    for ((y, x), &component) in components.indexed_iter().filter(|(_, c)| **c != 0) {
        for q in neighbours4([y, x], components.dim()).filter(|q| components[*q] != component) {
            let (all, masked) = &mut sides[component as usize];
            *all += 1;
            *masked += usize::from(mask[q]);
        }
    }
    sides
        .iter()
        .map(|&(all, masked)| masked as f64 > GLOW * all as f64)
        .collect()
}

/// Mean colours of cells and their surroundings, without the mask and its rim; not a number where there is hardly
/// anything else. The light is subtracted before and added after, so that one-sided means keep its slope.
fn averaged(image: &Array2<[f32; 3]>, binder: &BinderModel, mask: &Array2<bool>) -> Array2<Option<[f32; 3]>> {
    let (height, width) = image.dim();
    let cells = (height.div_ceil(CELL), width.div_ceil(CELL));
    let square = |[j, i]: [usize; 2]| {
        let rows = j * CELL..((j + 1) * CELL).min(height);
        let columns = i * CELL..((i + 1) * CELL).min(width);
        rows.flat_map(move |y| columns.clone().map(move |x| (y, x)))
    };
    let taken = Array2::from_shape_fn(cells, |(j, i)| square([j, i]).any(|p| mask[p]));
    let open_cell = Array2::from_shape_fn(cells, |(j, i)| {
        !taken[[j, i]] && !neighbours8([j, i], cells).any(|q| taken[q])
    });
    let mut sums = Array2::from_elem(cells, [0.0_f32; 3]);
    for ((j, i), sum) in sums.indexed_iter_mut().filter(|(p, _)| open_cell[*p]) {
        let light = binder.light(i * CELL, j * CELL);
        let mut count = 0.0;
        for p in square([j, i]) {
            (0..3).for_each(|c| sum[c] += image[p][c] - light[c]);
            count += 1.0;
        }
        sum.iter_mut().for_each(|s| *s /= count);
    }
    let sums = gaussian_filter_rgb(sums.view(), SIGMA);
    let weights = gaussian_filter(open_cell.mapv(|o| f32::from(u8::from(o))).view(), SIGMA);
    Array2::from_shape_fn(cells, |(j, i)| {
        let weight = weights[[j, i]];
        let light = binder.light(i * CELL, j * CELL);
        (weight >= KNOWN).then(|| std::array::from_fn(|c| light[c] + sums[[j, i]][c] / weight))
    })
}

#[cfg(test)]
mod tests {
    use super::faint_regions;
    use crate::files::compression::Compression;
    use crate::ground::binder::BinderModel;
    use ndarray::Array2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Blocks whose hue is stored one step beside that of the others are not faint particles if the size of the step is
    /// known; and regions of ten steps remain.
    #[test]
    fn steps_of_hue_are_no_regions() {
        // Of quality 40: 21 for hue, in coefficients that are eight times the mean over a block.
        let step = 21.0_f32 / 8.0 / 255.0;
        let compression = Compression {
            errors: [0.5, 1.0, 1.0].map(|steps| steps * f64::from(step) * (6.0_f64 / 12.0).sqrt()),
            subsampling: [2, 2],
        };
        let mask = Array2::from_elem((256, 256), false);
        let regions = |size: f32, compression| {
            let mut rng = ChaCha8Rng::seed_from_u64(0);
            let image = Array2::from_shape_fn((256, 256), |(y, x)| {
                // One of 16 blocks of 16 x 16 pixels; Cb and Cr raised.
                let hue = if (y / 16) % 4 == 1 && (x / 16) % 4 == 2 {
                    size
                } else {
                    0.0
                };
                let texture = 0.02 * rng.random::<f32>();
                [1.402, -1.058, 1.772].map(|c| 0.5 + texture + c * hue * step)
            });
            let binder = BinderModel::fit(&image, 0);
            let faint = faint_regions(&image, &binder, &mask, [3.5, 6.3], compression);
            faint.iter().filter(|z| **z > 0.0).count()
        };
        assert!(regions(1.0, None) > 2000);
        assert_eq!(regions(1.0, Some(compression)), 0);
        assert!(regions(10.0, Some(compression)) > 2000);
    }
}
