//! Decomposition of bodies that are not convex into convex parts.
//!
//! The bounding box of the body is cut in two repeatedly, each time where the hulls of the contents of both halves have
//! the smallest total volume, until the hulls exceed the volume of the body by no more than a tolerance. The hull of
//! the contents of a box does not require the cut surfaces to be capped: its extreme points are corners of triangles
//! clipped to the box, or corners of the box inside the body. Each hull lies in its own box, so the hulls do not
//! overlap and their volumes add up. Together they cover the body, so a direction that separates the hulls separates
//! the bodies.
//!
//! Rejected: decomposition of voxels (V-HACD, Mamou 2016), whose stair steps make parts larger than the body: 19 parts
//! instead of 8.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use stereology_shape::{ClosedMesh, TriangleMesh, UnitBody, convex_hull};

/// Convex bodies that cover a body and slightly exceed its volume, in unit coordinates.
///
/// # Examples
///
/// ```
/// use stereology_anneal::ConvexParts;
/// use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody};
///
/// let ring = Body::from_mesh(ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 24, 12))?);
/// let coarse = ConvexParts::of(&UnitBody::new(&ring), 0.2);
/// let fine = ConvexParts::of(&UnitBody::new(&ring), 0.1);
/// assert!(coarse.excess() <= 0.2 && fine.excess() <= 0.1);
/// assert!(fine.hulls().len() > coarse.hulls().len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ConvexParts {
    hulls: Vec<ClosedMesh>,
    excess: f64,
}

/// Maximum number of parts.
const MOST: usize = 128;
/// Planes tried along each axis of a part.
const PLANES: usize = 7;
/// Lengths below this fraction of a box are negligible.
const NEGLIGIBLE: f64 = 1e-6;
/// A cut that saves less than this fraction of a hull is no better than halving.
const LEAST_SAVING: f64 = 1e-3;

impl ConvexParts {
    /// Cuts a body until its parts exceed its volume by a fraction of no more than `tolerance`, or there are 128 parts.
    ///
    /// A convex mesh has one part, its own hull; spheres and ellipsoids have no mesh and so no parts. Cost: T log T for
    /// each of the about 40 cuts tried per part.
    #[must_use]
    pub fn of(body: &UnitBody, tolerance: f64) -> Self {
        let Some(mesh) = body.mesh() else {
            return Self {
                hulls: Vec::new(),
                excess: 0.0,
            };
        };
        let volume = mesh.volume();
        let Some(whole) = Piece::whole(mesh) else {
            return Self {
                hulls: Vec::new(),
                excess: 0.0,
            };
        };
        let mut pieces = vec![whole];
        let total = |pieces: &[Piece]| pieces.iter().map(|p| p.hull.volume()).sum::<f64>();
        while total(&pieces) > (1.0 + tolerance) * volume && pieces.len() < MOST {
            // The part with the largest excess volume.
            let Some(worst) = (0..pieces.len())
                .filter(|&i| !pieces[i].final_form)
                .max_by(|&i, &j| pieces[i].excess().total_cmp(&pieces[j].excess()).then(j.cmp(&i)))
            else {
                break;
            };
            let halves = pieces[worst].halved(body);
            if halves.is_empty() {
                pieces[worst].final_form = true;
            } else {
                pieces.splice(worst..=worst, halves);
            }
        }
        Self {
            excess: (total(&pieces) / volume - 1.0).max(0.0),
            hulls: pieces.into_iter().map(|piece| piece.hull).collect(),
        }
    }

    /// The parts, in the coordinates of the unit body.
    #[must_use]
    pub fn hulls(&self) -> &[ClosedMesh] {
        &self.hulls
    }

    /// Total volume of the parts divided by that of the body, minus one.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.excess
    }
}

/// One side of a cut.
enum Half {
    Filled(Box<Piece>),
    Empty,
    Flat,
}

/// The contents of one box.
struct Piece {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Surface of the body in the box.
    polygons: Vec<Vec<Point3<f64>>>,
    hull: ClosedMesh,
    /// Volume of the body in the box, estimated by counting points.
    filled: Option<f64>,
    /// No further cut is possible.
    final_form: bool,
}

