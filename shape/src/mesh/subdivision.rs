//! Subdivision of meshes: every triangle becomes four, flat or smoothed.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::index::index;
use crate::mesh::triangle_mesh::TriangleMesh;

/// Subdivision scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subdivision {
    /// Triangles are split at the midpoints of their edges. The solid stays the same.
    Midpoint,
    /// Loop's scheme (1987): vertices move to smooth averages; the limit surface is smooth (its curvature is continuous
    /// except at vertices without exactly six neighbours).
    Loop,
}

impl ClosedMesh {
    /// The mesh with every triangle split in four, repeated `times` times.
    ///
    /// The result is a plain triangle mesh: averaging may make a surface that nearly touches itself intersect itself.
    /// Check it with `ClosedMesh::try_from`. Cost: T 4^times log.
    ///
    /// ```
    /// use stereology_shape::{ClosedMesh, Subdivision, TriangleMesh};
    ///
    /// let cube = ClosedMesh::try_from(TriangleMesh::cuboid([1.0; 3]))?;
    /// let fine = ClosedMesh::try_from(cube.subdivided(Subdivision::Midpoint, 2))?;
    /// assert_eq!(fine.triangles().len(), 12 * 16);
    /// assert!((fine.volume() - 1.0).abs() < 1e-12);
    /// let pebble = ClosedMesh::try_from(cube.subdivided(Subdivision::Loop, 3))?;
    /// assert!(pebble.volume() < 0.6);
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn subdivided(&self, scheme: Subdivision, times: u32) -> TriangleMesh {
        let mut mesh = self.as_triangle_mesh().clone();
        for _ in 0..times {
            mesh = split(&mesh, scheme);
        }
        mesh
    }
}

/// An edge (lower vertex first) and the corner opposite to it in one of its triangles.
type Side = (u32, u32, u32);

fn split(mesh: &TriangleMesh, scheme: Subdivision) -> TriangleMesh {
    let mut sides: Vec<Side> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)])
        .map(|(from, to, opposite)| (from.min(to), from.max(to), opposite))
        .collect();
    sides.sort_unstable();
    let at = |v: u32| mesh.vertices[v as usize].coords;
    // A closed mesh has two sides per edge, next to each other in the list.
    let edges: Vec<[Side; 2]> = sides.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    let mut vertices = match scheme {
        Subdivision::Midpoint => mesh.vertices.clone(),
        Subdivision::Loop => smoothed(mesh, &edges),
    };
    let old = vertices.len();
    vertices.extend(edges.iter().map(|[(a, b, c), (_, _, d)]| {
        Point3::from(match scheme {
            Subdivision::Midpoint => 0.5 * (at(*a) + at(*b)),
            Subdivision::Loop => 0.375 * (at(*a) + at(*b)) + 0.125 * (at(*c) + at(*d)),
        })
    }));
    let middle = |a: u32, b: u32| {
        let place = edges.partition_point(|[(from, to, _), _]| (*from, *to) < (a.min(b), a.max(b)));
        index(old + place)
    };
    let triangles = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        })
        .collect();
    TriangleMesh { vertices, triangles }
}

/// Every vertex moved towards the mean of its neighbours by Loop's weight.
fn smoothed(mesh: &TriangleMesh, edges: &[[Side; 2]]) -> Vec<Point3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0_u32); mesh.vertices.len()];
    for &[(a, b, _), _] in edges {
        for (to, from) in [(a, b), (b, a)] {
            let (sum, count) = &mut sums[to as usize];
            *sum += mesh.vertices[from as usize].coords;
            *count += 1;
        }
    }
    let place = |(v, (sum, count)): (&Point3<f64>, &(Vector3<f64>, u32))| {
        let n = f64::from((*count).max(3));
        let weight = 0.625 - (0.375 + 0.25 * (TAU / n).cos()).powi(2);
        Point3::from(v.coords * (1.0 - weight) + sum * (weight / n))
    };
    mesh.vertices.iter().zip(&sums).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::Subdivision;
    use crate::{ClosedMesh, TriangleMesh};
    use approx::assert_relative_eq;

    #[test]
    fn midpoints_change_no_measure() {
        let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 9, 5)).unwrap();
        let fine = ClosedMesh::try_from(ring.subdivided(Subdivision::Midpoint, 2)).unwrap();
        assert_relative_eq!(fine.volume(), ring.volume(), max_relative = 1e-12);
        assert_relative_eq!(fine.surface_area(), ring.surface_area(), max_relative = 1e-12);
        assert_relative_eq!(fine.signed_mean_width(), ring.signed_mean_width(), max_relative = 1e-9);
    }

    /// Loop's scheme reproduces planes and keeps symmetric bodies symmetric: the limit of a tetrahedron is centred
    /// where it was.
    #[test]
    fn loop_keeps_centre_and_topology() {
        let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 12, 8)).unwrap();
        let fine = ClosedMesh::try_from(ring.subdivided(Subdivision::Loop, 2)).unwrap();
        let euler = |mesh: &ClosedMesh| mesh.vertices().len() as i64 - mesh.triangles().len() as i64 / 2;
        assert_eq!((euler(&ring), euler(&fine)), (0, 0));
        assert!(fine.centroid().coords.norm() < 1e-12 && fine.volume() < ring.volume());
    }
}
