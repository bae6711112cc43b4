//! A closed mesh seen along one direction, and the planes across that direction.

use crate::contour_area::ContourArea;
use nalgebra::Vector3;
use stereology_shape::{ClosedMesh, Knots, SectionAreas};

/// A closed mesh about its centroid in units of its reach, with the triangles around every vertex.
pub(crate) struct Surface<'a> {
    vertices: Vec<Vector3<f64>>,
    pub(crate) triangles: &'a [[u32; 3]],
    /// Across edge k → k + 1 of each triangle.
    neighbours: &'a [[u32; 3]],
    /// Corners around vertex v: `around[starts[v]..starts[v + 1]]`, each 4 × triangle + corner.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// Vertices whose triangles form more than one fan.
    pub(crate) pinched: Vec<bool>,
    /// Volume in units of the reach cubed.
    pub(crate) volume: f64,
    /// All sections of a convex mesh; totals of any.
    pub(crate) totals: SectionAreas,
    pub(crate) convex: bool,
    /// The mesh's unit of length in ours.
    pub(crate) reach: f64,
}

impl<'a> Surface<'a> {
    pub(crate) fn new(mesh: &'a ClosedMesh) -> Self {
        let totals = SectionAreas::new(mesh);
        let reach = totals.reach();
        let vertices: Vec<Vector3<f64>> = mesh
            .vertices()
            .iter()
            .map(|vertex| (vertex - totals.centre()) / reach)
            .collect();
        let triangles = mesh.triangles();
        let mut surface = Self {
            vertices,
            triangles,
            neighbours: mesh.neighbours(),
            starts: Vec::new(),
            around: Vec::new(),
            pinched: Vec::new(),
            volume: mesh.volume() / reach.powi(3),
            totals,
            convex: mesh.is_convex(),
            reach,
        };
        surface.list_corners();
        surface.pinched = (0..surface.vertices.len()).map(|v| surface.is_pinched(v)).collect();
        surface
    }

    fn list_corners(&mut self) {
        self.starts = vec![0; self.vertices.len() + 1];
        for vertex in self.triangles.iter().flatten() {
            self.starts[*vertex as usize + 1] += 1;
        }
        for v in 1..self.starts.len() {
            self.starts[v] += self.starts[v - 1];
        }
        let mut next = self.starts.clone();
        self.around = vec![0; 3 * self.triangles.len()];
        for (triangle, corners) in (0_u32..).zip(self.triangles) {
            for (corner, &vertex) in (0_u32..).zip(corners) {
                self.around[next[vertex as usize] as usize] = 4 * triangle + corner;
                next[vertex as usize] += 1;
            }
        }
    }

    pub(crate) fn around(&self, vertex: u32) -> &[u32] {
        &self.around[self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize]
    }

    /// Whether a traversal of the triangles around the vertex returns to its start before all were visited.
    fn is_pinched(&self, vertex: usize) -> bool {
        let fan = &self.around[self.starts[vertex] as usize..self.starts[vertex + 1] as usize];
        let Some(&start) = fan.first() else { return false };
        let start = start / 4;
        let mut triangle = start;
        let mut steps = 0;
        loop {
            let corners = self.triangles[triangle as usize];
            let corner = corners.iter().position(|&v| v as usize == vertex).unwrap_or(0);
            triangle = self.neighbours[triangle as usize][corner];
            steps += 1;
            if triangle == start || steps > fan.len() {
                return steps != fan.len();
            }
        }
    }
}

/// A surface seen along one direction: heights of its vertices, and which corner of each triangle is the lowest.
pub(crate) struct View<'a> {
    pub(crate) surface: &'a Surface<'a>,
    axes: [Vector3<f64>; 2],
    pub(crate) knots: Knots,
    /// The [`Role`] of corners 0, 1, 2 of each triangle, two bits each.
    roles: Vec<u8>,
}

/// Whether a vertex is the lowest, middle or highest of a triangle.
pub(crate) type Role = u8;
pub(crate) const LOWEST: Role = 0;
pub(crate) const MIDDLE: Role = 1;
pub(crate) const HIGHEST: Role = 2;

impl<'a> View<'a> {
    pub(crate) fn new(surface: &'a Surface<'a>) -> Self {
        Self {
            surface,
            axes: [Vector3::x(), Vector3::y()],
            knots: Knots::default(),
            roles: vec![0; surface.triangles.len()],
        }
    }

    #[allow(clippy::float_cmp, reason = "equal heights are ordered by index")]
    pub(crate) fn place(&mut self, direction: &Vector3<f64>) {
        self.axes = plane_axes(direction);
        self.surface.totals.place(direction, &mut self.knots);
        for (roles, corners) in self.roles.iter_mut().zip(self.surface.triangles) {
            let [i, j, k] = corners.map(|v| v as usize);
            let [a, b, c] = [i, j, k].map(|v| self.knots.heights[v]);
            let lower = |p: f64, v: usize, q: f64, w: usize| u8::from(p < q || (p == q && v < w));
            let (ij, jk, ki) = (lower(a, i, b, j), lower(b, j, c, k), lower(c, k, a, i));
            // For each corner: how many of the other two are lower.
            *roles = ((1 - ij) + ki) | ((1 - jk) + ij) << 2 | ((1 - ki) + jk) << 4;
        }
    }

