//! The section law, from which every kernel follows: F(x), the fraction of the profiles with √(A / A_max) ≤ x, and the
//! number of profiles.

use crate::depth_measure::Moments;
use crate::distribution::{Distribution, Table};
use crate::ellipsoid;
use crate::sample::Sample;
use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::f64::consts::PI;
use stereology_shape::{Body, BodyError, BodyKind};

/// Default number of cells of the table of F.
pub(crate) const DEFAULT_CELLS: usize = 512;

/// Random sections of a body: the distribution of its profile sizes, and the mean lengths that give the number of
/// profiles.
///
/// A profile is one connected component of the intersection of body and plane; a hole belongs to the profile around it.
///
/// # Formula
///
/// ```text
/// F(x)    = ⟨profiles with √(A / A_max) ≤ x⟩ / H_eff
/// K[i][j] = (j / n) (F(i / j) − F((i − 1) / j))                       columns sum to j / n: eq. (6)
/// H_hull  = ⟨hits⟩              mean width of the convex hull
/// H_chi   = ⟨profiles − holes⟩  the same sum over signed edge angles: exact for any closed mesh
/// H_eff   = ⟨profiles⟩          = H_chi + ⟨holes⟩;    N_A = H_eff K N_V
/// ```
///
/// where ⟨·⟩ is the mean over directions of the integral over offsets. For convex bodies the three lengths are equal.
///
/// # Examples
///
/// ```
/// use stereology_kmatrix::{SectionLaw, SphereKernel};
///
/// let law = SectionLaw::sphere(2.0)?;
/// assert_eq!(law.k_matrix(10), *SphereKernel::new(10)?.matrix()); // eq. (3)
/// assert_eq!(law.caliper_effective(), 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SectionLaw {
    pub(crate) distribution: Distribution,
    /// F of each random rotation; empty for closed forms.
    pub(crate) samples: Vec<Table>,
    pub(crate) lengths: Calipers,
    pub(crate) max_area: f64,
    pub(crate) largest_met: f64,
    pub(crate) squares: Squares,
    pub(crate) volume: f64,
    pub(crate) surface_area: f64,
    pub(crate) directions: usize,
    /// |swept profiles − holes − H_chi| in standard errors.
    pub(crate) chi_discrepancy: f64,
}

/// Mean lengths of the offsets at which a plane hits, by what is counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Calipers {
    pub(crate) hull: f64,
    pub(crate) chi: f64,
    pub(crate) effective: f64,
    pub(crate) effective_error: f64,
}

/// Mean squares of areas over random sections, and their standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Squares {
    pub(crate) profile: f64,
    pub(crate) profile_error: f64,
    /// ⟨A²⟩ of whole sections, over all planes: a length times an area squared.
    pub(crate) total: f64,
    pub(crate) total_error: f64,
}

impl Squares {
    pub(crate) fn of(samples: &[Sample], lengths: Calipers, unit: f64) -> Self {
        let count = samples.len() as f64;
        let mean = |of: fn(&Moments) -> f64| samples.iter().map(|sample| of(&sample.moments)).sum::<f64>() / count;
        let error = |of: fn(&Moments) -> f64| standard_error(samples.iter().map(|sample| of(&sample.moments)));
        let fifth = unit.powi(5);
        Self {
            profile: mean(|moments| moments.area_squared) * fifth / lengths.effective,
            profile_error: error(|moments| moments.area_squared) * fifth / lengths.effective,
            total: mean(|moments| moments.total_squared) * fifth,
            total_error: error(|moments| moments.total_squared) * fifth,
        }
    }
}

impl SectionLaw {
    /// The law of a sphere, in closed form: eq. (3).
    ///
    /// # Errors
    ///
    /// [`BodyError`] if the diameter is not a positive length.
    pub fn sphere(diameter: f64) -> Result<Self, BodyError> {
        Body::sphere(diameter).map(|body| Self::sphere_of(&body))
    }

    /// The law of an ellipsoid: closed form over depth, quadrature over directions; the error of F is about 1e-7.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if a semi-axis is not a positive length.
    ///
    /// ```
    /// let needle = stereology_kmatrix::SectionLaw::ellipsoid([1.0, 1.0, 4.0])?;
    /// assert!((needle.max_area() - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    /// assert!(needle.cdf(0.6) > 0.5); // most cuts go across it
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn ellipsoid(semi_axes: [f64; 3]) -> Result<Self, BodyError> {
        Body::ellipsoid(semi_axes).map(|body| Self::ellipsoid_of(&body, semi_axes))
    }

    pub(crate) fn sphere_of(body: &Body) -> Self {
        Self::closed_form(body, Distribution::Sphere)
    }

    pub(crate) fn ellipsoid_of(body: &Body, semi_axes: [f64; 3]) -> Self {
        Self::closed_form(body, ellipsoid::distribution(semi_axes, DEFAULT_CELLS))
    }

