//! Simplification: fewer triangles where the relief is flat (section 4.4: adaptively reduce the resolution of the final
//! mesh).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Matrix3, Point3, Vector3};
use stereology_shape::TriangleMesh;

use crate::conversions::index;

/// Weight of the planes perpendicular to borders, which keep borders in place.
const BORDER: f64 = 100.0;
/// A triangle may not turn by more than about 78°.
const TURN: f64 = 0.2;

/// A simplified mesh, and the values of its vertices.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Simplified {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// A value at each vertex.
    pub values: Vec<f64>,
}

/// The mesh with at most `most` triangles, edges collapsed where that changes the surface least (quadric error, Garland
/// & Heckbert 1997): triangles stay small where the relief is detailed. Values at vertices are interpolated.
///
/// The topology is preserved: no edge is collapsed that would pinch the surface or flip a triangle, so there may remain
/// more triangles than requested. Cost: n log n.
///
/// # Panics
///
/// If there is not one value per vertex, or an index is out of range.
///
/// # Examples
///
/// ```
/// use stereology_microgeometry::simplified;
/// use stereology_shape::TriangleMesh;
///
/// let ball = TriangleMesh::icosphere(2.0, 4);
/// let heights: Vec<f64> = ball.vertices.iter().map(|p| p.z).collect();
/// let coarse = simplified(&ball, &heights, 1000);
/// assert_eq!(coarse.mesh.triangles.len(), 1000);
/// assert!(coarse.mesh.vertices.iter().all(|p| (p.coords.norm() - 1.0).abs() < 0.02));
/// ```
#[must_use]
pub fn simplified(mesh: &TriangleMesh, values: &[f64], most: usize) -> Simplified {
    assert_eq!(values.len(), mesh.vertices.len(), "one value a vertex");
    let mut work = Collapse::new(mesh, values);
    let mut left = mesh.triangles.len();
    while left > most {
        let Some(Reverse((_, a, b, stamps))) = work.queue.pop() else {
            break;
        };
        if stamps != [work.stamp[a as usize], work.stamp[b as usize]] {
            continue;
        }
        left -= work.collapse(a, b);
    }
    work.finish()
}

/// xᵀ A x + 2 bᵀ x + c: the sum of squared distances to planes, weighted by area.
#[derive(Clone, Copy)]
struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    const ZERO: Self = Self {
        a: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        b: Vector3::new(0.0, 0.0, 0.0),
        c: 0.0,
    };

    fn plane(normal: &Vector3<f64>, through: &Point3<f64>, weight: f64) -> Self {
        let d = -normal.dot(&through.coords);
        Self {
            a: weight * normal * normal.transpose(),
            b: weight * d * normal,
            c: weight * d * d,
        }
    }

    fn add(&mut self, other: &Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
    }

    fn at(&self, p: &Point3<f64>) -> f64 {
        p.coords.dot(&(self.a * p.coords)) + 2.0 * self.b.dot(&p.coords) + self.c
    }
}

type Candidate = Reverse<(u64, u32, u32, [u32; 2])>;

struct Collapse {
    origin: Vector3<f64>,
    points: Vec<Point3<f64>>,
    values: Vec<f64>,
    quadrics: Vec<Quadric>,
    triangles: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
    stamp: Vec<u32>,
    queue: BinaryHeap<Candidate>,
}

