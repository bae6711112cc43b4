//! Refinement of meshes until they are fine enough for the relief (section 4.4: split triangles until the mesh is fine
//! enough).

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use stereology_shape::{Subdivision, TriangleMesh};

use crate::conversions::index;
use crate::error::MicrogeometryError;

/// Most triangles of a refined mesh.
pub const MOST_TRIANGLES: usize = 50_000_000;

/// The mesh with no edge longer than `edge_length`.
///
/// [`Subdivision::Midpoint`] splits the edges that are too long at their middles, and only those: the surface does not
/// change, and uneven meshes become even. [`Subdivision::Loop`] first smooths the whole mesh by Loop's scheme (borders
/// by their own rule) until the mean edge is short enough, then splits the edges that are still too long. Open meshes
/// and edges with any number of triangles are allowed. Cost: linear in the triangles that result.
///
/// # Errors
///
/// [`MicrogeometryError::Parameter`] if the length is not a positive number or would make more than [`MOST_TRIANGLES`].
///
/// # Examples
///
/// ```
/// use stereology_microgeometry::refined;
/// use stereology_shape::{Subdivision, TriangleMesh};
///
/// let bar = TriangleMesh::cuboid([8.0, 1.0, 1.0]);
/// let fine = refined(&bar, Subdivision::Midpoint, 0.5)?;
/// for t in &fine.triangles {
///     for k in 0..3 {
///         let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| fine.vertices[v as usize]);
///         assert!((a - b).norm() <= 0.5);
///     }
/// }
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn refined(mesh: &TriangleMesh, scheme: Subdivision, edge_length: f64) -> Result<TriangleMesh, MicrogeometryError> {
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return Err(MicrogeometryError::Parameter(format!(
            "the length of edges must be a positive finite number, not {edge_length}"
        )));
    }
    let mut mesh = mesh.clone();
    if scheme == Subdivision::Loop {
        while mean_edge(&mesh) > edge_length {
            check_count(4 * mesh.triangles.len(), edge_length)?;
            let edges = Edges::of(&mesh);
            let all = vec![true; edges.ends.len()];
            mesh = split(&mesh, &edges, &all, true);
        }
    }
    loop {
        let edges = Edges::of(&mesh);
        let long: Vec<bool> = edges
            .ends
            .iter()
            .map(|&[from, to]| (mesh.vertices[from as usize] - mesh.vertices[to as usize]).norm() > edge_length)
            .collect();
        let count = long.iter().filter(|long| **long).count();
        if count == 0 {
            return Ok(mesh);
        }
        check_count(mesh.triangles.len() + 2 * count, edge_length)?;
        mesh = split(&mesh, &edges, &long, false);
    }
}

fn check_count(triangles: usize, edge_length: f64) -> Result<(), MicrogeometryError> {
    if triangles > MOST_TRIANGLES {
        return Err(MicrogeometryError::Parameter(format!(
            "edges of {edge_length} would make more than {MOST_TRIANGLES} triangles: give a larger length"
        )));
    }
    Ok(())
}

fn mean_edge(mesh: &TriangleMesh) -> f64 {
    let lengths = mesh.triangles.iter().flat_map(|t| {
        [0, 1, 2].map(|k| (mesh.vertices[t[k] as usize] - mesh.vertices[t[(k + 1) % 3] as usize]).norm())
    });
    lengths.sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64
}

/// The edges of a mesh, in order of their vertices.
struct Edges {
    /// Lower vertex first.
    ends: Vec<[u32; 2]>,
    /// The edge from corner k of triangle t to the next, at 3 t + k.
    of_side: Vec<u32>,
}

