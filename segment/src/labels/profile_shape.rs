//! The shape of a profile: axis ratio, ellipticity, solidity, orientation.

use std::f64::consts::PI;

/// Pixels below which a profile's shape is that of its pixels.
const LEAST_PIXELS: u64 = 50;

/// Numbers that describe the shape of a profile, from the centres and sides of its pixels.
///
/// # Formula
///
/// C holds the second central moments of the pixel centres, with eigenvalues λ₁ ≥ λ₂. The moments of a single pixel,
/// 1/12, are not added: with them the logarithm of the ellipticity is biased by 0.9 / pixels.
///
/// ```text
/// axis_ratio = √(λ₂ / λ₁)        ellipticity = A / (4π √(det C))        solidity = A / A(convex hull)
/// ```
///
/// The ellipticity is the same for all affine images of a shape: 1 for an ellipse, 0.955 for a parallelogram, 0.827 for
/// a triangle. It measures how angular a profile is, whatever its elongation.
///
/// The convex hull is that of the middles of the pixels' sides. A digitised disc of 200 pixels has a solidity of
/// 0.978 ± 0.005; the difference from 1 decreases with the number of pixels. Solidities above 1, which a rectangle
/// along the rows has by half a pixel, are set to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileShape {
    /// Minor over major axis of the ellipse of equal second moments, 0 to 1.
    pub axis_ratio: f64,
    /// Area over that of the ellipse of equal second moments.
    pub ellipticity: f64,
    /// Area over that of the convex hull, at most 1.
    pub solidity: f64,
    /// Angle of the major axis in degrees, 0 to 180, from the direction of the rows towards larger y: clockwise on the
    /// screen.
    pub orientation: f64,
}

/// Pixels of a profile in one row: the row, the first and the last column.
type RowExtent = [usize; 3];

/// Sums over the pixels of a profile, from which its shape is computed. Exact for photos of up to 2³¹ pixels.
#[derive(Clone, Default)]
pub(crate) struct ShapeSums {
    count: u64,
    first: [u64; 2],
    second: [u128; 3],
    /// By increasing row.
    rows: Vec<RowExtent>,
}

impl ShapeSums {
    /// Adds a pixel; pixels must come in reading order.
    pub(crate) fn add(&mut self, x: usize, y: usize) {
        self.count += 1;
        let [u, v] = [x as u64, y as u64];
        self.first[0] += u;
        self.first[1] += v;
        self.second[0] += u128::from(u * u);
        self.second[1] += u128::from(u * v);
        self.second[2] += u128::from(v * v);
        match self.rows.last_mut() {
            Some([row, _, last]) if *row == y => *last = x,
            _ => self.rows.push([y, x, x]),
        }
    }

    /// Number of pixels.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Mean of the pixel centres.
    pub(crate) fn centre(&self) -> [f64; 2] {
        self.first.map(|sum| sum as f64 / self.count as f64 + 0.5)
    }

    /// The shape; `None` of fewer than 50 pixels, and of pixels on one line.
    pub(crate) fn shape(&self) -> Option<ProfileShape> {
        if self.count < LEAST_PIXELS {
            return None;
        }
        let [sum_x, sum_y] = self.first.map(u128::from);
        let n = u128::from(self.count);
        // Differences of exact products, so that large coordinates cost no digits.
        let central = |second: u128, product: u128| {
            let (more, less) = (n * second, product);
            let magnitude = more.abs_diff(less) as f64 / (n as f64).powi(2);
            if more >= less { magnitude } else { -magnitude }
        };
        let xx = central(self.second[0], sum_x * sum_x);
        let xy = central(self.second[1], sum_x * sum_y);
        let yy = central(self.second[2], sum_y * sum_y);
        let determinant = xx * yy - xy * xy;
        let half_trace = 0.5 * (xx + yy);
        let radius = (0.5 * (xx - yy)).hypot(xy);
        let (major, minor) = (half_trace + radius, determinant / (half_trace + radius));
        // Pixels on one line: the determinant is rounding.
        if minor <= 1e-12 * major {
            return None;
        }
        let area = self.count as f64;
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy).to_degrees();
        Some(ProfileShape {
            axis_ratio: (minor / major).sqrt().min(1.0),
            ellipticity: area / (4.0 * PI * determinant.sqrt()),
            solidity: (area / hull_area(&self.rows)).min(1.0),
            orientation: if angle < 0.0 { angle + 180.0 } else { angle },
        })
    }
}

/// Area of the convex hull of the middles of the sides of pixels.
fn hull_area(rows: &[RowExtent]) -> f64 {
    // By increasing y, then x, as the chains need them; only the ends of rows can be corners.
    let mut points = Vec::with_capacity(6 * rows.len());
    for &[y, first, last] in rows {
        let [y, first, last] = [y, first, last].map(|v| v as f64);
        points.extend([[first + 0.5, y], [last + 0.5, y]]);
        points.extend([[first, y + 0.5], [last + 1.0, y + 0.5]]);
        points.extend([[first + 0.5, y + 1.0], [last + 0.5, y + 1.0]]);
    }
    points.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    0.5 * (chain(points.iter()) + chain(points.iter().rev()))
}