impl Collapse {
    fn new(mesh: &TriangleMesh, values: &[f64]) -> Self {
        // Relative to the middle, where products of coordinates lose the least precision.
        let (low, high) = mesh.bounding_box().unwrap_or_default();
        let origin = nalgebra::center(&low, &high).coords;
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|p| p - origin).collect();
        let mut quadrics = vec![Quadric::ZERO; points.len()];
        let mut around = vec![Vec::new(); points.len()];
        let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
        let normal_of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a))
        };
        for (number, t) in mesh.triangles.iter().enumerate() {
            let cross = normal_of(t);
            let area = 0.5 * cross.norm();
            if area > 0.0 {
                let plane = Quadric::plane(&(cross / (2.0 * area)), &points[t[0] as usize], area);
                t.iter().for_each(|&v| quadrics[v as usize].add(&plane));
            }
            for k in 0..3 {
                around[t[k] as usize].push(index(number));
                let (from, to) = (t[k], t[(k + 1) % 3]);
                sides.push((from.min(to), from.max(to), index(number)));
            }
        }
        sides.sort_unstable();
        let mut work = Self {
            origin,
            stamp: vec![0; points.len()],
            values: values.to_vec(),
            triangles: mesh.triangles.iter().copied().map(Some).collect(),
            queue: BinaryHeap::new(),
            points,
            quadrics,
            around,
        };
        for same in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (from, to, t) = same[0];
            if let ([_], Some(triangle)) = (same, work.triangles[t as usize]) {
                let [p, q] = [from, to].map(|v| work.points[v as usize]);
                let [a, b, c] = triangle.map(|v| work.points[v as usize]);
                let upright = (q - p).cross(&(b - a).cross(&(c - a))).try_normalize(0.0);
                if let Some(upright) = upright {
                    let wall = Quadric::plane(&upright, &p, BORDER * (q - p).norm_squared());
                    work.quadrics[from as usize].add(&wall);
                    work.quadrics[to as usize].add(&wall);
                }
            }
        }
        for same in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            work.propose(same[0].0, same[0].1);
        }
        work
    }

    fn propose(&mut self, a: u32, b: u32) {
        let (a, b) = (a.min(b), a.max(b));
        let (_, cost) = self.best(a, b);
        let stamps = [self.stamp[a as usize], self.stamp[b as usize]];
        self.queue.push(Reverse((rank(cost), a, b, stamps)));
    }

    /// The best position for the merged vertex, and its cost.
    fn best(&self, a: u32, b: u32) -> (Point3<f64>, f64) {
        let mut sum = self.quadrics[a as usize];
        sum.add(&self.quadrics[b as usize]);
        let [p, q] = [a, b].map(|v| self.points[v as usize]);
        let middle = nalgebra::center(&p, &q);
        let mut places = vec![p, q, middle];
        // A point of least error far away means that the surface is flat here: the midpoint is as good.
        let trace = sum.a.trace();
        let firm = sum.a.determinant() > 1e-9 * (trace / 3.0).powi(3);
        if let Some(least) = sum
            .a
            .try_inverse()
            .filter(|_| firm)
            .map(|inverse| Point3::from(-(inverse * sum.b)))
            && (least - middle).norm() <= 2.0 * (q - p).norm()
        {
            places.push(least);
        }
        let cost = |place: &Point3<f64>| sum.at(place).max(0.0) + 1e-12 * trace * (place - middle).norm_squared();
        let best = places
            .into_iter()
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .unwrap_or(middle);
        (best, cost(&best))
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut near: Vec<u32> = self.around[v as usize]
            .iter()
            .filter_map(|&t| self.triangles[t as usize])
            .flatten()
            .filter(|&w| w != v)
            .collect();
        near.sort_unstable();
        near.dedup();
        near
    }

    /// Merges b into a; returns how many triangles were removed, 0 if merging is not allowed.
    fn collapse(&mut self, a: u32, b: u32) -> usize {
        let (near_a, near_b) = (self.neighbours(a), self.neighbours(b));
        let shared = self.around[a as usize]
            .iter()
            .filter(|&&t| self.triangles[t as usize].is_some_and(|t| t.contains(&b)))
            .count();
        let common = near_a.iter().filter(|v| near_b.binary_search(v).is_ok()).count();
        if common != shared || shared == 0 || shared > 2 {
            return 0;
        }
        // An inner edge between two border vertices: collapsing it would pinch the surface.
        if shared == 2 && self.on_border(a, &near_a) && self.on_border(b, &near_b) {
            return 0;
        }
        let (place, _) = self.best(a, b);
        if self.turns(a, b, &place) || self.turns(b, a, &place) {
            return 0;
        }
        let [p, q] = [a, b].map(|v| self.points[v as usize]);
        let along = q - p;
        let share = ((place - p).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        self.values[a as usize] += share * (self.values[b as usize] - self.values[a as usize]);
        self.points[a as usize] = place;
        let quadric = self.quadrics[b as usize];
        self.quadrics[a as usize].add(&quadric);
        let mut gone = 0;
        for t in std::mem::take(&mut self.around[b as usize]) {
            let Some(mut corners) = self.triangles[t as usize] else {
                continue;
            };
            if corners.contains(&a) {
                self.triangles[t as usize] = None;
                gone += 1;
                continue;
            }
            corners.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
            self.triangles[t as usize] = Some(corners);
            self.around[a as usize].push(t);
        }
        let triangles = &self.triangles;
        self.around[a as usize].retain(|&t| triangles[t as usize].is_some());
        self.stamp[b as usize] += 1;
        self.stamp[a as usize] += 1;
        for v in self.neighbours(a) {
            self.propose(a, v);
        }
        gone
    }

    fn on_border(&self, v: u32, near: &[u32]) -> bool {
        let live = self.around[v as usize]
            .iter()
            .filter(|&&t| self.triangles[t as usize].is_some())
            .count();
        live != near.len()
    }

    /// Whether a triangle of `v` without `other` would flip if v moved to `place`.
    fn turns(&self, v: u32, other: u32, place: &Point3<f64>) -> bool {
        self.around[v as usize].iter().any(|&t| {
            let Some(corners) = self.triangles[t as usize].filter(|c| !c.contains(&other)) else {
                return false;
            };
            let normal = |moved: bool| {
                let [a, b, c] = corners.map(|w| {
                    if moved && w == v {
                        *place
                    } else {
                        self.points[w as usize]
                    }
                });
                (b - a).cross(&(c - a))
            };
            let (before, after) = (normal(false), normal(true));
            before.dot(&after) <= TURN * before.norm() * after.norm()
        })
    }

    fn finish(self) -> Simplified {
        let mut number = vec![u32::MAX; self.points.len()];
        let (mut vertices, mut values) = (Vec::new(), Vec::new());
        let triangles = self
            .triangles
            .iter()
            .flatten()
            .map(|t| {
                t.map(|v| {
                    let known = &mut number[v as usize];
                    if *known == u32::MAX {
                        *known = index(vertices.len());
                        vertices.push(self.points[v as usize] + self.origin);
                        values.push(self.values[v as usize]);
                    }
                    *known
                })
            })
            .collect();
        Simplified {
            mesh: TriangleMesh { vertices, triangles },
            values,
        }
    }
}

/// Integers that sort as the floats do.
fn rank(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}
