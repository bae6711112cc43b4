//! Order in a packing: alignment of particles and crystallisation.

use crate::neighbours::Neighbours;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use stereology_shape::{Particle, PeriodicBox};

/// Distribution of the directions of an axis of the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct OrientationTensor {
    /// Mean of `u uᵀ`; trace 1, one third of the identity if isotropic.
    pub tensor: Matrix3<f64>,
    /// Its eigenvalues, ascending.
    pub eigenvalues: [f64; 3],
    /// Bingham's statistic `15/2 N Σ (λ − 1/3)²`: for isotropic directions χ² of 5 degrees of freedom (one in a million
    /// exceeds 35.9).
    pub bingham: f64,
}

/// The orientation tensor of a body axis, given in body coordinates with any length except 0. `None` without particles
/// or without an axis.
///
/// # References
///
/// Bingham 1974; Mardia & Jupp 2000, *Directional Statistics*, 10.3.
///
/// # Examples
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_anneal::{Grain, orientation_tensor, populate};
/// use stereology_shape::PeriodicBox;
///
/// let period = PeriodicBox::new(Vector3::repeat(9.0))?;
/// let particles = populate(&[Grain { shape: 0, size: 1.0, category: 0 }; 500], &period, 0);
/// let tensor = orientation_tensor(&particles, &Vector3::x()).ok_or("no particles")?;
/// assert!(tensor.bingham < 35.9 && (tensor.tensor.trace() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn orientation_tensor(particles: &[Particle], axis: &Vector3<f64>) -> Option<OrientationTensor> {
    let axis = axis.try_normalize(0.0)?;
    if particles.is_empty() {
        return None;
    }
    let count = particles.len() as f64;
    let sum = particles.iter().fold(Matrix3::zeros(), |sum: Matrix3<f64>, particle| {
        let u = particle.orientation * axis;
        sum + u * u.transpose()
    });
    let tensor = sum / count;
    let mut eigenvalues: [f64; 3] = SymmetricEigen::new(tensor).eigenvalues.into();
    eigenvalues.sort_by(f64::total_cmp);
    let spread: f64 = eigenvalues.iter().map(|l| (l - 1.0 / 3.0).powi(2)).sum();
    Some(OrientationTensor {
        tensor,
        eigenvalues,
        bingham: 7.5 * count * spread,
    })
}

/// Bond-orientational order of degree 6 (Steinhardt).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BondOrder {
    /// Q₆ of all bonds: about 1/√(number of bonds) if disordered, .57 in a face-centred cubic crystal, .48 hexagonal,
    /// .51 body-centred.
    pub global: f64,
    /// Mean over particles of q₆ of their bonds.
    pub local: f64,
    /// Number of bonds, each counted once.
    pub bonds: usize,
}

