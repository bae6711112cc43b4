//! All sections across one direction at once: a sweep over the sorted vertices of a closed mesh.
//!
//! Between two consecutive vertex heights the section keeps its topology and every contour's area is a quadratic in the height: each triangle
//! cut adds the area of the fan from the axis to its segment. A vertex changes only the triangles around it.

use crate::contours::Contours;
use crate::depth_measure::{DepthMeasure, Quadratic};
use nalgebra::Vector3;
use stereology_shape::ClosedMesh;

/// Heights are rounded to this part of the body's reach: rounding errors of nearly horizontal triangles (1 / Δh²) and of the heights balance.
const HEIGHT_STEPS: f64 = (1_u64 << 26) as f64;

/// A closed mesh about its centroid in units of its reach, with the triangles around every vertex.
pub(crate) struct Surface<'a> {
    vertices: Vec<Vector3<f64>>,
    pub(crate) triangles: &'a [[u32; 3]],
    /// Across edge k → k + 1 of each triangle.
    pub(crate) neighbours: &'a [[u32; 3]],
    /// Triangles around vertex v: `around[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// Vertices whose triangles form more than one fan.
    pinched: Vec<bool>,
    convex: bool,
    /// The mesh's unit of length in ours.
    pub(crate) reach: f64,
}

impl<'a> Surface<'a> {
    pub(crate) fn new(mesh: &'a ClosedMesh) -> Self {
        let centre = mesh.centroid();
        let offsets: Vec<Vector3<f64>> = mesh.vertices().iter().map(|vertex| vertex - centre).collect();
        let reach = offsets.iter().map(Vector3::norm).fold(0.0, f64::max);
        let triangles = mesh.triangles();
        let mut starts = vec![0_u32; offsets.len() + 1];
        for vertex in triangles.iter().flatten() {
            starts[*vertex as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut around = vec![0; 3 * triangles.len()];
        for (triangle, corners) in (0_u32..).zip(triangles) {
            for &vertex in corners {
                around[next[vertex as usize] as usize] = triangle;
                next[vertex as usize] += 1;
            }
        }
        let mut surface = Self {
            vertices: offsets.iter().map(|offset| offset / reach).collect(),
            triangles,
            neighbours: mesh.neighbours(),
            starts,
            around,
            pinched: Vec::new(),
            convex: mesh.is_convex(),
            reach,
        };
        surface.pinched = (0..surface.vertices.len()).map(|v| surface.is_pinched(v)).collect();
        surface
    }

    fn around(&self, vertex: usize) -> &[u32] {
        &self.around[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    /// Whether walking from triangle to triangle around the vertex comes back before all were seen.
    fn is_pinched(&self, vertex: usize) -> bool {
        let fan = self.around(vertex);
        let Some(&start) = fan.first() else { return false };
        let mut triangle = start;
        let mut steps = 0;
        loop {
            let corner = self.corner(triangle, vertex);
            triangle = self.neighbours[triangle as usize][corner];
            steps += 1;
            if triangle == start || steps > fan.len() {
                return steps != fan.len();
            }
        }
    }

    /// Which corner (0, 1, 2) of the triangle the vertex is.
    fn corner(&self, triangle: u32, vertex: usize) -> usize {
        self.triangles[triangle as usize]
            .iter()
            .position(|&v| v as usize == vertex)
            .unwrap_or(0)
    }
}

/// One direction's view of a surface: heights, order, position in the plane, and the quadratics of the triangles. Kept between directions.
#[derive(Default)]
pub(crate) struct Sweep {
    order: Vec<u64>,
    rank: Vec<u32>,
    /// (x, y, height) of each vertex.
    pub(crate) placed: Vec<[f64; 3]>,
    /// Quadratics of each triangle below and above its middle vertex.
    pieces: Vec<[[f64; 3]; 2]>,
    contours: Contours,
}

/// What a vertex is to a triangle around it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Lowest,
    Middle,
    Highest,
}

impl Sweep {
    /// Adds all sections across `direction` (a unit vector) to `measure`, in units of the surface's reach.
    pub(crate) fn run(&mut self, surface: &Surface<'_>, direction: &Vector3<f64>, measure: &mut DepthMeasure) {
        self.place(surface, direction);
        if surface.convex {
            self.sweep_convex(surface, measure);
        } else {
            self.sweep_contours(surface, measure);
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Heights are within ±1: steps fit into 28 bits; indices are u32 already.
    fn place(&mut self, surface: &Surface<'_>, direction: &Vector3<f64>) {
        let [x, y] = plane_axes(direction);
        self.placed.clear();
        self.order.clear();
        for (v, vertex) in surface.vertices.iter().enumerate() {
            let step = (vertex.dot(direction) * HEIGHT_STEPS).round();
            self.placed.push([vertex.dot(&x), vertex.dot(&y), step / HEIGHT_STEPS]);
            self.order.push((((step + 2.0 * HEIGHT_STEPS) as u64) << 32) | v as u64);
        }
        // By height, then by index: a total order, so that level vertices are no special case.
        self.order.sort_unstable();
        self.rank.clear();
        self.rank.resize(self.order.len(), 0);
        for (rank, key) in (0_u32..).zip(&self.order) {
            self.rank[(key & 0xffff_ffff) as usize] = rank;
        }
        self.pieces.clear();
        self.pieces.resize(surface.triangles.len(), [[0.0; 3]; 2]);
    }

    fn sweep_convex(&mut self, surface: &Surface<'_>, measure: &mut DepthMeasure) {
        let mut area = Quadratic::default();
        let mut below = f64::INFINITY;
        for i in 0..self.order.len() {
            let vertex = self.vertex(i);
            let height = self.placed[vertex][2];
            if height > below {
                measure.add_profile(area.coefficients(), below, height);
            }
            below = height;
            for &triangle in surface.around(vertex) {
                self.exchange(surface, triangle, self.role(surface, triangle, vertex), &mut area);
            }
        }
    }

    fn sweep_contours(&mut self, surface: &Surface<'_>, measure: &mut DepthMeasure) {
        let mut contours = std::mem::take(&mut self.contours);
        contours.restart(surface.triangles.len());
        let mut below = f64::INFINITY;
        for i in 0..self.order.len() {
            let vertex = self.vertex(i);
            let height = self.placed[vertex][2];
            if height > below {
                contours.measure(
                    &View {
                        surface,
                        sweep: self,
                        rank: self.rank[vertex],
                    },
                    below,
                    height,
                    measure,
                );
            }
            below = height;
            self.pass(surface, vertex, &mut contours);
        }
        self.contours = contours;
    }

    /// Moves the section from just below a vertex to just above it.
    fn pass(&mut self, surface: &Surface<'_>, vertex: usize, contours: &mut Contours) {
        let fan = surface.around(vertex);
        let (mut middles, mut lowest, mut highest) = (0, 0, 0);
        for &triangle in fan {
            match self.role(surface, triangle, vertex) {
                Role::Lowest => lowest += 1,
                Role::Middle => middles += 1,
                Role::Highest => highest += 1,
            }
        }
        // Around the vertex the height passes its own as often as there are triangles with a corner on either side: 0 is an extremum, 2 a
        // regular vertex, more a saddle.
        let simple = !surface.pinched[vertex];
        if simple && middles == 2 {
            let contour = contours.of(fan
                .iter()
                .copied()
                .find(|&t| self.role(surface, t, vertex) != Role::Lowest));
            let mut area = contours.area(contour);
            for &triangle in fan {
                let role = self.role(surface, triangle, vertex);
                self.exchange(surface, triangle, role, &mut area);
                if role != Role::Highest {
                    contours.assign(triangle, contour);
                }
            }
            contours.set_area(contour, area);
            return;
        }
        if simple && middles == 0 && (lowest == 0 || highest == 0) {
            if highest == 0 {
                let contour = contours.begin();
                let mut area = Quadratic::default();
                for &triangle in fan {
                    self.exchange(surface, triangle, Role::Lowest, &mut area);
                    contours.assign(triangle, contour);
                }
                contours.set_area(contour, area);
            } else {
                contours.end(contours.of(fan.first().copied()));
            }
            return;
        }
        self.retrace(surface, vertex, contours);
    }

    /// Contours split or merge: those through the vertex end, and what leaves it is walked around anew.
    fn retrace(&mut self, surface: &Surface<'_>, vertex: usize, contours: &mut Contours) {
        let fan = surface.around(vertex);
        for &triangle in fan {
            match self.role(surface, triangle, vertex) {
                Role::Lowest => {
                    self.exchange(surface, triangle, Role::Lowest, &mut Quadratic::default());
                    contours.release(triangle);
                }
                Role::Middle | Role::Highest => {
                    contours.end(contours.of(Some(triangle)));
                    contours.release(triangle);
                }
            }
        }
        let view = View {
            surface,
            sweep: self,
            rank: self.rank[vertex] + 1,
        };
        for &start in fan {
            if self.role(surface, start, vertex) == Role::Highest || contours.is_assigned(start) {
                continue;
            }
            let contour = contours.begin();
            let mut area = Quadratic::default();
            let mut triangle = start;
            loop {
                contours.assign(triangle, contour);
                area.add(self.pieces[triangle as usize][usize::from(view.is_past_middle(triangle))]);
                triangle = view.next(triangle).0;
                if triangle == start {
                    break;
                }
            }
            contours.set_area(contour, area);
        }
    }

    #[allow(clippy::cast_possible_truncation)] // The low half of the key is the index.
    fn vertex(&self, place: usize) -> usize {
        (self.order[place] & 0xffff_ffff) as usize
    }

    fn role(&self, surface: &Surface<'_>, triangle: u32, vertex: usize) -> Role {
        let rank = self.rank[vertex];
        let below = surface.triangles[triangle as usize]
            .iter()
            .filter(|&&v| self.rank[v as usize] < rank)
            .count();
        [Role::Lowest, Role::Middle, Role::Highest][below]
    }

    /// Adds or takes away what the triangle contributes to its contour's area when the section passes its vertex of that role.
    fn exchange(&mut self, surface: &Surface<'_>, triangle: u32, role: Role, area: &mut Quadratic) {
        match role {
            Role::Lowest => {
                let pieces = self.fans(surface.triangles[triangle as usize]);
                self.pieces[triangle as usize] = pieces;
                area.add(pieces[0]);
            }
            Role::Middle => {
                let [lower, upper] = self.pieces[triangle as usize];
                area.subtract(lower);
                area.add(upper);
            }
            Role::Highest => area.subtract(self.pieces[triangle as usize][1]),
        }
    }

    /// The signed area between the axis and the triangle's segment, as quadratics of the height below and above the middle vertex.
    fn fans(&self, corners: [u32; 3]) -> [[f64; 3]; 2] {
        let mut sorted = corners.map(|v| v as usize);
        sorted.sort_unstable_by_key(|&v| self.rank[v]);
        let [low, middle, high] = sorted.map(|v| self.placed[v]);
        // Counter-clockwise seen from outside, the solid lies to the left of the step from the falling to the rising edge.
        let first = corners
            .map(|v| v as usize)
            .iter()
            .position(|&v| v == sorted[0])
            .unwrap_or(0);
        let sign = if corners[(first + 1) % 3] as usize == sorted[1] {
            0.5
        } else {
            -0.5
        };
        let run = |from: [f64; 3], to: [f64; 3]| {
            let height = to[2] - from[2];
            [(to[0] - from[0]) / height, (to[1] - from[1]) / height]
        };
        // Segment at height h: from `apex + (h − apex_h) a` to `apex + (h − apex_h) b`.
        let fan = |apex: [f64; 3], a: [f64; 2], b: [f64; 2]| {
            let square = sign * (a[0] * b[1] - a[1] * b[0]);
            let linear = sign * (apex[0] * (b[1] - a[1]) - apex[1] * (b[0] - a[0]));
            let h = apex[2];
            [h * (h * square - linear), linear - 2.0 * h * square, square]
        };
        // Between level vertices there is no offset to measure.
        let long = if high[2] > low[2] {
            run(low, high)
        } else {
            return [[0.0; 3]; 2];
        };
        [
            if middle[2] > low[2] {
                fan(low, long, run(low, middle))
            } else {
                [0.0; 3]
            },
            if high[2] > middle[2] {
                fan(high, long, run(middle, high))
            } else {
                [0.0; 3]
            },
        ]
    }
}

/// The section just below the vertex of a rank.
pub(crate) struct View<'a> {
    surface: &'a Surface<'a>,
    sweep: &'a Sweep,
    rank: u32,
}

impl View<'_> {
    fn is_below(&self, vertex: u32) -> bool {
        self.sweep.rank[vertex as usize] < self.rank
    }

    fn is_past_middle(&self, triangle: u32) -> bool {
        self.surface.triangles[triangle as usize]
            .iter()
            .filter(|&&v| self.is_below(v))
            .count()
            == 2
    }

    /// The next triangle along the contour, the solid to the left, and the edge in between (lower, upper vertex).
    pub(crate) fn next(&self, triangle: u32) -> (u32, [u32; 2]) {
        let corners = self.surface.triangles[triangle as usize];
        let below = corners.map(|v| self.is_below(v));
        let rising = (0..3).find(|&k| below[k] && !below[(k + 1) % 3]).unwrap_or(0);
        (
            self.surface.neighbours[triangle as usize][rising],
            [corners[rising], corners[(rising + 1) % 3]],
        )
    }

    /// The corners of the contour through a triangle at a height.
    pub(crate) fn polygon(&self, start: u32, height: f64) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        let mut triangle = start;
        loop {
            let (next, [low, high]) = self.next(triangle);
            let (low, high) = (self.sweep.placed[low as usize], self.sweep.placed[high as usize]);
            let t = if high[2] > low[2] {
                ((height - low[2]) / (high[2] - low[2])).clamp(0.0, 1.0)
            } else {
                0.5
            };
            points.push([low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1])]);
            triangle = next;
            if triangle == start {
                return points;
            }
        }
    }
}

/// Two unit vectors that make a right-handed frame with the direction.
fn plane_axes(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut axis = Vector3::zeros();
    axis[direction.iamin()] = 1.0;
    let x = axis.cross(direction).normalize();
    [x, direction.cross(&x)]
}
