//! The largest single profile of any plane section of a mesh; its area defines the size of a body.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Point3, Rotation3, UnitVector3, Vector3};
use rayon::prelude::*;

use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::measures::double_area;
use crate::section::section_areas::SectionAreas;
use crate::section::slicer::Slicer;

/// Area of the largest single profile, by maximisation over directions and depths.
///
/// A maximum over random sections would be too low: by 2 % for a cube after 10,000 sections. Here the total area at
/// **all** depths of directions spread over the half-sphere (and of the hull's largest faces) bounds the area of a
/// single profile there. The directions with the highest bounds are cut; the best distinct cuts are improved by a
/// pattern search with decreasing steps in direction and depth; and the best is compared with planes through pairs and
/// triples of vertices near it, where polyhedra have their maxima. Bodies with few vertices are also tested with planes
/// through all pairs. The result is the area of an existing section, so it is never too large. Fine meshes of round
/// bodies have many local maxima of nearly equal height; the highest may be missed by some 1e-6. Of a thousand hulls of
/// 6, 8 and 12 random points, 6, 0 and 2 gave a larger value in another orientation, by 8e-5 at most. The result has
/// the same bits at any number of threads.
pub(crate) fn largest_section_area(mesh: &ClosedMesh) -> f64 {
    let budget = Budget::of(mesh);
    let starts = scan(mesh, &budget);
    let starts = distinct(&starts, budget.climbs);
    let Some((first, others)) = starts.split_first() else {
        return 0.0;
    };
    // The first maximum is the bound that the others must exceed.
    let top = Search::new(mesh, &budget).summit_from(*first, 0.0);
    let mut tops: Vec<Cut> = others
        .par_iter()
        .map_init(
            || Search::new(mesh, &budget),
            |search, start| search.summit_from(*start, top.area),
        )
        .collect();
    tops.push(top);
    tops.sort_by(|a, b| b.area.total_cmp(&a.area));
    if mesh.vertices().len() <= MOST_PAIRED {
        let mut search = Search::new(mesh, &budget);
        let ridge = search.best_through_pairs(&tops[0]);
        if ridge.area > tops[0].area {
            tops.insert(0, search.climb(ridge, 1e-3, 0.0));
        }
    }
    let snapped = tops
        .iter()
        .take(budget.snaps)
        .filter(|cut| cut.area > 0.999 * tops[0].area);
    snapped
        .map(|cut| Search::new(mesh, &budget).snapped_summit(*cut).area)
        .fold(tops[0].area, f64::max)
}

/// A plane and its largest profile.
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

/// Extent of the search: small meshes are cheap and have many near ties, large ones are smooth.
struct Budget {
    directions: u32,
    depths: usize,
    climbs: usize,
    /// Number of maxima compared with planes through vertices.
    snaps: usize,
    /// First and last step of the pattern search, in radians and in units of the body's reach.
    step: f64,
    finest: f64,
}

impl Budget {
    fn of(mesh: &ClosedMesh) -> Self {
        let (directions, depths, climbs, snaps, step, finest) = match (mesh.triangles().len(), mesh.is_convex()) {
            (0..=200, _) => (600, 24, 12, 12, 0.06, 1e-7),
            (201..=5000, true) => (400, 0, 16, 1, 0.08, 1e-6),
            (201..=5000, false) => (400, 32, 10, 1, 0.08, 1e-6),
            _ => (200, 32, 6, 1, 0.1, 1e-5),
        };
        Self {
            directions,
            depths,
            climbs,
            snaps,
            step,
            finest,
        }
    }
}

/// Bodies with at most this many vertices are tested with planes through all pairs of vertices.
const MOST_PAIRED: usize = 12;

/// Iterations of the pattern search. Most searches take some 30; along a curved ridge the gains may become small
/// without end.
const MOST_ROUNDS: usize = 250;

/// Positions of the pattern, in steps: those that second differences need.
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

