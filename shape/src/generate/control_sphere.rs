//! A sphere edited by its control points, as the paper's particles were made (section 5.2): a rational quadratic
//! surface.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Point3, Vector3, Vector4};

use crate::mesh::index::index;
use crate::mesh::triangle_mesh::TriangleMesh;

/// Control points of a closed surface in rows from pole to pole; each row runs around the axis.
///
/// A NURBS surface of degree 2 along both axes with double knots: every second point of every second row lies on the
/// surface, and the others attract it. The number of rows is odd, at least 3; the number of points per row is even, at
/// least 4. The first and the last row are the poles, where all points of the row coincide.
///
/// # Examples
///
/// ```
/// use stereology_shape::{ClosedMesh, ControlSphere};
///
/// let mut pebble = ControlSphere::sphere(2.0);
/// assert!((ClosedMesh::try_from(pebble.triangles(24))?.volume() / 4.18879 - 1.0).abs() < 0.01);
/// pebble.points_mut()[2][0].x += 0.5; // pull one point of the equator
/// assert!(ClosedMesh::try_from(pebble.triangles(24))?.volume() > 4.2);
/// # Ok::<(), stereology_shape::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ControlSphere {
    points: Vec<Vec<Point3<f64>>>,
    weights: Vec<Vec<f64>>,
}

/// Why control points do not make a closed surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlSphereError {
    /// The grid has the wrong numbers of rows or of points.
    #[error(
        "a control-point sphere has an odd number of rows (3 to 999) of an even number of points (4 to 998) each; row {row} has {points} points, there are {rows} rows"
    )]
    Grid {
        /// The first row that is wrong, from 0.
        row: usize,
        /// How many points it has.
        points: usize,
        /// How many rows there are.
        rows: usize,
    },
    /// A coordinate is not finite, or a weight not positive.
    #[error("row {row}, point {point} (counted from 0): coordinates must be finite and weights positive")]
    Number {
        /// The row.
        row: usize,
        /// The point in it.
        point: usize,
    },
    /// The points of the first or the last row differ.
    #[error("row {row} is a pole: all its points must be the same, point {point} is not")]
    Pole {
        /// The row.
        row: usize,
        /// The first point that differs.
        point: usize,
    },
    /// The file is not JSON of this form.
    #[error(
        "expected {{\"control_points\": [[[x, y, z], ...], ...], \"weights\": [[w, ...], ...]}} (weights may be left out): {message}"
    )]
    Json {
        /// Message of the parser.
        message: String,
    },
}

/// Weight of a control point by whether it lies on the surface along a row and a column.
fn standard_weight(row: usize, column: usize) -> f64 {
    let along = |k: usize| if k.is_multiple_of(2) { 1.0 } else { FRAC_1_SQRT_2 };
    along(row) * along(column)
}

