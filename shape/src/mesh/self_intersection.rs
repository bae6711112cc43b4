//! Self-intersection of a surface: a tree of boxes finds triangles near each other, and exact signs of determinants
//! decide which of them cross.
//!
//! Two triangles cross if their interiors meet, transversally or over an area in one plane. Contact without crossing (a
//! vertex on a face, three corners on a line, an edge along another) does not change the enclosed solid and is not a
//! crossing. To exclude the effect of rounded coordinates, one triangle must extend through the other by more than
//! [`ROUNDING`].

use nalgebra::{Point2, Point3};
use robust::{Coord, orient2d, orient3d};

use crate::mesh::index::index;
use crate::mesh::measures::double_area;
use crate::mesh::topology::{Neighbours, known_neighbours};
use crate::mesh::triangle_mesh::TriangleMesh;
use crate::mesh::winding::coord;

/// Crossings shallower than this fraction of the mesh's extent count as rounding: files in single precision hold 24
/// bits.
pub(crate) const ROUNDING: f64 = 1e-7;

/// Heights above this fraction of the product of their lengths have a reliable sign: rounding is below 10⁻¹⁴ of it.
const FILTER: f64 = 1e-10;

/// The search stops at this number of crossings.
const MOST: usize = 1000;

/// Two triangles that cross, the number of such pairs found (the search stops at 1000), and a point on the first
/// crossing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub(crate) triangles: [usize; 2],
    pub(crate) place: Point3<f64>,
    pub(crate) count: usize,
}

/// Number of pairs of triangles that cross each other; the search stops at 1000. It is 0 for a surface that does not
/// intersect itself.
///
/// Open surfaces and edges with more than two triangles are allowed; triangles that share an edge are not compared.
/// Decisions are exact signs of determinants; crossings shallower than 10⁻⁷ of the extent are ignored as rounding.
/// Indices must be in range. Cost: T log T, and the pairs of triangles whose boxes overlap.
///
/// ```
/// use stereology_shape::{TriangleMesh, self_intersections};
///
/// let cube = TriangleMesh::cuboid([1.0; 3]);
/// assert_eq!(self_intersections(&cube), 0);
/// let turned = nalgebra::Rotation3::from_euler_angles(0.3, 0.7, 1.1);
/// assert!(self_intersections(&cube.clone().with(&cube.mapped(|p| turned * p))) > 0);
/// ```
#[must_use]
pub fn self_intersections(mesh: &TriangleMesh) -> usize {
    if mesh.triangles.is_empty() {
        return 0;
    }
    first_crossing(mesh, &known_neighbours(mesh)).map_or(0, |crossing| crossing.count)
}

/// The first crossing of the surface with itself. Cost: T log T, and the pairs of triangles whose boxes overlap.
pub(crate) fn first_crossing(mesh: &TriangleMesh, across: &Neighbours) -> Option<Crossing> {
    let (low, high) = mesh.bounding_box()?;
    let tolerance = ROUNDING * (high - low).max();
    let pairs = Boxes::new(mesh);
    let mut found: Vec<[u32; 2]> = Vec::new();
    pairs.each_overlap(&mut |a, b| {
        let pair = [a.min(b), a.max(b)];
        if cross(mesh, across, pair, tolerance) {
            found.push(pair);
        }
        found.len() < MOST
    });
    let first = *found.iter().min()?;
    let corners = first.map(|t| mesh.corners(t as usize));
    Some(Crossing {
        triangles: first.map(|t| t as usize),
        place: meeting_place(&corners[0], &corners[1]),
        count: found.len(),
    })
}