/// Maximum of the paraboloid through the centre and the pattern, in steps, and its height above the centre; `None`
/// without a maximum.
fn summit(centre: f64, polls: &[f64; 9]) -> Option<(Vector3<f64>, f64)> {
    let p = |k: usize| polls[k] - centre;
    let gradient = Vector3::new(p(0) - p(1), p(2) - p(3), p(4) - p(5)) * 0.5;
    let (xx, yy, zz) = (p(0) + p(1), p(2) + p(3), p(4) + p(5));
    let (xy, yz, zx) = (p(6) - p(0) - p(2), p(7) - p(2) - p(4), p(8) - p(0) - p(4));
    let hessian = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
    let place = (-hessian).cholesky()?.solve(&gradient);
    Some((place, 0.5 * gradient.dot(&place)))
}

/// Good sections of directions spread over the half-sphere, best first.
fn scan(mesh: &ClosedMesh, budget: &Budget) -> Vec<Cut> {
    let mut directions = half_sphere(budget.directions);
    directions.extend(largest_hull_normals(mesh, 32));
    let areas = SectionAreas::new(mesh);
    let mut bounds: Vec<Cut> = directions
        .par_iter()
        .map_init(|| areas.clone(), |areas, &normal| largest_total(areas, normal))
        .collect();
    // Ties keep the order of the directions.
    bounds.sort_by(|a, b| b.area.total_cmp(&a.area));
    if mesh.is_convex() {
        return bounds;
    }
    let mut cuts: Vec<Cut> = Vec::new();
    let mut best = 0.0_f64;
    for batch in bounds.chunks(8) {
        // Enough directions are known that exceed the bounds of the rest.
        if batch[0].area < 0.9 * best && cuts.len() >= budget.climbs {
            break;
        }
        let found: Vec<Cut> = batch
            .par_iter()
            .map_init(
                || (Search::new(mesh, budget), areas.clone()),
                |(search, areas), bound| search.best_depth(bound, areas, 0.8 * best),
            )
            .collect();
        cuts.extend(found.into_iter().filter(|cut| cut.area > 0.0));
        best = cuts.iter().map(|cut| cut.area).fold(0.0, f64::max);
    }
    cuts.sort_by(|a, b| b.area.total_cmp(&a.area));
    cuts
}

/// The depth of the largest total area perpendicular to a direction: exact, the maximum of a piecewise quadratic.
fn largest_total(areas: &mut SectionAreas, normal: UnitVector3<f64>) -> Cut {
    let mut best = (0.0, 0.0);
    areas.sweep(&normal, |low, high, [a, b, c]| {
        let mut try_at = |t: f64| {
            let area = a + t * (b + t * c);
            if area > best.0 {
                best = (area, low + t);
            }
        };
        try_at(high - low);
        if c < 0.0 && b > 0.0 {
            try_at((-0.5 * b / c).min(high - low));
        }
    });
    Cut {
        normal,
        offset: normal.dot(&areas.centre().coords) + best.1 * areas.reach(),
        area: best.0 * areas.reach() * areas.reach(),
    }
}

struct Search<'a> {
    mesh: &'a ClosedMesh,
    slicer: Slicer<'a>,
    budget: &'a Budget,
    reach: f64,
    /// During fine steps of the pattern search: the triangles that its planes can meet.
    nearby: Option<Vec<usize>>,
}

impl<'a> Search<'a> {
    fn new(mesh: &'a ClosedMesh, budget: &'a Budget) -> Self {
        Self {
            mesh,
            slicer: Slicer::new(mesh),
            budget,
            reach: mesh.reach(&mesh.centroid()),
            nearby: None,
        }
    }

    fn summit_from(&mut self, start: Cut, to_beat: f64) -> Cut {
        // For a convex body the scan gives a total area that rounding may increase.
        let start = self.cut(start.normal, start.offset);
        self.climb(start, self.budget.step, to_beat)
    }

    fn snapped_summit(&mut self, mut top: Cut) -> Cut {
        for _ in 0..3 {
            let snapped = self.snap(&top);
            if snapped.area <= top.area * (1.0 + 1e-12) {
                break;
            }
            top = self.climb(snapped, 1e-3, top.area);
        }
        top
    }

