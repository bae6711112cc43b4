//! The largest single profile that any plane cuts from a mesh: the area that gives a body its size.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Point3, Rotation3, UnitVector3, Vector3};

use crate::closed_mesh::ClosedMesh;
use crate::measures::double_area;
use crate::section::Slicer;

/// Area of the largest single profile, by maximisation over directions and depths.
///
/// Never a maximum over random sections: that is 2 % low for a cube after 10,000 of them. Here all depths of directions spread over the
/// half-sphere (and of the hull's largest faces) are scanned, the best distinct starts are climbed by shrinking polls in direction and
/// depth together, and the result is tried against planes through triples of vertices near it, where polyhedra have their maxima.
/// The result is the area of a section that exists: never too large. Turned copies of 100 rocks agreed to 2e-5, nearly all to 1e-11;
/// fine meshes of round bodies have many summits of nearly one height, of which the highest may be missed by some 1e-6.
pub(crate) fn largest_section_area(mesh: &ClosedMesh) -> f64 {
    let mut search = Search::new(mesh);
    let mut starts = search.scan();
    starts.sort_by(|a, b| b.area.total_cmp(&a.area));
    let mut best = 0.0_f64;
    for start in distinct(&starts, search.budget.climbs) {
        let mut top = search.climb(start, search.budget.step, best);
        // A summit clearly below another is not worth its last digits.
        let rounds = if top.area > 0.999 * best { 3 } else { 0 };
        for _ in 0..rounds {
            let snapped = search.snap(&top);
            if snapped.area <= top.area * (1.0 + 1e-12) {
                break;
            }
            top = search.climb(snapped, 1e-3, best);
        }
        best = best.max(top.area);
    }
    best
}

/// A plane and the largest profile it cuts.
#[derive(Clone, Copy)]
struct Cut {
    normal: UnitVector3<f64>,
    offset: f64,
    area: f64,
}

impl Cut {
    fn larger(self, other: &Self) -> Self {
        if other.area > self.area { *other } else { self }
    }
}

/// How much to look: small meshes are cheap and have many near ties, large ones are smooth.
struct Budget {
    directions: u32,
    depths: usize,
    climbs: usize,
    /// First poll of a climb, in radians and in units of the body's reach; and the last.
    step: f64,
    finest: f64,
}

/// Where a climb looks, in steps: what second differences need.
const POLLS: [[f64; 3]; 9] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 1.0],
    [1.0, 0.0, 1.0],
];

/// Summit of the parabola through the centre and the polls, in steps, and how much higher it is; `None` if it has none.
fn summit(centre: f64, polls: &[f64; 9]) -> Option<(Vector3<f64>, f64)> {
    let p = |k: usize| polls[k] - centre;
    let gradient = Vector3::new(p(0) - p(1), p(2) - p(3), p(4) - p(5)) * 0.5;
    let (xx, yy, zz) = (p(0) + p(1), p(2) + p(3), p(4) + p(5));
    let (xy, yz, zx) = (p(6) - p(0) - p(2), p(7) - p(2) - p(4), p(8) - p(0) - p(4));
    let hessian = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
    let place = (-hessian).cholesky()?.solve(&gradient);
    Some((place, 0.5 * gradient.dot(&place)))
}

struct Search<'a> {
    mesh: &'a ClosedMesh,
    slicer: Slicer<'a>,
    budget: Budget,
    reach: f64,
}

impl<'a> Search<'a> {
    fn new(mesh: &'a ClosedMesh) -> Self {
        let (directions, depths, climbs, step, finest) = match mesh.triangles().len() {
            0..=200 => (800, 16, 12, 0.06, 1e-7),
            201..=5000 => (600, 32, if mesh.is_convex() { 48 } else { 12 }, 0.08, 1e-7),
            _ => (160, 32, 6, 0.12, 1e-6),
        };
        let budget = Budget {
            directions,
            depths,
            climbs,
            step,
            finest,
        };
        Self {
            mesh,
            slicer: Slicer::new(mesh),
            budget,
            reach: mesh.reach(&mesh.centroid()),
        }
    }

    /// The best depth of every direction.
    fn scan(&mut self) -> Vec<Cut> {
        let mut directions = half_sphere(self.budget.directions);
        directions.extend(largest_hull_normals(self.mesh, 32));
        directions.into_iter().map(|normal| self.best_depth(normal)).collect()
    }

