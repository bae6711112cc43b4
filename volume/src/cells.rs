//! Search grid: cells of the periodic box, each with the particle images that reach into it.

use crate::images::{Image, Images, NONE};
use crate::narrow::{floor, modulo, number, whole};
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use stereology_shape::{Particle, PeriodicBox, UnitBody};

/// Cells per particle: a compromise between long lists in the cells and a long construction.
const CELLS_PER_PARTICLE: f64 = 32.0;
const MOST_CELLS_PER_SIDE: f64 = 512.0;
/// Fraction of a cell by which its bounds are widened, more than the rounding of its coordinates.
const SLACK: f64 = 1e-9;

/// The particles, and the cells of the box that they reach into.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    sides: Vector3<f64>,
    counts: [usize; 3],
    cells_per_length: Vector3<f64>,
    placed: Vec<Placed>,
    /// The particle that covers the whole cell, if it has the lowest index there; otherwise [`NONE`].
    owners: Vec<u32>,
    /// `images[starts[cell]..starts[cell + 1]]` reach into the cell, lowest particle first.
    starts: Vec<u32>,
    images: Vec<Image>,
    by_height: Images,
}

/// A particle with its inverse transformation.
#[derive(Clone, Debug)]
struct Placed {
    shape: usize,
    size: f64,
    /// R⁻¹ / size.
    to_local: Matrix3<f64>,
    /// Radii of the bounding ball and of the inscribed ball about the centre.
    outer: f64,
    inner: f64,
}

/// How a particle covers a cell.
#[derive(Clone, Copy, PartialEq)]
enum Cover {
    Partial,
    Whole,
}

impl Cells {
    /// The particles must be valid, as in an arrangement.
    pub(crate) fn new(bodies: &[UnitBody], particles: &[Particle], period: &PeriodicBox) -> Self {
        let sides = period.sides();
        let wanted = (CELLS_PER_PARTICLE * particles.len().max(1) as f64 / period.volume()).cbrt();
        let counts = [0, 1, 2].map(|k| whole((sides[k] * wanted).ceil().clamp(1.0, MOST_CELLS_PER_SIDE)));
        let cells_per_length = Vector3::from_fn(|k, _| counts[k] as f64 / sides[k]);
        let placed: Vec<Placed> = particles
            .iter()
            .map(|particle| Placed::new(particle, &bodies[particle.shape]))
            .collect();
        let by_height = Images::new(particles, |particle| placed[particle].outer, period);
        let total = counts.iter().product::<usize>();
        let mut cells = Self {
            sides,
            counts,
            cells_per_length,
            placed,
            owners: vec![NONE; total],
            starts: vec![0; total + 1],
            images: Vec::new(),
            by_height,
        };
        let reached: Vec<Vec<(u32, Cover, Image)>> = particles
            .par_iter()
            .enumerate()
            .map(|(index, particle)| cells.reached(index, &bodies[particle.shape], &period.wrap(&particle.position)))
            .collect();
        cells.sort_in(&reached);
        cells
    }

