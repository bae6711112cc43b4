//! Overlap of bodies that are not convex: crossing faces, and bodies inside one another.
//!
//! Two solids share no interior point if no faces of their surfaces cross and neither surface lies inside the other
//! solid. Two triangles are proved separate by one of 17 directions (their normals, the cross products of their edges,
//! the normals of their edges in their planes); a triangle and an ellipsoid by the search for convex bodies; a solid
//! and a sphere by the distance of the centre of the sphere. Whether a surface lies inside is decided exactly, for one
//! vertex of each of its connected components.
//!
//! Surfaces that touch within rounding may overlap without any crossing (two L that share a plane): then four points
//! slightly below every face are tested as well.

use crate::conversions::compact;
use crate::difference::{Posed, Solid};
use crate::gauge::{Gauge, Search};
use nalgebra::{Matrix3, Point3, Vector3};
use stereology_shape::{BodyKind, UnitBody};

/// Allowance for the rounding of coordinates.
const ROUNDING: f64 = 1e-12;
/// Depth of these points below their face, in sizes.
const BELOW: f64 = 1e-7;

/// The faces of a body in a tree of bounding spheres, which are invariant under rotation of the body.
#[derive(Debug)]
pub(crate) struct Surface {
    triangles: Vec<[Vector3<f64>; 3]>,
    spheres: Vec<Bound>,
    /// A vertex of each connected component of the surface.
    witnesses: Vec<Vector3<f64>>,
}

#[derive(Debug)]
struct Bound {
    centre: Vector3<f64>,
    radius: f64,
    /// First triangle of a leaf, or index of the second child; the first child follows its parent.
    start: usize,
    /// Number of triangles of a leaf, 0 for a node.
    count: usize,
}

const LEAF: usize = 4;

impl Surface {
    /// The surface of a body that is a mesh.
    pub(crate) fn of(body: &UnitBody) -> Option<Self> {
        let mesh = body.mesh()?.as_triangle_mesh();
        let mut triangles: Vec<[Vector3<f64>; 3]> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| mesh.vertices[v as usize].coords))
            .collect();
        let mut piece: Vec<u32> = (0..compact(mesh.vertices.len())).collect();
        for &[a, b, c] in &mesh.triangles {
            let root = first(&mut piece, a);
            for v in [b, c] {
                let other = first(&mut piece, v);
                piece[other as usize] = root;
            }
        }
        let mut used: Vec<u32> = mesh.triangles.iter().map(|t| first(&mut piece, t[0])).collect();
        used.sort_unstable();
        used.dedup();
        let witnesses = used.iter().map(|&v| mesh.vertices[v as usize].coords).collect();
        let mut spheres = Vec::new();
        split(&mut spheres, &mut triangles, 0);
        Some(Self {
            triangles,
            spheres,
            witnesses,
        })
    }
}

fn first(piece: &mut [u32], mut v: u32) -> u32 {
    while piece[v as usize] != v {
        piece[v as usize] = piece[piece[v as usize] as usize];
        v = piece[v as usize];
    }
    v
}

fn split(spheres: &mut Vec<Bound>, triangles: &mut [[Vector3<f64>; 3]], start: usize) {
    let corner = triangles[0][0];
    let (low, high) = triangles
        .iter()
        .flatten()
        .fold((corner, corner), |(low, high), p| (low.inf(p), high.sup(p)));
    let centre = 0.5 * (low + high);
    let radius = triangles
        .iter()
        .flatten()
        .map(|p| (p - centre).norm())
        .fold(0.0, f64::max);
    let at = spheres.len();
    let count = if triangles.len() <= LEAF { triangles.len() } else { 0 };
    spheres.push(Bound {
        centre,
        radius,
        start,
        count,
    });
    if count > 0 {
        return;
    }
    let axis = (high - low).imax();
    let middle = triangles.len() / 2;
    let key = |t: &[Vector3<f64>; 3]| t.iter().map(|p| p[axis]).sum::<f64>();
    triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
    let (left, right) = triangles.split_at_mut(middle);
    split(spheres, left, start);
    spheres[at].start = spheres.len();
    split(spheres, right, start + middle);
}

/// A particle: its body, its surface if it is a mesh, its size and orientation.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    pub(crate) body: &'a UnitBody,
    pub(crate) surface: Option<&'a Surface>,
    pub(crate) size: f64,
    pub(crate) rotation: &'a Matrix3<f64>,
}

