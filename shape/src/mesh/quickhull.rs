//! Convex hull of points: quickhull with exact predicates, robust for any set of points.

use nalgebra::Point3;
use robust::orient3d;

use crate::mesh::index::index;
use crate::mesh::triangle_mesh::{TriangleMesh, flush_tiny};
use crate::mesh::winding::coord;

/// Why points have no hull with a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum HullError {
    /// Fewer than four points.
    #[error("a hull needs at least four points, not all in one plane; there are {count}")]
    TooFewPoints {
        /// How many points there are.
        count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {point} (counted from 0) has a coordinate that is not finite")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// All points lie in one plane, on one line or at one position.
    #[error("the points lie in one plane: their hull has no volume")]
    Flat,
    /// The points span less than 1e-60 or more than 1e60 units.
    #[error("the points span less than 1e-60 or more than 1e60: choose another unit")]
    Extent,
}

/// The triangles of the hull.
pub(crate) fn hull_mesh(points: &[Point3<f64>]) -> Result<TriangleMesh, HullError> {
    if let Some(point) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(HullError::NotFinite { point });
    }
    if points.len() < 4 {
        return Err(HullError::TooFewPoints { count: points.len() });
    }
    let mut points = points.to_vec();
    flush_tiny(&mut points);
    let mut hull = Quickhull::start(&points)?;
    while let Some(face) = hull.pending.pop() {
        if hull.faces[face].alive && !hull.faces[face].outside.is_empty() {
            hull.raise(face);
        }
    }
    let faces = hull.faces.iter().filter(|face| face.alive);
    let triangles = faces.map(|face| face.corners).collect();
    let mut mesh = TriangleMesh {
        vertices: points,
        triangles,
    };
    mesh.drop_unused_vertices();
    Ok(mesh)
}

struct Face {
    corners: [u32; 3],
    /// Faces across the edges 0→1, 1→2, 2→0.
    across: [usize; 3],
    /// Points strictly outside this face, each listed at one face only.
    outside: Vec<u32>,
    alive: bool,
}

/// An edge between a visible face and an invisible one, `beyond`, of which it is edge number `side`.
struct HorizonEdge {
    from: u32,
    to: u32,
    beyond: usize,
    side: usize,
}

struct Quickhull<'a> {
    points: &'a [Point3<f64>],
    faces: Vec<Face>,
    /// Faces that may have points outside them.
    pending: Vec<usize>,
    /// For a vertex of the current horizon: the new face whose base edge starts there.
    face_from: Vec<usize>,
}