    fn closed_form(body: &Body, distribution: Distribution) -> Self {
        let width = body.mean_width();
        // ∫ A² dh = (16/15) w A₀² with A₀ = V / (4 w / 3): (3/5) V² ⟨1 / w⟩.
        let total = match body.kind() {
            BodyKind::Ellipsoid { semi_axes } => {
                0.6 * body.volume().powi(2) * ellipsoid::mean_reciprocal_half_width(semi_axes)
            }
            _ => 1.2 * body.volume().powi(2) / width,
        };
        Self {
            distribution,
            samples: Vec::new(),
            lengths: Calipers {
                hull: width,
                chi: width,
                effective: width,
                effective_error: 0.0,
            },
            max_area: body.largest_section_area(),
            largest_met: body.largest_section_area(),
            squares: Squares {
                profile: total / width,
                profile_error: 0.0,
                total,
                total_error: 0.0,
            },
            volume: body.volume(),
            surface_area: body.surface_area(),
            directions: 0,
            chi_discrepancy: 0.0,
        }
    }

    /// F(x): the fraction of the profiles with √(A / A_max) ≤ x. Zero below 0, one from 1 on.
    #[must_use]
    pub fn cdf(&self, x: f64) -> f64 {
        self.distribution.at(x)
    }

    /// Standard error of [`cdf`](Self::cdf) at x; zero for closed forms.
    #[must_use]
    pub fn cdf_standard_error(&self, x: f64) -> f64 {
        let theta = x.clamp(0.0, 1.0).asin();
        standard_error(self.samples.iter().map(|table| table.at(theta)))
    }

    /// The paper's kernel for `bins` equal bins: row = profile bin, column = size bin with particles at its upper edge.
    /// Column j sums to j / n.
    ///
    /// It has no unit: multiply by [`caliper_effective`](Self::caliper_effective) in units of the largest particle.
    /// With zero bins the matrix is empty.
    #[must_use]
    pub fn k_matrix(&self, bins: usize) -> DMatrix<f64> {
        if self.distribution == Distribution::Sphere {
            return crate::SphereKernel::new(bins)
                .map_or_else(|_| DMatrix::zeros(0, 0), |kernel| kernel.matrix().clone());
        }
        matrix_of(bins, |x| self.distribution.at(x))
    }

    /// Standard error of every entry of [`k_matrix`](Self::k_matrix), from the spread between random rotations; zero
    /// for closed forms.
    ///
    /// An entry to which only few directions contribute (sections just above the area of a face) has a skewed error
    /// that the standard error does not capture. Use the [largest](Self::standard_error) for all entries.
    #[must_use]
    pub fn k_standard_errors(&self, bins: usize) -> DMatrix<f64> {
        let samples: Vec<_> = self
            .samples
            .iter()
            .map(|table| matrix_of(bins, |x| table_at(table, x)))
            .collect();
        DMatrix::from_fn(bins, bins, |i, j| {
            standard_error(samples.iter().map(|matrix| matrix[(i, j)]))
        })
    }

    /// The largest standard error of the matrix of `bins` bins.
    #[must_use]
    pub fn standard_error(&self, bins: usize) -> f64 {
        self.k_standard_errors(bins).iter().copied().fold(0.0, f64::max)
    }

