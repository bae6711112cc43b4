//! The blur detector: how steep grey levels are.

use ndarray::Array2;

/// Mean length of the gradient by forward differences, grey levels per pixel; over the last row and column there is none. Zero for pictures less than two pixels wide or high.
///
/// The ratio of a solid's to its exemplar's is 1; below 1 the solid is blurred, above 1 it is noisier or has seams.
///
/// ```
/// use ndarray::Array2;
/// use stereology_exemplar::measure::mean_gradient;
///
/// let slope = Array2::from_shape_fn((5, 7), |(y, x)| 0.03 * x as f32 + 0.04 * y as f32);
/// assert!((mean_gradient(&slope) - 0.05).abs() < 1e-6);
/// ```
#[must_use]
pub fn mean_gradient(picture: &Array2<f32>) -> f64 {
    let (height, width) = picture.dim();
    if height < 2 || width < 2 {
        return 0.0;
    }
    let mut sum = 0.0;
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let at = f64::from(picture[[y, x]]);
            let (right, below) = (f64::from(picture[[y, x + 1]]) - at, f64::from(picture[[y + 1, x]]) - at);
            sum += (right * right + below * below).sqrt();
        }
    }
    sum / ((height - 1) * (width - 1)) as f64
}
