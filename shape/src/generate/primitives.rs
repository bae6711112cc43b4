//! Meshes of simple solids, centred at the origin.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use crate::mesh::index::index;
use crate::mesh::triangle_mesh::TriangleMesh;

impl TriangleMesh {
    /// Sphere of `diameter`: an icosahedron whose triangles are split into four `subdivisions` times (at most 10); all
    /// vertices are on the sphere.
    ///
    /// `20 · 4^subdivisions` triangles; volume, surface and mean width converge from below with the square of the edge
    /// length.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// assert_eq!(TriangleMesh::icosphere(1.0, 3).triangles.len(), 1280);
    /// ```
    #[must_use]
    pub fn icosphere(diameter: f64, subdivisions: u32) -> Self {
        let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
        let mut directions: Vec<Vector3<f64>> = Vec::new();
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            directions.extend([
                Vector3::new(0.0, a, b),
                Vector3::new(a, b, 0.0),
                Vector3::new(b, 0.0, a),
            ]);
        }
        let edge = 2.0;
        let near = |a: usize, b: usize, d: &[Vector3<f64>]| ((d[a] - d[b]).norm() - edge).abs() < 1e-6;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if near(a, b, &directions) && near(b, c, &directions) && near(a, c, &directions) {
                        let outward = directions[a].cross(&directions[b]).dot(&directions[c]) > 0.0;
                        triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(index));
                    }
                }
            }
        }
        directions.iter_mut().for_each(|d| *d = d.normalize());
        for _ in 0..subdivisions.min(10) {
            triangles = split_in_four(&mut directions, &triangles);
        }
        let vertices = directions.iter().map(|d| Point3::from(d * (0.5 * diameter))).collect();
        Self { vertices, triangles }
    }

    /// The unit sphere: an octahedron with its corners on the axes, whose triangles are split into four `subdivisions`
    /// times.
    pub(crate) fn octasphere(subdivisions: u32) -> Self {
        let mut directions = vec![
            Vector3::x(),
            -Vector3::x(),
            Vector3::y(),
            -Vector3::y(),
            Vector3::z(),
            -Vector3::z(),
        ];
        let mut triangles = Vec::new();
        for octant in 0..8_u32 {
            let corner = |axis: u32| 2 * axis + (octant >> axis & 1);
            let [x, y, z] = [0, 1, 2].map(corner);
            // An odd number of mirrored axes reverses the triangle.
            triangles.push(if octant.count_ones() % 2 == 0 {
                [x, y, z]
            } else {
                [x, z, y]
            });
        }
        for _ in 0..subdivisions {
            triangles = split_in_four(&mut directions, &triangles);
        }
        let vertices = directions.into_iter().map(Point3::from).collect();
        Self { vertices, triangles }
    }

    /// Box with edges `[a, b, c]` along x, y, z: 12 triangles.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// assert_eq!(TriangleMesh::cuboid([1.0, 2.0, 3.0]).triangles.len(), 12);
    /// ```
    #[must_use]
    pub fn cuboid(edges: [f64; 3]) -> Self {
        let corner = |i: usize, axis: usize| {
            if i >> axis & 1 == 1 {
                0.5 * edges[axis]
            } else {
                -0.5 * edges[axis]
            }
        };
        let vertices = (0..8)
            .map(|i| Point3::new(corner(i, 0), corner(i, 1), corner(i, 2)))
            .collect();
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { vertices, triangles }
    }

    /// The surface of unit cubes at integer places: each cube is [i, i + 1] × [j, j + 1] × [k, k + 1], and faces that
    /// two cubes share are left out. Cubes should share whole faces or nothing; those that touch along an edge alone
    /// make a surface that is no [`ClosedMesh`](crate::ClosedMesh). Quadratic in the number of cubes.
    ///
    /// ```
    /// # use stereology_shape::{ClosedMesh, TriangleMesh};
    /// let bent = ClosedMesh::try_from(TriangleMesh::cubes(&[[0, 0, 0], [1, 0, 0], [0, 1, 0]]))?;
    /// assert!((bent.volume() - 3.0).abs() < 1e-12 && (bent.surface_area() - 14.0).abs() < 1e-12);
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn cubes(places: &[[i32; 3]]) -> Self {
        let mut mesh = Self {
            vertices: Vec::new(),
            triangles: Vec::new(),
        };
        for place in places {
            for axis in 0..3 {
                for (side, beside) in [(0, -1), (1, 1)] {
                    let mut next = *place;
                    next[axis] += beside;
                    if !places.contains(&next) {
                        mesh.push_face(place.map(f64::from), axis, side);
                    }
                }
            }
        }
        mesh.weld();
        mesh
    }

    /// Adds the face of the unit cube at `corner` whose normal is along `axis`, negative for side 0, positive for 1.
    fn push_face(&mut self, corner: [f64; 3], axis: usize, side: u8) {
        let first = index(self.vertices.len());
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            let mut vertex = corner;
            vertex[axis] += f64::from(side);
            vertex[(axis + 1) % 3] += u;
            vertex[(axis + 2) % 3] += v;
            self.vertices.push(vertex.into());
        }
        let corners = if side == 1 { [[1, 2], [2, 3]] } else { [[2, 1], [3, 2]] };
        self.triangles
            .extend(corners.map(|[p, q]| [first, first + p, first + q]));
    }

    /// Upright cylinder along z: a prism of `sides` (at least 3) sides whose cross-section has the **area of the
    /// circle** of `diameter`, so its volume is the cylinder's. `4 sides - 4` triangles.
    ///
    /// ```
    /// # use stereology_shape::{ClosedMesh, TriangleMesh};
    /// let can = ClosedMesh::try_from(TriangleMesh::cylinder(2.0, 3.0, 64))?;
    /// assert!((can.volume() - 3.0 * std::f64::consts::PI).abs() < 1e-9);
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn cylinder(diameter: f64, length: f64, sides: u32) -> Self {
        let n = sides.max(3);
        let step = TAU / f64::from(n);
        let radius = 0.5 * diameter * (step / step.sin()).sqrt();
        let ring = |z: f64| {
            (0..n).map(move |i| {
                let (sin, cos) = (step * f64::from(i)).sin_cos();
                Point3::new(radius * cos, radius * sin, z)
            })
        };
        let vertices = ring(-0.5 * length).chain(ring(0.5 * length)).collect();
        let mut triangles = Vec::new();
        for i in 0..n {
            let j = (i + 1) % n;
            triangles.extend([[i, j, n + j], [i, n + j, n + i]]);
            if i > 0 && j > 0 {
                triangles.extend([[0, j, i], [n, n + i, n + j]]);
            }
        }
        Self { vertices, triangles }
    }

    /// Torus about z: circles of `tube_diameter` whose centres run on a circle of `ring_diameter`; all vertices on the
    /// torus, `around` (at least 3) steps about z and `across` (at least 3) about the tube.
    ///
    /// ```
    /// # use stereology_shape::{ClosedMesh, TriangleMesh};
    /// let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.5, 96, 48))?;
    /// let exact = 2.0 * std::f64::consts::PI.powi(2) * 1.0 * 0.25 * 0.25;
    /// assert!((ring.volume() / exact - 1.0).abs() < 0.01);
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn torus(ring_diameter: f64, tube_diameter: f64, around: u32, across: u32) -> Self {
        let (n, m) = (around.max(3), across.max(3));
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for i in 0..n {
            let (sin_ring, cos_ring) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
            for k in 0..m {
                let (sin, cos) = (PI * (2.0 * f64::from(k) / f64::from(m))).sin_cos();
                let radius = 0.5 * (ring_diameter + tube_diameter * cos);
                vertices.push(Point3::new(
                    radius * cos_ring,
                    radius * sin_ring,
                    0.5 * tube_diameter * sin,
                ));
                let at = |i: u32, k: u32| (i % n) * m + k % m;
                triangles.push([at(i, k), at(i + 1, k), at(i + 1, k + 1)]);
                triangles.push([at(i, k), at(i + 1, k + 1), at(i, k + 1)]);
            }
        }
        Self { vertices, triangles }
    }
}

/// Splits each triangle at the midpoints of its edges, moved to the unit sphere.
fn split_in_four(directions: &mut Vec<Vector3<f64>>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut edges: Vec<(u32, u32)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .filter(|(a, b)| a < b)
        .collect();
    edges.sort_unstable();
    let first = directions.len();
    for &(a, b) in &edges {
        directions.push((directions[a as usize] + directions[b as usize]).normalize());
    }
    let middle = |a: u32, b: u32| {
        let at = edges
            .binary_search(&(a.min(b), a.max(b)))
            .expect("every edge of a closed mesh is listed once");
        index(first + at)
    };
    triangles
        .iter()
        .flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        })
        .collect()
}
