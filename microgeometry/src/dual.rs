//! Distances over a mesh: the dual graph, whose nodes are the triangles' centroids.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use stereology_shape::TriangleMesh;

use crate::conversions::{index, single};
use crate::error::MicrogeometryError;
use crate::wavefront::Wavefront;

/// Which triangles are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adjacency {
    /// Triangles that share a vertex: lengths of paths are 1.01 to 1.03 times those over the smooth surface.
    #[default]
    Vertices,
    /// Triangles that share an edge, as in the paper (section 4.2): paths zigzag and are 1.2 to 1.3 times too long,
    /// over slivers up to 4 times.
    Edges,
}

/// How the length of a step from centroid to centroid is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Metric {
    /// By its Euclidean length, as in the paper.
    #[default]
    Isotropic,
    /// By √(eᵀ M e) with a symmetric positive definite M: steps along the directions that M stretches are longer, so
    /// structures are narrower there.
    Tensor(Matrix3<f64>),
}

impl Metric {
    /// Structures `stretch` times as long along `axis` as across it, with the same area.
    ///
    /// Lengths along the axis are divided by √stretch, lengths across it multiplied by it; so distances are squared
    /// lengths M = a aᵀ/stretch + (1 − a aᵀ) stretch.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::Metric`] if the axis is not a direction or the stretch not a positive number.
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use stereology_microgeometry::Metric;
    ///
    /// let fibres = Metric::along(Vector3::z(), 4.0)?;
    /// assert!((fibres.length(&Vector3::z()) - 0.5).abs() < 1e-12);
    /// assert!((fibres.length(&Vector3::x()) - 2.0).abs() < 1e-12);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    pub fn along(axis: Vector3<f64>, stretch: f64) -> Result<Self, MicrogeometryError> {
        let direction = axis.try_normalize(0.0).filter(|d| d.norm().is_finite());
        match direction {
            Some(d) if stretch.is_finite() && stretch > 0.0 => {
                let along = d * d.transpose();
                Ok(Self::Tensor(along / stretch + (Matrix3::identity() - along) * stretch))
            }
            _ => Err(MicrogeometryError::Metric),
        }
    }

    /// Length of a step.
    #[must_use]
    pub fn length(&self, step: &Vector3<f64>) -> f64 {
        match self {
            Self::Isotropic => step.norm(),
            Self::Tensor(m) => step.dot(&(m * step)).max(0.0).sqrt(),
        }
    }

    fn check(&self) -> Result<(), MicrogeometryError> {
        match self {
            Self::Tensor(m) if (m - m.transpose()).amax() > 1e-9 * m.amax() || m.cholesky().is_none() => {
                Err(MicrogeometryError::Metric)
            }
            _ => Ok(()),
        }
    }
}

/// The dual of a mesh: one node per triangle, and edges between neighbours, as long as the step between their
/// centroids.
///
/// Distances over the surface are shortest paths in it (section 4.2 of the paper). |xₐ − x_b| ≤ w on every edge is
/// equivalent to |xₐ − x_b| ≤ d(a, b) for all pairs, because paths are sums of edges.
///
/// # Examples
///
/// ```
/// use stereology_microgeometry::{Adjacency, DualGraph, Metric};
/// use stereology_shape::TriangleMesh;
///
/// let ball = TriangleMesh::icosphere(2.0, 3);
/// let edges = DualGraph::new(&ball, Adjacency::Edges, Metric::Isotropic)?;
/// assert!((0..1280).all(|t| edges.neighbours(t).count() == 3));
/// let corners = DualGraph::new(&ball, Adjacency::Vertices, Metric::Isotropic)?;
/// assert!((0..1280).all(|t| (11..=12).contains(&corners.neighbours(t).count())));
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DualGraph {
    /// Where the neighbours of each triangle begin.
    starts: Vec<u32>,
    links: Vec<Link>,
    areas: Vec<f64>,
    components: Vec<Vec<u32>>,
    mean_length: f64,
}

/// A step to a neighbour. Its length is rounded down to single precision, so that graphs need half the memory and
/// labels never differ by more than the exact length; sums are in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    length: f32,
    pub(crate) to: u32,
}

impl Link {
    pub(crate) fn length(self) -> f64 {
        f64::from(self.length)
    }
}

/// The largest number of single precision that does not exceed a finite length.
pub(crate) fn rounded_down(length: f64) -> f32 {
    let near = single(length);
    if f64::from(near) > length {
        near.next_down()
    } else {
        near
    }
}

