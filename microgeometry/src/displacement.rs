//! Displacement: from labels to relief (section 4.5 of the paper).

use std::fmt;
use std::str::FromStr;

use nalgebra::Vector3;
use stereology_shape::TriangleMesh;

use crate::error::MicrogeometryError;
use crate::reconstruction::longest_side;

/// f(x): the height as a function of the distance to the interface.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// f(x) = x: straight flanks, sharp ridges and valleys.
    Linear,
    /// f(x) = √x: rounded.
    Root,
    /// Linear between given points (x, f), the first at x ≥ 0 and x increasing; constant beyond them.
    Table(Vec<[f64; 2]>),
}

impl Profile {
    /// f(x) for x ≥ 0.
    ///
    /// ```
    /// use stereology_microgeometry::Profile;
    /// let terrace: Profile = "0=0;2=0;3=1".parse()?;
    /// assert_eq!((Profile::Root.height(4.0), terrace.height(2.5), terrace.height(9.0)), (2.0, 0.5, 1.0));
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    #[must_use]
    pub fn height(&self, x: f64) -> f64 {
        match self {
            Self::Linear => x,
            Self::Root => x.sqrt(),
            Self::Table(points) => {
                let next = points.partition_point(|point| point[0] <= x);
                match (next.checked_sub(1).map(|i| points[i]), points.get(next)) {
                    (Some([x0, f0]), Some([x1, f1])) => f0 + (f1 - f0) * (x - x0) / (x1 - x0),
                    (Some([_, f]), None) | (None, Some(&[_, f])) => f,
                    (None, None) => 0.0,
                }
            }
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear => out.write_str("x"),
            Self::Root => out.write_str("sqrt"),
            Self::Table(points) => {
                let words: Vec<String> = points.iter().map(|[x, f]| format!("{x}={f}")).collect();
                out.write_str(&words.join(";"))
            }
        }
    }
}

impl FromStr for Profile {
    type Err = MicrogeometryError;

    /// `x`, `sqrt`, or a table `0=0;1=0.5;3=2`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || {
            MicrogeometryError::Parameter(format!(
                "{text:?} is not a profile: x, sqrt, or a table such as 0=0;1=0.5;3=2 (distance=height, distances increasing from 0)"
            ))
        };
        match text.trim() {
            "x" | "linear" => return Ok(Self::Linear),
            "sqrt" | "root" => return Ok(Self::Root),
            _ => {}
        }
        let mut points: Vec<[f64; 2]> = Vec::new();
        for point in text.split(';') {
            let (x, f) = point.split_once('=').ok_or_else(wrong)?;
            let number = |word: &str| {
                word.trim()
                    .parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .ok_or_else(wrong)
            };
            let (x, f) = (number(x)?, number(f)?);
            if points.last().map_or(x < 0.0, |last| x <= last[0]) {
                return Err(wrong());
            }
            points.push([x, f]);
        }
        Ok(Self::Table(points))
    }
}

/// Which way vertices of a region move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// Along the normal: s = 1.
    #[default]
    Out,
    /// Against it: s = −1.
    In,
    /// Not at all: s = 0, a dash in table 1.
    Still,
}

impl Direction {
    /// s.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Out => 1.0,
            Self::In => -1.0,
            Self::Still => 0.0,
        }
    }

    /// `out`, `in` or `none`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Out => "out",
            Self::In => "in",
            Self::Still => "none",
        }
    }
}

impl FromStr for Direction {
    type Err = MicrogeometryError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.trim() {
            "1" | "+1" | "out" => Ok(Self::Out),
            "-1" | "in" => Ok(Self::In),
            "0" | "none" => Ok(Self::Still),
            _ => Err(MicrogeometryError::Parameter(format!(
                "{text:?} is not a direction: out (or 1), in (or -1), none (or 0)"
            ))),
        }
    }
}

/// s, k, f of one region.
#[derive(Clone, Debug, PartialEq)]
pub struct Offset {
    /// s: the direction.
    pub direction: Direction,
    /// k: the scale, in halves of the mesh's longest box side; table 1 has 0.01 to 0.055.
    pub scale: f64,
    /// f: the profile.
    pub profile: Profile,
}

impl Offset {
    /// Not moved.
    #[must_use]
    pub const fn still() -> Self {
        Self {
            direction: Direction::Still,
            scale: 0.0,
            profile: Profile::Linear,
        }
    }

    /// s k f(x).
    #[must_use]
    pub fn height(&self, x: f64) -> f64 {
        self.direction.sign() * self.scale * self.profile.height(x)
    }
}