/// Q₆ of the bonds between particles whose centres are closer than `cutoff` times the mean of their sizes; 1.4 gives
/// the first shell of spheres.
///
/// # Formula
///
/// ```text
/// Q₆ = √( 4π/13 Σₘ |⟨Y₆ₘ(bond)⟩|² )
/// ```
///
/// # References
///
/// Steinhardt, Nelson & Ronchetti 1983, eq. (1.3).
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_anneal::bond_order;
/// use stereology_shape::{Particle, PeriodicBox};
///
/// // The face-centred cubic crystal.
/// let mut particles = Vec::new();
/// for k in 0..8_u8 {
///     for corner in [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
///         let cell = Vector3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
///         let position = Point3::from(cell + Vector3::from(corner));
///         particles.push(Particle { shape: 0, size: 0.5_f64.sqrt(), category: 0, position, orientation: UnitQuaternion::identity() });
///     }
/// }
/// let order = bond_order(&particles, &PeriodicBox::new(Vector3::repeat(2.0))?, 1.2);
/// assert_eq!(order.bonds, 6 * particles.len());
/// assert!((order.global - 0.5745).abs() < 1e-4 && (order.local - 0.5745).abs() < 1e-4);
/// # Ok::<(), stereology_shape::BoxError>(())
/// ```
#[must_use]
pub fn bond_order(particles: &[Particle], period: &PeriodicBox, cutoff: f64) -> BondOrder {
    let centres: Vec<Vector3<f64>> = particles.iter().map(|p| period.wrap(&p.position).coords).collect();
    let reach: Vec<f64> = particles.iter().map(|p| 0.5 * cutoff.max(0.0) * p.size).collect();
    let neighbours = Neighbours::find(&centres, &reach, period.sides(), 0.0);
    let mut own = vec![(Harmonics::default(), 0_u32); particles.len()];
    let (mut all, mut bonds) = (Harmonics::default(), 0);
    for i in 0..particles.len() {
        for neighbour in neighbours.of(i).1 {
            let j = neighbour.other as usize;
            let bond = centres[j] + neighbours.images.shift(neighbour.image) - centres[i];
            let Some(direction) = bond.try_normalize(0.0) else {
                continue;
            };
            // The degree is even: the value is the same from either end.
            let harmonics = Harmonics::of(&direction);
            all.add(&harmonics);
            bonds += 1;
            for end in [i, j] {
                own[end].0.add(&harmonics);
                own[end].1 += 1;
            }
        }
    }
    let bound: Vec<f64> = own
        .iter()
        .filter(|(_, bonds)| *bonds > 0)
        .map(|(sum, bonds)| sum.norm() / f64::from(*bonds))
        .collect();
    BondOrder {
        global: if bonds > 0 { all.norm() / bonds as f64 } else { 0.0 },
        local: if bound.is_empty() {
            0.0
        } else {
            bound.iter().sum::<f64>() / bound.len() as f64
        },
        bonds,
    }
}

/// Sums of the real and imaginary parts of √(4π/13) Y₆ₘ, m = 0..6.
#[derive(Clone, Copy, Default)]
struct Harmonics {
    re: [f64; 7],
    im: [f64; 7],
}

impl Harmonics {
    fn of(n: &Vector3<f64>) -> Self {
        let z = n.z;
        // P₆ᵐ(z) / (1 − z²)^(m/2); (x + iy)ᵐ contains the remaining factor of the sine.
        let z2 = z * z;
        let legendre = [
            (((231.0 * z2 - 315.0) * z2 + 105.0) * z2 - 5.0) / 16.0,
            z * ((33.0 * z2 - 30.0) * z2 + 5.0) * 21.0 / 8.0,
            ((33.0 * z2 - 18.0) * z2 + 1.0) * 105.0 / 8.0,
            z * (11.0 * z2 - 3.0) * 315.0 / 2.0,
            (11.0 * z2 - 1.0) * 945.0 / 2.0,
            z * 10395.0,
            10395.0,
        ];
        let mut sum = Self::default();
        let (mut re, mut im) = (1.0, 0.0);
        // (6 − m)! / (6 + m)!
        let mut ratio = 1.0;
        for (m, legendre) in legendre.into_iter().enumerate() {
            if m > 0 {
                (re, im) = (re * n.x - im * n.y, re * n.y + im * n.x);
                ratio /= (6 + m) as f64 * (7 - m) as f64;
            }
            let scale = legendre * f64::sqrt(ratio);
            (sum.re[m], sum.im[m]) = (scale * re, scale * im);
        }
        sum
    }

    fn add(&mut self, other: &Self) {
        for m in 0..7 {
            self.re[m] += other.re[m];
            self.im[m] += other.im[m];
        }
    }

    /// √ of the sum over m = −6..6.
    fn norm(&self) -> f64 {
        let square = |m: usize| self.re[m].powi(2) + self.im[m].powi(2);
        (square(0) + 2.0 * (1..7).map(square).sum::<f64>()).sqrt()
    }
}
