//! A random smooth function on the sphere: the roughness of rocks.

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Degrees of the roughness: bumps from a third of the rock's width down to a twentieth.
const DEGREES: std::ops::RangeInclusive<usize> = 3..=20;

/// g(u) = Σ a_lm Y_lm(u), normal coefficients with the power of a degree decreasing as l^(−2 H − 1), H = 0.8: a
/// self-affine surface. The mean square of g over the sphere has expectation 1.
pub(crate) struct Roughness {
    /// One pair for each (l, m), m from 0 to l: the coefficients of cos mφ and of sin mφ.
    coefficients: Vec<[f64; 2]>,
}

const HURST: f64 = 0.8;

impl Roughness {
    pub(crate) fn random(rng: &mut impl Rng) -> Self {
        let power = |l: usize| (l as f64).powf(-2.0 * HURST - 1.0);
        let whole: f64 = DEGREES.map(power).sum();
        let mut coefficients = Vec::new();
        for l in DEGREES {
            // The squares of the 2 l + 1 orthonormal functions of a degree add up to (2 l + 1) / 4π everywhere.
            let deviation = (power(l) / whole * 4.0 * std::f64::consts::PI / (2 * l + 1) as f64).sqrt();
            for m in 0..=l {
                let mut normal = || {
                    let z: f64 = StandardNormal.sample(rng);
                    deviation * z
                };
                let cosine = normal();
                let sine = normal();
                coefficients.push([cosine, if m == 0 { 0.0 } else { sine }]);
            }
        }
        Self { coefficients }
    }

    /// g in the direction of a unit vector.
    pub(crate) fn at(&self, u: &Vector3<f64>) -> f64 {
        let azimuth = u.y.atan2(u.x);
        let highest = *DEGREES.end();
        let table = legendre(highest, u.z.clamp(-1.0, 1.0));
        let mut sum = 0.0;
        let mut at = 0;
        for l in DEGREES {
            for m in 0..=l {
                let [cosine, sine] = self.coefficients[at];
                let (s, c) = (m as f64 * azimuth).sin_cos();
                let norm = if m == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
                sum += norm * table[l * (l + 1) / 2 + m] * (cosine * c + sine * s);
                at += 1;
            }
        }
        sum
    }
}

/// Associated Legendre functions normalised so that Y_lm is orthonormal over the sphere, at l (l + 1) / 2 + m (Holmes &
/// Featherstone 2002).
fn legendre(highest: usize, z: f64) -> Vec<f64> {
    let at = |l: usize, m: usize| l * (l + 1) / 2 + m;
    let sine = ((1.0 - z) * (1.0 + z)).sqrt();
    let mut p = vec![0.0; at(highest, highest) + 1];
    p[0] = (0.25 / std::f64::consts::PI).sqrt();
    for m in 1..=highest {
        p[at(m, m)] = sine * ((2 * m + 1) as f64 / (2 * m) as f64).sqrt() * p[at(m - 1, m - 1)];
    }
    for m in 0..highest {
        p[at(m + 1, m)] = z * ((2 * m + 3) as f64).sqrt() * p[at(m, m)];
        for l in m + 2..=highest {
            let (l2, m2) = ((l * l) as f64, (m * m) as f64);
            let a = ((4.0 * l2 - 1.0) / (l2 - m2)).sqrt();
            let b = (((l as f64 - 1.0).powi(2) - m2) / (4.0 * (l as f64 - 1.0).powi(2) - 1.0)).sqrt();
            p[at(l, m)] = a * (z * p[at(l - 1, m)] - b * p[at(l - 2, m)]);
        }
    }
    p
}

#[cfg(test)]
mod tests {
    use super::{Roughness, legendre};
    use crate::TriangleMesh;
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::PI;

    /// The addition theorem: Σ_m Y_lm² = (2 l + 1) / 4π in every direction.
    #[test]
    fn squares_of_a_degree_add_up() {
        for z in [-1.0, -0.3, 0.0, 0.77, 1.0] {
            let table = legendre(20, z);
            for l in 0..=20_usize {
                let sum: f64 = (0..=l)
                    .map(|m| if m == 0 { 1.0 } else { 2.0 } * table[l * (l + 1) / 2 + m].powi(2))
                    .sum();
                assert_relative_eq!(sum, (2 * l + 1) as f64 / (4.0 * PI), max_relative = 1e-10);
            }
        }
    }

    #[test]
    fn roughness_has_mean_square_one() {
        let ball = TriangleMesh::icosphere(2.0, 3);
        let mean: f64 = (0..40)
            .map(|seed| {
                let rough = Roughness::random(&mut ChaCha8Rng::seed_from_u64(seed));
                let squares = ball.vertices.iter().map(|p| rough.at(&p.coords).powi(2)).sum::<f64>();
                squares / ball.vertices.len() as f64
            })
            .sum::<f64>()
            / 40.0;
        assert!((mean - 1.0).abs() < 0.25, "{mean}");
    }
}