    /// Half-width of a two-sided interval of this confidence (0..1), in standard errors: Student's t with one degree of
    /// freedom less than rotations.
    ///
    /// With few rotations the normal distribution gives intervals that are too narrow: with 8 rotations, four standard
    /// errors fail once in 200.
    #[must_use]
    pub fn error_quantile(&self, confidence: f64) -> f64 {
        let freedom = self.samples.len().saturating_sub(1).max(1) as f64;
        StudentsT::new(0.0, 1.0, freedom)
            .map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * confidence.clamp(0.0, 1.0)))
    }

    /// H_hull: the mean width of the convex hull, the mean length of offsets at which a plane hits the body.
    #[must_use]
    pub fn caliper_hull(&self) -> f64 {
        self.lengths.hull
    }

    /// H_chi: mean profiles minus holes, exact from the signed edge angles of a closed mesh.
    #[must_use]
    pub fn caliper_chi(&self) -> f64 {
        self.lengths.chi
    }

    /// Difference between the sweep's count of profiles minus holes and H_chi, in standard errors of the sweep.
    ///
    /// Both are equal for any mesh that bounds a solid. Beyond 6 the mesh intersects itself, and neither its sections
    /// nor this law are meaningful. Zero for closed forms and Monte Carlo.
    #[must_use]
    pub fn chi_discrepancy(&self) -> f64 {
        self.chi_discrepancy
    }

    /// H_eff: mean profiles; N_A = H_eff K N_V.
    #[must_use]
    pub fn caliper_effective(&self) -> f64 {
        self.lengths.effective
    }

    /// Standard error of H_eff; zero for closed forms and for bodies whose sections have no holes.
    #[must_use]
    pub fn caliper_effective_standard_error(&self) -> f64 {
        self.lengths.effective_error
    }

    /// H_holes = H_eff − H_chi: mean holes.
    #[must_use]
    pub fn caliper_holes(&self) -> f64 {
        self.lengths.effective - self.lengths.chi
    }

    /// m = H_eff / H_hull: mean number of profiles per plane that hits the body; 1 for convex bodies.
    #[must_use]
    pub fn profiles_per_hit(&self) -> f64 {
        self.lengths.effective / self.lengths.hull
    }

    /// A_max: the area of the largest profile of the body.
    #[must_use]
    pub fn max_area(&self) -> f64 {
        self.max_area
    }

    /// The area of the largest profile found while the law was computed. If it exceeds [`max_area`](Self::max_area), it
    /// counts in the last bin.
    #[must_use]
    pub fn largest_area_met(&self) -> f64 {
        self.largest_met
    }

    /// The body's size: the diameter of the circle with the area of the largest profile.
    #[must_use]
    pub fn size(&self) -> f64 {
        2.0 * (self.max_area / PI).sqrt()
    }

    /// Volume of the body.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Volume of the body scaled to size 1, for volume fractions from number densities by size.
    #[must_use]
    pub fn unit_volume(&self) -> f64 {
        self.volume / self.size().powi(3)
    }

    /// Surface of the body.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        self.surface_area
    }

    /// Mean area of a profile, V / H_eff: exact.
    #[must_use]
    pub fn mean_profile_area(&self) -> f64 {
        self.volume / self.lengths.effective
    }

    /// Mean squared area of a profile, ⟨A²⟩ / H_eff.
    #[must_use]
    pub fn mean_square_profile_area(&self) -> f64 {
        self.squares.profile
    }

    /// Standard error of the mean squared profile area; zero for closed forms.
    #[must_use]
    pub fn mean_square_profile_area_standard_error(&self) -> f64 {
        self.squares.profile_error
    }

    /// Mean total area of a section, all its profiles together: V / H_hull, exact.
    #[must_use]
    pub fn mean_section_area(&self) -> f64 {
        self.volume / self.lengths.hull
    }

    /// Mean squared total area of a section.
    #[must_use]
    pub fn mean_square_section_area(&self) -> f64 {
        self.squares.total / self.lengths.hull
    }

    /// Standard error of the mean squared total area; zero for closed forms.
    #[must_use]
    pub fn mean_square_section_area_standard_error(&self) -> f64 {
        self.squares.total_error / self.lengths.hull
    }

    /// The body's self-energy ½ ∬ dx dy / |x − y|, which is the mean over directions of ∫ A² dh: the density of random
    /// planes through two points of the body is inversely proportional to their distance.
    ///
    /// Unit cube: 0.94115632; ball of radius R: 16 π² R⁵ / 15.
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// let ball = stereology_kmatrix::SectionLaw::sphere(2.0)?;
    /// assert!((ball.self_energy() - 16.0 * PI * PI / 15.0).abs() < 1e-12);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    #[must_use]
    pub fn self_energy(&self) -> f64 {
        self.squares.total
    }

    /// Total number of directions over all rotations; zero for closed forms, the number of sections that hit for Monte
    /// Carlo.
    #[must_use]
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Number of random rotations (or Monte Carlo batches) that the standard error comes from; zero for closed forms.
    #[must_use]
    pub fn rotations(&self) -> usize {
        self.samples.len()
    }
}

/// K[i][j] = (j / n) (F(i / j) − F((i − 1) / j)).
fn matrix_of(bins: usize, f: impl Fn(f64) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(bins, bins, |i, j| {
        if i > j {
            return 0.0;
        }
        let size = (j + 1) as f64;
        size / bins as f64 * (f((i + 1) as f64 / size) - f(i as f64 / size))
    })
}

fn table_at(table: &Table, x: f64) -> f64 {
    if x >= 1.0 { 1.0 } else { table.at(x.asin()) }
}

/// Standard error of the mean of independent values; zero without values.
pub(crate) fn standard_error(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    if values.len() < 2 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    (squares / (count - 1.0) / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::SectionLaw;
    use approx::assert_relative_eq;

    #[test]
    fn lengths_must_be_positive() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(SectionLaw::sphere(bad).is_err());
            assert!(SectionLaw::ellipsoid([1.0, bad, 1.0]).is_err());
        }
    }

    #[test]
    fn the_largest_section_of_an_ellipsoid_contains_its_two_longest_axes() {
        for axes in [
            [1.0, 2.0, 3.0],
            [3.0, 2.0, 1.0],
            [2.0, 1.0, 3.0],
            [2.0, 3.0, 1.0],
            [1.0, 3.0, 2.0],
            [3.0, 1.0, 2.0],
        ] {
            assert_relative_eq!(
                SectionLaw::ellipsoid(axes).unwrap().max_area(),
                6.0 * std::f64::consts::PI,
                epsilon = 1e-12
            );
        }
    }

    #[test]
    fn columns_of_an_ellipsoid_sum_to_relative_size() {
        let matrix = SectionLaw::ellipsoid([1.0, 2.0, 3.0]).unwrap().k_matrix(10);
        for j in 0..10 {
            assert_relative_eq!(matrix.column(j).sum(), (j + 1) as f64 / 10.0, epsilon = 1e-12);
        }
    }
}