impl Edges {
    /// Sorted by the lower vertex by counting, then each vertex's few edges among themselves.
    fn of(mesh: &TriangleMesh) -> Self {
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut starts = vec![0_u32; mesh.vertices.len() + 1];
        for [a, b] in sides() {
            starts[a.min(b) as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut upper = vec![(0_u32, 0_u32); 3 * mesh.triangles.len()];
        for (side, [a, b]) in sides().enumerate() {
            let place = &mut next[a.min(b) as usize];
            upper[*place as usize] = (a.max(b), index(side));
            *place += 1;
        }
        let mut made = Self {
            ends: Vec::with_capacity(upper.len() / 2),
            of_side: vec![0; upper.len()],
        };
        for (from, ends) in starts.windows(2).enumerate() {
            let of_vertex = &mut upper[ends[0] as usize..ends[1] as usize];
            of_vertex.sort_unstable();
            for same in of_vertex.chunk_by(|a, b| a.0 == b.0) {
                for &(_, side) in same {
                    made.of_side[side as usize] = index(made.ends.len());
                }
                made.ends.push([index(from), same[0].0]);
            }
        }
        made
    }

    /// The corners opposite to each edge, and how many triangles it has; with more than two of them, two.
    fn opposite(&self, mesh: &TriangleMesh) -> Vec<([u32; 2], u32)> {
        let mut opposite = vec![([0; 2], 0); self.ends.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (of, count) = &mut opposite[self.of_side[3 * t + k] as usize];
                of[(*count).min(1) as usize] = corners[(k + 2) % 3];
                *count += 1;
            }
        }
        opposite
    }
}

/// Splits the edges that are `chosen`; with `smooth` vertices move by Loop's rules (1987; borders by Hoppe 1994).
fn split(mesh: &TriangleMesh, edges: &Edges, chosen: &[bool], smooth: bool) -> TriangleMesh {
    let at = |v: u32| mesh.vertices[v as usize].coords;
    let opposite = if smooth { edges.opposite(mesh) } else { Vec::new() };
    let mut vertices = if smooth {
        smoothed(mesh, edges, &opposite)
    } else {
        mesh.vertices.clone()
    };
    let mut middles = vec![u32::MAX; edges.ends.len()];
    for (number, &[from, to]) in edges.ends.iter().enumerate().filter(|(number, _)| chosen[*number]) {
        let middle = match opposite.get(number) {
            Some(([c, d], 2)) => 0.375 * (at(from) + at(to)) + 0.125 * (at(*c) + at(*d)),
            _ => 0.5 * (at(from) + at(to)),
        };
        middles[number] = index(vertices.len());
        vertices.push(Point3::from(middle));
    }
    let mut triangles = Vec::with_capacity(mesh.triangles.len() + 2 * (vertices.len() - mesh.vertices.len()));
    for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let middle = |k: usize| Some(middles[edges.of_side[3 * t + k] as usize]).filter(|&m| m != u32::MAX);
        match [middle(0), middle(1), middle(2)] {
            [Some(ab), Some(bc), Some(ca)] => {
                triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            [None, None, None] => triangles.push([a, b, c]),
            [Some(m), None, None] => triangles.extend([[a, m, c], [m, b, c]]),
            [None, Some(m), None] => triangles.extend([[b, m, a], [m, c, a]]),
            [None, None, Some(m)] => triangles.extend([[c, m, b], [m, a, b]]),
            [Some(ab), Some(bc), None] => two_split(&vertices, &mut triangles, [a, ab, b, bc, c]),
            [None, Some(bc), Some(ca)] => two_split(&vertices, &mut triangles, [b, bc, c, ca, a]),
            [Some(ab), None, Some(ca)] => two_split(&vertices, &mut triangles, [c, ca, a, ab, b]),
        }
    }
    TriangleMesh { vertices, triangles }
}

/// A triangle a b c with midpoints on a b and b c: the corner at b, and the rest divided by its shorter diagonal.
fn two_split(vertices: &[Point3<f64>], triangles: &mut Vec<[u32; 3]>, [a, ab, b, bc, c]: [u32; 5]) {
    let length = |i: u32, j: u32| (vertices[i as usize] - vertices[j as usize]).norm_squared();
    triangles.push([ab, b, bc]);
    if length(a, bc) <= length(ab, c) {
        triangles.extend([[a, ab, bc], [a, bc, c]]);
    } else {
        triangles.extend([[a, ab, c], [ab, bc, c]]);
    }
}

/// Vertices moved towards their neighbours by Loop's weight; on borders along the border only.
fn smoothed(mesh: &TriangleMesh, edges: &Edges, opposite: &[([u32; 2], u32)]) -> Vec<Point3<f64>> {
    let zero = (Vector3::zeros(), 0_u32);
    let (mut inner, mut border) = (vec![zero; mesh.vertices.len()], vec![zero; mesh.vertices.len()]);
    for (&[a, b], (_, triangles)) in edges.ends.iter().zip(opposite) {
        let sums = if *triangles == 2 { &mut inner } else { &mut border };
        for (to, from) in [(a, b), (b, a)] {
            sums[to as usize].0 += mesh.vertices[from as usize].coords;
            sums[to as usize].1 += 1;
        }
    }
    let place = |(v, p): (usize, &Point3<f64>)| match (inner[v], border[v]) {
        (_, (sum, 2)) => Point3::from(0.75 * p.coords + 0.125 * sum),
        ((sum, count @ 1..), (_, 0)) => {
            let n = f64::from(count.max(3));
            let weight = 0.625 - (0.375 + 0.25 * (TAU / n).cos()).powi(2);
            Point3::from(p.coords * (1.0 - weight) + sum * (weight / f64::from(count)))
        }
        // Vertices where several borders meet, and those that no triangle uses.
        _ => *p,
    };
    mesh.vertices.iter().enumerate().map(place).collect()
}
