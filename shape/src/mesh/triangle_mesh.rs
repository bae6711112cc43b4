//! Arbitrary triangles, as in a mesh file. They need not enclose a solid.

use nalgebra::Point3;

use crate::mesh::index::index;
use crate::mesh::near_points::clusters;

/// Vertices and triangles as stored in files; the mesh may be open, inverted or broken.
///
/// A [`ClosedMesh`](crate::ClosedMesh) is checked to enclose a solid.
///
/// # Examples
///
/// ```
/// use stereology_shape::{ClosedMesh, TriangleMesh};
///
/// let ball = TriangleMesh::icosphere(2.0, 5);
/// let volume = ClosedMesh::try_from(ball)?.volume();
/// assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3);
/// # Ok::<(), stereology_shape::MeshError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions, in the mesh's own unit of length.
    pub vertices: Vec<Point3<f64>>,
    /// Three indices into `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Lowest and highest corner of the axis-aligned bounding box; `None` without vertices.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// let (low, high) = TriangleMesh::cuboid([2.0, 4.0, 6.0]).bounding_box().unwrap();
    /// assert_eq!((low.x, high.z), (-1.0, 3.0));
    /// ```
    #[must_use]
    pub fn bounding_box(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(low, high), v| (low.inf(v), high.sup(v))),
        )
    }

    /// The mesh with every vertex mapped by `place`; a reflection turns the mesh inside out.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// let cube = TriangleMesh::cuboid([1.0; 3]).mapped(|p| 2.0 * p);
    /// assert_eq!(cube.bounding_box().unwrap().1.x, 1.0);
    /// ```
    #[must_use]
    pub fn mapped(&self, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        Self {
            vertices: self.vertices.iter().map(place).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Both meshes in one; no vertices are welded.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// let cube = TriangleMesh::cuboid([1.0; 3]);
    /// assert_eq!(cube.clone().with(&cube).triangles.len(), 24);
    /// ```
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        let shift = index(self.vertices.len());
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i.saturating_add(shift))));
        self
    }

    /// Merges vertices at exactly equal positions (0 and -0 are equal); returns the number of vertices removed.
    ///
    /// The kept vertices keep their order. Cost: V log V.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// let cube = TriangleMesh::cuboid([1.0; 3]);
    /// let mut twice = cube.clone().with(&cube);
    /// assert_eq!(twice.weld(), 8);
    /// assert_eq!(twice.vertices, cube.vertices);
    /// ```
    pub fn weld(&mut self) -> usize {
        let key = |i: u32| self.vertices[i as usize].coords.map(|x| x + 0.0).into();
        let mut order: Vec<u32> = (0..index(self.vertices.len())).collect();
        order.sort_unstable_by(|&a, &b| {
            let (pa, pb): ([f64; 3], [f64; 3]) = (key(a), key(b));
            let compare = |k: usize| pa[k].total_cmp(&pb[k]);
            compare(0).then(compare(1)).then(compare(2)).then(a.cmp(&b))
        });
        // `first[i]`: the lowest index of a vertex at the position of vertex i.
        let mut first: Vec<u32> = (0..index(self.vertices.len())).collect();
        for pair in order.windows(2) {
            if self.vertices[pair[0] as usize] == self.vertices[pair[1] as usize] {
                first[pair[1] as usize] = first[pair[0] as usize];
            }
        }
        self.keep_vertices(&first)
    }

    /// Merges vertices nearer than `tolerance` to each other at the position of the first of them; chains of near
    /// vertices become one vertex. Returns the number of vertices removed.
    ///
    /// Use it for files whose seams do not match exactly. A tolerance near the length of edges collapses them; stay
    /// well below. Coordinates must be finite. Cost: about V log V, at any tolerance.
    ///
    /// ```
    /// # use stereology_shape::TriangleMesh;
    /// let cube = TriangleMesh::cuboid([1.0; 3]);
    /// let mut twice = cube.clone().with(&cube.mapped(|p| p * (1.0 + 1e-7)));
    /// assert_eq!((twice.weld(), twice.weld_within(1e-6)), (0, 8));
    /// ```
    pub fn weld_within(&mut self, tolerance: f64) -> usize {
        if tolerance.is_nan() || tolerance <= 0.0 {
            return self.weld();
        }
        let first = clusters(&self.vertices, tolerance);
        self.keep_vertices(&first)
    }

    /// Drops vertices that no triangle uses; returns their number.
    pub(crate) fn drop_unused_vertices(&mut self) -> usize {
        let mut target = vec![u32::MAX; self.vertices.len()];
        for &i in self.triangles.iter().flatten() {
            target[i as usize] = i;
        }
        self.keep_vertices(&target)
    }

    /// Keeps the vertices i with `target[i] == i`; triangles follow `target` to a kept vertex.
    fn keep_vertices(&mut self, target: &[u32]) -> usize {
        let before = self.vertices.len();
        let mut renumbered = vec![u32::MAX; before];
        let mut kept = Vec::with_capacity(before);
        for (i, vertex) in self.vertices.iter().enumerate() {
            if target[i] as usize == i {
                renumbered[i] = index(kept.len());
                kept.push(*vertex);
            }
        }
        for corner in self.triangles.iter_mut().flatten() {
            // Indices out of range stay out of range: the checks that follow report them.
            if let Some(&to) = target.get(*corner as usize) {
                *corner = renumbered[to as usize];
            } else {
                *corner = u32::MAX;
            }
        }
        self.vertices = kept;
        before - self.vertices.len()
    }

    /// The corners of triangle `t`.
    pub(crate) fn corners(&self, t: usize) -> [Point3<f64>; 3] {
        self.triangles[t].map(|i| self.vertices[i as usize])
    }
}

/// Sets coordinates less than 1e-20 of the largest to zero and returns their number. They are far below its rounding,
/// and products of three of them would leave the range in which predicates are exact.
pub(crate) fn flush_tiny(points: &mut [Point3<f64>]) -> usize {
    let largest = points
        .iter()
        .flat_map(|p| p.iter())
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut count = 0;
    for x in points.iter_mut().flat_map(|p| p.iter_mut()) {
        if *x != 0.0 && x.abs() < 1e-20 * largest {
            *x = 0.0;
            count += 1;
        }
    }
    count
}
