//! Sections of ellipsoids: closed form over depth for every direction, quadrature over directions.

use crate::distribution::{Distribution, Table, gauss_8};
use std::f64::consts::FRAC_PI_2;

/// The distribution of √(A / A_max) over the profiles of an ellipsoid with these semi-axes.
///
/// # Formula
///
/// ```text
/// w(u) = √(Σ aᵢ² uᵢ²)              half-width in direction u
/// A(t) = (π a b c / w) (1 − t²)    section at depth t w
/// F(x) = ⟨w (1 − √max(0, 1 − x² w / c))⟩ / ⟨w⟩,  c the shortest semi-axis
/// ```
pub(crate) fn distribution(semi_axes: [f64; 3], cells: usize) -> Distribution {
    let mut axes = semi_axes;
    axes.sort_by(f64::total_cmp);
    let [c, b, a] = axes;
    // Only the proportions matter. With c = 1 nothing overflows.
    let ellipsoid = Proportions { b: b / c, a: a / c };
    let mean_half_width = ellipsoid.mean(f64::INFINITY);
    // F has kinks at the sections across the axes, x² = c / a and c / b. Nodes are denser there and at both ends.
    let mut bends = vec![0.0, (c / a).sqrt().asin(), (c / b).sqrt().asin(), FRAC_PI_2];
    bends.dedup_by(|next, last| *next - *last < 1e-6);
    let mut angles = vec![0.0];
    for pair in bends.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let cells = cells / 2;
        angles.extend((1..=cells).map(|k| from + (to - from) * smooth_step(k as f64 / cells as f64).0));
    }
    let last = angles.len() - 1;
    angles[last] = FRAC_PI_2;
    let values = angles
        .iter()
        .enumerate()
        .map(|(k, theta)| match k {
            0 => 0.0,
            _ if k == last => 1.0,
            _ => (1.0 - ellipsoid.mean(theta.sin().powi(-2)) / mean_half_width).clamp(0.0, 1.0),
        })
        .collect();
    Distribution::Table(Table::new(angles, values))
}

/// ⟨1 / w⟩ over directions: Carlson's elliptic integral R_F(a², b², c²).
pub(crate) fn mean_reciprocal_half_width(semi_axes: [f64; 3]) -> f64 {
    let unit = semi_axes.iter().copied().fold(0.0, f64::max);
    let [mut x, mut y, mut z] = semi_axes.map(|a| (a / unit) * (a / unit));
    // Each duplication step reduces the spread of x, y, z to a quarter, until only their mean matters.
    for _ in 0..60 {
        let lambda = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
        [x, y, z] = [x, y, z].map(|t| 0.25 * (t + lambda));
    }
    ((x + y + z) / 3.0).sqrt().recip() / unit
}

/// Semi-axes over the shortest: 1 ≤ b ≤ a.
struct Proportions {
    b: f64,
    a: f64,
}

impl Proportions {
    /// ⟨w √max(0, 1 − w / limit)⟩ over directions; infinite limit: ⟨w⟩.
    ///
    /// The integrand has a square-root end where w = limit, and a sharp bend near the long axis of a slender body. Both
    /// integrals use the substitution [`smooth_step`], whose slope is zero at both ends.
    fn mean(&self, limit: f64) -> f64 {
        // In the plane of the two long axes the half-width is g(φ), from b (φ = π/2) to a (φ = 0).
        let spread = (self.a - self.b) * (self.a + self.b);
        let cos_squared = (limit - self.b) * (limit + self.b) / spread;
        let corner = if spread > 0.0 && cos_squared > 0.0 && cos_squared < 1.0 {
            cos_squared.sqrt().acos()
        } else {
            0.0
        };
        let over = |from: f64, to: f64| {
            self.panels(|v| {
                let (step, slope) = smooth_step(v);
                slope * (to - from) * self.meridian(from + (to - from) * step, limit)
            })
        };
        (over(0.0, corner) + over(corner, FRAC_PI_2)) / FRAC_PI_2
    }

    /// The mean over z = cos(polar angle from the short axis) at azimuth φ.
    fn meridian(&self, azimuth: f64, limit: f64) -> f64 {
        let (sin, cos) = azimuth.sin_cos();
        // w² = 1 + (1 − z²) e
        let e = (self.a - 1.0) * (self.a + 1.0) * cos * cos + (self.b - 1.0) * (self.b + 1.0) * sin * sin;
        let start = if e > 0.0 && limit.is_finite() {
            (1.0 - (limit - 1.0) * (limit + 1.0) / e).max(0.0).sqrt()
        } else {
            0.0
        };
        self.panels(|v| {
            let (step, slope) = smooth_step(v);
            let z = start + (1.0 - start) * step;
            let w = (1.0 + (1.0 - z) * (1.0 + z) * e).sqrt();
            slope * (1.0 - start) * w * (1.0 - w / limit).max(0.0).sqrt()
        })
    }

    /// Composite quadrature over (0, 1), with more panels for more slender bodies.
    #[allow(clippy::cast_possible_truncation)] // The logarithm of a finite number is below 1100.
    fn panels(&self, mut f: impl FnMut(f64) -> f64) -> f64 {
        let panels = 3 + self.a.log2().ceil() as i32;
        (0..panels)
            .map(|p| {
                gauss_8(
                    f64::from(p) / f64::from(panels),
                    f64::from(p + 1) / f64::from(panels),
                    &mut f,
                )
            })
            .sum()
    }
}

/// 3 v² − 2 v³ and its slope.
fn smooth_step(v: f64) -> (f64, f64) {
    (v * v * (3.0 - 2.0 * v), 6.0 * v * (1.0 - v))
}

#[cfg(test)]
mod tests {
    use super::distribution;
    use crate::distribution::Distribution;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use stereology_shape::Body;

    #[test]
    fn equal_axes_are_a_sphere() {
        let law = distribution([2.0; 3], 256);
        for k in 0..=100 {
            let x = f64::from(k) / 100.0;
            assert_abs_diff_eq!(law.at(x), Distribution::Sphere.at(x), epsilon = 1e-7);
        }
    }

    #[test]
    fn mean_relative_area_is_volume_over_width() {
        // ∫ x² dF = ⟨A⟩ / A_max = V / (H A_max), by parts 1 − 2 ∫ x F dx.
        for axes in [[1.0, 1.0, 3.0], [1.0, 2.0, 3.0], [0.2, 1.0, 1.1], [1.0, 5.0, 5.0]] {
            let body = Body::ellipsoid(axes).unwrap();
            let law = distribution(axes, 512);
            let steps = 200_000;
            let mean: f64 = (0..steps)
                .map(|k| (f64::from(k) + 0.5) / f64::from(steps))
                .map(|x| 2.0 * x * (1.0 - law.at(x)) / f64::from(steps))
                .sum();
            assert_relative_eq!(
                mean,
                body.volume() / (body.mean_width() * body.largest_section_area()),
                max_relative = 1e-7
            );
        }
    }
}