impl Piece {
    fn whole(mesh: &ClosedMesh) -> Option<Self> {
        let triangles: &TriangleMesh = mesh.as_triangle_mesh();
        let (low, high) = triangles.bounding_box()?;
        let polygons = triangles
            .triangles
            .iter()
            .map(|t| t.iter().map(|&v| triangles.vertices[v as usize]).collect())
            .collect();
        Some(Self {
            low,
            high,
            polygons,
            hull: convex_hull(mesh.vertices()).ok()?,
            filled: None,
            final_form: false,
        })
    }

    /// Approximate excess of the hull over its contents, in volume.
    fn excess(&self) -> f64 {
        self.hull.volume() - self.filled.unwrap_or(0.0)
    }

    /// The halves of the best cut (one, if the other is empty); none if no cut is possible.
    fn halved(&self, body: &UnitBody) -> Vec<Self> {
        let extent = |axis: usize| {
            let along = self.hull.vertices().iter().map(|v| v[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let cuts: Vec<(usize, f64)> = (0..3)
            .flat_map(|axis| self.planes(axis, extent(axis)).into_iter().map(move |at| (axis, at)))
            .collect();
        let tried: Vec<(f64, Vec<Self>)> = cuts
            .par_iter()
            .map(|&(axis, at)| {
                let mut halves = Vec::new();
                for above in [false, true] {
                    match self.half(body, axis, at, above) {
                        Half::Filled(half) => halves.push(*half),
                        Half::Empty => {}
                        // A flat half has no hull but must not be lost: reject the cut.
                        Half::Flat => return (f64::INFINITY, Vec::new()),
                    }
                }
                (halves.iter().map(|half| half.hull.volume()).sum(), halves)
            })
            .collect();
        let length = |axis: usize| extent(axis).1 - extent(axis).0;
        let longest = (0..3).fold(0, |best, axis| if length(axis) > length(best) { axis } else { best });
        let along: Vec<usize> = (0..cuts.len()).filter(|&k| cuts[k].0 == longest).collect();
        let Some(&middle) = along.get(along.len() / 2) else {
            return Vec::new();
        };
        let (mut chosen, mut least) = (middle, (1.0 - LEAST_SAVING) * self.hull.volume());
        for (number, (volume, _)) in tried.iter().enumerate() {
            if *volume < least * (1.0 - 1e-9) {
                (chosen, least) = (number, *volume);
            }
        }
        let mut halves = tried
            .into_iter()
            .nth(chosen)
            .map(|(_, halves)| halves)
            .unwrap_or_default();
        for half in &mut halves {
            half.filled = Some(half.count(body));
        }
        halves
    }

    /// Positions of cuts perpendicular to an axis: the corners of the surface if they lie in few planes (edges of
    /// blocks), otherwise evenly spaced.
    fn planes(&self, axis: usize, (from, to): (f64, f64)) -> Vec<f64> {
        let negligible = NEGLIGIBLE * (to - from);
        let mut corners: Vec<f64> = self.polygons.iter().flatten().map(|p| p[axis]).collect();
        corners.retain(|x| from + negligible < *x && *x < to - negligible);
        corners.sort_by(f64::total_cmp);
        corners.dedup_by(|x, y| (*x - *y).abs() <= negligible);
        if (1..=2 * PLANES).contains(&corners.len()) {
            return corners;
        }
        (1..=PLANES)
            .map(|k| from + (to - from) * k as f64 / (PLANES + 1) as f64)
            .collect()
    }

    /// The part on one side of a plane perpendicular to an axis.
    fn half(&self, body: &UnitBody, axis: usize, at: f64, above: bool) -> Half {
        let (mut low, mut high) = (self.low, self.high);
        if above {
            low[axis] = at;
        } else {
            high[axis] = at;
        }
        let polygons: Vec<Vec<Point3<f64>>> = self
            .polygons
            .iter()
            .map(|polygon| clipped(polygon, axis, at, above))
            .filter(|polygon| polygon.len() > 2)
            .collect();
        let mut points: Vec<Point3<f64>> = polygons.iter().flatten().copied().collect();
        // Test slightly inside the box: a corner may lie on the surface of a body that fills the box around it.
        let middle = nalgebra::center(&low, &high);
        points.extend(corners(&low, &high).filter(|corner| body.contains(&(corner + (middle - corner) * NEGLIGIBLE))));
        points.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)));
        points.dedup();
        if points.is_empty() {
            return Half::Empty;
        }
        let Ok(hull) = convex_hull(&points) else {
            return Half::Flat;
        };
        Half::Filled(Box::new(Self {
            low,
            high,
            polygons,
            hull,
            filled: None,
            final_form: false,
        }))
    }