/// Twice the area that one chain of the convex hull adds (Andrew 1979).
fn chain<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> f64 {
    let turn = |a: &[f64; 2], b: &[f64; 2], c: &[f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for point in points {
        while let [.., a, b] = corners.as_slice()
            && turn(a, b, point) <= 0.0
        {
            corners.pop();
        }
        corners.push(*point);
    }
    corners.windows(2).map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Shape of the pixels of a 120 x 120 image whose centres lie inside.
    fn shape_of(inside: impl Fn(f64, f64) -> bool) -> (f64, ProfileShape) {
        let mut sums = ShapeSums::default();
        for y in 0..120 {
            for x in 0..120 {
                if inside(x as f64 - 59.5, y as f64 - 59.5) {
                    sums.add(x, y);
                }
            }
        }
        (sums.count() as f64, sums.shape().unwrap())
    }

    /// A test of whether a point is inside a figure that is turned by `degrees` and moved by less than a pixel.
    fn turned(degrees: f64, shift: [f64; 2], inside: impl Fn(f64, f64) -> bool) -> impl Fn(f64, f64) -> bool {
        let (sin, cos) = degrees.to_radians().sin_cos();
        move |x, y| {
            let (x, y) = (x - shift[0], y - shift[1]);
            inside(x * cos + y * sin, y * cos - x * sin)
        }
    }

    fn place() -> impl Strategy<Value = (f64, [f64; 2])> {
        (0.0..180.0_f64, [0.0..1.0_f64, 0.0..1.0_f64])
    }

    proptest! {
        /// Every ellipse has ellipticity 1, its own axis ratio and direction, and is convex, within errors that
        /// decrease with the number of pixels.
        #[test]
        fn ellipses((degrees, shift) in place(), major in 14.0..40.0_f64, ratio in 0.4..1.0_f64) {
            let (pixels, shape) = shape_of(turned(degrees, shift, |x, y| x.powi(2) + (y / ratio).powi(2) < major.powi(2)));
            prop_assert!((shape.ellipticity - 1.0).abs() < 2.0 / pixels, "{shape:?}");
            prop_assert!((shape.axis_ratio / ratio).ln().abs() < 0.8 / pixels.sqrt(), "{shape:?}");
            prop_assert!(shape.solidity > 1.0 - 1.2 / pixels.sqrt() && shape.solidity <= 1.0, "{shape:?}");
            let off = (shape.orientation - degrees + 270.0) % 180.0 - 90.0;
            prop_assert!(ratio > 0.9 || off.abs() < 3.0, "{} for {degrees}", shape.orientation);
        }

        /// Every parallelogram has the ellipticity of the square, 3/π, whatever its direction and shear.
        #[test]
        fn parallelograms((degrees, shift) in place(), side in 12.0..30.0_f64, shear in 0.0..1.0_f64) {
            let inside = turned(degrees, shift, |x, y| y.abs() < side && (x - shear * y).abs() < side);
            let (pixels, shape) = shape_of(inside);
            prop_assert!((shape.ellipticity - 3.0 / PI).abs() < 1.5 / pixels.sqrt(), "{shape:?}");
            prop_assert!(shape.solidity > 1.0 - 2.2 / pixels.sqrt(), "{shape:?}");
        }

        /// A figure turned by a right angle has the same shape, its direction turned; one moved by whole pixels has
        /// exactly the same.
        #[test]
        fn right_angles(cells in proptest::collection::vec(proptest::bool::weighted(0.7), 100..169), far in 0_usize..1_000_000) {
            let inside = |x: usize, y: usize| cells.get(13 * y + x).copied().unwrap_or(false);
            let (mut plain, mut moved, mut quarter) = (ShapeSums::default(), ShapeSums::default(), ShapeSums::default());
            for y in 0..13 {
                for x in 0..13 {
                    if inside(x, y) {
                        plain.add(x, y);
                        moved.add(x + far, y + 2 * far);
                    }
                    if inside(y, 12 - x) {
                        quarter.add(x, y);
                    }
                }
            }
            prop_assert_eq!(plain.shape(), moved.shape());
            let [a, b] = [&plain, &quarter].map(ShapeSums::shape);
            let (Some(a), Some(b)) = (a, b) else { return Ok(()) };
            prop_assert!((a.axis_ratio - b.axis_ratio).abs() < 1e-9 && (a.ellipticity - b.ellipticity).abs() < 1e-9);
            prop_assert!((a.solidity - b.solidity).abs() < 1e-9);
            let off = (a.orientation - b.orientation).abs() - 90.0;
            prop_assert!(off.abs() < 1e-6 || a.axis_ratio > 1.0 - 1e-9);
        }
    }

    /// A hollow or bent figure is less solid than its hull: a cross of five squares has 5/7 of it.
    #[test]
    fn concave_figures() {
        let (_, shape) = shape_of(|x, y| x.abs().max(y.abs()) < 45.0 && x.abs().min(y.abs()) < 15.0);
        assert!((shape.solidity - 5.0 / 7.0).abs() < 0.01, "{shape:?}");
    }

    /// Few pixels, and pixels on one line, have no shape.
    #[test]
    fn no_shape() {
        let mut line = ShapeSums::default();
        (0..100).for_each(|i| line.add(i, i));
        let mut few = ShapeSums::default();
        (0..49).for_each(|i| few.add(i % 7, i / 7));
        assert_eq!([line.shape(), few.shape()], [None, None]);
        few.add(0, 7);
        assert!(few.shape().is_some());
    }
}
