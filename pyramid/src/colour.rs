//! Uncorrelated colour components: the principal axes of the colours of an exemplar, optionally after brightness.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Mean and principal axes of a set of colours (any number of channels).
///
/// The components along the axes are uncorrelated, so each component can be synthesised separately.
///
/// # References
///
/// Heeger & Bergen 1995, section 3.5.
///
/// # Examples
///
/// ```
/// use stereology_pyramid::PrincipalColours;
///
/// let colours = [[1.0_f32, 1.1, 0.9], [2.0, 2.0, 2.0], [3.0, 2.9, 3.1]];
/// let axes = PrincipalColours::fit(3, colours.iter().map(|c| c.as_slice()));
/// let mut component = [0.0; 3];
/// axes.decorrelate(&colours[2], &mut component);
/// assert!(component[0].abs() > 1.6, "almost all variance is along grey");
/// let mut back = [0.0; 3];
/// axes.recombine(&component, &mut back);
/// assert!(back.iter().zip(&colours[2]).all(|(a, b)| (a - b).abs() < 1e-6));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipalColours {
    mean: Vec<f64>,
    /// Rows: the weights of the channels in each component.
    axes: DMatrix<f64>,
    /// Columns: the colour that each component adds; the inverse of `axes`.
    colours: DMatrix<f64>,
    variances: Vec<f64>,
}

impl PrincipalColours {
    /// Principal axes of colours with `channels` channels, by decreasing variance, with the sign that makes the sum of
    /// each axis positive.
    ///
    /// # Panics
    ///
    /// If a colour has another number of channels.
    pub fn fit<'a>(channels: usize, colours: impl Iterator<Item = &'a [f32]> + Clone) -> Self {
        let mut mean = vec![0.0; channels];
        let mut n = 0.0;
        for colour in colours.clone() {
            assert_eq!(colour.len(), channels, "every colour has {channels} channels");
            mean.iter_mut().zip(colour).for_each(|(m, &v)| *m += f64::from(v));
            n += 1.0;
        }
        mean.iter_mut().for_each(|m| *m /= f64::max(n, 1.0));
        let mut covariance = DMatrix::zeros(channels, channels);
        for colour in colours {
            for i in 0..channels {
                for j in 0..=i {
                    covariance[(i, j)] += (f64::from(colour[i]) - mean[i]) * (f64::from(colour[j]) - mean[j]);
                }
            }
        }
        covariance /= f64::max(n, 1.0);
        covariance.fill_upper_triangle_with_lower_triangle();
        let (axes, variances) = principal_axes(covariance);
        Self {
            mean,
            colours: axes.transpose(),
            axes,
            variances,
        }
    }

    /// The same colours with a weighted sum of the channels, such as brightness, as the first component, followed by
    /// the principal axes of the residual colours (after regression on that sum) by decreasing variance. The components
    /// are still uncorrelated.
    ///
    /// Components that are uncorrelated overall can be correlated within a frequency band. Components synthesised
    /// separately have their own statistics, but not those of their sums: therefore brightness, to which the eye is
    /// most sensitive, should be a component.
    ///
    /// # Panics
    ///
    /// If the number of weights is not the number of channels, or all weights are zero.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_pyramid::PrincipalColours;
    ///
    /// let colours = [[1.0_f32, 0.1, 0.0], [0.0, 0.9, 0.0], [0.2, 0.0, 0.5], [0.6, 0.7, 0.4]];
    /// let axes = PrincipalColours::fit(3, colours.iter().map(|c| c.as_slice())).led_by(&[1.0, 1.0, 1.0]);
    /// let mut component = [0.0; 3];
    /// axes.decorrelate(&colours[0], &mut component);
    /// let brightness: f64 = colours[0].iter().zip(axes.mean()).map(|(&v, m)| f64::from(v) - m).sum();
    /// assert!((f64::from(component[0]) - brightness / 3.0_f64.sqrt()).abs() < 1e-6);
    /// let mut back = [0.0; 3];
    /// axes.recombine(&component, &mut back);
    /// assert!(back.iter().zip(&colours[0]).all(|(a, b)| (a - b).abs() < 1e-6));
    /// ```
    #[must_use]
    pub fn led_by(self, weights: &[f64]) -> Self {
        let n = self.mean.len();
        assert_eq!(weights.len(), n, "a weight for every channel");
        let first = DVector::from_column_slice(weights).normalize();
        assert!(first.iter().all(|v| v.is_finite()), "weights that are not all zero");
        let covariance =
            &self.colours * DMatrix::from_diagonal(&DVector::from_column_slice(&self.variances)) * &self.axes;
        let variance = first.dot(&(&covariance * &first));
        let all = covariance.trace();
        // Mean change of the colours per unit of the sum.
        let slope = if variance > 1e-9 * all {
            &covariance * &first / variance
        } else {
            first.clone()
        };
        let left = covariance - variance * &slope * slope.transpose();
        // The added term makes `first` the first axis, so that the others are orthogonal to it.
        let (basis, variances) = principal_axes(left + 2.0 * all.max(f64::MIN_POSITIVE) * &first * first.transpose());
        let mut axes = basis.clone();
        let mut colours = basis.transpose();
        axes.set_row(0, &first.transpose());
        colours.set_column(0, &slope);
        for row in 1..n {
            let along = basis.row(row).dot(&slope.transpose());
            axes.set_row(row, &(basis.row(row) - along * first.transpose()));
        }
        let variances = std::iter::once(variance * slope.norm_squared()).chain(variances.into_iter().skip(1));
        Self {
            mean: self.mean,
            axes,
            colours,
            variances: variances.collect(),
        }
    }

    /// Mean colour.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Variance of the colours in each component, decreasing except for a chosen first component.
    #[must_use]
    pub fn variances(&self) -> &[f64] {
        &self.variances
    }

    /// Components of one colour: its difference from the mean along each axis.
    #[allow(clippy::cast_possible_truncation, reason = "computed in f64, kept in f32")]
    pub fn decorrelate(&self, colour: &[f32], components: &mut [f32]) {
        for (row, component) in components.iter_mut().enumerate() {
            let along = colour.iter().zip(&self.mean).enumerate();
            *component = along
                .map(|(c, (&v, m))| self.axes[(row, c)] * (f64::from(v) - m))
                .sum::<f64>() as f32;
        }
    }

    /// Colour of components: the inverse of [`Self::decorrelate`].
    #[allow(clippy::cast_possible_truncation, reason = "computed in f64, kept in f32")]
    pub fn recombine(&self, components: &[f32], colour: &mut [f32]) {
        for (c, value) in colour.iter_mut().enumerate() {
            let along = components
                .iter()
                .enumerate()
                .map(|(row, &v)| self.colours[(c, row)] * f64::from(v));
            *value = (self.mean[c] + along.sum::<f64>()) as f32;
        }
    }
}

/// Axes (rows) by decreasing variance, each with a positive sum, and the variances.
fn principal_axes(covariance: DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let channels = covariance.nrows();
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..channels).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
    let axes = DMatrix::from_fn(channels, channels, |row, channel| {
        let axis = eigen.eigenvectors.column(order[row]);
        axis[channel] * if axis.sum() < 0.0 { -1.0 } else { 1.0 }
    });
    let variances = order.iter().map(|&i| eigen.eigenvalues[i].max(0.0)).collect();
    (axes, variances)
}