    /// The cells that the images of a particle reach into.
    fn reached(&self, index: usize, body: &UnitBody, centre: &Point3<f64>) -> Vec<(u32, Cover, Image)> {
        let placed = &self.placed[index];
        let size = self.cells_per_length.map(f64::recip);
        let half_diagonal = size.norm() * (0.5 + SLACK);
        let range = |k: usize| {
            let reach = placed.outer + SLACK * size[k];
            let cell = |x: f64| floor(x * self.cells_per_length[k]);
            cell(centre[k] - reach)..=cell(centre[k] + reach)
        };
        let mut reached = Vec::new();
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let index_along = [i, j, k];
                    let middle = Point3::from(Vector3::from_fn(|a, _| (index_along[a] as f64 + 0.5) * size[a]));
                    let offset = middle - centre;
                    let distance = offset.norm();
                    if distance > placed.outer + half_diagonal {
                        continue;
                    }
                    let cover = if distance + half_diagonal < placed.inner {
                        Cover::Whole
                    } else {
                        let depth = placed.size * body.signed_distance_bound(&placed.local(&offset));
                        if depth > half_diagonal {
                            continue;
                        }
                        if depth < -half_diagonal {
                            Cover::Whole
                        } else {
                            Cover::Partial
                        }
                    };
                    let turns = Vector3::from_fn(|a, _| index_along[a].div_euclid(self.counts[a] as i64) as f64);
                    let cell = [0, 1, 2].map(|a| modulo(index_along[a], self.counts[a]));
                    let image = Image::new(centre - turns.component_mul(&self.sides), placed.outer, number(index));
                    reached.push((number(self.number(cell)), cover, image));
                }
            }
        }
        reached
    }

    /// Sorts the images into their cells, in the order of the particles.
    fn sort_in(&mut self, reached: &[Vec<(u32, Cover, Image)>]) {
        for (cell, ..) in reached.iter().flatten() {
            self.starts[*cell as usize + 1] += 1;
        }
        for cell in 0..self.owners.len() {
            self.starts[cell + 1] += self.starts[cell];
        }
        let mut next = self.starts.clone();
        let nowhere = Image::new(Point3::origin(), 0.0, 0);
        self.images = vec![nowhere; reached.iter().map(Vec::len).sum()];
        for &(cell, cover, image) in reached.iter().flatten() {
            let cell = cell as usize;
            if cover == Cover::Whole && next[cell] == self.starts[cell] {
                self.owners[cell] = image.particle;
            }
            self.images[next[cell] as usize] = image;
            next[cell] += 1;
        }
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.counts[1] + j) * self.counts[0] + i
    }

    fn cell_of(&self, p: &Point3<f64>) -> [usize; 3] {
        [0, 1, 2].map(|k| whole(p[k] * self.cells_per_length[k]).min(self.counts[k] - 1))
    }

    fn images_in(&self, cell: usize) -> &[Image] {
        &self.images[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The particle at a point of the box, lowest index first; some 50 ns.
    pub(crate) fn particle_at(&self, bodies: &[UnitBody], p: &Point3<f64>) -> Option<usize> {
        let cell = self.number(self.cell_of(p));
        if self.owners[cell] != NONE {
            return Some(self.owners[cell] as usize);
        }
        let inside = |image: &&Image| {
            let offset = p - image.centre;
            offset.norm_squared() < image.outer_squared && self.holds(bodies, image.particle, &offset)
        };
        self.images_in(cell)
            .iter()
            .find(inside)
            .map(|image| image.particle as usize)
    }

    /// Whether a particle contains the point at this offset from its centre.
    #[inline]
    pub(crate) fn holds(&self, bodies: &[UnitBody], particle: u32, offset: &Vector3<f64>) -> bool {
        let placed = &self.placed[particle as usize];
        bodies[placed.shape].contains(&placed.local(offset))
    }

    /// The shape of a particle, and the matrix from offsets from its centre to that shape.
    pub(crate) fn placed(&self, particle: u32) -> (usize, &Matrix3<f64>) {
        let placed = &self.placed[particle as usize];
        (placed.shape, &placed.to_local)
    }

    /// All images, for rows of points.
    pub(crate) fn images(&self) -> &Images {
        &self.by_height
    }

    /// Signed distance from a point of the box to the nearest surface, negative inside a particle; infinite without
    /// particles.
    pub(crate) fn distance(&self, bodies: &[UnitBody], p: &Point3<f64>) -> f64 {
        if self.images.is_empty() {
            return f64::INFINITY;
        }
        let depth = |particle: usize, offset: &Vector3<f64>| {
            let placed = &self.placed[particle];
            placed.size * bodies[placed.shape].signed_distance(&placed.local(offset))
        };
        let home = self.cell_of(p);
        let to_wall = (0..3)
            .map(|k| {
                let from = home[k] as f64 / self.cells_per_length[k];
                (p[k] - from).min(from + self.cells_per_length[k].recip() - p[k])
            })
            .fold(f64::INFINITY, f64::min);
        // The nearest point of any surface is at most half a period away along each axis.
        let limits = self.counts.map(|count| count as i64 / 2 + 2);
        let mut nearest = f64::INFINITY;
        let mut seen: Vec<(u32, Vector3<f64>)> = Vec::new();
        for ring in 0.. {
            let left = (0..3).filter(|&k| ring <= limits[k]);
            let thinnest = left
                .map(|k| self.cells_per_length[k].recip())
                .fold(f64::INFINITY, f64::min);
            // Any particle nearer than this reaches into the rings already visited.
            if nearest <= to_wall + (ring as f64 - 1.0) * thinnest || thinnest.is_infinite() {
                break;
            }
            for_ring(ring, limits, |step| {
                let raw = [0, 1, 2].map(|k| home[k] as i64 + step[k]);
                let turns = Vector3::from_fn(|k, _| raw[k].div_euclid(self.counts[k] as i64) as f64);
                let cell = [0, 1, 2].map(|k| modulo(raw[k], self.counts[k]));
                let shift = turns.component_mul(&self.sides);
                for image in self.images_in(self.number(cell)) {
                    let offset = p - (image.centre + shift);
                    let key = (image.particle, offset);
                    if offset.norm() - self.placed[image.particle as usize].outer < nearest && !seen.contains(&key) {
                        nearest = nearest.min(depth(image.particle as usize, &offset));
                        seen.push(key);
                    }
                }
            });
        }
        nearest
    }
}

/// The cells at Chebyshev distance `ring` from the origin that are at most `limits` away along each axis.
fn for_ring(ring: i64, limits: [i64; 3], mut visit: impl FnMut([i64; 3])) {
    let [along_i, along_j, along_k] = limits.map(|limit| limit.min(ring));
    for k in -along_k..=along_k {
        for j in -along_j..=along_j {
            if k.abs() == ring || j.abs() == ring {
                (-along_i..=along_i).for_each(|i| visit([i, j, k]));
            } else if along_i == ring {
                [-ring, ring].into_iter().for_each(|i| visit([i, j, k]));
            }
        }
    }
}

impl Placed {
    fn new(particle: &Particle, body: &UnitBody) -> Self {
        Self {
            shape: particle.shape,
            size: particle.size,
            to_local: particle.orientation.to_rotation_matrix().matrix().transpose() / particle.size,
            outer: body.bounding_radius() * particle.size,
            inner: body.inscribed_radius() * particle.size,
        }
    }

    fn local(&self, offset: &Vector3<f64>) -> Point3<f64> {
        Point3::from(self.to_local * offset)
    }
}
