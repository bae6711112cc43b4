//! Light and scatter of a binder: the quadratic surface that its colour follows across the photo, and the covariance of
//! its pixels around it.

use ndarray::Array2;

use crate::conversions::whole_part;

/// Terms of a quadratic surface.
pub(crate) const TERMS: usize = 6;

/// Least number of pixels in the sample, where the photo has as many.
const SAMPLE: usize = 16_000;
/// Least standard deviation: half a grey level of an 8-bit image.
const LEAST_DEVIATION: f64 = 0.5 / 255.0;

/// Coefficients of the surface, for each channel.
pub(crate) type Surface = [[f64; TERMS]; 3];

/// A pixel of the sample: position in −1..1 and colour.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) place: [f64; 2],
    pub(crate) colour: [f64; 3],
}

/// Pixels on a square lattice.
pub(crate) fn sample(image: &Array2<[f32; 3]>) -> Vec<Sample> {
    let (height, width) = image.dim();
    let step = whole_part(((height * width / SAMPLE) as f64).sqrt()).max(1);
    let at = |n: usize| (step / 2..n).step_by(step);
    at(height)
        .flat_map(|y| at(width).map(move |x| (x, y)))
        .map(|(x, y)| Sample {
            place: place(x, y, (height, width)),
            colour: image[[y, x]].map(f64::from),
        })
        .collect()
}

pub(crate) fn identity(scale: f64) -> [[f64; 3]; 3] {
    [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]]
}

pub(crate) fn place(x: usize, y: usize, (height, width): (usize, usize)) -> [f64; 2] {
    [
        (2 * x + 1) as f64 / width as f64 - 1.0,
        (2 * y + 1) as f64 / height as f64 - 1.0,
    ]
}

fn basis([u, v]: [f64; 2]) -> [f64; TERMS] {
    [1.0, u, v, u * u, u * v, v * v]
}

/// Least squares with slight shrinkage of slopes and curvatures, so that a binder visible in one corner only is not
/// extrapolated wildly.
pub(crate) fn fit_surface(inside: &[&Sample], terms: usize) -> Surface {
    let mut normal = [[0.0; TERMS]; TERMS];
    let mut right = [[0.0; TERMS]; 3];
    for s in inside {
        let b = basis(s.place);
        for i in 0..terms {
            for j in 0..=i {
                normal[i][j] += b[i] * b[j];
            }
            for (right, colour) in right.iter_mut().zip(s.colour) {
                right[i] += b[i] * colour;
            }
        }
    }
    let shrinkage = 1e-3 * inside.len() as f64;
    (1..terms).for_each(|i| normal[i][i] += shrinkage);
    // Cholesky: the matrix is positive definite (at least 50 samples, shrinkage).
    for i in 0..terms {
        for j in 0..=i {
            let inner: f64 = (0..j).map(|k| normal[i][k] * normal[j][k]).sum();
            let rest = normal[i][j] - inner;
            normal[i][j] = if i == j {
                rest.max(1e-12).sqrt()
            } else {
                rest / normal[j][j]
            };
        }
    }
    right.map(|mut r| {
        for i in 0..terms {
            let inner: f64 = (0..i).map(|k| normal[i][k] * r[k]).sum();
            r[i] = (r[i] - inner) / normal[i][i];
        }
        for i in (0..terms).rev() {
            let inner: f64 = (i + 1..terms).map(|k| normal[k][i] * r[k]).sum();
            r[i] = (r[i] - inner) / normal[i][i];
        }
        r
    })
}

/// Inverse Cholesky factor of the covariance around the surface, and its standard deviation. The covariance gives the
/// shape and the median distance the scale, so that particles of a colour near the binder's do not widen it; it is at
/// least that of rounding to 8 bits.
pub(crate) fn scatter(surface: &Surface, inside: &[&Sample]) -> ([[f64; 3]; 3], f64) {
    let mut cov = [[0.0; 3]; 3];
    for s in inside {
        let b = colour_at(surface, s.place);
        let d = [s.colour[0] - b[0], s.colour[1] - b[1], s.colour[2] - b[2]];
        for i in 0..3 {
            for j in 0..=i {
                cov[i][j] += d[i] * d[j];
            }
        }
    }
    cov.iter_mut().flatten().for_each(|v| *v /= inside.len() as f64);
    let floor = LEAST_DEVIATION * LEAST_DEVIATION;
    let w = inverse_factor(&cov, floor);
    // Channels that scatter: 1 for a grey photo, 3 for a coloured one.
    let dimension = (3.0 - w.iter().flatten().map(|v| v * v).sum::<f64>() * floor).clamp(1.0, 3.0);
    let mut squares: Vec<f64> = inside
        .iter()
        .map(|s| {
            let b = colour_at(surface, s.place);
            let d = [s.colour[0] - b[0], s.colour[1] - b[1], s.colour[2] - b[2]];
            w.iter()
                .map(|w| (w[0] * d[0] + w[1] * d[1] + w[2] * d[2]).powi(2))
                .sum()
        })
        .collect();
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // Median of chi squared with one and with three degrees of freedom, truncated at the gate.
    let expected = 0.4515 + (dimension - 1.0) * 0.914;
    let scale = *median / expected;
    cov.iter_mut().flatten().for_each(|v| *v *= scale);
    (
        inverse_factor(&cov, floor),
        ((cov[0][0] + cov[1][1] + cov[2][2]) / 3.0 + floor).sqrt(),
    )
}

/// Lower triangular W with WᵀW the inverse of a covariance, given by its lower triangle, plus `floor` on the diagonal.
pub(crate) fn inverse_factor(cov: &[[f64; 3]; 3], floor: f64) -> [[f64; 3]; 3] {
    let mut cov = *cov;
    (0..3).for_each(|i| cov[i][i] += floor);
    let l00 = cov[0][0].sqrt();
    let (l10, l20) = (cov[1][0] / l00, cov[2][0] / l00);
    let l11 = (cov[1][1] - l10 * l10).max(1e-12).sqrt();
    let l21 = (cov[2][1] - l20 * l10) / l11;
    let l22 = (cov[2][2] - l20 * l20 - l21 * l21).max(1e-12).sqrt();
    // Inverse of a lower triangle.
    let (w00, w11, w22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let w10 = -l10 * w00 * w11;
    let w21 = -l21 * w11 * w22;
    let w20 = -(l20 * w00 + l21 * w10) * w22;
    [[w00, 0.0, 0.0], [w10, w11, 0.0], [w20, w21, w22]]
}

/// Colour of the surface at a position.
pub(crate) fn colour_at(surface: &Surface, place: [f64; 2]) -> [f64; 3] {
    let basis = basis(place);
    surface.map(|c| c.iter().zip(basis).map(|(c, b)| c * b).sum())
}
