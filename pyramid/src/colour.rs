//! Colours as independent numbers: the principal axes of an exemplar's colours.

use nalgebra::{DMatrix, SymmetricEigen};

/// Mean and principal axes of a set of colours (any number of channels).
///
/// Along the axes the colours are uncorrelated, so that each component can be synthesised on its own.
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
    /// Rows: axes by falling variance.
    axes: DMatrix<f64>,
    variances: Vec<f64>,
}

impl PrincipalColours {
    /// Axes of colours with `channels` channels, by falling variance; each points to where its channels sum to more.
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
        let eigen = SymmetricEigen::new(covariance);
        let mut order: Vec<usize> = (0..channels).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
        let axes = DMatrix::from_fn(channels, channels, |row, channel| {
            let axis = eigen.eigenvectors.column(order[row]);
            axis[channel] * if axis.sum() < 0.0 { -1.0 } else { 1.0 }
        });
        let variances = order.iter().map(|&i| eigen.eigenvalues[i].max(0.0)).collect();
        Self { mean, axes, variances }
    }

    /// Mean colour.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Variance along each axis, falling.
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
                .map(|(row, &v)| self.axes[(row, c)] * f64::from(v));
            *value = (self.mean[c] + along.sum::<f64>()) as f32;
        }
    }
}