impl<'a> Placed<'a> {
    /// The body or its convex hull, as one convex solid.
    pub(crate) fn hull(&self) -> Posed<'a> {
        Posed {
            solid: Solid::Body(self.body),
            size: self.size,
            rotation: self.rotation,
        }
    }

    pub(crate) fn is_sphere(&self) -> bool {
        matches!(self.body.body().kind(), BodyKind::Sphere { .. })
    }

    fn to_local(self, p: &Vector3<f64>) -> Point3<f64> {
        Point3::from(self.rotation.tr_mul(p) / self.size)
    }
}

/// 0 if two bodies, at least one of them a mesh, are proved separate; otherwise the depth of the deepest crossing face
/// or enclosed point, always positive.
///
/// `offset` is the vector from the centroid of `a` to that of `b`.
pub(crate) fn depth(a: &Placed<'_>, b: &Placed<'_>, offset: &Vector3<f64>) -> f64 {
    let depth = match (a.surface, b.surface) {
        (Some(_), _) if b.is_sphere() => with_sphere(a, b, offset),
        (_, Some(_)) if a.is_sphere() => with_sphere(b, a, &-offset),
        (Some(of_a), Some(of_b)) => between_meshes(a, of_a, b, of_b, offset),
        (Some(of_a), None) => with_ellipsoid(a, of_a, b, offset),
        (None, Some(of_b)) => with_ellipsoid(b, of_b, a, &-offset),
        // Callers pass at least one mesh; pairs not proved separate count as overlapping.
        (None, None) => Some(f64::MIN_POSITIVE),
    };
    depth.map_or(0.0, |depth| depth.max(f64::MIN_POSITIVE))
}

/// Depth of the overlap of a mesh and a sphere.
fn with_sphere(mesh: &Placed<'_>, sphere: &Placed<'_>, offset: &Vector3<f64>) -> Option<f64> {
    let distance = mesh.body.signed_distance(&mesh.to_local(offset)) * mesh.size;
    let radius = 0.5 * sphere.size;
    let allowance = ROUNDING * (mesh.size * mesh.body.bounding_radius() + radius);
    (distance < radius - allowance).then_some(radius - distance)
}

fn with_ellipsoid(mesh: &Placed<'_>, surface: &Surface, round: &Placed<'_>, offset: &Vector3<f64>) -> Option<f64> {
    let reach = round.size * round.body.bounding_radius();
    let ellipsoid = round.hull();
    let search = Search {
        enough: 1.0,
        precision: 1e-12,
        steps: 100,
    };
    let mut deepest: Option<f64> = None;
    let mut stack = vec![0];
    while let Some(at) = stack.pop() {
        let sphere = &surface.spheres[at];
        let centre = mesh.rotation * sphere.centre * mesh.size - offset;
        if centre.norm() > sphere.radius * mesh.size + reach {
            continue;
        }
        if sphere.count == 0 {
            stack.extend([at + 1, sphere.start]);
            continue;
        }
        for corners in &surface.triangles[sphere.start..sphere.start + sphere.count] {
            let middle = corners.iter().sum::<Vector3<f64>>() / 3.0;
            let points = corners.map(|p| p - middle);
            let triangle = Posed {
                solid: Solid::Points(&points),
                size: mesh.size,
                rotation: mesh.rotation,
            };
            let between = offset - mesh.rotation * middle * mesh.size;
            let gauge = Gauge::search(&triangle, &ellipsoid, &between, &search);
            let apart = gauge.normal != Vector3::zeros()
                && triangle.reach(&gauge.normal) + ellipsoid.reach(&-gauge.normal)
                    <= gauge.normal.dot(&between) + ROUNDING * (mesh.size + round.size);
            if !apart {
                let depth = (1.0 - gauge.value).max(0.0) * gauge.width;
                deepest = Some(deepest.unwrap_or(0.0).max(depth));
            }
        }
    }
    // An ellipsoid that crosses no face is inside or outside as a whole.
    let local = mesh.to_local(offset);
    if mesh.body.contains(&local) {
        let depth = -mesh.body.signed_distance(&local) * mesh.size;
        deepest = Some(deepest.unwrap_or(0.0).max(depth));
    }
    deepest
}

/// Result of the traversal of two trees.
struct Crossings {
    deepest: Option<f64>,
    touching: bool,
}

