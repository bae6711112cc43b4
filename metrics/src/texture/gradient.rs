//! Mean gradient: the steepness of grey levels, which blur reduces.

use ndarray::Array2;

/// Mean length of the gradient by forward differences, grey levels per pixel; the last row and column have none. Zero
/// for images less than two pixels wide or high.
///
/// If the ratio of a solid's mean gradient to its exemplar's is below 1, the solid is blurred; if it is above 1, the
/// solid is noisier or has seams.
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::mean_gradient;
///
/// let slope = Array2::from_shape_fn((5, 7), |(y, x)| 0.03 * x as f32 + 0.04 * y as f32);
/// assert!((mean_gradient(&slope) - 0.05).abs() < 1e-6);
/// ```
#[must_use]
pub fn mean_gradient(image: &Array2<f32>) -> f64 {
    let (height, width) = image.dim();
    if height < 2 || width < 2 {
        return 0.0;
    }
    let mut sum = 0.0;
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let at = f64::from(image[[y, x]]);
            let (right, below) = (f64::from(image[[y, x + 1]]) - at, f64::from(image[[y + 1, x]]) - at);
            sum += (right * right + below * below).sqrt();
        }
    }
    sum / ((height - 1) * (width - 1)) as f64
}