fn cross(mesh: &TriangleMesh, across: &Neighbours, [t, s]: [u32; 2], tolerance: f64) -> bool {
    let (one, two) = (mesh.triangles[t as usize], mesh.triangles[s as usize]);
    let shared = one.iter().filter(|v| two.contains(v)).count();
    // Across a common edge the surface can only fold flat onto itself: a fin, which encloses no volume.
    if shared >= 2 {
        return false;
    }
    let (a, b) = (mesh.corners(t as usize), mesh.corners(s as usize));
    if clearly_beside(&a, &b, tolerance) || clearly_beside(&b, &a, tolerance) {
        return false;
    }
    let (sides_a, sides_b) = (sides(&a, &b), sides(&b, &a));
    let apart = |sides: &[i8; 3]| sides.iter().all(|&s| s > 0) || sides.iter().all(|&s| s < 0);
    let (heights_a, heights_b) = (heights(&a, &b), heights(&b, &a));
    let flat = heights_a.iter().chain(&heights_b).all(|h| h.abs() <= tolerance);
    if flat {
        let same_side = double_area(&a).dot(&double_area(&b)) > 0.0;
        let exactly = sides_a == [0; 3] && sides_b == [0; 3];
        return (same_side || (exactly && shared == 0)) && flat_overlap(&a, &b) > tolerance;
    }
    if apart(&sides_a) || apart(&sides_b) {
        return false;
    }
    let depth = sticks_out(&heights_a).min(sticks_out(&heights_b));
    if depth > tolerance && interiors_cross(&a, &sides_a, &b, &sides_b) {
        return true;
    }
    edge_passes(mesh, across, t, &sides_a, &b, tolerance) || edge_passes(mesh, across, s, &sides_b, &a, tolerance)
}

/// Whether all corners except shared ones lie on one side of a plane, farther from it than the tolerance and any
/// rounding. Then the triangles do not cross. This decides most pairs of neighbours.
fn clearly_beside(corners: &[Point3<f64>; 3], plane: &[Point3<f64>; 3], tolerance: f64) -> bool {
    let [u, v] = [plane[1] - plane[0], plane[2] - plane[0]];
    let normal = u.cross(&v);
    let (length, rounding) = (normal.norm(), FILTER * u.norm() * v.norm());
    let mut side = 0.0;
    for p in corners {
        if plane.contains(p) {
            continue;
        }
        let d = p - plane[0];
        let height = normal.dot(&d);
        if !(height.abs() > tolerance * length && height.abs() > rounding * d.norm() && height * side >= 0.0) {
            return false;
        }
        side = height;
    }
    side != 0.0
}

/// The side of the plane of `plane` on which each corner lies, exactly: 1 for the side of its normal, -1, or 0.
fn sides(corners: &[Point3<f64>; 3], plane: &[Point3<f64>; 3]) -> [i8; 3] {
    corners.map(|p| {
        // Shared corners are common, and the slowest case of the predicate.
        if plane.contains(&p) {
            return 0;
        }
        sign(-orient3d(
            coord(&plane[0]),
            coord(&plane[1]),
            coord(&plane[2]),
            coord(&p),
        ))
    })
}