/// More steps than this do not fit into memory: 2 GB.
const MOST_LINKS: usize = 1 << 28;
/// Coordinates are below this, so that squares of areas are numbers.
const LARGEST: f64 = 1e60;
/// Triangles per task.
const BLOCK: usize = 8192;

impl DualGraph {
    /// The dual of any triangles, open or not. Vertices at equal positions should have been welded. Cost: linear in
    /// triangles (times their number around a vertex).
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError`] if there are fewer than two triangles, an index is out of range, a vertex is not finite,
    /// no triangle has an area, the metric is not positive, or some vertex has so many triangles that the graph does
    /// not fit.
    pub fn new(mesh: &TriangleMesh, adjacency: Adjacency, metric: Metric) -> Result<Self, MicrogeometryError> {
        check(mesh)?;
        metric.check()?;
        let corners = |t: usize| mesh.triangles[t].map(|i| mesh.vertices[i as usize]);
        let count = mesh.triangles.len();
        let centroids: Vec<Point3<f64>> = (0..count)
            .into_par_iter()
            .map(|t| {
                let [a, b, c] = corners(t);
                Point3::from((a.coords + b.coords + c.coords) / 3.0)
            })
            .collect();
        let areas: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|t| {
                let [a, b, c] = corners(t);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .collect();
        if areas.iter().sum::<f64>() <= 0.0 {
            return Err(MicrogeometryError::NoArea);
        }
        let around = Around::new(mesh);
        let crowd: usize = around.sizes().map(|n| n.saturating_mul(n)).sum();
        if crowd > MOST_LINKS {
            return Err(MicrogeometryError::Crowded {
                most: around.sizes().max().unwrap_or_default(),
            });
        }
        let numbers: Vec<u32> = (0..index(count)).collect();
        let blocks: Vec<(Vec<u32>, Vec<Link>)> = numbers
            .par_chunks(BLOCK)
            .map(|block| {
                let (mut sizes, mut links, mut near) = (Vec::with_capacity(block.len()), Vec::new(), Vec::new());
                for &t in block {
                    around.neighbours(&mesh.triangles[t as usize], t, adjacency, &mut near);
                    sizes.push(index(near.len()));
                    links.extend(near.iter().map(|&to| Link {
                        // The same bits from both ends: the lower triangle first.
                        length: rounded_down(
                            metric.length(&(centroids[t.max(to) as usize] - centroids[t.min(to) as usize])),
                        ),
                        to,
                    }));
                }
                (sizes, links)
            })
            .collect();
        let mut starts = Vec::with_capacity(count + 1);
        let mut links = Vec::with_capacity(blocks.iter().map(|(_, links)| links.len()).sum());
        starts.push(0_u32);
        for (sizes, of_block) in blocks {
            for size in sizes {
                starts.push(starts[starts.len() - 1] + size);
            }
            links.extend(of_block);
        }
        Ok(Self::finished(starts, links, areas))
    }

    /// A graph of these areas and steps: from, to, length; both ways, in order.
    pub(crate) fn between(areas: Vec<f64>, steps: &[(u32, u32, f32)]) -> Self {
        let mut starts = vec![0_u32; areas.len() + 1];
        for step in steps {
            starts[step.0 as usize + 1] += 1;
        }
        for node in 1..starts.len() {
            starts[node] += starts[node - 1];
        }
        let links = steps.iter().map(|&(_, to, length)| Link { length, to }).collect();
        Self::finished(starts, links, areas)
    }

    fn finished(starts: Vec<u32>, links: Vec<Link>, areas: Vec<f64>) -> Self {
        let mean_length = links.iter().map(|link| link.length()).sum::<f64>() / links.len().max(1) as f64;
        let mut graph = Self {
            starts,
            links,
            areas,
            components: Vec::new(),
            mean_length,
        };
        graph.components = graph.connected();
        graph
    }

    /// How many triangles there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Always false: a graph has at least two triangles.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// The neighbours of triangle `t` and the distances of their centroids.
    pub fn neighbours(&self, t: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.links(t).iter().map(|link| (link.to as usize, link.length()))
    }

    /// Areas of the triangles.
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// The connected components, each a list of triangles, in order of their lowest triangle.
    #[must_use]
    pub fn components(&self) -> &[Vec<u32>] {
        &self.components
    }

    /// Mean length of an edge.
    #[must_use]
    pub fn mean_length(&self) -> f64 {
        self.mean_length
    }

    /// Distances over the graph from some triangles, each with an initial distance; infinite where no path leads. Cost:
    /// Dijkstra's, n log n.
    ///
    /// ```
    /// use stereology_microgeometry::{Adjacency, DualGraph, Metric};
    /// use stereology_shape::TriangleMesh;
    ///
    /// let graph = DualGraph::new(&TriangleMesh::icosphere(2.0, 4), Adjacency::Vertices, Metric::Isotropic)?;
    /// let farthest = graph.distances(&[(0, 0.0)]).into_iter().fold(0.0, f64::max);
    /// assert!((farthest / std::f64::consts::PI - 1.0).abs() < 0.05); // half a great circle of the unit sphere
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    #[must_use]
    pub fn distances(&self, from: &[(usize, f64)]) -> Vec<f64> {
        let mut negated = vec![f64::NEG_INFINITY; self.len()];
        for &(t, d) in from {
            negated[t] = negated[t].max(-d);
        }
        let sources: Vec<(u32, f64)> = from.iter().map(|&(t, _)| (index(t), negated[t])).collect();
        spread(self, &mut negated, &sources);
        negated.into_iter().map(|d| -d).collect()
    }