fn between_meshes(
    a: &Placed<'_>,
    of_a: &Surface,
    b: &Placed<'_>,
    of_b: &Surface,
    offset: &Vector3<f64>,
) -> Option<f64> {
    // In the axes of `a`, whose faces are only scaled.
    let turn = a.rotation.tr_mul(b.rotation);
    let offset_a = a.rotation.tr_mul(offset);
    let allowance = ROUNDING * (a.size * a.body.bounding_radius() + b.size * b.body.bounding_radius());
    let mut found = Crossings {
        deepest: None,
        touching: false,
    };
    let mut stack = vec![(0, 0)];
    while let Some((i, j)) = stack.pop() {
        let (p, q) = (&of_a.spheres[i], &of_b.spheres[j]);
        let between = offset_a + turn * q.centre * b.size - p.centre * a.size;
        let (reach_p, reach_q) = (p.radius * a.size, q.radius * b.size);
        if between.norm() > reach_p + reach_q + allowance {
            continue;
        }
        if p.count > 0 && q.count > 0 {
            for s in &of_a.triangles[p.start..p.start + p.count] {
                let s = s.map(|v| v * a.size);
                for t in &of_b.triangles[q.start..q.start + q.count] {
                    let t = t.map(|v| offset_a + turn * v * b.size);
                    let gap = gap(&s, &t);
                    if gap < -allowance {
                        found.deepest = Some(found.deepest.unwrap_or(0.0).max(-gap));
                    } else if gap <= allowance {
                        found.touching = true;
                    }
                }
            }
        } else if q.count > 0 || (p.count == 0 && reach_p > reach_q) {
            stack.extend([(i + 1, j), (p.start, j)]);
        } else {
            stack.extend([(i, j + 1), (i, q.start)]);
        }
    }
    let mut deepest = found.deepest;
    let mut include = |depth: Option<f64>| {
        if let Some(depth) = depth {
            deepest = Some(deepest.unwrap_or(0.0).max(depth));
        }
    };
    include(enclosed(a, of_a, b, offset, found.touching));
    include(enclosed(b, of_b, a, &-offset, found.touching));
    deepest
}

/// Depth inside `b` of the witnesses of `a`, and, if the surfaces touch, of points slightly below all faces of `a`.
fn enclosed(a: &Placed<'_>, of_a: &Surface, b: &Placed<'_>, offset: &Vector3<f64>, touching: bool) -> Option<f64> {
    let mut deepest: Option<f64> = None;
    let reach = b.size * b.body.bounding_radius();
    let mut test = |p: &Vector3<f64>, least: f64| {
        let from_b = a.rotation * p * a.size - offset;
        if from_b.norm_squared() > reach * reach {
            return;
        }
        let local = b.to_local(&from_b);
        if b.body.contains(&local) {
            let depth = -b.body.signed_distance(&local) * b.size;
            if depth > least {
                deepest = Some(deepest.unwrap_or(0.0).max(depth));
            }
        }
    };
    let rounding = ROUNDING * (a.size + b.size);
    of_a.witnesses.iter().for_each(|p| test(p, rounding));
    if touching {
        for [p, q, r] in &of_a.triangles {
            let Some(normal) = (q - p).cross(&(r - p)).try_normalize(0.0) else {
                continue;
            };
            let middle = (p + q + r) / 3.0;
            for point in [
                middle,
                0.4 * middle + 0.6 * p,
                0.4 * middle + 0.6 * q,
                0.4 * middle + 0.6 * r,
            ] {
                test(&(point - normal * BELOW), 0.5 * BELOW * a.size.min(b.size));
            }
        }
    }
    deepest
}

/// The widest gap between two triangles over all directions that can separate them; negative if they cross, then minus
/// the depth.
fn gap(s: &[Vector3<f64>; 3], t: &[Vector3<f64>; 3]) -> f64 {
    let edges = |c: &[Vector3<f64>; 3]| [c[1] - c[0], c[2] - c[1], c[0] - c[2]];
    let (of_s, of_t) = (edges(s), edges(t));
    let (normal_s, normal_t) = (of_s[0].cross(&of_s[1]), of_t[0].cross(&of_t[1]));
    let mut widest = f64::NEG_INFINITY;
    let mut project = |axis: Vector3<f64>, scale: f64| {
        let length = axis.norm();
        // The cross product of parallel edges consists of rounding errors.
        if length > 1e-9 * scale {
            let range = |c: &[Vector3<f64>; 3]| {
                let h = c.map(|p| axis.dot(&p));
                (h[0].min(h[1]).min(h[2]), h[0].max(h[1]).max(h[2]))
            };
            let ((low_s, high_s), (low_t, high_t)) = (range(s), range(t));
            widest = widest.max((low_t - high_s).max(low_s - high_t) / length);
        }
    };
    project(normal_s, 0.0);
    project(normal_t, 0.0);
    for e in &of_s {
        project(e.cross(&normal_s), 0.0);
        for f in &of_t {
            project(e.cross(f), e.norm() * f.norm());
        }
    }
    for f in &of_t {
        project(f.cross(&normal_t), 0.0);
    }
    widest
}