fn side(p: &Point3<f64>, plane: &[Point3<f64>; 3]) -> i8 {
    sides(&[*p; 3], plane)[0]
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// Heights of the corners over the plane, in double precision; zero over a triangle without area.
fn heights(corners: &[Point3<f64>; 3], plane: &[Point3<f64>; 3]) -> [f64; 3] {
    let normal = double_area(plane).try_normalize(0.0).unwrap_or_default();
    corners.map(|p| normal.dot(&(p - plane[0])))
}

/// How far the smaller part extends beyond the plane.
fn sticks_out(heights: &[f64; 3]) -> f64 {
    let (up, down) = heights
        .iter()
        .fold((0.0_f64, 0.0_f64), |(up, down), &h| (up.max(h), down.max(-h)));
    up.min(down)
}

/// Whether the interiors of two triangles in different planes meet; exact (Guigue & Devillers 2003).
///
/// Each triangle meets the line common to both planes in an interval. The order of the ends is the sign of a
/// determinant of four corners.
fn interiors_cross(a: &[Point3<f64>; 3], sides_a: &[i8; 3], b: &[Point3<f64>; 3], sides_b: &[i8; 3]) -> bool {
    let (Some(i), Some(j)) = (lone(sides_a), lone(sides_b)) else {
        return false;
    };
    let [p1, mut q1, mut r1] = [0, 1, 2].map(|k| a[(i + k) % 3]);
    let [p2, mut q2, mut r2] = [0, 1, 2].map(|k| b[(j + k) % 3]);
    if sides_a[i] < 0 {
        std::mem::swap(&mut q2, &mut r2);
    }
    if sides_b[j] < 0 {
        std::mem::swap(&mut q1, &mut r1);
    }
    // The ends on the edges p1 q1 and p2 q2, and those on p1 r1 and p2 r2, are in this order along the line iff the
    // intervals overlap.
    side(&q2, &[p1, q1, p2]) < 0 && side(&r2, &[p1, r1, p2]) > 0
}

/// The corner that is alone on its side, for a triangle with corners strictly on both sides.
fn lone(sides: &[i8; 3]) -> Option<usize> {
    let on = |side: i8| sides.iter().filter(|&&s| s == side).count();
    match (on(1), on(-1)) {
        (0, _) | (_, 0) => None,
        (1, _) => sides.iter().position(|&s| s == 1),
        _ => sides.iter().position(|&s| s == -1),
    }
}

/// Whether an edge of triangle `t` lies in the face `b`, with the surface on both sides of it.
fn edge_passes(
    mesh: &TriangleMesh,
    across: &Neighbours,
    t: u32,
    sides_t: &[i8; 3],
    b: &[Point3<f64>; 3],
    tolerance: f64,
) -> bool {
    let Some(free) = (0..3).find(|&k| sides_t[k] != 0 && sides_t[(k + 1) % 3] == 0 && sides_t[(k + 2) % 3] == 0) else {
        return false;
    };
    let corners = mesh.triangles[t as usize];
    let (from, to) = (corners[(free + 1) % 3], corners[(free + 2) % 3]);
    // There is no surface beyond a border.
    let Some(beyond) = mesh.triangles.get(across[t as usize][(free + 1) % 3] as usize) else {
        return false;
    };
    let Some(&opposite) = beyond.iter().find(|&&v| v != from && v != to) else {
        return false;
    };
    let [own, other] = [corners[free], opposite].map(|v| mesh.vertices[v as usize]);
    let deep = |p: &Point3<f64>| heights(&[*p; 3], b)[0].abs() > tolerance;
    side(&other, b) == -sides_t[free]
        && deep(&own)
        && deep(&other)
        && flat_interiors_meet(&[from, to].map(|v| mesh.vertices[v as usize]), b)
}

/// Whether a segment and a triangle in one plane meet in the triangle's interior; exact.
fn flat_interiors_meet(segment: &[Point3<f64>; 2], triangle: &[Point3<f64>; 3]) -> bool {
    let axis = double_area(triangle).iamax();
    let flat = |p: &Point3<f64>| Coord {
        x: p[(axis + 1) % 3],
        y: p[(axis + 2) % 3],
    };
    let (segment, triangle) = (segment.map(|p| flat(&p)), triangle.map(|p| flat(&p)));
    let turn = sign(orient2d(triangle[0], triangle[1], triangle[2]));
    let on_side = |a, b, p, side: i8| sign(orient2d(a, b, p)) * side <= 0;
    let apart_by_triangle = (0..3).any(|k| {
        segment
            .iter()
            .all(|&p| on_side(triangle[k], triangle[(k + 1) % 3], p, turn))
    });
    let apart_by_segment = [1, -1]
        .iter()
        .any(|&side| triangle.iter().all(|&p| on_side(segment[0], segment[1], p, side)));
    turn != 0 && !apart_by_triangle && !apart_by_segment
}

/// The distance by which one of two triangles in (nearly) one plane must move to end their overlap; zero or less if
/// they do not overlap.
fn flat_overlap(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> f64 {
    let (of_a, of_b) = (double_area(a), double_area(b));
    let normal = if of_a.norm_squared() > of_b.norm_squared() {
        of_a
    } else {
        of_b
    };
    let axis = normal.iamax();
    // Projection along an axis shrinks lengths to no less than 1 / √3.
    let flat = |p: &Point3<f64>| {
        Point2::new(
            p[(axis + 1) % 3] - a[0][(axis + 1) % 3],
            p[(axis + 2) % 3] - a[0][(axis + 2) % 3],
        )
    };
    let (a, b) = (a.map(|p| flat(&p)), b.map(|p| flat(&p)));
    let mut least = f64::INFINITY;
    for triangle in [&a, &b] {
        for k in 0..3 {
            let edge = triangle[(k + 1) % 3] - triangle[k];
            let Some(across) = nalgebra::Vector2::new(-edge.y, edge.x).try_normalize(0.0) else {
                return 0.0;
            };
            let extent = |corners: &[Point2<f64>; 3]| {
                let places = corners.map(|p| across.dot(&p.coords));
                let low = places.iter().copied().fold(f64::INFINITY, f64::min);
                (low, places.iter().copied().fold(f64::NEG_INFINITY, f64::max))
            };
            let ((low_a, high_a), (low_b, high_b)) = (extent(&a), extent(&b));
            least = least.min(high_a.min(high_b) - low_a.max(low_b));
        }
    }
    least
}

/// A point on the crossing, for error messages: where an edge of one triangle passes the other's plane, nearest to that
/// triangle's middle.
fn meeting_place(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> Point3<f64> {
    let mut best = (f64::INFINITY, a[0]);
    for (from, plane) in [(a, b), (b, a)] {
        let middle = nalgebra::center(&nalgebra::center(&plane[0], &plane[1]), &plane[2]);
        let h = heights(from, plane);
        for k in 0..3 {
            let n = (k + 1) % 3;
            if h[k] * h[n] <= 0.0 && (h[k] - h[n]).abs() > 0.0 {
                let p = from[k] + (from[n] - from[k]) * (h[k] / (h[k] - h[n]));
                let far = (p - middle).norm_squared();
                if far < best.0 {
                    best = (far, p);
                }
            }
        }
    }
    best.1
}

/// A tree of bounding boxes of the triangles.
struct Boxes {
    nodes: Vec<Node>,
    order: Vec<u32>,
    boxes: Vec<[Point3<f64>; 2]>,
}

#[derive(Clone, Copy)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    /// First triangle of a leaf in `order`, or the second child of an inner node (the first follows its parent).
    start: u32,
    /// Number of triangles of a leaf, 0 for an inner node.
    count: u32,
}

const LEAF: usize = 4;

impl Boxes {
    fn new(mesh: &TriangleMesh) -> Self {
        let boxes: Vec<[Point3<f64>; 2]> = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                [a.inf(&b).inf(&c), a.sup(&b).sup(&c)]
            })
            .collect();
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..index(boxes.len())).collect(),
            boxes,
        };
        let mut order = std::mem::take(&mut tree.order);
        tree.split(&mut order, 0);
        tree.order = order;
        tree
    }

    fn split(&mut self, order: &mut [u32], first: usize) {
        let start = self.boxes[order[0] as usize];
        let [low, high] = order.iter().fold(start, |[low, high], &t| {
            let [l, h] = self.boxes[t as usize];
            [low.inf(&l), high.sup(&h)]
        });
        let at = self.nodes.len();
        let count = if order.len() <= LEAF { order.len() } else { 0 };
        self.nodes.push(Node {
            low,
            high,
            start: index(first),
            count: index(count),
        });
        if count > 0 {
            return;
        }
        let axis = (high - low).imax();
        let middle = order.len() / 2;
        let boxes = &self.boxes;
        let centre = |t: u32| boxes[t as usize][0][axis] + boxes[t as usize][1][axis];
        order.select_nth_unstable_by(middle, |&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(middle);
        self.split(left, first);
        self.nodes[at].start = index(self.nodes.len());
        self.split(right, first + middle);
    }

    /// Calls `visit` with every two triangles whose boxes touch, until it returns false.
    fn each_overlap(&self, visit: &mut dyn FnMut(u32, u32) -> bool) {
        let mut stack: Vec<(u32, u32)> = vec![(0, 0)];
        while let Some((a, b)) = stack.pop() {
            let (m, n) = (&self.nodes[a as usize], &self.nodes[b as usize]);
            if a != b && !overlap(&[m.low, m.high], &[n.low, n.high]) {
                continue;
            }
            match (m.count, n.count) {
                (0, 0) if a == b => stack.extend([(a + 1, a + 1), (m.start, m.start), (a + 1, m.start)]),
                (0, 0) if (m.high - m.low).norm_squared() < (n.high - n.low).norm_squared() => {
                    stack.extend([(a, b + 1), (a, n.start)]);
                }
                (0, _) => stack.extend([(a + 1, b), (m.start, b)]),
                (_, 0) => stack.extend([(a, b + 1), (a, n.start)]),
                _ => {
                    for i in m.start..m.start + m.count {
                        let from = if a == b { i + 1 } else { n.start };
                        for j in from..n.start + n.count {
                            let [t, s] = [i, j].map(|k| self.order[k as usize]);
                            if overlap(&self.boxes[t as usize], &self.boxes[s as usize]) && !visit(t, s) {
                                return;
                            }
                        }
                    }
                }
            }
        }
    }
}

