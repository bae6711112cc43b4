//! How many triangles meet at each edge.

use stereology_shape::TriangleMesh;

/// Numbers of edges that are not those of a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeCensus {
    /// Edges of one triangle: the mesh is open there.
    pub border: usize,
    /// Edges of more than two triangles.
    pub crowded: usize,
}

impl EdgeCensus {
    /// Counts the edges of a mesh. Cost: n log n.
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
        let mut edges: Vec<(u32, u32)> = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        edges.sort_unstable();
        let mut census = Self { border: 0, crowded: 0 };
        for same in edges.chunk_by(|a, b| a == b) {
            match same.len() {
                1 => census.border += 1,
                2 => {}
                _ => census.crowded += 1,
            }
        }
        census
    }
}
