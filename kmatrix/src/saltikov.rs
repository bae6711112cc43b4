//! Saltikov's kernel: what profile sizes does a random section through a sphere of each size give?

use nalgebra::DMatrix;

/// Section kernel of spheres whose diameters are the upper edges of `bins` equal bins of (0, 1].
///
/// # Formula
///
/// ```text
/// K[i][j] = (√(j² − (i−1)²) − √(j² − i²)) / n   for j ≥ i, else 0        (i, j = 1..n)
/// ```
///
/// Column `j` sums to `j / n`: large spheres are cut more often. The diagonal is positive, so the kernel can always be
/// inverted.
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, eqs. (2), (3); Saltikov 1967.
///
/// # Examples
///
/// ```
/// use stereology_kmatrix::SphereKernel;
///
/// let kernel = SphereKernel::new(4)?;
/// let profiles = kernel.profile_densities(2.0, &[0.0, 0.0, 0.0, 1.0]);
/// assert!((profiles.iter().sum::<f64>() - 2.0).abs() < 1e-12); // eq. (1): N_A = d_max N_V
/// # Ok::<(), stereology_kmatrix::BinCountError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SphereKernel {
    matrix: DMatrix<f64>,
}

/// A kernel needs at least one bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a kernel needs at least one bin: give 1 or more")]
#[non_exhaustive]
pub struct BinCountError;

impl SphereKernel {
    /// Kernel with `bins` size bins and the same number of profile bins. Complexity: `bins`².
    ///
    /// # Errors
    ///
    /// [`BinCountError`] if `bins` is zero.
    pub fn new(bins: usize) -> Result<Self, BinCountError> {
        if bins == 0 {
            return Err(BinCountError);
        }
        let half_chord = |diameter: usize, profile: usize| {
            // Exact in integers up to 2^26 bins: the square root is of a difference of squares, not of a rounded
            // product.
            ((diameter - profile) as f64 * (diameter + profile) as f64).sqrt()
        };
        let matrix = DMatrix::from_fn(bins, bins, |i, j| {
            let (profile, diameter) = (i + 1, j + 1);
            if diameter < profile {
                return 0.0;
            }
            (half_chord(diameter, profile - 1) - half_chord(diameter, profile)) / bins as f64
        });
        Ok(Self { matrix })
    }

    /// Rows: profile bins; columns: size bins; no unit.
    #[must_use]
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Profiles per unit area, by bin, of a material with `number_density[j]` spheres per unit volume in bin `j`: eq.
    /// (2).
    ///
    /// `largest_diameter` carries the unit of length. Densities beyond the number of bins are ignored; missing
    /// densities are zero.
    #[must_use]
    pub fn profile_densities(&self, largest_diameter: f64, number_density: &[f64]) -> Vec<f64> {
        self.matrix
            .row_iter()
            .map(|row| largest_diameter * row.iter().zip(number_density).map(|(k, n_v)| k * n_v).sum::<f64>())
            .collect()
    }
}

/// Edges of Saltikov's geometric classes, for comparison: relative diameters 10^(−0.1 k), so that classes of A / A_max
/// fall by a factor of 0.631; from 10^(−0.1 n) up to 1. Saltikov used 12.
///
/// Earlier authors used these (paper, section 3.2); the paper's equal classes of √(A / A_max) distribute the profiles
/// more evenly. Multiplied by the largest size, they are the profile edges and size edges for
/// [`SectionLaw::kernel`](crate::SectionLaw::kernel).
///
/// ```
/// use stereology_kmatrix::{SectionLaw, Sizes, condition_number, geometric_classes};
///
/// let sphere = SectionLaw::sphere(1.0)?;
/// let edges = geometric_classes(10);
/// let geometric = condition_number(&sphere.kernel(&edges, &edges, Sizes::UpperEdge)?);
/// let equal = condition_number(&sphere.k_matrix(10));
/// assert!(geometric < 12.0 && equal < 12.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn geometric_classes(classes: usize) -> Vec<f64> {
    (0..=classes)
        .map(|i| 10.0_f64.powf(-0.1 * (classes - i) as f64))
        .collect()
}

/// Ratio of the largest to the smallest singular value of a kernel: the factor by which unfolding may magnify relative
/// errors of profile counts. Infinite if the kernel is singular; 1 if it is empty.
#[must_use]
pub fn condition_number(kernel: &DMatrix<f64>) -> f64 {
    if kernel.is_empty() {
        return 1.0;
    }
    let values = kernel.clone().singular_values();
    values.max() / values.min()
}

/// Profiles per unit area of particles with a mean caliper: `N_A = H N_V`, eq. (1).
///
/// `mean_caliper` is a length, `number_density` is in particles per unit volume. Eq. (1) holds for convex particles;
/// for others use [`SectionLaw::caliper_effective`](crate::SectionLaw::caliper_effective), which counts every disjoint
/// profile.
///
/// ```
/// // Spheres of diameter 2 at three per unit volume.
/// assert_eq!(stereology_kmatrix::profiles_per_area(2.0, 3.0), 6.0);
/// ```
#[must_use]
pub fn profiles_per_area(mean_caliper: f64, number_density: f64) -> f64 {
    mean_caliper * number_density
}

/// Factor from the body's unit of length to that of the photograph: `s = √(A_img / A_max)`, eq. (7).
///
/// `largest_profile_area` is the area of the largest observed profile, `max_area` that of the body's largest section.
/// The largest of a few hundred profiles is smaller than the largest possible one: even for particles of one size `s`
/// is 2-7 % low with 500 profiles. Use the largest size instead if it is known.
///
/// ```
/// assert_eq!(stereology_kmatrix::scale(8.0, 2.0), 2.0);
/// ```
#[must_use]
pub fn scale(largest_profile_area: f64, max_area: f64) -> f64 {
    (largest_profile_area / max_area).sqrt()
}

#[cfg(test)]
mod tests {
    use super::SphereKernel;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    proptest! {
        /// The probability that a plane hits a sphere of diameter j/n is proportional to its diameter, so column j sums
        /// to j/n.
        #[test]
        fn columns_sum_to_relative_diameter(bins in 1_usize..200) {
            let kernel = SphereKernel::new(bins).unwrap();
            for (j, column) in kernel.matrix().column_iter().enumerate() {
                assert_relative_eq!(column.sum(), (j + 1) as f64 / bins as f64, epsilon = 1e-12);
            }
        }

        /// The kernel can always be inverted: it is upper triangular with a positive diagonal.
        #[test]
        fn kernel_is_upper_triangular_with_positive_diagonal(bins in 1_usize..100) {
            let kernel = SphereKernel::new(bins).unwrap();
            for j in 0..bins {
                prop_assert!(kernel.matrix()[(j, j)] > 0.0);
                for i in j + 1..bins {
                    prop_assert!(kernel.matrix()[(i, j)] == 0.0);
                }
            }
        }
    }

    #[test]
    fn no_bins_is_an_error() {
        assert!(SphereKernel::new(0).is_err());
    }
}