fn overlap([low, high]: &[Point3<f64>; 2], [other_low, other_high]: &[Point3<f64>; 2]) -> bool {
    (0..3).all(|k| low[k] <= other_high[k] && other_low[k] <= high[k])
}

#[cfg(test)]
mod tests {
    use super::first_crossing;
    use crate::mesh::topology::neighbours;
    use crate::mesh::triangle_mesh::TriangleMesh;
    use nalgebra::{Point3, Rotation3, Vector3};
    use proptest::prelude::*;

    fn crossings(mesh: &TriangleMesh) -> usize {
        first_crossing(mesh, &neighbours(mesh).unwrap()).map_or(0, |crossing| crossing.count)
    }

    fn shifted(mesh: &TriangleMesh, by: [f64; 3]) -> TriangleMesh {
        mesh.mapped(|p| p + Vector3::from(by))
    }

    #[test]
    fn plain_solids_do_not_cross_themselves() {
        for mesh in [
            TriangleMesh::cuboid([1.0, 2.0, 1e-9]),
            TriangleMesh::cylinder(1.0, 2.0, 300),
            TriangleMesh::torus(2.0, 0.5, 40, 20),
            TriangleMesh::icosphere(1.0, 4),
        ] {
            assert_eq!(crossings(&mesh), 0);
            let turn = Rotation3::from_euler_angles(0.3, 0.7, 1.1);
            assert_eq!(crossings(&mesh.mapped(|p| turn * p)), 0);
        }
    }

