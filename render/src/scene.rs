//! The mesh as rays meet it: hits, smooth normals.

use crate::hierarchy::Hierarchy;
use nalgebra::{Point3, Vector3};
use stereology_shape::{TriangleMesh, corner_normals};

/// A triangle mesh with what rays ask of it.
pub(crate) struct Scene {
    hierarchy: Hierarchy,
    corners: Vec<[Point3<f64>; 3]>,
    /// Normals at the corners, smooth where the faces nearly agree.
    normals: Vec<[Vector3<f64>; 3]>,
}

/// Where a ray meets the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) distance: f64,
    facet: usize,
    /// Shares of the second and third corner.
    u: f64,
    v: f64,
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub(crate) point: Point3<f64>,
    /// Smooth, towards where the ray came from.
    pub(crate) normal: Vector3<f64>,
    /// Where rays of light start: on the smooth surface that the facets stand for, or facets would shade themselves.
    pub(crate) start: Point3<f64>,
    /// The wall of a void inside the mesh.
    pub(crate) inside: bool,
}

impl Scene {
    /// Of triangles whose indices and coordinates have been checked; at least one.
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

    /// Whether anything is in the way.
    pub(crate) fn is_hidden(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> bool {
        let mut hidden = false;
        self.hierarchy.visit(origin, direction, f64::INFINITY, |facet| {
            hidden = self.meet(facet, origin, direction).is_some();
            if hidden { None } else { Some(f64::INFINITY) }
        });
        hidden
    }

    /// Where a ray meets a facet from either side (Möller and Trumbore 1997).
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
        // Comparisons with what is no number, of a ray along the facet, are false.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(Hit { distance, facet, u, v })
    }

    /// The surface where a ray from `origin` hit it.
    pub(crate) fn surface(&self, hit: &Hit, direction: &Vector3<f64>) -> Surface {
        let corners = &self.corners[hit.facet];
        let shares = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let point = Point3::from((0..3).map(|i| shares[i] * corners[i].coords).sum::<Vector3<f64>>());
        let flat = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let side = if flat.dot(direction) > 0.0 { -1.0 } else { 1.0 };
        let normals = self.normals[hit.facet].map(|normal| side * normal);
        let smooth = (0..3).map(|i| shares[i] * normals[i]).sum::<Vector3<f64>>();
        // Where the smooth normal turns away from the viewer, the facet's own is nearer to the truth.
        let normal = smooth
            .try_normalize(1e-12)
            .filter(|n| n.dot(direction) < 0.0)
            .unwrap_or(side * flat.normalize());
        // Hanika 2021: lift the point to the planes through the corners across their normals.
        let lift = |i: usize| {
            let below = (point - corners[i]).dot(&normals[i]).min(0.0);
            -shares[i] * below * normals[i]
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
        /// The hit found through the boxes is the nearest of all triangles, and lies on the ball within its facets' sagitta.
        #[test]
        fn the_first_hit_is_the_nearest(from in vector(3.0), to in vector(0.9), axis in 0_usize..4) {
            let ball = TriangleMesh::icosphere(2.0, 3);
            let scene = Scene::new(&ball);
            let origin = Point3::from(from);
            // Rays along an axis too: they lie in the planes of boxes.
            let direction = if axis < 3 { Vector3::ith(axis, 1.0) } else { (to - from).normalize() };
            let hits = (0..ball.triangles.len()).filter_map(|facet| scene.meet(facet, &origin, &direction));
            let nearest = hits.map(|hit| hit.distance).fold(f64::INFINITY, f64::min);
            let found = scene.first_hit(&origin, &direction, f64::INFINITY);
            prop_assert_eq!(found.map_or(f64::INFINITY, |hit| hit.distance).to_bits(), nearest.to_bits());
            prop_assert_eq!(scene.is_hidden(&origin, &direction), nearest.is_finite());
            if let Some(hit) = found {
                let surface = scene.surface(&hit, &direction);
                prop_assert!((surface.point.coords.norm() - 1.0).abs() < 0.01);
                prop_assert!(surface.normal.cross(&surface.point.coords).norm() < 0.03);
                prop_assert!(surface.normal.dot(&direction) < 0.0);
            }
        }
    }

    /// Triangles ever smaller towards a corner make a tree of many floors; rays through it find what a search of all finds.
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
