//! Carving: the solid's colours at the vertices of a mesh, refined to resolve the texture.

use crate::carve_error::{CarveError, check};
use crate::solid::Solid;
use nalgebra::{Point3, Vector3, center};
use rayon::prelude::*;
use std::collections::BTreeMap;
use stereology_metrics::Progress;
use stereology_shape::{ColouredMesh, TriangleMesh, corner_normals};

/// Carving options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarveOptions {
    /// Edges are not split below this length, in the unit of the solid; by default the voxel of its residual, or a
    /// hundredth of its shortest side.
    pub detail: Option<f64>,
    /// An edge is split if colours along it differ by more than this from the interpolation between its ends.
    pub contrast: f32,
    /// Near this number of triangles, only the edges with the largest differences are split, and then the refinement
    /// ends.
    pub most_triangles: usize,
}

impl Default for CarveOptions {
    /// Edges down to a pixel of the photograph, a contrast of 4 % of the range of colours, a million triangles.
    fn default() -> Self {
        Self {
            detail: None,
            contrast: 0.04,
            most_triangles: 1_000_000,
        }
    }
}

/// A carved mesh.
#[derive(Clone, Debug)]
pub struct Carved {
    /// The mesh in its given coordinates.
    pub coloured: ColouredMesh,
    /// Number of edges that remain coarser than requested because the limit of triangles was reached.
    pub coarse_edges: usize,
}

impl Solid {
    /// Gives the surface of `mesh` the colours of the solid; `place` maps points of the mesh to the solid.
    ///
    /// Triangles are bisected at their longest edges (Rivara 1984), so they stay well shaped and no gaps open, until
    /// the colours along each edge match the interpolation between its ends, or edges are as short as the texture's
    /// detail. An edge longer than eight details is always split, so that no particle is missed. In voids alpha is 0: a
    /// hole. The mesh may be open. Shading stays that of the given mesh. Cost: about 10 colours per edge and iteration.
    ///
    /// # Errors
    ///
    /// [`CarveError`] states the triangle or option that is not valid.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use std::ops::ControlFlow;
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// use stereology_shape::TriangleMesh;
    /// use stereology_volume::{CarveOptions, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// # let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[1.0, 0.0, 0.0]], [0.0; 3], None)?;
    /// // A cube of 12 triangles through a red sphere: fine at the border of the sphere.
    /// let cube = TriangleMesh::cuboid([5.0, 5.0, 5.0]);
    /// let carved = solid.carve(&cube, &|p| p + Vector3::repeat(5.0), &CarveOptions::default(), &|_| ControlFlow::Continue(()))?;
    /// assert_eq!(carved.coarse_edges, 0);
    /// assert!((1_000..100_000).contains(&carved.coloured.mesh.triangles.len()));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn carve(
        &self,
        mesh: &TriangleMesh,
        place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
        options: &CarveOptions,
        progress: Progress<'_>,
    ) -> Result<Carved, CarveError> {
        check(mesh)?;
        let detail = options
            .detail
            .or_else(|| self.residual_voxel())
            .unwrap_or_else(|| self.period().sides().min() / 100.0);
        let contrast = options.contrast;
        if !(detail.is_finite() && detail > 0.0 && contrast.is_finite() && contrast > 0.0) {
            return Err(CarveError::Options { detail, contrast });
        }
        let colour = |p: &Point3<f64>| {
            let p = place(p);
            let [r, g, b] = self.colour_at(&p);
            [r, g, b, if self.is_void_at(&p) { 0.0 } else { 1.0 }]
        };
        let mut refined = Refined::new(mesh, &colour);
        let measure = Measure {
            colour: &colour,
            place,
            detail,
            contrast,
        };
        let mut coarse_edges = 0;
        for round in 0.. {
            // Each iteration halves edges; the number of iterations left is known only at the end.
            if progress(1.0 - 0.8_f64.powi(round)).is_break() {
                return Err(CarveError::Cancelled);
            }
            let mut wanted = refined.edges_to_split(&measure);
            let room = options.most_triangles.saturating_sub(refined.mesh.triangles.len()) / 3;
            if wanted.len() > room {
                coarse_edges = wanted.len() - room;
                wanted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
                wanted.truncate(room);
            }
            if wanted.is_empty() {
                break;
            }
            refined.split(wanted.into_iter().map(|(edge, _)| edge).collect(), &colour);
            if coarse_edges > 0 {
                break;
            }
        }
        let Refined { mesh, colours, normals } = refined;
        Ok(Carved {
            coloured: ColouredMesh { mesh, colours, normals },
            coarse_edges,
        })
    }
}

/// The two vertices of an edge, the lower index first.
type Edge = [u32; 2];

fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// Decides whether an edge is short enough.
struct Measure<'a> {
    colour: &'a (dyn Fn(&Point3<f64>) -> [f32; 4] + Sync),
    place: &'a (dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
    detail: f64,
    contrast: f32,
}

/// Edges longer than this many details are split regardless of their colours.
const LONGEST: f64 = 8.0;
/// Edges below two details are not split: halves would be shorter than one detail.
const SHORTEST: f64 = 2.0;

