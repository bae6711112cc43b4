//! Absolute kernels, in units of length, for any bins: the input of unfolding.

use crate::section_law::SectionLaw;
use nalgebra::DMatrix;
use stereology_metrics::{EdgesError, check_edges};

/// Which sizes the particles of a size bin have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sizes {
    /// All at the bin's upper edge, as in the paper. Correct for sizes that are exactly there; otherwise it has a bias
    /// that no amount of data removes (the total is 2-8 % low on the paper's figure 7).
    UpperEdge,
    /// Spread evenly over the bin.
    #[default]
    Integrated,
}

/// What is counted when a plane cuts a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// Every disjoint profile: N_A = H_eff K N_V.
    #[default]
    Profiles,
    /// The paper's normalisation: N_A = H K N_V with the mean caliper of the hull and columns that sum to j / n, eqs.
    /// (5), (6). It ignores the number m of profiles per hit: number densities of non-convex bodies are m times too
    /// large (torus 1.4, L 1.1), and the proportions of mixtures are wrong. Equal to [`Counting::Profiles`] for convex
    /// bodies.
    Paper,
}

impl SectionLaw {
    /// Kernel in units of length: entry (i, j) is the expected number of profiles per unit area in profile bin i of one
    /// particle per unit volume in size bin j. Bins are (a, b]; both sizes are diameters of circles: of the profile's
    /// area, of the largest section's area.
    ///
    /// # Formula
    ///
    /// ```text
    /// h = H_eff / size                                                  the effective caliper of the body at size 1
    /// UpperEdge:  K[i][j] = h b_j (F(d_i / b_j) − F(d_{i−1} / b_j))
    /// Integrated: K[i][j] = h / (b_j − a_j) ∫ D (F(d_i / D) − F(d_{i−1} / D)) dD over (a_j, b_j], F = 1 beyond 1
    /// ```
    ///
    /// This uses [`Counting::Profiles`]; see [`kernel_counting`](Self::kernel_counting) for the paper's normalisation.
    /// The cost per entry is one table lookup (`UpperEdge`) or some tens (`Integrated`).
    ///
    /// # Errors
    ///
    /// [`EdgesError`] if edges do not increase, are negative or not finite, or are fewer than two.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_kmatrix::{SectionLaw, Sizes};
    ///
    /// let law = SectionLaw::sphere(1.0)?;
    /// let kernel = law.kernel(&[0.0, 1.0, 2.0], &[0.0, 2.0], Sizes::UpperEdge)?;
    /// assert!((kernel.column(0).sum() - 2.0).abs() < 1e-12); // a sphere of diameter 2 is cut over a length of 2
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn kernel(&self, profile_edges: &[f64], size_edges: &[f64], sizes: Sizes) -> Result<DMatrix<f64>, EdgesError> {
        self.kernel_counting(profile_edges, size_edges, sizes, Counting::Profiles)
    }

    /// [`kernel`](Self::kernel) with a choice of what is counted.
    ///
    /// # Errors
    ///
    /// As [`kernel`](Self::kernel).
    pub fn kernel_counting(
        &self,
        profile_edges: &[f64],
        size_edges: &[f64],
        sizes: Sizes,
        counting: Counting,
    ) -> Result<DMatrix<f64>, EdgesError> {
        check_edges(profile_edges)?;
        check_edges(size_edges)?;
        let caliper = match counting {
            Counting::Profiles => self.caliper_effective(),
            Counting::Paper => self.caliper_hull(),
        } / self.size();
        // Expected length of the offsets, at size 1, that show a profile up to the edge d.
        let below = |d: f64, j: usize| {
            let (a, b) = (size_edges[j], size_edges[j + 1]);
            match sizes {
                Sizes::UpperEdge => b * self.cdf(d / b),
                Sizes::Integrated => self.distribution.size_integral(d, a, b) / (b - a),
            }
        };
        let mut kernel = DMatrix::zeros(profile_edges.len() - 1, size_edges.len() - 1);
        for j in 0..kernel.ncols() {
            let mut last = below(profile_edges[0], j);
            for i in 0..kernel.nrows() {
                // Profiles are never larger than the particle: exactly zero, not a rounding error.
                if profile_edges[i] >= size_edges[j + 1] {
                    break;
                }
                let next = below(profile_edges[i + 1], j);
                kernel[(i, j)] = caliper * (next - last).max(0.0);
                last = next;
            }
        }
        Ok(kernel)
    }
}

#[cfg(test)]
mod tests {
    use super::Sizes;
    use crate::SectionLaw;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use std::sync::LazyLock;
    use stereology_metrics::EdgesError;

    fn equal_edges(largest: f64, bins: usize) -> Vec<f64> {
        (0..=bins).map(|k| largest * k as f64 / bins as f64).collect()
    }

    static ELLIPSOID: LazyLock<SectionLaw> = LazyLock::new(|| SectionLaw::ellipsoid([1.0, 1.5, 2.5]).unwrap());

    proptest! {
        /// In units of the largest particle the upper-edge kernel is the paper's matrix times the effective caliper.
        #[test]
        fn upper_edge_kernel_is_caliper_times_matrix(bins in 1_usize..20, largest in 0.1..100.0_f64) {
            let law = &*ELLIPSOID;
            let edges = equal_edges(largest, bins);
            let kernel = law.kernel(&edges, &edges, Sizes::UpperEdge).unwrap();
            let caliper = law.caliper_effective() * largest / law.size();
            assert_relative_eq!(kernel, law.k_matrix(bins) * caliper, epsilon = 1e-9 * largest);
        }

        /// Equal bins, sizes spread: column j sums to (j − 1/2) / n.
        #[test]
        fn integrated_columns_sum_to_the_mean_size(bins in 1_usize..20, largest in 0.1..100.0_f64) {
            let edges = equal_edges(largest, bins);
            for law in [&SectionLaw::sphere(3.0).unwrap(), &*ELLIPSOID] {
                let kernel = law.kernel(&edges, &edges, Sizes::Integrated).unwrap();
                for j in 0..bins {
                    let expected = law.caliper_effective() / law.size() * largest * (j as f64 + 0.5) / bins as f64;
                    assert_relative_eq!(kernel.column(j).sum(), expected, max_relative = 1e-9);
                }
            }
        }
    }

    #[test]
    fn edges_are_checked() {
        let law = SectionLaw::sphere(1.0).unwrap();
        let good = [0.0, 1.0];
        assert_eq!(law.kernel(&[], &good, Sizes::UpperEdge), Err(EdgesError::TooFew(0)));
        assert!(matches!(
            law.kernel(&good, &[0.0, f64::NAN], Sizes::UpperEdge),
            Err(EdgesError::NotALength { index: 1, .. })
        ));
        assert_eq!(
            law.kernel(&[0.0, 1.0, 1.0], &good, Sizes::Integrated),
            Err(EdgesError::NotIncreasing { index: 2 })
        );
        assert!(law.kernel(&[-1.0, 1.0], &good, Sizes::Integrated).is_err());
    }
}