    /// The largest profile perpendicular to a direction, among evenly spaced depths with a total area above `least`.
    fn best_depth(&mut self, bound: &Cut, areas: &mut SectionAreas, least: f64) -> Cut {
        let normal = bound.normal;
        self.slicer.turn_to(&normal);
        let centre = normal.dot(&areas.centre().coords);
        let (low, high) = self.mesh.extent(&normal);
        let steps = self.budget.depths;
        let offsets: Vec<f64> = (0..steps)
            .map(|i| low + (high - low) * (i as f64 + 0.5) / steps as f64)
            .collect();
        // Also the depth of the bound: if that section is one profile, it is the largest.
        let mut wanted = vec![bound.offset];
        let (reach, mut next) = (areas.reach(), 0);
        areas.sweep(&normal, |from, to, [a, b, c]| {
            while next < steps && offsets[next] <= centre + to * reach {
                let t = (offsets[next] - centre) / reach - from;
                if reach * reach * (a + t * (b + t * c)) > least {
                    wanted.push(offsets[next]);
                }
                next += 1;
            }
        });
        wanted.sort_by(f64::total_cmp);
        let mut best = Cut {
            normal,
            offset: bound.offset,
            area: 0.0,
        };
        for (offset, area) in self.areas_at(&wanted) {
            if area > best.area {
                best = Cut { normal, offset, area };
            }
        }
        best
    }

