//! Kernels, the input of unfolding, and mixtures of the kernels of several particle types.

use crate::profile_law::ProfileLaw;
use crate::size_bins::{ReportedEdgesError, SizeBins};
use nalgebra::DMatrix;

/// An absolute kernel with the sizes of its columns.
///
/// Entry (i, j): expected profiles per unit area in profile bin i of one particle per unit volume in size bin j; a
/// length. The paper's `H K` (eqs. 2, 5) with the mean caliper of the largest particle, or any kernel of another
/// source.
///
/// # Examples
///
/// Spheres by hand: `|x| 1 - sqrt(1 - x²)` is the fraction of their profiles below the relative size x.
///
/// ```
/// use stereology_unfold::{Kernel, SizeBins, equal_edges};
/// use nalgebra::DMatrix;
///
/// let f = |x: f64| if x < 1.0 { 1.0 - (1.0 - x * x).sqrt() } else { 1.0 };
/// let edges = equal_edges(1.0, 4);
/// let matrix = DMatrix::from_fn(4, 4, |i, j| edges[j + 1] * (f(edges[i + 1] / edges[j + 1]) - f(edges[i] / edges[j + 1])));
/// let kernel = Kernel::new(matrix, SizeBins::upper_edge(&edges)?, std::f64::consts::PI / 6.0)?;
/// assert!((kernel.matrix().column(1).sum() - 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    matrix: DMatrix<f64>,
    sizes: SizeBins,
    unit_volume: f64,
    unit_surface: Option<f64>,
    law: Option<ProfileLaw>,
}

/// Why a matrix is not a kernel, or kernels cannot be mixed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KernelError {
    /// The matrix has no rows, or not a column a size bin.
    #[error(
        "a kernel of {rows} rows and {columns} columns for {bins} size bins: it needs one column a size bin and at least one row"
    )]
    Shape {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
        /// Size bins.
        bins: usize,
    },
    /// An entry that is negative or not finite.
    #[error("kernel entry ({row}, {column}) is {value}: expected counts must be finite and not negative")]
    Entry {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The body's volume is not a positive number.
    #[error("the body's volume at size 1 is {0}: it must be positive and finite")]
    Volume(f64),
    /// The body's surface is not a positive number.
    #[error("the body's surface area at size 1 is {0}: it must be positive and finite")]
    Surface(f64),
    /// An invalid capping angle.
    #[error("the capping angle is {0}: it must lie from 0 to below a right angle, in radians")]
    CappingAngle(f64),
    /// Invalid fractions, or not one per kernel.
    #[error("{fractions} fractions for {kernels} kernels: give one per kernel, finite and not negative, not all zero")]
    Fractions {
        /// Number of fractions.
        fractions: usize,
        /// Number of kernels.
        kernels: usize,
    },
    /// Kernels of different bins.
    #[error("the bins of kernel {index} differ from those of the first: mixed kernels need the same bins")]
    Bins {
        /// Which, from 0.
        index: usize,
    },
}

impl Kernel {
    /// A kernel from a matrix (rows: profile bins, columns: size bins), the sizes of its columns and the volume of the
    /// body at size 1 (a sphere's: π / 6).
    ///
    /// # Errors
    ///
    /// [`KernelError`] if the shape does not fit the bins, an entry is negative or not finite, or the volume is not
    /// positive.
    pub fn new(matrix: DMatrix<f64>, sizes: SizeBins, unit_volume: f64) -> Result<Self, KernelError> {
        if matrix.nrows() == 0 || matrix.ncols() != sizes.len() {
            return Err(KernelError::Shape {
                rows: matrix.nrows(),
                columns: matrix.ncols(),
                bins: sizes.len(),
            });
        }
        for column in 0..matrix.ncols() {
            for row in 0..matrix.nrows() {
                let value = matrix[(row, column)];
                if !(value.is_finite() && value >= 0.0) {
                    return Err(KernelError::Entry { row, column, value });
                }
            }
        }
        if !(unit_volume.is_finite() && unit_volume > 0.0) {
            return Err(KernelError::Volume(unit_volume));
        }
        Ok(Self {
            matrix,
            sizes,
            unit_volume,
            unit_surface: None,
            law: None,
        })
    }

