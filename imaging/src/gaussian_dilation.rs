//! Dilation by a Gaussian: how far the blur of a bright spot reaches.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// Largest value around each pixel, lowered with distance as a Gaussian of standard deviation `sigma` pixels is.
///
/// # Formula
///
/// ```text
/// D(p) = max over q of f(q) exp(−|p − q|² / 2σ²),    |p − q| up to 4σ along rows and columns
/// ```
///
/// Values must not be negative. No value of the result is below that of the field.
///
/// # Complexity
///
/// Pixels times sigma: the kernel is a product, so one pass along rows and one along columns. Rows are worked on in
/// parallel.
///
/// # Examples
///
/// ```
/// let mut spot = ndarray::Array2::<f32>::zeros((9, 9));
/// spot[[4, 4]] = 8.0;
/// let dilated = stereology_imaging::gaussian_dilation(spot.view(), 1.0);
/// assert!((dilated[[4, 6]] - 8.0 * (-2.0_f32).exp()).abs() < 1e-5);
/// assert!((dilated[[3, 5]] - 8.0 * (-1.0_f32).exp()).abs() < 1e-5);
/// ```
#[must_use]
pub fn gaussian_dilation(field: ArrayView2<'_, f32>, sigma: f32) -> Array2<f32> {
    let mut out = field.as_standard_layout().into_owned();
    let weights: Vec<f32> = (1_u16..)
        .map(f32::from)
        .take_while(|step| *step <= 4.0 * sigma)
        .map(|step| (-0.5 * (step / sigma).powi(2)).exp())
        .collect();
    let (height, width) = field.dim();
    let raise = |out: &mut [f32], source: &[f32], weight: f32| {
        out.iter_mut().zip(source).for_each(|(o, s)| *o = o.max(weight * s));
    };
    out.axis_iter_mut(Axis(0)).into_par_iter().for_each(|mut row| {
        let source = row.to_vec();
        let Some(row) = row.as_slice_mut() else { return };
        for (step, &weight) in (1..width).zip(&weights) {
            raise(&mut row[step..], &source, weight);
            raise(row, &source[step..], weight);
        }
    });
    let along_rows = out.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let Some(row) = row.as_slice_mut() else { return };
            for (step, &weight) in (1..height).zip(&weights) {
                for j in [y.checked_sub(step), Some(y + step).filter(|j| *j < height)]
                    .into_iter()
                    .flatten()
                {
                    if let Some(source) = along_rows.row(j).as_slice() {
                        raise(row, source, weight);
                    }
                }
            }
        });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The two passes give the maximum over the square of the definition.
        #[test]
        fn maximum_of_the_definition(width in 1_usize..12, values in proptest::collection::vec(0.0..9.0_f32, 12..90), sigma in 0.2..2.0_f32) {
            let field = Array2::from_shape_fn((values.len() / width, width), |(y, x)| values[y * width + x]);
            let found = gaussian_dilation(field.view(), sigma);
            for ((y, x), d) in found.indexed_iter() {
                let within = |a: usize, b: usize| a.abs_diff(b) as f32 <= 4.0 * sigma;
                let reaching = field.indexed_iter().filter(|((j, i), _)| within(*j, y) && within(*i, x));
                let lowered = reaching.map(|((j, i), v)| {
                    let squared = (j.abs_diff(y).pow(2) + i.abs_diff(x).pow(2)) as f32;
                    v * (-0.5 * squared / sigma.powi(2)).exp()
                });
                let expected = lowered.fold(0.0, f32::max);
                prop_assert!((d - expected).abs() <= 1e-5 * expected, "{d} for {expected}");
            }
        }
    }
}