impl ControlSphere {
    /// The exact sphere of a diameter about the origin: 5 rows of 8 points.
    #[must_use]
    pub fn sphere(diameter: f64) -> Self {
        let radius = 0.5 * diameter;
        let meridian = [(0.0, -1.0), (1.0, -1.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let square = [
            (1.0, 0.0),
            (1.0, 1.0),
            (0.0, 1.0),
            (-1.0, 1.0),
            (-1.0, 0.0),
            (-1.0, -1.0),
            (0.0, -1.0),
            (1.0, -1.0),
        ];
        let row = |(out, up): (f64, f64)| {
            let point = |(x, y): (f64, f64)| Point3::from(Vector3::new(out * x, out * y, up) * radius);
            square.map(point).to_vec()
        };
        let points: Vec<Vec<Point3<f64>>> = meridian.into_iter().map(row).collect();
        let weights = standard_weights(&points);
        Self { points, weights }
    }

    /// From rows of control points, with the weights of the exact sphere if none are given.
    ///
    /// # Errors
    ///
    /// [`ControlSphereError`] states the position.
    pub fn new(points: Vec<Vec<Point3<f64>>>, weights: Option<Vec<Vec<f64>>>) -> Result<Self, ControlSphereError> {
        let rows = points.len();
        let around = points.first().map_or(0, Vec::len);
        let fits =
            |row: &Vec<Point3<f64>>| row.len() == around && (4..=998).contains(&around) && around.is_multiple_of(2);
        let wrong = points.iter().position(|row| !fits(row));
        if wrong.is_some() || rows.is_multiple_of(2) || !(3..=999).contains(&rows) {
            let row = wrong.unwrap_or(0);
            let points = points.get(row).map_or(0, Vec::len);
            return Err(ControlSphereError::Grid { row, points, rows });
        }
        let weights = weights.unwrap_or_else(|| standard_weights(&points));
        for (row, line) in points.iter().enumerate() {
            for (point, p) in line.iter().enumerate() {
                let weight = weights
                    .get(row)
                    .and_then(|line| line.get(point))
                    .copied()
                    .unwrap_or(f64::NAN);
                if !p.iter().all(|x| x.is_finite()) || !(1e-6..=1e6).contains(&weight) {
                    return Err(ControlSphereError::Number { row, point });
                }
            }
        }
        for row in [0, rows - 1] {
            if let Some(point) = points[row].iter().position(|p| *p != points[row][0]) {
                return Err(ControlSphereError::Pole { row, point });
            }
        }
        Ok(Self { points, weights })
    }

    /// From JSON: `{"control_points": [[[x, y, z], ...], ...]}`, and `"weights"` if they are not the sphere's.
    ///
    /// # Errors
    ///
    /// [`ControlSphereError`] states the position.
    ///
    /// ```
    /// use stereology_shape::ControlSphere;
    /// let sphere = ControlSphere::sphere(1.0);
    /// assert_eq!(ControlSphere::from_json(&sphere.to_json())?, sphere);
    /// # Ok::<(), stereology_shape::ControlSphereError>(())
    /// ```
    #[cfg(feature = "io")]
    pub fn from_json(text: &str) -> Result<Self, ControlSphereError> {
        let wrong = |message: String| ControlSphereError::Json { message };
        let value: serde_json::Value = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        let points: Vec<Vec<[f64; 3]>> = serde_json::from_value(value["control_points"].clone())
            .map_err(|error| wrong(format!("control_points: {error}")))?;
        let weights: Option<Vec<Vec<f64>>> =
            serde_json::from_value(value["weights"].clone()).map_err(|error| wrong(format!("weights: {error}")))?;
        let points = points
            .into_iter()
            .map(|row| row.into_iter().map(Point3::from).collect())
            .collect();
        Self::new(points, weights)
    }

    /// As JSON, to be edited by hand or by a program.
    #[cfg(feature = "io")]
    #[must_use]
    pub fn to_json(&self) -> String {
        let line = |items: Vec<String>| items.join(", ");
        let rows = |of: &dyn Fn(usize) -> String| {
            let rows: Vec<String> = (0..self.points.len()).map(|row| format!("    [{}]", of(row))).collect();
            rows.join(",\n")
        };
        let points = |row: usize| {
            line(
                self.points[row]
                    .iter()
                    .map(|p| format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z))
                    .collect(),
            )
        };
        let weights = |row: usize| line(self.weights[row].iter().map(|w| format!("{w:?}")).collect());
        format!(
            "{{\n  \"control_points\": [\n{}\n  ],\n  \"weights\": [\n{}\n  ]\n}}\n",
            rows(&points),
            rows(&weights)
        )
    }

    /// The control points, row by row, to be moved. Keep the points of a pole together.
    pub fn points_mut(&mut self) -> &mut [Vec<Point3<f64>>] {
        &mut self.points
    }

    /// The surface as triangles: `steps` (at least 2) for each quarter of the way around and half of the way from pole
    /// to pole, as a sphere of 8 points a row has four arcs around and two up.
    #[must_use]
    pub fn triangles(&self, steps: u32) -> TriangleMesh {
        let steps = steps.max(2) as usize;
        let (arcs_up, arcs_around) = ((self.points.len() - 1) / 2, self.points[0].len() / 2);
        let (up, around) = (arcs_up * steps, arcs_around * steps);
        let last = self.points.len() - 1;
        let mut vertices = vec![self.points[0][0]];
        for v in 1..up {
            for u in 0..around {
                vertices.push(self.at(u as f64 / steps as f64, v as f64 / steps as f64));
            }
        }
        vertices.push(self.points[last][0]);
        let top = index(vertices.len() - 1);
        let vertex = |v: usize, u: usize| match v {
            0 => 0,
            v if v == up => top,
            v => index(1 + (v - 1) * around + u % around),
        };
        let mut triangles = Vec::new();
        for v in 0..up {
            for u in 0..around {
                let [a, b, c, d] = [vertex(v, u), vertex(v, u + 1), vertex(v + 1, u + 1), vertex(v + 1, u)];
                // At the first pole a = b, at the last c = d: one triangle is left of each quad.
                if v > 0 {
                    triangles.push([a, b, c]);
                }
                if v + 1 < up {
                    triangles.push([a, c, d]);
                }
            }
        }
        TriangleMesh { vertices, triangles }
    }

    /// The point at `u` arcs around and `v` arcs up: a rational Bézier patch of 3 × 3 points.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of arcs"
    )]
    fn at(&self, u: f64, v: f64) -> Point3<f64> {
        let around = self.points[0].len();
        let arc = |t: f64, arcs: usize| {
            let k = (t.floor().max(0.0) as usize).min(arcs - 1);
            (2 * k, t - k as f64)
        };
        let ((column, s), (row, t)) = (arc(u, around / 2), arc(v, (self.points.len() - 1) / 2));
        let basis = |t: f64| [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
        let mut sum = Vector4::zeros();
        for (i, b) in basis(t).into_iter().enumerate() {
            for (j, c) in basis(s).into_iter().enumerate() {
                let at = (column + j) % around;
                let weight = self.weights[row + i][at] * b * c;
                sum += (self.points[row + i][at].coords * weight).push(weight);
            }
        }
        Point3::from(sum.xyz() / sum.w)
    }
}

