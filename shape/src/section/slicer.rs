//! Sections of a mesh by a plane: outlines with their holes, and their areas.

use nalgebra::{Point2, Point3, UnitVector3, Vector3};
use robust::{Coord, orient2d};

use crate::mesh::closed_mesh::ClosedMesh;

/// One profile: a connected region of the section plane inside the solid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SectionPolygon {
    /// Outer contour, counter-clockwise seen from where the normal points.
    pub outer: Vec<Point3<f64>>,
    /// Contours of the holes, clockwise.
    pub holes: Vec<Vec<Point3<f64>>>,
    /// Area with the holes subtracted.
    pub area: f64,
}

/// The profiles of the section of `mesh` by the plane n·x = `offset`, exact polygons.
///
/// A vertex in the plane counts as above it: the section is that of a plane infinitesimally below. Every triangle with
/// vertices on both sides adds one edge, and following neighbouring triangles closes every contour, so no section of a
/// closed mesh fails. An island in a hole is a profile of its own. Profiles come in the order of the mesh's triangles.
/// Cost: T, and contours × points where there are holes.
///
/// # Examples
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_shape::{ClosedMesh, TriangleMesh, section_polygons};
///
/// let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.5, 64, 32))?;
/// let equator = section_polygons(&torus, &Vector3::z_axis(), 0.0); // one ring
/// assert_eq!((equator.len(), equator[0].holes.len()), (1, 1));
/// let upright = section_polygons(&torus, &Vector3::x_axis(), 0.0); // two discs
/// assert_eq!((upright.len(), upright[0].holes.len()), (2, 0));
/// # Ok::<(), stereology_shape::MeshError>(())
/// ```
#[must_use]
pub fn section_polygons(mesh: &ClosedMesh, normal: &UnitVector3<f64>, offset: f64) -> Vec<SectionPolygon> {
    let mut slicer = Slicer::new(mesh);
    slicer.turn_to(normal);
    let basis = plane_basis(normal);
    let lift = |contour: Vec<Point2<f64>>| -> Vec<Point3<f64>> {
        contour
            .iter()
            .map(|p| Point3::from(basis[0] * p.x + basis[1] * p.y + normal.into_inner() * offset))
            .collect()
    };
    let profiles = slicer.profiles(offset, 0..mesh.triangles().len());
    profiles
        .into_iter()
        .map(|profile| SectionPolygon {
            area: profile.area(),
            outer: lift(profile.outer.points),
            holes: profile.holes.into_iter().map(|hole| lift(hole.points)).collect(),
        })
        .collect()
}

/// Two unit vectors u, v with u × v = n.
pub(crate) fn plane_basis(normal: &UnitVector3<f64>) -> [Vector3<f64>; 2] {
    let least = normal.iamin();
    let mut axis = Vector3::zeros();
    axis[least] = 1.0;
    let u = axis.cross(normal).normalize();
    [u, normal.cross(&u)]
}

/// A closed contour in the coordinates of the plane, and its signed area (holes negative).
pub(crate) struct Contour {
    pub(crate) points: Vec<Point2<f64>>,
    pub(crate) signed_area: f64,
}

pub(crate) struct FlatProfile {
    outer: Contour,
    holes: Vec<Contour>,
}

impl FlatProfile {
    pub(crate) fn area(&self) -> f64 {
        (self.outer.signed_area + self.holes.iter().map(|hole| hole.signed_area).sum::<f64>()).max(0.0)
    }
}

/// Cuts one mesh many times, keeping its buffers.
pub(crate) struct Slicer<'a> {
    mesh: &'a ClosedMesh,
    basis: [Vector3<f64>; 2],
    /// n·x of every vertex.
    pub(crate) heights: Vec<f64>,
    /// The cut that last walked through each triangle.
    walked: Vec<u32>,
    cut: u32,
}

impl<'a> Slicer<'a> {
    pub(crate) fn new(mesh: &'a ClosedMesh) -> Self {
        let basis = [Vector3::x(), Vector3::y()];
        Self {
            mesh,
            basis,
            heights: Vec::new(),
            walked: vec![0; mesh.triangles().len()],
            cut: 0,
        }
    }

    pub(crate) fn turn_to(&mut self, normal: &UnitVector3<f64>) {
        self.basis = plane_basis(normal);
        self.heights.clear();
        self.heights
            .extend(self.mesh.vertices().iter().map(|v| v.coords.dot(normal)));
    }

    /// Total area of all profiles, without separating them.
    pub(crate) fn total_area(&self, offset: f64) -> f64 {
        let mut twice = 0.0;
        let mut reference = None;
        for corners in self.mesh.triangles() {
            let above = corners.map(|i| self.heights[i as usize] >= offset);
            if let Some(k) = entry(above) {
                let from = self.crossing(corners[k], corners[(k + 1) % 3], offset);
                let exit = (0..3).find(|&j| !above[j] && above[(j + 1) % 3]).unwrap_or(k);
                let to = self.crossing(corners[exit], corners[(exit + 1) % 3], offset);
                let origin = *reference.get_or_insert(from);
                twice += (from - origin).perp(&(to - origin));
            }
        }
        0.5 * twice
    }