impl fmt::Display for Offset {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{},{},{}", self.direction.name(), self.scale, self.profile)
    }
}

impl FromStr for Offset {
    type Err = MicrogeometryError;

    /// `S,K,F`: `out,0.03,sqrt`, `-1,0.02,x`, `none`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || {
            MicrogeometryError::Parameter(format!(
                "{text:?} is not an offset S,K,F: direction (out, in, none), scale (zero or above), profile (x, sqrt, or a table), such as out,0.03,sqrt"
            ))
        };
        let parts: Vec<&str> = text.splitn(3, ',').collect();
        match parts[..] {
            [s] if s.parse() == Ok(Direction::Still) => Ok(Self::still()),
            [s, k, f] => {
                let scale = k.trim().parse().ok().filter(|k: &f64| k.is_finite() && *k >= 0.0);
                Ok(Self {
                    direction: s.parse()?,
                    scale: scale.ok_or_else(wrong)?,
                    profile: f.parse()?,
                })
            }
            _ => Err(wrong()),
        }
    }
}

/// A displaced mesh.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Displaced {
    /// The mesh with moved vertices and the same triangles.
    pub mesh: TriangleMesh,
    /// Signed distance to the interface of each vertex: the mean of the triangles around it, distribution units.
    pub values: Vec<f64>,
}

/// Moves every vertex along the normal by s k f(|x|) half box sides, x the mean label of the triangles around it, and
/// s, k, f those of its region (section 4.5).
///
/// Normals are means of the triangles' normals, weighted by their angles; a vertex without a normal does not move.
/// `labels` are in distribution units, one per triangle; the mesh is in any unit. Cost: linear.
///
/// # Errors
///
/// [`MicrogeometryError`] if there is not one label per triangle, or the mesh has no extent or is invalid.
///
/// # Examples
///
/// ```
/// use stereology_microgeometry::{Offset, displace};
/// use stereology_shape::TriangleMesh;
///
/// let ball = TriangleMesh::icosphere(2.0, 3);
/// let labels = vec![4.0; ball.triangles.len()];
/// let swollen = displace(&ball, &labels, &Offset::still(), &"out,0.05,sqrt".parse()?)?;
/// assert!(swollen.mesh.vertices.iter().all(|p| (p.coords.norm() - 1.1).abs() < 1e-3));
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn displace(
    mesh: &TriangleMesh,
    labels: &[f64],
    negative: &Offset,
    positive: &Offset,
) -> Result<Displaced, MicrogeometryError> {
    if labels.len() != mesh.triangles.len() {
        return Err(MicrogeometryError::Parameter(format!(
            "{} labels for {} triangles",
            labels.len(),
            mesh.triangles.len()
        )));
    }
    let half = 0.5 * longest_side(mesh)?;
    let values = vertex_values(mesh, labels);
    let vertices = mesh
        .vertices
        .iter()
        .zip(vertex_normals(mesh))
        .zip(&values)
        .map(|((p, normal), x)| {
            let offset = if *x < 0.0 { negative } else { positive };
            p + normal * (half * offset.height(x.abs()))
        })
        .collect();
    Ok(Displaced {
        mesh: TriangleMesh {
            vertices,
            triangles: mesh.triangles.clone(),
        },
        values,
    })
}

/// Mean label of the triangles around each vertex; 0 if there are none.
#[must_use]
pub fn vertex_values(mesh: &TriangleMesh, labels: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_u32); mesh.vertices.len()];
    for (triangle, label) in mesh.triangles.iter().zip(labels) {
        for &v in triangle {
            let (sum, count) = &mut sums[v as usize];
            *sum += label;
            *count += 1;
        }
    }
    sums.into_iter()
        .map(|(sum, count)| if count > 0 { sum / f64::from(count) } else { 0.0 })
        .collect()
}

/// Unit normal at each vertex, the triangles' normals weighted by their angles there; zero if they cancel.
#[must_use]
pub fn vertex_normals(mesh: &TriangleMesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| mesh.vertices[v as usize]);
        let flat = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let Some(flat) = flat.try_normalize(0.0).filter(|n| n.norm().is_finite()) else {
            continue;
        };
        for k in 0..3 {
            let [to, left, right] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            normals[triangle[k] as usize] += flat * (left - to).angle(&(right - to));
        }
    }
    for normal in &mut normals {
        *normal = normal.try_normalize(1e-12).unwrap_or_default();
    }
    normals
}
