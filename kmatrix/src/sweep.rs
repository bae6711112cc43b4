//! All sections across one direction at once: a sweep over the sorted vertices of a closed mesh.
//!
//! Between two vertices of a contour its area is a quadratic of the height. Near a vertex the section changes by a polygon as large as the
//! distance from it, so area and slope are continuous there and only the curvature jumps, by a sum over the triangles around the vertex.
//! A contour is therefore three numbers that every vertex on it moves on; only where contours split or merge are they walked around anew.

use crate::contours::{Contours, State};
use crate::depth_measure::DepthMeasure;
use nalgebra::Vector3;
use stereology_shape::{ClosedMesh, Knots, SectionAreas};

/// A sweep whose areas do not add up to the volume to this part was spoilt by an edge that is all but level: it is repeated a hair aside.
const MOST_DEFECT: f64 = 1e-7;
/// How far aside, and how often, before the mesh itself must be at fault.
const ASIDE: f64 = 1e-8;
const ATTEMPTS: i32 = 4;

/// A closed mesh about its centroid in units of its reach, with the triangles around every vertex.
pub(crate) struct Surface<'a> {
    vertices: Vec<Vector3<f64>>,
    triangles: &'a [[u32; 3]],
    /// Across edge k → k + 1 of each triangle.
    neighbours: &'a [[u32; 3]],
    /// Corners around vertex v: `around[starts[v]..starts[v + 1]]`, each 4 × triangle + corner.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// Vertices whose triangles form more than one fan.
    pinched: Vec<bool>,
    /// Volume in units of the reach cubed.
    volume: f64,
    /// All sections of a convex mesh; totals of any.
    totals: SectionAreas,
    convex: bool,
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

    fn around(&self, vertex: u32) -> &[u32] {
        &self.around[self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize]
    }

    /// Whether walking from triangle to triangle around the vertex comes back before all were seen.
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

/// One direction's view of a surface. Kept between directions.
pub(crate) struct Sweep<'a> {
    surface: &'a Surface<'a>,
    totals: SectionAreas,
    axes: [Vector3<f64>; 2],
    knots: Knots,
    /// What its corners 0, 1, 2 are to each triangle: two bits of a [`Role`] each.
    roles: Vec<u8>,
    contours: Contours,
}

/// What a vertex is to a triangle around it.
type Role = u8;
const LOWEST: Role = 0;
const MIDDLE: Role = 1;
const HIGHEST: Role = 2;

impl<'a> Sweep<'a> {
    pub(crate) fn new(surface: &'a Surface<'a>) -> Self {
        Self {
            surface,
            totals: surface.totals.clone(),
            axes: [Vector3::x(), Vector3::y()],
            knots: Knots::default(),
            roles: vec![0; surface.triangles.len()],
            contours: Contours::default(),
        }
    }

    /// Adds all sections across `direction` (a unit vector) to `measure`, in units of the surface's reach.
    pub(crate) fn run(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) {
        let mut direction = *direction;
        for attempt in 0..=ATTEMPTS {
            measure.begin();
            let defect = if self.surface.convex {
                self.sweep_convex(&direction, measure)
            } else {
                self.sweep_contours(&direction, measure)
            };
            // Very thin bodies have volumes that rounding alone spoils: their sections count as they are.
            if defect <= MOST_DEFECT || (attempt == ATTEMPTS && defect.is_finite()) {
                break;
            }
            measure.undo();
            let aside = Vector3::new(0.36, -0.48, 0.8) * (ASIDE * 10.0_f64.powi(attempt));
            direction = (direction + aside).normalize();
        }
    }

    fn sweep_convex(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) -> f64 {
        self.totals
            .sweep(direction, |low, high, area| measure.add_section(area, high - low))
    }

    fn sweep_contours(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) -> f64 {
        let before = measure.moments.area;
        self.place(direction);
        let mut contours = std::mem::take(&mut self.contours);
        contours.restart(self.surface.triangles.len());
        let mut total = State::default();
        let mut below = f64::INFINITY;
        for i in 0..self.knots.order.len() {
            let vertex = self.knots.order[i];
            let height = self.knots.heights[vertex as usize];
            if height > below {
                measure.add_total([total.area, total.slope, total.curvature], height - below);
                total.advance(height - below);
                if contours.have_changed() {
                    contours.find_holes(&self.plane_below(vertex), below, 0.5 * (below + height));
                }
            }
            below = height;
            total.curvature += self.knots.jumps[vertex as usize];
            self.pass(vertex, &mut contours, measure);
        }
        self.contours = contours;
        ((measure.moments.area - before) / self.surface.volume - 1.0).abs()
    }

    #[allow(clippy::float_cmp, reason = "level to the last bit: then the index decides")]
    fn place(&mut self, direction: &Vector3<f64>) {
        self.axes = plane_axes(direction);
        self.surface.totals.place(direction, &mut self.knots);
        for (roles, corners) in self.roles.iter_mut().zip(self.surface.triangles) {
            let [i, j, k] = corners.map(|v| v as usize);
            let [a, b, c] = [i, j, k].map(|v| self.knots.heights[v]);
            let lower = |p: f64, v: usize, q: f64, w: usize| u8::from(p < q || (p == q && v < w));
            let (ij, jk, ki) = (lower(a, i, b, j), lower(b, j, c, k), lower(c, k, a, i));
            // How many of the other two are below each.
            *roles = ((1 - ij) + ki) | ((1 - jk) + ij) << 2 | ((1 - ki) + jk) << 4;
        }
    }

    fn role(&self, corner: u32) -> Role {
        self.roles[(corner / 4) as usize] >> (2 * (corner % 4)) & 3
    }