impl Measure<'_> {
    /// Difference that requires an edge to be split; `None` if it does not.
    fn need(&self, ends: [&Point3<f64>; 2], colours: [[f32; 4]; 2]) -> Option<f32> {
        let length = ((self.place)(ends[1]) - (self.place)(ends[0])).norm() / self.detail;
        if length < SHORTEST {
            return None;
        }
        if length > LONGEST {
            #[allow(clippy::cast_possible_truncation, reason = "only compared")]
            return Some(length as f32);
        }
        let steps = length.ceil();
        #[allow(clippy::cast_possible_truncation, reason = "at most LONGEST")]
        let along = (1..steps as usize).map(|i| i as f64 / steps);
        let off = along.map(|t| {
            let seen = (self.colour)(&(ends[0] + t * (ends[1] - ends[0])));
            #[allow(clippy::cast_possible_truncation, reason = "a fraction of an edge")]
            let t = t as f32;
            let between = |c: usize| colours[0][c] + t * (colours[1][c] - colours[0][c]);
            (0..4).map(|c| (seen[c] - between(c)).abs()).fold(0.0, f32::max)
        });
        Some(off.fold(0.0, f32::max)).filter(|off| *off > self.contrast)
    }
}

/// The mesh during refinement.
struct Refined {
    mesh: TriangleMesh,
    colours: Vec<[f32; 4]>,
    normals: Vec<[Vector3<f64>; 3]>,
}

impl Refined {
    fn new(mesh: &TriangleMesh, colour: &(dyn Fn(&Point3<f64>) -> [f32; 4] + Sync)) -> Self {
        Self {
            mesh: mesh.clone(),
            colours: mesh.vertices.par_iter().map(colour).collect(),
            normals: corner_normals(mesh),
        }
    }

    fn vertex(&self, i: u32) -> &Point3<f64> {
        &self.mesh.vertices[i as usize]
    }

    fn edges_to_split(&self, measure: &Measure<'_>) -> Vec<(Edge, f32)> {
        let mut edges: Vec<Edge> = self
            .mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [edge(a, b), edge(b, c), edge(c, a)])
            .collect();
        edges.par_sort_unstable();
        edges.dedup();
        let need = |&[a, b]: &Edge| {
            let colours = [self.colours[a as usize], self.colours[b as usize]];
            measure
                .need([self.vertex(a), self.vertex(b)], colours)
                .map(|need| ([a, b], need))
        };
        edges.par_iter().filter_map(need).collect()
    }

    /// Splits these edges, and further edges so that each split triangle is split at its longest edge.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "more than 2^32 vertices do not fit into memory"
    )]
    fn split(&mut self, edges: Vec<Edge>, colour: &(dyn Fn(&Point3<f64>) -> [f32; 4] + Sync)) {
        let mut middles: BTreeMap<Edge, u32> = edges.into_iter().map(|edge| (edge, 0)).collect();
        loop {
            let before = middles.len();
            for triangle in &self.mesh.triangles {
                let sides = sides(triangle);
                if sides.iter().any(|side| middles.contains_key(side)) {
                    middles.entry(sides[self.longest(triangle)]).or_insert(0);
                }
            }
            if middles.len() == before {
                break;
            }
        }
        let first = self.mesh.vertices.len();
        for (i, (&[a, b], middle)) in middles.iter_mut().enumerate() {
            *middle = (first + i) as u32;
            let between = center(&self.mesh.vertices[a as usize], &self.mesh.vertices[b as usize]);
            self.mesh.vertices.push(between);
        }
        let new: Vec<[f32; 4]> = self.mesh.vertices[first..].par_iter().map(colour).collect();
        self.colours.extend(new);

        let (triangles, normals) = (
            std::mem::take(&mut self.mesh.triangles),
            std::mem::take(&mut self.normals),
        );
        for (triangle, normals) in triangles.into_iter().zip(normals) {
            self.bisect(triangle, normals, &middles);
        }
    }

    /// Halves a triangle at its longest edge, and its halves at theirs, where edges have midpoints.
    fn bisect(&mut self, triangle: [u32; 3], normals: [Vector3<f64>; 3], middles: &BTreeMap<Edge, u32>) {
        // In a half, only the edge inherited from the whole triangle can have a midpoint.
        let split = (0..3)
            .filter(|&k| middles.contains_key(&sides(&triangle)[k]))
            .max_by(|&k, &l| {
                self.length(&triangle, k)
                    .total_cmp(&self.length(&triangle, l))
                    .then(l.cmp(&k))
            });
        let Some(k) = split else {
            self.mesh.triangles.push(triangle);
            self.normals.push(normals);
            return;
        };
        let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
        let [na, nb, nc] = [0, 1, 2].map(|i| normals[(k + i) % 3]);
        let middle = middles[&edge(a, b)];
        let normal = (na + nb).try_normalize(1e-12).unwrap_or(na);
        self.bisect([a, middle, c], [na, normal, nc], middles);
        self.bisect([middle, b, c], [normal, nb, nc], middles);
    }

    /// The longest side; among equal ones the side with the lowest vertices, so that both triangles at an edge agree.
    fn longest(&self, triangle: &[u32; 3]) -> usize {
        let sides = sides(triangle);
        let longer = |&k: &usize, &l: &usize| {
            let by_length = self.length(triangle, k).total_cmp(&self.length(triangle, l));
            by_length.then(sides[l].cmp(&sides[k]))
        };
        (0..3).max_by(longer).unwrap_or(0)
    }

    fn length(&self, triangle: &[u32; 3], side: usize) -> f64 {
        let [a, b] = sides(triangle)[side];
        (self.vertex(b) - self.vertex(a)).norm_squared()
    }
}

/// Side k goes from corner k to the next.
fn sides(&[a, b, c]: &[u32; 3]) -> [Edge; 3] {
    [edge(a, b), edge(b, c), edge(c, a)]
}