    fn best_depth(&mut self, normal: UnitVector3<f64>) -> Cut {
        self.slicer.turn_to(&normal);
        let (low, high) = self.mesh.extent(&normal);
        if self.mesh.is_convex() {
            // √A is concave in depth (Brunn and Minkowski): one summit.
            let at = |offset: f64| Cut {
                normal,
                offset,
                area: self.slicer.total_area(offset),
            };
            return highest(low, high, 1e-3 * (high - low), at);
        }
        let margin = 1e-9 * self.reach;
        let steps = self.budget.depths;
        let mut offsets: Vec<f64> = (0..=steps)
            .map(|i| low + (high - low) * i as f64 / steps as f64)
            .collect();
        offsets[0] += margin;
        offsets[steps] -= margin;
        let mut best = Cut {
            normal,
            offset: offsets[0],
            area: 0.0,
        };
        for (offset, area) in self.areas_at(&offsets) {
            if area > best.area {
                best = Cut { normal, offset, area };
            }
        }
        best
    }

    /// Largest profile at each of the rising offsets, each cut looking only at the triangles that span it.
    fn areas_at(&mut self, offsets: &[f64]) -> Vec<(f64, f64)> {
        let mut spanning: Vec<Vec<usize>> = vec![Vec::new(); offsets.len()];
        for (t, corners) in self.mesh.triangles().iter().enumerate() {
            let [a, b, c] = corners.map(|i| self.slicer.heights[i as usize]);
            let first = offsets.partition_point(|&offset| offset < a.min(b).min(c));
            let last = offsets.partition_point(|&offset| offset <= a.max(b).max(c));
            for list in &mut spanning[first..last] {
                list.push(t);
            }
        }
        let cuts = offsets.iter().zip(spanning);
        cuts.map(|(&offset, list)| (offset, largest(self.slicer.profiles(offset, list))))
            .collect()
    }

    fn cut(&mut self, normal: UnitVector3<f64>, offset: f64) -> Cut {
        self.slicer.turn_to(&normal);
        let area = if self.mesh.is_convex() {
            self.slicer.total_area(offset)
        } else {
            largest(self.slicer.profiles(offset, 0..self.mesh.triangles().len()))
        };
        Cut { normal, offset, area }
    }

    /// Polls planes around the best one so far, turned and shifted by `step`, and the summit of the parabola through the polls; halves
    /// the step where none is better. Gives up a summit that will stay below `to_beat`.
    fn climb(&mut self, start: Cut, step: f64, to_beat: f64) -> Cut {
        let mut best = start;
        let mut step = step;
        let mut turn = 0.0_f64;
        let mut failures = 0;
        while step > self.budget.finest && !(step < 2e-3 && best.area < 0.99 * to_beat) {
            let centre = best;
            // Fresh axes each round: on the ridges of polyhedra fixed ones get stuck.
            turn += 2.4;
            let polls = POLLS.map(|[x, y, z]| self.near(&centre, turn, [x * step, y * step, z * step]));
            for tried in &polls {
                best = best.larger(tried);
            }
            let summit = summit(centre.area, &polls.map(|cut| cut.area));
            let mut gain = f64::INFINITY;
            if let Some((place, expected)) = summit {
                gain = expected;
                let shorten = 4.0_f64.min(place.norm()) / place.norm().max(f64::MIN_POSITIVE) * step;
                best = best.larger(&self.near(&centre, turn, (place * shorten).into()));
            }
            if best.area > centre.area {
                failures = 0;
                continue;
            }
            failures += 1;
            // Where profiles merge and part the area jumps: wide steps get several tries, fine ones end on a smooth summit.
            if step < 0.01 && gain < 1e-13 * best.area {
                break;
            }
            if step < 0.01 || failures == 3 {
                failures = 0;
                step *= 0.5;
            }
        }
        best
    }

    /// The cut of a plane near `from`: turned by x and y about two axes in it, which `turn` turns, and shifted by z times the reach.
    fn near(&mut self, from: &Cut, turn: f64, [x, y, z]: [f64; 3]) -> Cut {
        let [u, v] = crate::section::plane_basis(&from.normal);
        let (sin, cos) = turn.sin_cos();
        let (u, v) = (u * cos + v * sin, v * cos - u * sin);
        let pivot = self.mesh.centroid().coords;
        let normal = UnitVector3::new_normalize(from.normal.into_inner() + u * x + v * y);
        // The distance from the centroid is kept, so turning and shifting are apart.
        let offset = from.offset + pivot.dot(&(normal.into_inner() - from.normal.into_inner())) + z * self.reach;
        self.cut(normal, offset)
    }

