//! The cumulative distribution of relative profile sizes, x = √(A / A_max).

use std::f64::consts::FRAC_PI_2;

/// Nodes and weights of Gauss-Legendre quadrature with eight points on [-1, 1].
const GAUSS_8: [(f64, f64); 8] = [
    (-0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// Sums `weight · f(x)` over a Gauss-Legendre rule of eight points on (from, to).
pub(crate) fn gauss_8(from: f64, to: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS_8.iter().map(|&(x, w)| w * f(centre + half * x)).sum::<f64>() * half
}

/// F(x): the fraction of the profiles with √(A / A_max) ≤ x.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Distribution {
    /// 1 − √(1 − x²), exactly.
    Sphere,
    /// Values at nodes of θ = asin x, interpolated by monotone cubics.
    Table(Table),
}

impl Distribution {
    pub(crate) fn at(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        if x >= 1.0 {
            return 1.0;
        }
        match self {
            // 1 − √(1 − x²) without the cancellation at small x.
            Self::Sphere => x * x / (1.0 + ((1.0 - x) * (1.0 + x)).sqrt()),
            Self::Table(table) => table.at(x.asin()),
        }
    }

    /// ∫ from `a` to `b` of D F(d / D) dD, with F = 1 where the particle is smaller than the profile edge `d`.
    pub(crate) fn size_integral(&self, d: f64, a: f64, b: f64) -> f64 {
        if d <= 0.0 || b <= a {
            return 0.0;
        }
        // Below D = d every profile is smaller than d: the integrand is D.
        let below = if d > a {
            0.5 * (d.min(b) - a) * (d.min(b) + a)
        } else {
            0.0
        };
        let a = a.max(d);
        if b <= a {
            return below;
        }
        below
            + match self {
                Self::Sphere => {
                    // ∫ D − √(D² − d²) = D²/2 − (D √(D² − d²) − d² ln(D + √(D² − d²))) / 2
                    let root = |diameter: f64| ((diameter - d) * (diameter + d)).sqrt();
                    let (at_a, at_b) = (root(a), root(b));
                    0.5 * ((b - a) * (b + a) - b * at_b + a * at_a + d * d * ((b + at_b) / (a + at_a)).ln())
                }
                Self::Table(table) => {
                    // With D = d / sin θ the square-root singularity at D = d disappears: ∫ d² F cos θ / sin³ θ dθ.
                    let (from, to) = ((d / b).asin(), (d / a).min(1.0).asin());
                    let panels = ((b / a).ln() / 0.25).ceil().clamp(1.0, 400.0);
                    let ratio = (to / from).powf(1.0 / panels);
                    let mut left = from;
                    let mut sum = 0.0;
                    while left < to * (1.0 - 1e-12) {
                        let right = (left * ratio).min(to);
                        sum += gauss_8(left, right, |theta| {
                            let (sin, cos) = theta.sin_cos();
                            table.at(theta) * cos / (sin * sin * sin)
                        });
                        left = right;
                    }
                    d * d * sum
                }
            }
    }
}

/// Values of F at increasing angles θ = asin x from 0 to π/2, interpolated by monotone cubics (Steffen 1990).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    angles: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Table {
    /// Equal steps of θ, from 0 to π/2.
    pub(crate) fn equal_angles(cells: usize) -> Vec<f64> {
        (0..=cells)
            .map(|k| {
                if k == cells {
                    FRAC_PI_2
                } else {
                    FRAC_PI_2 * k as f64 / cells as f64
                }
            })
            .collect()
    }

    /// A table from angles that increase from 0 to π/2 and values that do not decrease, from 0 to 1.
    pub(crate) fn new(angles: Vec<f64>, values: Vec<f64>) -> Self {
        let last = values.len() - 1;
        let step = |k: usize| angles[k + 1] - angles[k];
        let rise = |k: usize| (values[k + 1] - values[k]) / step(k);
        let slope = |k: usize| {
            if k == 0 {
                return end_slope(rise(0), step(0), rise(1.min(last - 1)), step(1.min(last - 1)));
            }
            if k == last {
                let inner = last.saturating_sub(2);
                return end_slope(rise(last - 1), step(last - 1), rise(inner), step(inner));
            }
            let (left, right) = (rise(k - 1), rise(k));
            let parabolic = (left * step(k) + right * step(k - 1)) / (step(k - 1) + step(k));
            parabolic.min(2.0 * left).min(2.0 * right).max(0.0)
        };
        let slopes = (0..=last).map(slope).collect();
        Self { angles, values, slopes }
    }

    pub(crate) fn at(&self, theta: f64) -> f64 {
        let cell = self
            .angles
            .partition_point(|&angle| angle <= theta)
            .clamp(1, self.angles.len() - 1)
            - 1;
        let width = self.angles[cell + 1] - self.angles[cell];
        let t = ((theta - self.angles[cell]) / width).clamp(0.0, 1.0);
        let (y0, rise) = (self.values[cell], self.values[cell + 1] - self.values[cell]);
        let (m0, m1) = (self.slopes[cell] * width, self.slopes[cell + 1] * width);
        y0 + t * (m0 + t * ((3.0 * rise - 2.0 * m0 - m1) + t * (m0 + m1 - 2.0 * rise)))
    }
}

/// One-sided parabolic slope at an end, limited so that the curve stays monotone.
fn end_slope(near: f64, near_step: f64, next: f64, next_step: f64) -> f64 {
    (near + (near - next) * near_step / (near_step + next_step)).clamp(0.0, 2.0 * near.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::{Distribution, Table};
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    fn tabulated_sphere(cells: usize) -> Distribution {
        let angles = Table::equal_angles(cells);
        let values = angles
            .iter()
            .map(|theta| Distribution::Sphere.at(theta.sin()))
            .collect();
        Distribution::Table(Table::new(angles, values))
    }

    proptest! {
        /// Between its nodes a table of the sphere's distribution agrees with the closed form.
        #[test]
        fn table_agrees_with_closed_form(x in 0.0..1.0_f64) {
            assert_abs_diff_eq!(tabulated_sphere(512).at(x), Distribution::Sphere.at(x), epsilon = 1e-8);
        }

        /// The integral over particle sizes by quadrature of the table is the sphere's closed form.
        #[test]
        fn size_integral_agrees_with_closed_form(d in 0.01..1.2_f64, a in 0.0..1.0_f64, width in 0.01..1.0_f64) {
            let (exact, table) = (Distribution::Sphere, tabulated_sphere(512));
            assert_abs_diff_eq!(table.size_integral(d, a, a + width), exact.size_integral(d, a, a + width), epsilon = 1e-7);
        }

        /// The closed form agrees with the midpoint rule.
        #[test]
        fn sphere_size_integral_agrees_with_midpoint_rule(d in 0.01..1.2_f64, a in 0.0..1.0_f64, width in 0.01..1.0_f64) {
            let steps = 20_000;
            let sum: f64 = (0..steps)
                .map(|k| {
                    let diameter = a + width * (k as f64 + 0.5) / steps as f64;
                    diameter * Distribution::Sphere.at(d / diameter) * width / steps as f64
                })
                .sum();
            assert_abs_diff_eq!(Distribution::Sphere.size_integral(d, a, a + width), sum, epsilon = 1e-5);
        }
    }
}