    pub(crate) fn role(&self, corner: u32) -> Role {
        self.roles[(corner / 4) as usize] >> (2 * (corner % 4)) & 3
    }

    /// The plane just below a vertex.
    pub(crate) fn plane_below(&self, vertex: u32) -> Plane<'_> {
        let height = self.knots.heights.get(vertex as usize).copied().unwrap_or(0.0);
        Plane {
            view: self,
            height,
            vertex,
        }
    }
}

/// A plane perpendicular to the direction, between two vertices of the order.
pub(crate) struct Plane<'a> {
    view: &'a View<'a>,
    /// Vertices at this height are below the plane if their index is below `vertex`.
    height: f64,
    vertex: u32,
}

impl Plane<'_> {
    pub(crate) fn at(self, height: f64) -> Self {
        Self { height, ..self }
    }

    #[allow(clippy::float_cmp, reason = "equal heights are ordered by index")]
    fn is_below(&self, vertex: u32) -> bool {
        let height = self.view.knots.heights[vertex as usize];
        height < self.height || (height == self.height && vertex < self.vertex)
    }

    /// The next triangle along the contour, the solid to the left, and the edge in between (lower, upper vertex).
    pub(crate) fn next(&self, triangle: u32) -> (u32, [u32; 2]) {
        let corners = self.view.surface.triangles[triangle as usize];
        let below = corners.map(|v| self.is_below(v));
        let rising = (0..3).find(|&k| below[k] && !below[(k + 1) % 3]).unwrap_or(0);
        (
            self.view.surface.neighbours[triangle as usize][rising],
            [corners[rising], corners[(rising + 1) % 3]],
        )
    }

    /// (x, y, height) of a vertex.
    fn placed(&self, vertex: u32) -> [f64; 3] {
        let position = &self.view.surface.vertices[vertex as usize];
        let [x, y] = &self.view.axes;
        [
            position.dot(x),
            position.dot(y),
            self.view.knots.heights[vertex as usize],
        ]
    }

    /// The corners of the contour through a triangle, at a height up to the next vertex.
    pub(crate) fn polygon(&self, start: u32, height: f64) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        let mut triangle = start;
        loop {
            let (next, [low, high]) = self.next(triangle);
            let (low, high) = (self.placed(low), self.placed(high));
            let t = if high[2] > low[2] {
                ((height - low[2]) / (high[2] - low[2])).clamp(0.0, 1.0)
            } else {
                0.5
            };
            points.push([low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1])]);
            triangle = next;
            // A traversal of a closed mesh always returns to its start; the bound guarantees that the loop ends.
            if triangle == start || points.len() > self.view.surface.triangles.len() {
                return points;
            }
        }
    }

    /// Adds the signed area between the axis and the segment that the plane cuts from a triangle.
    pub(crate) fn add_fan(&self, triangle: u32, area: &mut ContourArea) {
        let corners = self.view.surface.triangles[triangle as usize];
        let roles = self.view.roles[triangle as usize];
        let place = |role: Role| (0..3).find(|k| roles >> (2 * k) & 3 == role).unwrap_or(0);
        let (lowest, middle) = (place(LOWEST), place(MIDDLE));
        let [low, mid, high] = [lowest, middle, place(HIGHEST)].map(|k| self.placed(corners[k]));
        // Counter-clockwise seen from outside, the solid lies to the left of the step from the falling to the rising
        // edge.
        let sign = if (lowest + 1) % 3 == middle { 0.5 } else { -0.5 };
        let run = |from: [f64; 3], to: [f64; 3]| {
            let height = to[2] - from[2];
            [(to[0] - from[0]) / height, (to[1] - from[1]) / height]
        };
        // The segment runs from `apex + t a` to `apex + t b`.
        let (apex, b) = if self.is_below(corners[middle]) {
            (high, run(mid, high))
        } else {
            (low, run(low, mid))
        };
        let a = run(low, high);
        let t = self.height - apex[2];
        let square = sign * (a[0] * b[1] - a[1] * b[0]);
        let linear = sign * (apex[0] * (b[1] - a[1]) - apex[1] * (b[0] - a[0]));
        area.area += t * (linear + t * square);
        area.slope += linear + 2.0 * t * square;
        area.curvature += square;
    }
}

/// Two unit vectors that form a right-handed frame with the direction.
fn plane_axes(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut axis = Vector3::zeros();
    axis[direction.iamin()] = 1.0;
    let x = axis.cross(direction).normalize();
    [x, direction.cross(&x)]
}
