//! Edges by the number of their triangles.

use stereology_shape::TriangleMesh;

/// Numbers of edges that a closed surface does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeCensus {
    /// Edges of one triangle: the mesh is open there.
    pub border: usize,
    /// Edges of more than two triangles.
    pub crowded: usize,
}

impl EdgeCensus {
    /// Counts the edges of a mesh, whose indices must be in range. Cost: linear.
    ///
    /// ```
    /// use stereology_microgeometry::EdgeCensus;
    /// use stereology_shape::TriangleMesh;
    ///
    /// let mut cube = TriangleMesh::cuboid([1.0; 3]);
    /// assert_eq!(EdgeCensus::of(&cube), EdgeCensus { border: 0, crowded: 0 });
    /// cube.triangles.pop();
    /// assert_eq!(EdgeCensus::of(&cube), EdgeCensus { border: 3, crowded: 0 });
    /// ```
    #[must_use]
    pub fn of(mesh: &TriangleMesh) -> Self {
        // Sorted by the lower vertex by counting, then each vertex's few edges among themselves.
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let mut starts = vec![0_usize; mesh.vertices.len() + 1];
        for (a, b) in sides() {
            starts[a.min(b) as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut upper = vec![0; 3 * mesh.triangles.len()];
        for (a, b) in sides() {
            let place = &mut next[a.min(b) as usize];
            upper[*place] = a.max(b);
            *place += 1;
        }
        let mut census = Self { border: 0, crowded: 0 };
        for ends in starts.windows(2) {
            let of_vertex = &mut upper[ends[0]..ends[1]];
            of_vertex.sort_unstable();
            for same in of_vertex.chunk_by(|a, b| a == b) {
                match same.len() {
                    1 => census.border += 1,
                    2 => {}
                    _ => census.crowded += 1,
                }
            }
        }
        census
    }
}