    /// The profiles of the plane, visiting only `candidates` (which must include all triangles that it cuts).
    pub(crate) fn profiles(&mut self, offset: f64, candidates: impl IntoIterator<Item = usize>) -> Vec<FlatProfile> {
        let (mut outer, mut holes) = (Vec::new(), Vec::new());
        self.cut += 1;
        for start in candidates {
            if self.walked[start] == self.cut || entry(self.above(start, offset)).is_none() {
                continue;
            }
            let contour = self.walk(start, offset);
            // A plane that only touches a vertex or an edge gives a contour without area.
            let slit = 1e-13 * perimeter(&contour.points).powi(2);
            if contour.signed_area > slit {
                outer.push(contour);
            } else if contour.signed_area < -slit {
                holes.push(contour);
            }
        }
        let mut profiles: Vec<FlatProfile> = outer
            .into_iter()
            .map(|outer| FlatProfile {
                outer,
                holes: Vec::new(),
            })
            .collect();
        for hole in holes {
            if let Some(owner) = owner(&hole, &profiles) {
                profiles[owner].holes.push(hole);
            }
        }
        profiles
    }

    /// Follows the contour through triangle `start`, the solid on the left.
    fn walk(&mut self, start: usize, offset: f64) -> Contour {
        let mut points = Vec::new();
        let mut triangle = start;
        while self.walked[triangle] != self.cut {
            self.walked[triangle] = self.cut;
            let corners = self.mesh.triangles()[triangle];
            let above = self.above(triangle, offset);
            let exit = (0..3)
                .find(|&k| !above[k] && above[(k + 1) % 3])
                .expect("a cut triangle has one edge that goes up");
            points.push(self.crossing(corners[exit], corners[(exit + 1) % 3], offset));
            triangle = self.mesh.neighbours()[triangle][exit] as usize;
        }
        let signed_area = signed_area(&points);
        Contour { points, signed_area }
    }

    fn above(&self, triangle: usize, offset: f64) -> [bool; 3] {
        self.mesh.triangles()[triangle].map(|i| self.heights[i as usize] >= offset)
    }

    /// Where an edge crosses the plane; the same bits from both of its triangles.
    fn crossing(&self, a: u32, b: u32, offset: f64) -> Point2<f64> {
        let (a, b) = (a.min(b) as usize, a.max(b) as usize);
        let (height_a, height_b) = (self.heights[a], self.heights[b]);
        let (pa, pb) = (&self.mesh.vertices()[a], &self.mesh.vertices()[b]);
        let p = pa + (pb - pa) * ((offset - height_a) / (height_b - height_a));
        Point2::new(p.coords.dot(&self.basis[0]), p.coords.dot(&self.basis[1]))
    }
}

/// The edge (k → k + 1) that goes from above the plane to below it; `None` if the triangle is not cut.
fn entry(above: [bool; 3]) -> Option<usize> {
    (0..3).find(|&k| above[k] && !above[(k + 1) % 3])
}

/// The smallest outer contour around the hole.
fn owner(hole: &Contour, profiles: &[FlatProfile]) -> Option<usize> {
    let around = |profile: &FlatProfile| {
        // A hole may touch its outer contour in a point; one of its points is strictly inside.
        profile.outer.signed_area > -hole.signed_area
            && hole.points.iter().any(|p| strictly_inside(p, &profile.outer.points))
    };
    (0..profiles.len())
        .filter(|&i| around(&profiles[i]))
        .min_by(|&i, &j| profiles[i].outer.signed_area.total_cmp(&profiles[j].outer.signed_area))
}

/// Exact winding test; false on the contour itself.
fn strictly_inside(p: &Point2<f64>, contour: &[Point2<f64>]) -> bool {
    let at = |q: &Point2<f64>| Coord { x: q.x, y: q.y };
    let mut winding = 0;
    for (i, a) in contour.iter().enumerate() {
        let b = &contour[(i + 1) % contour.len()];
        if a.y <= p.y && b.y > p.y {
            winding += i32::from(orient2d(at(a), at(b), at(p)) > 0.0);
        } else if a.y > p.y && b.y <= p.y {
            winding -= i32::from(orient2d(at(a), at(b), at(p)) < 0.0);
        }
    }
    winding > 0
}

fn signed_area(points: &[Point2<f64>]) -> f64 {
    let origin = points[0];
    let fans = points
        .windows(2)
        .map(|pair| (pair[0] - origin).perp(&(pair[1] - origin)));
    0.5 * fans.sum::<f64>()
}

fn perimeter(points: &[Point2<f64>]) -> f64 {
    let closing = points.last().map_or(0.0, |last| (last - points[0]).norm());
    closing + points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f64>()
}