impl<'a> Quickhull<'a> {
    fn start(points: &'a [Point3<f64>]) -> Result<Self, HullError> {
        let simplex = first_simplex(points).ok_or(HullError::Flat)?;
        let [a, b, c, d] = simplex;
        let corners = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]];
        let across = [[1, 2, 3], [3, 2, 0], [1, 3, 0], [2, 1, 0]];
        let faces = (0..4)
            .map(|f| Face {
                corners: corners[f],
                across: across[f],
                outside: Vec::new(),
                alive: true,
            })
            .collect();
        let mut hull = Self {
            points,
            faces,
            pending: vec![0, 1, 2, 3],
            face_from: vec![usize::MAX; points.len()],
        };
        for p in 0..index(points.len()) {
            if !simplex.contains(&p) {
                hull.assign(p, 0..4);
            }
        }
        Ok(hull)
    }

    /// Whether point `p` lies strictly outside the plane of `face`: exact.
    fn sees(&self, p: u32, face: usize) -> bool {
        let at = |i: u32| coord(&self.points[i as usize]);
        let [a, b, c] = self.faces[face].corners;
        orient3d(at(a), at(b), at(c), at(p)) < 0.0
    }

    /// Lists `p` at the first of `faces` that it lies outside of. A point outside no face is inside the hull.
    fn assign(&mut self, p: u32, faces: std::ops::Range<usize>) {
        if let Some(face) = faces.into_iter().find(|&face| self.sees(p, face)) {
            self.faces[face].outside.push(p);
        }
    }

    /// Adds the farthest point outside `face` to the hull.
    fn raise(&mut self, face: usize) {
        let apex = self.farthest(face);
        let (visible, horizon) = self.horizon(apex, face);
        let first = self.faces.len();
        for (offset, &HorizonEdge { from, to, beyond, side }) in horizon.iter().enumerate() {
            self.faces.push(Face {
                corners: [from, to, apex],
                across: [beyond, usize::MAX, usize::MAX],
                outside: Vec::new(),
                alive: true,
            });
            self.faces[beyond].across[side] = first + offset;
            self.face_from[from as usize] = first + offset;
        }
        let new = first..self.faces.len();
        for face in new.clone() {
            let next = self.face_from[self.faces[face].corners[1] as usize];
            self.faces[face].across[1] = next;
            self.faces[next].across[2] = face;
        }
        for face in visible {
            for p in std::mem::take(&mut self.faces[face].outside) {
                if p != apex {
                    self.assign(p, new.clone());
                }
            }
        }
        self.pending.extend(new);
    }

    /// Any point outside is valid; the farthest keeps the hull small. Ties: the lowest index.
    fn farthest(&self, face: usize) -> u32 {
        let Face { corners, outside, .. } = &self.faces[face];
        let [a, b, c] = corners.map(|i| self.points[i as usize]);
        let normal = (b - a).cross(&(c - a));
        let mut best = (f64::NEG_INFINITY, outside[0]);
        for &p in outside {
            let height = normal.dot(&(self.points[p as usize] - a));
            if height > best.0 {
                best = (height, p);
            }
        }
        best.1
    }

    /// The faces visible from `apex` (marked dead), and the edges around them.
    fn horizon(&mut self, apex: u32, start: usize) -> (Vec<usize>, Vec<HorizonEdge>) {
        self.faces[start].alive = false;
        let mut visible = vec![start];
        let mut horizon = Vec::new();
        let mut next = 0;
        while let Some(&face) = visible.get(next) {
            next += 1;
            for k in 0..3 {
                let beyond = self.faces[face].across[k];
                if !self.faces[beyond].alive {
                    continue;
                }
                if self.sees(apex, beyond) {
                    self.faces[beyond].alive = false;
                    visible.push(beyond);
                } else {
                    let corners = self.faces[face].corners;
                    let side = self.faces[beyond].across.iter().position(|&f| f == face);
                    let side = side.expect("faces are neighbours of each other");
                    horizon.push(HorizonEdge {
                        from: corners[k],
                        to: corners[(k + 1) % 3],
                        beyond,
                        side,
                    });
                }
            }
        }
        (visible, horizon)
    }
}

/// Four points not in one plane, the last below the first three; far apart where possible.
fn first_simplex(points: &[Point3<f64>]) -> Option<[u32; 4]> {
    let farthest = |measure: &dyn Fn(&Point3<f64>) -> f64| {
        let mut best = (f64::NEG_INFINITY, 0);
        for (i, p) in points.iter().enumerate() {
            let value = measure(p);
            if value > best.0 {
                best = (value, i);
            }
        }
        best.1
    };
    let a = farthest(&|p| -p.x);
    let b = farthest(&|p| (p - points[a]).norm_squared());
    let c = farthest(&|p| (points[b] - points[a]).cross(&(p - points[a])).norm_squared());
    let normal = (points[b] - points[a]).cross(&(points[c] - points[a]));
    let d = farthest(&|p| normal.dot(&(p - points[a])).abs());
    let side = |d: usize| {
        orient3d(
            coord(&points[a]),
            coord(&points[b]),
            coord(&points[c]),
            coord(&points[d]),
        )
    };
    // Among points nearly in a plane, rounding may have chosen one in it; then any point exactly off the plane serves.
    let d = if side(d) == 0.0 {
        (0..points.len()).find(|&i| side(i) != 0.0)?
    } else {
        d
    };
    let [a, b, c] = if side(d) > 0.0 { [a, b, c] } else { [a, c, b] };
    Some([a, b, c, d].map(index))
}