    /// With the surface area of the body at size 1 (a sphere's: π), for the surface per unit volume S_V.
    ///
    /// # Errors
    ///
    /// [`KernelError::Surface`] if it is not a positive number.
    pub fn with_unit_surface(mut self, unit_surface: f64) -> Result<Self, KernelError> {
        if !(unit_surface.is_finite() && unit_surface > 0.0) {
            return Err(KernelError::Surface(unit_surface));
        }
        self.unit_surface = Some(unit_surface);
        Ok(self)
    }

    /// With the profiles of particles of any single size: `up_to(x)` is how many profiles no larger than x a particle
    /// of size 1 shows, per unit area at one particle per unit volume (H F(x), less what is not seen), for x from 0 to
    /// 1.
    ///
    /// Then the sparse estimate can have particles of exact sizes, where the bins of the kernel hold a range of sizes.
    #[must_use]
    pub fn with_profile_law(mut self, up_to: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        self.law = Some(ProfileLaw::new(up_to));
        self
    }

    pub(crate) fn law(&self) -> Option<&ProfileLaw> {
        self.law.as_ref()
    }

    /// With several of its bins summed to each bin that is reported.
    ///
    /// # Errors
    ///
    /// [`ReportedEdgesError`] if the edges bound no bins or are not among those of the kernel.
    pub fn reported_in(mut self, edges: &[f64]) -> Result<Self, ReportedEdgesError> {
        self.sizes = self.sizes.reported_in(edges)?;
        Ok(self)
    }

    /// The kernel of several types that share one size distribution, with given fractions of the particles: eqs.
    /// (10)-(12).
    ///
    /// Fractions are scaled to sum to 1; the volume at size 1 is their mean.
    ///
    /// # Errors
    ///
    /// [`KernelError`] if there is no kernel, bins differ or fractions are not one per kernel.
    pub fn mix(kernels: &[Self], fractions: &[f64]) -> Result<Self, KernelError> {
        let matrices: Vec<_> = kernels.iter().map(|kernel| kernel.matrix.clone()).collect();
        let matrix = mix_kernels(&matrices, fractions)?;
        let first = kernels.first().ok_or(KernelError::Fractions {
            fractions: fractions.len(),
            kernels: 0,
        })?;
        if let Some(index) = kernels.iter().position(|kernel| kernel.sizes != first.sizes) {
            return Err(KernelError::Bins { index });
        }
        let whole: f64 = fractions.iter().sum();
        let unit_volume = kernels
            .iter()
            .zip(fractions)
            .map(|(kernel, p)| kernel.unit_volume * p / whole)
            .sum();
        let mut mixed = Self::new(matrix, first.sizes.clone(), unit_volume)?;
        let surfaces = kernels.iter().zip(fractions);
        let laws: Option<Vec<ProfileLaw>> = kernels.iter().map(|kernel| kernel.law.clone()).collect();
        mixed.law = laws.map(|laws| ProfileLaw::mix(laws, fractions.iter().map(|p| p / whole).collect()));
        mixed.unit_surface = surfaces.map(|(kernel, p)| Some(kernel.unit_surface? * p / whole)).sum();
        Ok(mixed)
    }

    /// Rows: profile bins; columns: size bins; lengths.
    #[must_use]
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// The bins of the columns.
    #[must_use]
    pub fn sizes(&self) -> &SizeBins {
        &self.sizes
    }

    /// Volume of the body at size 1.
    #[must_use]
    pub fn unit_volume(&self) -> f64 {
        self.unit_volume
    }

