//! Intersections of rays with the mesh, and smooth normals there.

use crate::hierarchy::Hierarchy;
use nalgebra::{Point3, Vector3};
use stereology_shape::{TriangleMesh, corner_normals};

/// A triangle mesh, its box hierarchy and its normals.
pub(crate) struct Scene {
    hierarchy: Hierarchy,
    corners: Vec<[Point3<f64>; 3]>,
    /// Normals at the corners, smooth where adjacent faces differ little.
    normals: Vec<[Vector3<f64>; 3]>,
}

/// Intersection of a ray with the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) distance: f64,
    facet: usize,
    /// Barycentric coordinates of the second and third corner.
    u: f64,
    v: f64,
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub(crate) point: Point3<f64>,
    /// Smooth, on the side from which the ray came.
    pub(crate) normal: Vector3<f64>,
    /// Origin of light rays: on the smooth surface that the facets approximate, so that facets do not shade themselves.
    pub(crate) start: Point3<f64>,
    /// The wall of a void inside the mesh.
    pub(crate) inside: bool,
}

impl Scene {
    /// `mesh` has at least one triangle; its indices and coordinates have been checked.
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let corners: Vec<[Point3<f64>; 3]> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.vertices[i as usize]))
            .collect();
        let hierarchy = Hierarchy::new(&corners);
        let normals = corner_normals(mesh);
        Self {
            hierarchy,
            corners,
            normals,
        }
    }

    /// The first hit nearer than `far`.
    pub(crate) fn first_hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>, far: f64) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let mut far = far;
        self.hierarchy.visit(origin, direction, far, |facet| {
            if let Some(hit) = self.meet(facet, origin, direction).filter(|hit| hit.distance < far) {
                far = hit.distance;
                nearest = Some(hit);
            }
            Some(far)
        });
        nearest
    }

    /// Whether a triangle blocks a ray.
    pub(crate) fn blocks(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> bool {
        let mut blocked = false;
        self.hierarchy.visit(origin, direction, f64::INFINITY, |facet| {
            blocked = self.meet(facet, origin, direction).is_some();
            if blocked { None } else { Some(f64::INFINITY) }
        });
        blocked
    }

    /// Intersection of a ray with a facet, from either side (Möller and Trumbore 1997).
    fn meet(&self, facet: usize, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let [a, b, c] = &self.corners[facet];
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(&ac);
        let inverse = ab.dot(&p).recip();
        let s = origin - a;
        let u = s.dot(&p) * inverse;
        let q = s.cross(&ab);
        let v = direction.dot(&q) * inverse;
        let distance = ac.dot(&q) * inverse;
        // A ray in the plane of the facet gives NaN, and every comparison with NaN is false.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(Hit { distance, facet, u, v })
    }

    /// The surface at a hit.
    pub(crate) fn surface(&self, hit: &Hit, direction: &Vector3<f64>) -> Surface {
        let corners = &self.corners[hit.facet];
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let point = Point3::from((0..3).map(|i| weights[i] * corners[i].coords).sum::<Vector3<f64>>());
        let flat = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let side = if flat.dot(direction) > 0.0 { -1.0 } else { 1.0 };
        let normals = self.normals[hit.facet].map(|normal| side * normal);
        let smooth = (0..3).map(|i| weights[i] * normals[i]).sum::<Vector3<f64>>();
        // Where the smooth normal points away from the viewer, the normal of the facet is the better estimate.
        let normal = smooth
            .try_normalize(1e-12)
            .filter(|n| n.dot(direction) < 0.0)
            .unwrap_or(side * flat.normalize());
        // Hanika 2021: lift the point to the tangent planes at the corners.
        let lift = |i: usize| {
            let below = (point - corners[i]).dot(&normals[i]).min(0.0);
            -weights[i] * below * normals[i]
        };
        Surface {
            point,
            normal,
            start: point + lift(0) + lift(1) + lift(2),
            inside: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Scene;
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;
    use stereology_shape::TriangleMesh;

    fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Vector3::from)
    }

    proptest! {
        /// The hit found through the hierarchy is the nearest of all triangles, and lies on the sphere within the
        /// sagitta of the facets.
        #[test]
        fn the_first_hit_is_the_nearest(from in vector(3.0), to in vector(0.9), axis in 0_usize..4) {
            let ball = TriangleMesh::icosphere(2.0, 3);
            let scene = Scene::new(&ball);
            let origin = Point3::from(from);
            // Rays along an axis lie in the planes of boxes.
            let direction = if axis < 3 { Vector3::ith(axis, 1.0) } else { (to - from).normalize() };
            let hits = (0..ball.triangles.len()).filter_map(|facet| scene.meet(facet, &origin, &direction));
            let nearest = hits.map(|hit| hit.distance).fold(f64::INFINITY, f64::min);
            let found = scene.first_hit(&origin, &direction, f64::INFINITY);
            prop_assert_eq!(found.map_or(f64::INFINITY, |hit| hit.distance).to_bits(), nearest.to_bits());
            prop_assert_eq!(scene.blocks(&origin, &direction), nearest.is_finite());
            if let Some(hit) = found {
                let surface = scene.surface(&hit, &direction);
                prop_assert!((surface.point.coords.norm() - 1.0).abs() < 0.01);
                prop_assert!(surface.normal.cross(&surface.point.coords).norm() < 0.03);
                prop_assert!(surface.normal.dot(&direction) < 0.0);
            }
        }
    }

    /// Triangles that shrink towards a corner make a deep tree; rays through it find the same hits as a search of all
    /// triangles.
    #[test]
    fn deep_trees_are_searched_to_the_end() {
        let mut mesh = TriangleMesh::default();
        let place = |i: u32| (-0.6 * f64::from(i)).exp();
        for i in 0..700 {
            let (at, size) = (place(i), 0.01 * place(i));
            let corners = [[at, 0.0, 0.0], [at, size, 0.0], [at, 0.0, size]];
            mesh.vertices.extend(corners.map(Point3::from));
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let scene = Scene::new(&mesh);
        for i in 0..700 {
            let origin = Point3::new(-1.0, 0.003 * place(i), 0.003 * place(i));
            let nearest = (0..mesh.triangles.len())
                .filter_map(|facet| scene.meet(facet, &origin, &Vector3::x()))
                .map(|hit| hit.distance)
                .fold(f64::INFINITY, f64::min);
            let found = scene.first_hit(&origin, &Vector3::x(), f64::INFINITY);
            assert_eq!(
                found.map_or(f64::INFINITY, |hit| hit.distance).to_bits(),
                nearest.to_bits()
            );
        }
    }
}