fn standard_weights(points: &[Vec<Point3<f64>>]) -> Vec<Vec<f64>> {
    let line =
        |(row, line): (usize, &Vec<Point3<f64>>)| (0..line.len()).map(|point| standard_weight(row, point)).collect();
    points.iter().enumerate().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::{ControlSphere, ControlSphereError};
    use crate::ClosedMesh;

    #[test]
    fn the_sphere_is_exact() {
        let mesh = ControlSphere::sphere(2.0).triangles(12);
        assert!(mesh.vertices.iter().all(|p| (p.coords.norm() - 1.0).abs() < 1e-14));
        let ball = ClosedMesh::try_from(mesh).unwrap();
        assert!(ball.repairs().is_empty() && ball.volume() > 4.1);
    }

    #[test]
    fn broken_grids_are_refused_with_their_place() {
        let wrong = |change: &dyn Fn(&mut ControlSphere)| {
            let mut sphere = ControlSphere::sphere(1.0);
            change(&mut sphere);
            ControlSphere::new(sphere.points, Some(sphere.weights)).unwrap_err()
        };
        assert_eq!(
            wrong(&|s| s.points[2][3].y = f64::NAN),
            ControlSphereError::Number { row: 2, point: 3 }
        );
        assert_eq!(
            wrong(&|s| s.weights[1][0] = -1.0),
            ControlSphereError::Number { row: 1, point: 0 }
        );
        assert_eq!(
            wrong(&|s| s.points[4][5].x = 1.0),
            ControlSphereError::Pole { row: 4, point: 5 }
        );
        assert!(matches!(
            wrong(&|s| s.points.truncate(4)),
            ControlSphereError::Grid { rows: 4, .. }
        ));
        assert!(matches!(
            wrong(&|s| s.points[1].truncate(7)),
            ControlSphereError::Grid { row: 1, .. }
        ));
        #[cfg(feature = "io")]
        for text in [
            "",
            "{}",
            "[]",
            "{\"control_points\": 3}",
            "{\"control_points\": []}",
            "{\"control_points\": [[[1,2]]]}",
        ] {
            assert!(ControlSphere::from_json(text).is_err(), "{text}");
        }
    }
}