    /// Volume of the body in the bounding box of the hull, from a grid of points.
    fn count(&self, body: &UnitBody) -> f64 {
        const POINTS: usize = 16;
        let corner = self.hull.vertices()[0];
        let (low, high) = self
            .hull
            .vertices()
            .iter()
            .fold((corner, corner), |(low, high), v| (low.inf(v), high.sup(v)));
        let size = high - low;
        let inside = (0..POINTS.pow(3))
            .filter(|&k| {
                let cell = Vector3::new(k % POINTS, k / POINTS % POINTS, k / POINTS / POINTS);
                body.contains(&(low + cell.map(|i| (i as f64 + 0.5) / POINTS as f64).component_mul(&size)))
            })
            .count();
        size.product() * inside as f64 / POINTS.pow(3) as f64
    }
}

fn corners(low: &Point3<f64>, high: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    let (low, high) = (*low, *high);
    (0..8).map(move |k| {
        Point3::from(Vector3::from_fn(|axis, _| {
            if k >> axis & 1 == 0 { low[axis] } else { high[axis] }
        }))
    })
}

/// The part of a convex polygon on one side of a plane perpendicular to an axis (Sutherland & Hodgman 1974).
fn clipped(polygon: &[Point3<f64>], axis: usize, at: f64, above: bool) -> Vec<Point3<f64>> {
    let height = |p: &Point3<f64>| if above { p[axis] - at } else { at - p[axis] };
    // A polygon that only touches the plane belongs to the other half.
    if polygon.iter().all(|p| height(p) <= 0.0) {
        return Vec::new();
    }
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, here) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (h, k) = (height(here), height(next));
        if h >= 0.0 {
            kept.push(*here);
        }
        if h * k < 0.0 {
            let mut crossing = here + (next - here) * (h / (h - k));
            crossing[axis] = at;
            kept.push(crossing);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::ConvexParts;
    use nalgebra::Point3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody};

    /// Every point of the body lies in a part, and the parts exceed the body by little.
    #[test]
    fn parts_cover_the_body() {
        let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 24, 12)).unwrap();
        let ring = UnitBody::new(&Body::from_mesh(ring));
        let parts = ConvexParts::of(&ring, 0.1);
        assert!(
            parts.excess() <= 0.1 && parts.hulls().len() < 40,
            "{}",
            parts.hulls().len()
        );
        let outside = |hull: &ClosedMesh, p: &Point3<f64>| {
            let heights = hull.triangles().iter().filter_map(|t| {
                let [a, b, c] = t.map(|v| hull.vertices()[v as usize]);
                // Degenerate triangles have no normal.
                let normal = (b - a).cross(&(c - a)).try_normalize(1e-12)?;
                Some(normal.dot(&(p - a)))
            });
            heights.fold(f64::NEG_INFINITY, f64::max)
        };
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut inside = 0;
        for _ in 0..4000 {
            let p = Point3::from(nalgebra::Vector3::from_fn(|_, _| 1.6 * rng.random::<f64>() - 0.8));
            if ring.contains(&p) {
                inside += 1;
                assert!(parts.hulls().iter().any(|hull| outside(hull, &p) < 1e-9), "{p}");
            }
        }
        assert!(inside > 100);
    }
}
