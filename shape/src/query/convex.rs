//! Fast queries of convex polytopes: half-spaces and the farthest vertex in a direction.

use nalgebra::{Point3, Vector3, Vector4};

use crate::mesh::index::index;
use crate::mesh::measures::double_area;
use crate::mesh::topology::{Neighbours, neighbours};
use crate::mesh::triangle_mesh::TriangleMesh;

/// The faces of a convex mesh as half-spaces n·x ≤ d, stored (n, d), largest face first; triangles in one plane form
/// one face.
pub(crate) fn half_spaces(hull: &TriangleMesh) -> Vec<Vector4<f64>> {
    let across = neighbours(hull).unwrap_or_default();
    let reach = hull.vertices.iter().map(|v| v.coords.norm()).fold(0.0, f64::max);
    let areas: Vec<Vector3<f64>> = (0..hull.triangles.len())
        .map(|t| double_area(&hull.corners(t)))
        .collect();
    let mut order: Vec<usize> = (0..areas.len()).collect();
    order.sort_by(|&a, &b| {
        areas[b]
            .norm_squared()
            .total_cmp(&areas[a].norm_squared())
            .then(a.cmp(&b))
    });
    let mut used = vec![false; areas.len()];
    let mut faces = Vec::new();
    // The normal of a sliver is dominated by rounding; leaving it out enlarges the body by less than its width.
    let sliver = 1e-10 * reach * reach;
    for start in order {
        if !used[start] && areas[start].norm() > sliver {
            faces.push(face_from(start, hull, &across, &areas, &mut used, 1e-9 * reach));
        }
    }
    faces.sort_by(|a: &(f64, Vector4<f64>), b| b.0.total_cmp(&a.0));
    faces.into_iter().map(|(_, plane)| plane).collect()
}

/// Gathers the triangles about `start` whose corners lie within `tolerance` of its plane; returns twice their area and
/// their half-space.
fn face_from(
    start: usize,
    hull: &TriangleMesh,
    across: &Neighbours,
    areas: &[Vector3<f64>],
    used: &mut [bool],
    tolerance: f64,
) -> (f64, Vector4<f64>) {
    let normal = areas[start].normalize();
    let height = normal.dot(&hull.corners(start)[0].coords);
    used[start] = true;
    let mut face = vec![start];
    let mut next = 0;
    while let Some(&t) = face.get(next) {
        next += 1;
        for &other in across.get(t).into_iter().flatten() {
            let other = other as usize;
            let flat = || {
                hull.corners(other)
                    .iter()
                    .all(|p| (normal.dot(&p.coords) - height).abs() <= tolerance)
            };
            if !used[other] && areas[other].dot(&normal) >= 0.0 && flat() {
                used[other] = true;
                face.push(other);
            }
        }
    }
    let total: Vector3<f64> = face.iter().map(|&t| areas[t]).sum();
    let normal = total.normalize();
    let corners = face.iter().flat_map(|&t| hull.corners(t));
    let height = corners.map(|p| normal.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
    (total.norm(), Vector4::new(normal.x, normal.y, normal.z, height))
}

/// Finds the vertex of a convex mesh that is farthest in a direction.
#[derive(Clone, Debug)]
pub(crate) struct SupportMap {
    vertices: Vec<Point3<f64>>,
    /// `beside[starts[v]..starts[v + 1]]` are the vertices that share an edge with v; empty for few vertices.
    starts: Vec<u32>,
    beside: Vec<u32>,
    /// A starting vertex near the result for each cell of a cube of directions.
    guesses: Vec<u32>,
}

/// Up to this number of vertices, a scan of all of them is faster than walking.
const FEW: usize = 48;
/// Cells along an edge of the cube of directions.
const CELLS: usize = 8;

impl SupportMap {
    pub(crate) fn new(hull: &TriangleMesh) -> Self {
        let vertices = hull.vertices.clone();
        let mut map = Self {
            starts: vec![0; vertices.len() + 1],
            vertices,
            beside: Vec::new(),
            guesses: Vec::new(),
        };
        if map.vertices.len() <= FEW {
            return map;
        }
        let mut edges: Vec<(u32, u32)> = hull
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        for &(from, _) in &edges {
            map.starts[from as usize + 1] += 1;
        }
        for v in 1..map.starts.len() {
            map.starts[v] += map.starts[v - 1];
        }
        map.beside = edges.into_iter().map(|(_, to)| to).collect();
        let mut guess = 0;
        for cell in 0..6 * CELLS * CELLS {
            guess = map.climb(guess, &cell_direction(cell));
            map.guesses.push(guess);
        }
        map
    }

    /// The farthest vertex; any of them in a tie.
    pub(crate) fn support(&self, direction: &Vector3<f64>) -> Point3<f64> {
        if !self.guesses.is_empty() {
            return self.vertices[self.climb(self.guesses[direction_cell(direction)], direction) as usize];
        }
        let mut best = (f64::NEG_INFINITY, 0);
        for (i, v) in self.vertices.iter().enumerate() {
            let height = v.coords.dot(direction);
            if height > best.0 {
                best = (height, i);
            }
        }
        self.vertices[best.1]
    }

    /// Walks along edges to higher vertices; on a convex body the first maximum is the global one.
    fn climb(&self, from: u32, direction: &Vector3<f64>) -> u32 {
        let height = |v: u32| self.vertices[v as usize].coords.dot(direction);
        let mut best = (height(from), from);
        loop {
            let at = best.1 as usize;
            for &v in &self.beside[self.starts[at] as usize..self.starts[at + 1] as usize] {
                let h = height(v);
                if h > best.0 {
                    best = (h, v);
                }
            }
            if best.1 as usize == at {
                return index(at);
            }
        }
    }
}

/// Cell of a cube around the origin hit by a direction.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast saturates, and the cell is clamped"
)]
fn direction_cell(d: &Vector3<f64>) -> usize {
    let axis = d.iamax();
    let side = 2 * axis + usize::from(d[axis] < 0.0);
    let along = |k: usize| (((d[k] / d[axis].abs() + 1.0) * 0.5 * CELLS as f64) as usize).min(CELLS - 1);
    (side * CELLS + along((axis + 1) % 3)) * CELLS + along((axis + 2) % 3)
}

fn cell_direction(cell: usize) -> Vector3<f64> {
    let (side, i, j) = (cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS);
    let along = |i: usize| (i as f64 + 0.5) / CELLS as f64 * 2.0 - 1.0;
    let axis = side / 2;
    let mut d = Vector3::zeros();
    d[axis] = if side % 2 == 0 { 1.0 } else { -1.0 };
    d[(axis + 1) % 3] = along(i);
    d[(axis + 2) % 3] = along(j);
    d
}
