//! The area of every section across a direction at once: a quadratic spline over depth whose knots are the vertices.
//!
//! The section closes the surface below it, so its area is minus the flux of that surface's area vectors a_t through the direction u:
//!
//! ```text
//! A(h) = − Σ over triangles (a_t · u) Σ over corners (h − h_i)₊² / ((h_i − h_j) (h_i − h_k))
//! ```
//!
//! where the inner sum, the divided difference of a truncated square, is the part of the triangle below h. Near a vertex the section
//! changes by a polygon as large as the distance from it: area and slope are continuous, only the second derivative jumps. Nothing is cut,
//! no contour is walked.

use nalgebra::{Point3, Vector3};

use crate::closed_mesh::ClosedMesh;
use crate::measures::double_area;

/// Sweeps planes across a mesh: total area of the section as a function of depth, for one direction after another.
///
/// Works about the mesh's centroid in units of its reach (the distance of its farthest vertex), so that depths are within ±1.
/// Cost of a direction: T + V log V.
///
/// # Examples
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_shape::{ClosedMesh, SectionAreas, TriangleMesh};
///
/// let brick = ClosedMesh::try_from(TriangleMesh::cuboid([1.0, 2.0, 3.0]))?;
/// let mut areas = SectionAreas::new(&brick);
/// let direction = Vector3::new(0.3, 0.5, 0.8).normalize();
/// let mut volume = 0.0; // ∫ area over depth, whatever the direction
/// areas.sweep(&direction, |low, high, [a, b, c]| {
///     let t = high - low;
///     volume += t * (a + t * (b / 2.0 + t * c / 3.0));
/// });
/// assert!((volume * areas.reach().powi(3) - 6.0).abs() < 1e-12);
/// # Ok::<(), stereology_shape::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SectionAreas {
    vertices: Vec<Vector3<f64>>,
    /// The area vector of each triangle.
    areas: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    centre: Point3<f64>,
    reach: f64,
    volume: f64,
    heights: Vec<f64>,
    /// Half the jump of the second derivative at each vertex.
    jumps: Vec<f64>,
    order: Vec<(u64, u32)>,
}

impl SectionAreas {
    /// Prepares a mesh. Cost: T.
    #[must_use]
    pub fn new(mesh: &ClosedMesh) -> Self {
        let centre = mesh.centroid();
        let reach = mesh.reach(&centre);
        let vertices: Vec<Vector3<f64>> = mesh.vertices().iter().map(|v| (v - centre) / reach).collect();
        let triangles = mesh.triangles().to_vec();
        let areas = triangles
            .iter()
            .map(|corners| 0.5 * double_area(&corners.map(|i| Point3::from(vertices[i as usize]))))
            .collect();
        Self {
            heights: vec![0.0; vertices.len()],
            jumps: vec![0.0; vertices.len()],
            order: Vec::with_capacity(vertices.len()),
            volume: mesh.volume() / reach.powi(3),
            vertices,
            areas,
            triangles,
            centre,
            reach,
        }
    }

    /// The mesh's unit of length in units of the sweep's: multiply depths by it, areas by its square.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The centroid, depth 0 of every direction.
    #[must_use]
    pub fn centre(&self) -> Point3<f64> {
        self.centre
    }

    /// Visits the pieces of the area function across `direction` (a unit vector), from the lowest depth up: `visit(low, high, [a, b, c])`
    /// says that the sections at depths `low + t` up to `high` have area a + b t + c t².
    ///
    /// Returns by how much ∫ A dh differs from the volume, as a part of it: 1e-12 or so for nearly every direction, but up to anything
    /// (NaN too) for one along which an edge is exactly level. Take such a direction a hair aside, or cut by
    /// [`section_polygons`](crate::section_polygons).
    pub fn sweep(&mut self, direction: &Vector3<f64>, mut visit: impl FnMut(f64, f64, [f64; 3])) -> f64 {
        self.place(direction);
        let (mut area, mut slope, mut curvature) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut volume = 0.0;
        let mut low = f64::NEG_INFINITY;
        for &(_, vertex) in &self.order {
            let high = self.heights[vertex as usize];
            let t = high - low;
            if t > 0.0 && t.is_finite() {
                visit(low, high, [area, slope, curvature]);
                volume += t * (area + t * (0.5 * slope + t * curvature * (1.0 / 3.0)));
                area += t * (slope + t * curvature);
                slope += 2.0 * t * curvature;
            }
            low = high;
            curvature += self.jumps[vertex as usize];
        }
        (volume / self.volume - 1.0).abs()
    }

    fn place(&mut self, direction: &Vector3<f64>) {
        self.order.clear();
        for (i, (vertex, height)) in (0_u32..).zip(self.vertices.iter().zip(&mut self.heights)) {
            *height = vertex.dot(direction);
            self.order.push((rising_bits(*height), i));
        }
        self.order.sort_unstable();
        self.jumps.fill(0.0);
        for (corners, area) in self.triangles.iter().zip(&self.areas) {
            let [i, j, k] = corners.map(|v| v as usize);
            let [h, m, n] = [i, j, k].map(|v| self.heights[v]);
            let (d, e, f) = (m - h, n - m, h - n);
            // One division for all three: 1 / (d e f) times the side that the corner lacks.
            let scale = area.dot(direction) / (d * e * f);
            self.jumps[i] += scale * e;
            self.jumps[j] += scale * f;
            self.jumps[k] += scale * d;
        }
    }
}

/// Bits that sort as the number does (finite numbers; -0 sorts below 0, to the same place).
fn rising_bits(x: f64) -> u64 {
    let bits = x.to_bits();
    bits ^ if bits >> 63 == 1 { u64::MAX } else { 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::SectionAreas;
    use crate::section::Slicer;
    use crate::{ClosedMesh, TriangleMesh};
    use approx::assert_abs_diff_eq;
    use nalgebra::{UnitVector3, Vector3};
    use proptest::prelude::*;

    proptest! {
        /// The spline is what cutting at a depth measures, for bodies of any topology.
        #[test]
        fn areas_are_those_of_polygons(x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in 0.1..1.0_f64, depth in -0.9..0.9_f64, which in 0..3) {
            let mesh = match which {
                0 => TriangleMesh::cuboid([1.0, 2.0, 3.0]),
                1 => TriangleMesh::torus(2.0, 0.8, 24, 12),
                _ => TriangleMesh::icosphere(3.0, 3),
            };
            let mesh = ClosedMesh::try_from(mesh).unwrap();
            let normal = UnitVector3::new_normalize(Vector3::new(x, y, z));
            let mut areas = SectionAreas::new(&mesh);
            let mut swept = 0.0;
            let defect = areas.sweep(&normal, |low, high, [a, b, c]| {
                if low < depth && depth <= high {
                    swept = a + (depth - low) * (b + (depth - low) * c);
                }
            });
            prop_assert!(defect < 1e-9, "{defect}");
            let mut slicer = Slicer::new(&mesh);
            slicer.turn_to(&normal);
            let offset = normal.dot(&areas.centre().coords) + depth * areas.reach();
            assert_abs_diff_eq!(swept * areas.reach() * areas.reach(), slicer.total_area(offset), epsilon = 1e-8);
        }
    }

    #[test]
    fn a_level_edge_is_told() {
        let mesh = ClosedMesh::try_from(TriangleMesh::cuboid([1.0; 3])).unwrap();
        let defect = SectionAreas::new(&mesh).sweep(&Vector3::z(), |_, _, _| {});
        assert!(defect.is_nan() || defect > 1e-3);
    }
}