    /// Surface area of the body at size 1, if it is known.
    #[must_use]
    pub fn unit_surface(&self) -> Option<f64> {
        self.unit_surface
    }

    /// Ratio of the largest to the smallest singular value of the matrix: how much noise may grow; infinite if it is
    /// singular.
    #[must_use]
    pub fn condition_number(&self) -> f64 {
        condition_number(&self.matrix)
    }
}

/// Σ P(i) H_i K_i: the kernel of several types with a shared size distribution, eqs. (10)-(12). Fractions are scaled to
/// sum to 1.
///
/// # Errors
///
/// [`KernelError`] if there is no kernel, shapes differ or fractions are not one per kernel, finite, not negative and
/// not all zero.
///
/// ```
/// use nalgebra::dmatrix;
/// let mixed = stereology_unfold::mix_kernels(&[dmatrix![1.0], dmatrix![2.0]], &[3.0, 1.0])?;
/// assert_eq!(mixed, dmatrix![1.25]);
/// # Ok::<(), stereology_unfold::KernelError>(())
/// ```
pub fn mix_kernels(kernels: &[DMatrix<f64>], fractions: &[f64]) -> Result<DMatrix<f64>, KernelError> {
    let whole: f64 = fractions.iter().sum();
    let bad = fractions
        .iter()
        .any(|fraction| !(fraction.is_finite() && *fraction >= 0.0));
    let Some(first) = kernels
        .first()
        .filter(|_| !bad && whole > 0.0 && whole.is_finite() && fractions.len() == kernels.len())
    else {
        return Err(KernelError::Fractions {
            fractions: fractions.len(),
            kernels: kernels.len(),
        });
    };
    if let Some(index) = kernels.iter().position(|kernel| kernel.shape() != first.shape()) {
        return Err(KernelError::Bins { index });
    }
    Ok(kernels
        .iter()
        .zip(fractions)
        .fold(first * 0.0, |sum, (kernel, fraction)| sum + kernel * (fraction / whole)))
}

pub(crate) fn condition_number(matrix: &DMatrix<f64>) -> f64 {
    let values = matrix.singular_values();
    let (smallest, largest) = (values.min(), values.max());
    if smallest > 0.0 {
        largest / smallest
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::{Kernel, KernelError, mix_kernels};
    use crate::SizeBins;
    use nalgebra::dmatrix;

    #[test]
    fn kernels_are_checked() {
        let bins = || SizeBins::upper_edge(&[0.0, 1.0]).unwrap();
        assert!(matches!(
            Kernel::new(dmatrix![1.0, 2.0], bins(), 1.0),
            Err(KernelError::Shape { .. })
        ));
        assert!(matches!(
            Kernel::new(dmatrix![-1.0], bins(), 1.0),
            Err(KernelError::Entry { .. })
        ));
        assert!(matches!(
            Kernel::new(dmatrix![f64::NAN], bins(), 1.0),
            Err(KernelError::Entry { .. })
        ));
        assert!(matches!(
            Kernel::new(dmatrix![1.0], bins(), 0.0),
            Err(KernelError::Volume(_))
        ));
        assert!(mix_kernels(&[dmatrix![1.0]], &[]).is_err());
        assert!(mix_kernels(&[], &[]).is_err());
        assert!(mix_kernels(&[dmatrix![1.0]], &[-1.0]).is_err());
        assert!(mix_kernels(&[dmatrix![1.0], dmatrix![1.0, 1.0]], &[1.0, 1.0]).is_err());
    }

    #[test]
    fn a_mixture_of_one_is_itself() {
        let kernel = Kernel::new(
            dmatrix![1.0, 2.0; 0.0, 3.0],
            SizeBins::upper_edge(&[0.0, 1.0, 2.0]).unwrap(),
            0.5,
        )
        .unwrap();
        assert_eq!(
            Kernel::mix(&[kernel.clone(), kernel.clone()], &[2.0, 2.0]).unwrap(),
            kernel
        );
    }
}
