//! Vertices of a mesh near a point.

use nalgebra::Point3;
use stereology::shape::TriangleMesh;

/// Search of the nearest vertex of a mesh, with a grid of cells.
pub struct Nearest<'a> {
    points: &'a [Point3<f64>],
    low: Point3<f64>,
    cell: f64,
    sides: [usize; 3],
    starts: Vec<usize>,
    order: Vec<u32>,
}

impl<'a> Nearest<'a> {
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        let points = &mesh.vertices;
        let (low, high) = mesh.bounding_box().unwrap_or_default();
        // A few vertices per cell that the surface crosses.
        let cell = ((high - low).amax() / (points.len().max(1) as f64 / 6.0).sqrt()).max(1e-9);
        let sides = [0, 1, 2].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut made = Self {
            points,
            low,
            cell,
            sides,
            starts: vec![0; sides.iter().product::<usize>() + 1],
            order: (0..points.len() as u32).collect(),
        };
        let cells: Vec<usize> = points.iter().map(|p| made.index(made.place(p))).collect();
        made.order.sort_by_key(|&v| cells[v as usize]);
        for &cell in &cells {
            made.starts[cell + 1] += 1;
        }
        for cell in 1..made.starts.len() {
            made.starts[cell] += made.starts[cell - 1];
        }
        made
    }

    fn place(&self, p: &Point3<f64>) -> [usize; 3] {
        [0, 1, 2].map(|k| (((p[k] - self.low[k]) / self.cell).max(0.0) as usize).min(self.sides[k] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.sides[1] + y) * self.sides[0] + x
    }

    /// Mean of the values around a point, weighted towards near vertices.
    pub fn mean(&self, p: &Point3<f64>, values: &[f64]) -> f64 {
        let place = self.place(p);
        let range = |k: usize| place[k].saturating_sub(1)..=(place[k] + 1).min(self.sides[k] - 1);
        let (mut sum, mut of) = (0.0, 1e-300);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let cell = self.index([x, y, z]);
                    for &v in &self.order[self.starts[cell]..self.starts[cell + 1]] {
                        let far = (self.points[v as usize] - p).norm_squared() / (self.cell * self.cell);
                        let weight = (-16.0 * far).exp();
                        sum += weight * values[v as usize];
                        of += weight;
                    }
                }
            }
        }
        sum / of
    }

    /// The nearest vertex, if there is one within four cells.
    pub fn vertex(&self, p: &Point3<f64>) -> Option<usize> {
        let place = self.place(p);
        let mut best: Option<(f64, u32)> = None;
        for reach in 1..4_usize {
            let range = |k: usize| place[k].saturating_sub(reach)..=(place[k] + reach).min(self.sides[k] - 1);
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let cell = self.index([x, y, z]);
                        for &v in &self.order[self.starts[cell]..self.starts[cell + 1]] {
                            let far = (self.points[v as usize] - p).norm_squared();
                            if best.is_none_or(|(least, _)| far < least) {
                                best = Some((far, v));
                            }
                        }
                    }
                }
            }
            if best.is_some() {
                break;
            }
        }
        best.map(|(_, v)| v as usize)
    }
}