    /// The best plane near the given one through two or three of the vertices it passes closely: an edge in the plane makes a ridge
    /// of the area that polls cannot follow.
    fn snap(&mut self, near: &Cut) -> Cut {
        let mut close: Vec<(f64, usize)> = Vec::new();
        for (i, v) in self.mesh.vertices().iter().enumerate() {
            let distance = (v.coords.dot(&near.normal) - near.offset).abs();
            if distance < 2e-3 * self.reach {
                close.push((distance, i));
            }
        }
        close.sort_by(|a, b| a.0.total_cmp(&b.0));
        close.truncate(8);
        let close: Vec<Point3<f64>> = close.into_iter().map(|(_, i)| self.mesh.vertices()[i]).collect();
        let mut best = *near;
        for (i, p) in close.iter().enumerate() {
            for (j, q) in close.iter().enumerate().skip(i + 1) {
                if self.mesh.triangles().len() <= 5000 {
                    best = best.larger(&self.best_about_line(near, p, q));
                }
                for r in &close[j + 1..] {
                    best = best.larger(&self.through(&[*p, *q, *r]));
                }
            }
        }
        best
    }

    /// The plane through three points, a hair to the better side (a face may lie in it); of no area if they lie on a line.
    fn through(&mut self, points: &[Point3<f64>; 3]) -> Cut {
        let Some(normal) = UnitVector3::try_new(double_area(points), 1e-12 * self.reach * self.reach) else {
            return Cut {
                normal: Vector3::z_axis(),
                offset: 0.0,
                area: 0.0,
            };
        };
        let offset = normal.dot(&points[0].coords);
        let side = 1e-11 * self.reach;
        self.cut(normal, offset - side).larger(&self.cut(normal, offset + side))
    }

    /// The best of the planes through p and q that are turned at most 0.03 from `near`, by golden sections.
    fn best_about_line(&mut self, near: &Cut, p: &Point3<f64>, q: &Point3<f64>) -> Cut {
        let line = (q - p).normalize();
        let start = near.normal.into_inner() - line * line.dot(&near.normal);
        let aside = line.cross(&start);
        highest(-0.03, 0.03, 1e-9, |angle| {
            let normal = UnitVector3::new_normalize(start + aside * angle);
            self.cut(normal, normal.dot(&p.coords))
        })
    }
}

/// The largest of the cuts between `low` and `high` if they have one summit, to `width`, by golden sections.
fn highest(mut low: f64, mut high: f64, width: f64, mut at: impl FnMut(f64) -> Cut) -> Cut {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut inner = [high - golden * (high - low), low + golden * (high - low)];
    let mut cuts = inner.map(&mut at);
    while high - low > width {
        if cuts[0].area > cuts[1].area {
            high = inner[1];
            inner = [high - golden * (high - low), inner[0]];
            cuts = [at(inner[0]), cuts[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + golden * (high - low)];
            cuts = [cuts[1], at(inner[1])];
        }
    }
    cuts[0].larger(&cuts[1])
}

fn largest(profiles: Vec<crate::section::FlatProfile>) -> f64 {
    profiles
        .iter()
        .map(crate::section::FlatProfile::area)
        .fold(0.0, f64::max)
}

/// Starts best first, none within 0.12 of another (as planes: opposite normals are the same).
fn distinct(sorted: &[Cut], count: usize) -> Vec<Cut> {
    let mut chosen: Vec<Cut> = Vec::new();
    for cut in sorted {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|other| other.normal.cross(&cut.normal).norm() > 0.12) {
            chosen.push(*cut);
        }
    }
    chosen
}

/// Fibonacci points of the half-sphere, turned off the axes so that no symmetric body is cut along its edges only.
fn half_sphere(count: u32) -> Vec<UnitVector3<f64>> {
    let off_axis = Rotation3::from_euler_angles(0.3, 0.7, 1.1);
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|i| {
            let z = (f64::from(i) + 0.5) / f64::from(count);
            let radius = (1.0 - z * z).sqrt();
            let (sin, cos) = (golden_angle * f64::from(i)).sin_cos();
            UnitVector3::new_normalize(off_axis * Vector3::new(radius * cos, radius * sin, z))
        })
        .collect()
}

fn largest_hull_normals(mesh: &ClosedMesh, count: usize) -> Vec<UnitVector3<f64>> {
    let hull = mesh.hull();
    let mut areas: Vec<Vector3<f64>> = (0..hull.triangles.len())
        .map(|t| double_area(&hull.corners(t)))
        .collect();
    areas.sort_by(|a, b| b.norm_squared().total_cmp(&a.norm_squared()));
    areas.truncate(count);
    areas
        .into_iter()
        .filter_map(|area| UnitVector3::try_new(area, 0.0))
        .collect()
}