    /// Moves the section from just below a vertex to just above it.
    fn pass(&mut self, vertex: u32, contours: &mut Contours, measure: &mut DepthMeasure) {
        let surface = self.surface;
        let fan = surface.around(vertex);
        let (height, jump) = (self.knots.heights[vertex as usize], self.knots.jumps[vertex as usize]);
        let mut counts = [0_u32; 4];
        let mut cut = None;
        for &corner in fan {
            let role = self.role(corner);
            counts[role as usize] += 1;
            if role != LOWEST {
                cut = Some(corner / 4);
            }
        }
        // Around the vertex the height passes its own as often as it is the middle of a triangle: 0 is an extremum, 2 a regular vertex,
        // more a saddle.
        let simple = !surface.pinched[vertex as usize];
        match (counts[MIDDLE as usize], cut) {
            (2, Some(cut)) if simple => {
                let contour = contours.of(cut);
                contours.bend(contour, height, jump, measure);
                // Those it is the middle of, too: a contour remembers a triangle that is still cut.
                for &corner in fan {
                    if self.role(corner) != HIGHEST {
                        contours.assign(corner / 4, contour);
                    }
                }
            }
            (0, None) if simple => {
                contours.settle(height, measure);
                let state = State {
                    curvature: jump,
                    ..State::default()
                };
                let contour = contours.begin(height, state);
                for &corner in fan {
                    contours.assign(corner / 4, contour);
                }
            }
            (0, Some(cut)) if simple && counts[LOWEST as usize] == 0 => {
                contours.settle(height, measure);
                contours.end(contours.of(cut));
            }
            _ => {
                contours.settle(height, measure);
                self.retrace(vertex, contours);
            }
        }
    }

    /// Contours split or merge: those through the vertex end, and what leaves it is walked around anew.
    fn retrace(&mut self, vertex: u32, contours: &mut Contours) {
        let fan = self.surface.around(vertex);
        for &corner in fan {
            if self.role(corner) != LOWEST {
                contours.end(contours.of(corner / 4));
            }
            contours.release(corner / 4);
        }
        let height = self.knots.heights[vertex as usize];
        let plane = self.plane_below(vertex + 1).at(height);
        for &corner in fan {
            let start = corner / 4;
            if self.role(corner) == HIGHEST || contours.is_assigned(start) {
                continue;
            }
            let contour = contours.begin(height, State::default());
            let mut state = State::default();
            let mut triangle = start;
            loop {
                contours.assign(triangle, contour);
                plane.add_fan(triangle, &mut state);
                triangle = plane.next(triangle).0;
                if triangle == start {
                    break;
                }
            }
            contours.set_state(contour, state);
        }
    }

    /// The plane just below a vertex.
    fn plane_below(&self, vertex: u32) -> Plane<'_> {
        let height = self.knots.heights.get(vertex as usize).copied().unwrap_or(0.0);
        Plane {
            sweep: self,
            height,
            vertex,
        }
    }
}

/// A plane across the direction, between two vertices of the order.
pub(crate) struct Plane<'a> {
    sweep: &'a Sweep<'a>,
    /// Vertices at this height are below the plane if their index is below `vertex`.
    height: f64,
    vertex: u32,
}

impl Plane<'_> {
    fn at(self, height: f64) -> Self {
        Self { height, ..self }
    }

    #[allow(clippy::float_cmp, reason = "level to the last bit: then the index decides")]
    fn is_below(&self, vertex: u32) -> bool {
        let height = self.sweep.knots.heights[vertex as usize];
        height < self.height || (height == self.height && vertex < self.vertex)
    }

    /// The next triangle along the contour, the solid to the left, and the edge in between (lower, upper vertex).
    pub(crate) fn next(&self, triangle: u32) -> (u32, [u32; 2]) {
        let corners = self.sweep.surface.triangles[triangle as usize];
        let below = corners.map(|v| self.is_below(v));
        let rising = (0..3).find(|&k| below[k] && !below[(k + 1) % 3]).unwrap_or(0);
        (
            self.sweep.surface.neighbours[triangle as usize][rising],
            [corners[rising], corners[(rising + 1) % 3]],
        )
    }

    /// (x, y, height) of a vertex.
    fn placed(&self, vertex: u32) -> [f64; 3] {
        let position = &self.sweep.surface.vertices[vertex as usize];
        let [x, y] = &self.sweep.axes;
        [
            position.dot(x),
            position.dot(y),
            self.sweep.knots.heights[vertex as usize],
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
            // A walk around a closed mesh always comes back; the bound says so to the machine.
            if triangle == start || points.len() > self.sweep.surface.triangles.len() {
                return points;
            }
        }
    }

    /// Adds the signed area between the axis and the segment that the plane cuts from a triangle.
    fn add_fan(&self, triangle: u32, state: &mut State) {
        let corners = self.sweep.surface.triangles[triangle as usize];
        let roles = self.sweep.roles[triangle as usize];
        let place = |role: Role| (0..3).find(|k| roles >> (2 * k) & 3 == role).unwrap_or(0);
        let (lowest, middle) = (place(LOWEST), place(MIDDLE));
        let [low, mid, high] = [lowest, middle, place(HIGHEST)].map(|k| self.placed(corners[k]));
        // Counter-clockwise seen from outside, the solid lies to the left of the step from the falling to the rising edge.
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
        state.area += t * (linear + t * square);
        state.slope += linear + 2.0 * t * square;
        state.curvature += square;
    }
}

/// Two unit vectors that make a right-handed frame with the direction.
fn plane_axes(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut axis = Vector3::zeros();
    axis[direction.iamin()] = 1.0;
    let x = axis.cross(direction).normalize();
    [x, direction.cross(&x)]
}
