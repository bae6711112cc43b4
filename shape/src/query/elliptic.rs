//! Ellipsoids in closed form: Carlson's symmetric integrals, sections, and the nearest point of the surface.

use nalgebra::{Point3, Vector3};

/// Carlson's R_G(x, y, z): the mean over all directions u of √(x u₁² + y u₂² + z u₃²). Arguments positive.
///
/// With it the mean width of an ellipsoid is 2 R_G(a², b², c²) and its surface 4π R_G(a²b², a²c², b²c²). Carlson 1995,
/// *Numerical computation of real or complex elliptic integrals*; duplication until the series' error is below 1e-16.
pub(crate) fn carlson_rg(x: f64, y: f64, z: f64) -> f64 {
    // With z between x and y all three terms are positive, so no digits cancel.
    let mut sorted = [x, y, z];
    sorted.sort_unstable_by(f64::total_cmp);
    let [y, z, x] = sorted;
    0.5 * (z * carlson_rf(x, y, z) + (x - z) * (z - y) / 3.0 * carlson_rd(x, y, z) + (x * y / z).sqrt())
}

fn carlson_rf(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    let mut mean = (x + y + z) / 3.0;
    while (mean - x).abs().max((mean - y).abs()).max((mean - z).abs()) > 1e-3 * mean {
        let lambda = (x * y).sqrt() + (x * z).sqrt() + (y * z).sqrt();
        (x, y, z) = (0.25 * (x + lambda), 0.25 * (y + lambda), 0.25 * (z + lambda));
        mean = (x + y + z) / 3.0;
    }
    let (u, v) = (1.0 - x / mean, 1.0 - y / mean);
    let w = -u - v;
    let (e2, e3) = (u * v - w * w, u * v * w);
    (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / mean.sqrt()
}

fn carlson_rd(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    let (mut sum, mut power) = (0.0, 1.0);
    let mut mean = (x + y + 3.0 * z) / 5.0;
    while (mean - x).abs().max((mean - y).abs()).max((mean - z).abs()) > 1e-3 * mean {
        let lambda = (x * y).sqrt() + (x * z).sqrt() + (y * z).sqrt();
        sum += power / (z.sqrt() * (z + lambda));
        power *= 0.25;
        (x, y, z) = (0.25 * (x + lambda), 0.25 * (y + lambda), 0.25 * (z + lambda));
        mean = (x + y + 3.0 * z) / 5.0;
    }
    let (u, v) = (1.0 - x / mean, 1.0 - y / mean);
    let w = -(u + v) / 3.0;
    let (e2, e3) = (u * v - 6.0 * w * w, (3.0 * u * v - 8.0 * w * w) * w);
    let (e4, e5) = (3.0 * (u * v - w * w) * w * w, u * v * w * w * w);
    let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0
        + 3.0 * e5 / 26.0;
    3.0 * sum + power * series / (mean * mean.sqrt())
}

/// Half the width of the ellipsoid with semi-axes `axes` along `normal`: √(Σ aᵢ² nᵢ²).
pub(crate) fn half_width(axes: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    axes.component_mul(normal).norm()
}

/// Area of the section n·x = `offset`: (π abc / w) (1 - (offset / w)²), w the half-width.
pub(crate) fn section_area(axes: &Vector3<f64>, normal: &Vector3<f64>, offset: f64) -> f64 {
    let w = half_width(axes, normal);
    let depth = offset / w;
    std::f64::consts::PI * (axes.product() / w) * (1.0 - depth * depth).max(0.0)
}

/// Signed distance of `p` to the surface, negative inside.
///
/// The nearest point is xᵢ = aᵢ² pᵢ / (aᵢ² + t), with t the largest root of Σ (aᵢ pᵢ / (aᵢ² + t))² = 1 (Eberly,
/// *Distance from a point to an ellipsoid*). That sum decreases and is convex to the right of its last pole, so Newton
/// steps from the left of the root cannot overshoot; bisection safeguards them. The unknown is s = t + a₁², the
/// distance from that pole (a₁ the smallest axis), so no digits are lost near it.
pub(crate) fn signed_distance(axes: &Vector3<f64>, p: &Point3<f64>) -> f64 {
    // In units of the smallest axis, all coordinates positive.
    let smallest = axes.min();
    let e = axes / smallest;
    let y = p.coords.abs() / smallest;
    let gap = e.map(|e| (e - 1.0) * (e + 1.0));
    let sign = if y.component_div(&e).norm_squared() < 1.0 {
        -smallest
    } else {
        smallest
    };
    let term = |i: usize, s: f64| if y[i] == 0.0 { 0.0 } else { e[i] * y[i] / (gap[i] + s) };
    let value = |s: f64| (0..3).map(|i| term(i, s).powi(2)).sum::<f64>() - 1.0;
    // At `low` the terms of the smallest axis alone add up to 1; at `high` the sum is at most 1.
    let mut low = (0..3)
        .filter(|&i| gap[i] == 0.0)
        .map(|i| y[i] * y[i])
        .sum::<f64>()
        .sqrt();
    let mut high = e.component_mul(&y).norm();
    if low == 0.0 && value(0.0) <= 0.0 {
        // On the plane across the smallest axis, near the middle: the nearest point lies off that plane.
        return sign * distance_at_pole(&e, &y, &gap);
    }
    let mut s = low;
    for _ in 0..200 {
        let f = value(s);
        if f > 0.0 {
            low = s;
        } else {
            high = s;
        }
        let slope: f64 = (0..3)
            .filter(|&i| y[i] != 0.0)
            .map(|i| -2.0 * term(i, s).powi(2) / (gap[i] + s))
            .sum();
        let newton = s - f / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - s).abs() <= 4.0 * f64::EPSILON * s {
            break;
        }
        s = next;
    }
    let to_surface = Vector3::from_fn(|i, _| {
        if y[i] == 0.0 {
            0.0
        } else {
            y[i] * (1.0 - s) / (gap[i] + s)
        }
    });
    sign * to_surface.norm()
}

/// Distance for s = 0: the coordinates along longer axes follow from s, and those along the smallest axis contribute
/// the rest.
fn distance_at_pole(e: &Vector3<f64>, y: &Vector3<f64>, gap: &Vector3<f64>) -> f64 {
    let mut square = 0.0;
    let mut left = 1.0;
    for i in (0..3).filter(|&i| gap[i] > 0.0) {
        square += (y[i] / gap[i]).powi(2);
        left -= (e[i] * y[i] / gap[i]).powi(2);
    }
    (square + left.max(0.0)).sqrt()
}