    /// Largest profile at each of the ascending offsets; each section visits only the triangles that span it.
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
        } else if let Some(nearby) = &self.nearby {
            largest(self.slicer.profiles(offset, nearby.iter().copied()))
        } else {
            largest(self.slicer.profiles(offset, 0..self.mesh.triangles().len()))
        };
        Cut { normal, offset, area }
    }

    /// Tests planes around the best one so far, rotated and shifted by `step`, and the maximum of the paraboloid
    /// through the results; halves the step if none is better. Stops at a maximum that will stay below `to_beat`.
    fn climb(&mut self, start: Cut, step: f64, to_beat: f64) -> Cut {
        let mut best = start;
        let mut step = step;
        let mut turn = 0.0_f64;
        let mut failures = 0;
        let mut rounds = 0;
        while step > self.budget.finest && rounds < MOST_ROUNDS && !(step < 2e-3 && best.area < 0.99 * to_beat) {
            rounds += 1;
            let centre = best;
            self.look_about(&centre, step);
            // New axes in each iteration: on the ridges of polyhedra fixed axes get stuck.
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
            if best.area > centre.area * (1.0 + 1e-13) {
                failures = 0;
                continue;
            }
            failures += 1;
            // The area jumps where profiles merge and separate: wide steps get several attempts, fine ones end on a
            // smooth maximum.
            if step < 0.01 && gain < 1e-13 * best.area {
                break;
            }
            if step < 0.01 || failures == 3 {
                failures = 0;
                step *= 0.5;
            }
        }
        self.nearby = None;
        best
    }

    /// Finds the triangles that planes up to four steps from this one can meet, if they are few.
    fn look_about(&mut self, centre: &Cut, step: f64) {
        self.nearby = None;
        let margin = 8.0 * step * self.reach;
        if self.mesh.is_convex() || margin > 0.2 * self.reach {
            return;
        }
        self.slicer.turn_to(&centre.normal);
        let heights = &self.slicer.heights;
        let spans = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| heights[i as usize] - centre.offset);
            a.min(b).min(c) <= margin && a.max(b).max(c) >= -margin
        };
        let triangles = self.mesh.triangles().iter().enumerate();
        self.nearby = Some(
            triangles
                .filter(|(_, corners)| spans(corners))
                .map(|(t, _)| t)
                .collect(),
        );
    }

    /// The section by a plane near `from`: rotated by x and y about two axes in it, which `turn` rotates, and shifted
    /// by z times the reach.
    fn near(&mut self, from: &Cut, turn: f64, [x, y, z]: [f64; 3]) -> Cut {
        let [u, v] = crate::section::slicer::plane_basis(&from.normal);
        let (sin, cos) = turn.sin_cos();
        let (u, v) = (u * cos + v * sin, v * cos - u * sin);
        let pivot = self.mesh.centroid().coords;
        let normal = UnitVector3::new_normalize(from.normal.into_inner() + u * x + v * y);
        // The distance from the centroid is kept, so rotation and shift are independent.
        let offset = from.offset + pivot.dot(&(normal.into_inner() - from.normal.into_inner())) + z * self.reach;
        self.cut(normal, offset)
    }

    /// The best plane near the given one through two or three of the vertices close to it: an edge in the plane makes a
    /// ridge of the area that the pattern search cannot follow.
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
                if self.mesh.triangles().len() <= 2000 {
                    best = best.larger(&self.best_about_line(near, p, q));
                }
                for r in &close[j + 1..] {
                    best = best.larger(&self.through(&[*p, *q, *r]));
                }
            }
        }
        best
    }

    /// The best of `best` and the planes through two vertices: the pattern search ends on the ridges that they make.
    /// Between the angles at which such a plane meets a third vertex the area is smooth.
    fn best_through_pairs(&mut self, best: &Cut) -> Cut {
        let vertices: Vec<Vector3<f64>> = self.mesh.vertices().iter().map(|v| v.coords).collect();
        let mut best = *best;
        for (i, p) in vertices.iter().enumerate() {
            for q in &vertices[i + 1..] {
                let Some(line) = UnitVector3::try_new(q - p, 1e-9 * self.reach) else {
                    continue;
                };
                let [u, v] = crate::section::slicer::plane_basis(&line);
                let normal = |angle: f64| UnitVector3::new_normalize(u * angle.cos() + v * angle.sin());
                // The normal is perpendicular to the direction of the third vertex: a quarter turn further.
                let third = vertices
                    .iter()
                    .map(|r| r - p)
                    .filter(|r| r.cross(&line).norm() > 1e-9 * self.reach);
                let mut angles: Vec<f64> = third
                    .map(|r| (r.dot(&v).atan2(r.dot(&u)) + 0.5 * PI).rem_euclid(PI))
                    .collect();
                angles.sort_by(f64::total_cmp);
                let Some(&first) = angles.first() else { continue };
                angles.push(first + PI);
                for ends in angles.windows(2) {
                    let mut at = |angle: f64| {
                        let normal = normal(angle);
                        self.cut(normal, normal.dot(p))
                    };
                    let width = ends[1] - ends[0];
                    let seen = [0.02, 0.5, 0.98].map(|share| at(ends[0] + share * width).area);
                    if seen.into_iter().fold(0.0, f64::max) > 0.95 * best.area {
                        let found = highest(ends[0], ends[1], 1e-7, &mut at);
                        best = best.larger(&found);
                    }
                }
            }
        }
        best
    }

    /// The plane through three points, shifted slightly to the better side (a face may lie in it); of area zero if they
    /// lie on a line.
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

    /// The best of the planes through p and q at most 0.03 rad from `near`, by golden-section search.
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

/// The largest of the sections between `low` and `high` if they have a single maximum, to `width`, by golden-section
/// search.
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

fn largest(profiles: Vec<crate::section::slicer::FlatProfile>) -> f64 {
    profiles
        .iter()
        .map(crate::section::slicer::FlatProfile::area)
        .fold(0.0, f64::max)
}

/// Starting planes, best first, none within 0.12 of another (opposite normals are the same plane).
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

/// Fibonacci points on the half-sphere, rotated off the axes so that symmetric bodies are not cut along their edges
/// only.
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
        // Slightly rotated, so that no edge of the face is level.
        .filter_map(|area| UnitVector3::try_new(area.normalize() + Vector3::new(3e-6, 5e-6, 7e-6), 1e-3))
        .collect()
}