    pub(crate) fn links(&self, t: usize) -> &[Link] {
        &self.links[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    fn connected(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.len()];
        let mut pieces = Vec::new();
        for start in 0..self.len() {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            let mut piece = vec![index(start)];
            let mut next = 0;
            while let Some(&t) = piece.get(next) {
                next += 1;
                for link in self.links(t as usize) {
                    if !std::mem::replace(&mut seen[link.to as usize], true) {
                        piece.push(link.to);
                    }
                }
            }
            piece.sort_unstable();
            pieces.push(piece);
        }
        pieces
    }
}

/// Raises `bound` to max over the sources of (value − distance), everywhere: exact. Sources must have their values
/// already.
pub(crate) fn spread(graph: &DualGraph, bound: &mut [f64], sources: &[(u32, f64)]) {
    let mut front = Wavefront::new(0.5 * graph.mean_length());
    front.restart(sources.iter().fold(f64::NEG_INFINITY, |most, of| most.max(of.1)));
    for &(t, value) in sources {
        front.push(value, t);
    }
    while let Some((value, t)) = front.pop() {
        if value < bound[t as usize] {
            continue;
        }
        for link in graph.links(t as usize) {
            let there = value - link.length();
            if there > bound[link.to as usize] {
                bound[link.to as usize] = there;
                front.push(there, link.to);
            }
        }
    }
}

/// The triangles around each vertex.
struct Around {
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

impl Around {
    fn new(mesh: &TriangleMesh) -> Self {
        let mut starts = vec![0_usize; mesh.vertices.len() + 1];
        for &v in mesh.triangles.iter().flatten() {
            starts[v as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; 3 * mesh.triangles.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                triangles[next[v as usize]] = index(t);
                next[v as usize] += 1;
            }
        }
        Self { starts, triangles }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.triangles[self.starts[v as usize]..self.starts[v as usize + 1]]
    }

    fn sizes(&self) -> impl Iterator<Item = usize> + '_ {
        self.starts.windows(2).map(|pair| pair[1] - pair[0])
    }

    /// Fills `near` with the neighbours of `t`, in order.
    fn neighbours(&self, corners: &[u32; 3], t: u32, adjacency: Adjacency, near: &mut Vec<u32>) {
        near.clear();
        near.extend(corners.iter().flat_map(|&v| self.of(v)).filter(|&&s| s != t));
        near.sort_unstable();
        if adjacency == Adjacency::Edges {
            // Triangles that share an edge share two vertices.
            let mut last = u32::MAX;
            let mut kept = 0;
            for i in 0..near.len() {
                let again = i > 0 && near[i] == near[i - 1];
                if again && last != near[i] {
                    last = near[i];
                    near[kept] = last;
                    kept += 1;
                }
            }
            near.truncate(kept);
        } else {
            near.dedup();
        }
    }
}

fn check(mesh: &TriangleMesh) -> Result<(), MicrogeometryError> {
    let vertices = mesh.vertices.len();
    if mesh.triangles.len() < 2 {
        return Err(MicrogeometryError::TooFewTriangles {
            triangles: mesh.triangles.len(),
        });
    }
    let beyond = |t: &[u32; 3]| t.iter().any(|&i| i as usize >= vertices);
    if let Some(triangle) = mesh.triangles.iter().position(beyond) {
        return Err(MicrogeometryError::Index { triangle, vertices });
    }
    match mesh.vertices.iter().position(|p| !p.iter().all(|x| x.abs() < LARGEST)) {
        Some(vertex) => Err(MicrogeometryError::NotFinite { vertex }),
        None => Ok(()),
    }
}