    /// Two tetrahedra of a cube: only edges meet edges.
    #[test]
    fn stella_octangula_crosses_itself() {
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(Point3::from);
        let one = TriangleMesh {
            vertices: corners.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        };
        let mut two = one.mapped(|p| Point3::from(-p.coords));
        two.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(crossings(&one.with(&two)) > 0);
    }

    /// Boxes whose faces lie in common planes: no edge passes through the inside of a face, and yet they overlap.
    #[test]
    fn aligned_boxes_that_overlap_cross() {
        let cube = TriangleMesh::cuboid([2.0; 3]);
        let turn = Rotation3::from_euler_angles(0.3, 0.7, 1.1);
        for (by, touching) in [
            ([1.0, 0.0, 0.0], false),
            ([0.5, 0.5, 0.0], false),
            ([1.0, 1.0, 1.0], false),
            ([1.0, 2.0, 0.0], true),
        ] {
            let two = cube.clone().with(&shifted(&cube, by));
            assert!(crossings(&two) > 0, "{by:?} {touching}");
            if !touching {
                assert!(crossings(&two.mapped(|p| turn * p)) > 0, "turned {by:?}");
            }
        }
    }

    #[test]
    fn boxes_apart_and_within_do_not_cross() {
        let cube = TriangleMesh::cuboid([2.0; 3]);
        assert_eq!(crossings(&cube.clone().with(&shifted(&cube, [3.0, 0.0, 0.0]))), 0);
        assert_eq!(crossings(&cube.clone().with(&cube.mapped(|p| 0.5 * p))), 0);
        // Touching in a corner, or in part of an edge.
        assert_eq!(crossings(&cube.clone().with(&shifted(&cube, [2.0, 2.0, 2.0]))), 0);
        assert_eq!(crossings(&cube.clone().with(&shifted(&cube, [2.0, 2.0, 0.7]))), 0);
    }

    proptest! {
        /// Two balls cross exactly if their distance is below the sum of their radii and above the difference, at any
        /// scale and offset.
        #[test]
        fn balls_cross_where_they_overlap(distance in 0.05..1.6_f64, small in 0.2..0.6_f64, turn in prop::array::uniform3(-3.0..3.0_f64), scale in -20..20_i32) {
            prop_assume!((distance - (0.5 + 0.5 * small)).abs() > 0.03 && (distance - (0.5 - 0.5 * small)).abs() > 0.03);
            let ball = TriangleMesh::icosphere(1.0, 2);
            let turn = Rotation3::from_euler_angles(turn[0], turn[1], turn[2]);
            let other = ball.mapped(|p| turn * (small * p) + Vector3::new(distance, 0.0, 0.0));
            let both = ball.with(&other).mapped(|p| p * 10.0_f64.powi(scale));
            let overlap = distance < 0.5 + 0.5 * small && distance > 0.5 - 0.5 * small;
            prop_assert_eq!(crossings(&both) > 0, overlap);
        }
    }
}
