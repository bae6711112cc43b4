//! Bodies that the tests share, each with a topology of its own.

use nalgebra::{Point3, Rotation3, Vector3};
use stereology_shape::{Body, ClosedMesh, TriangleMesh};

pub(crate) fn body(triangles: TriangleMesh) -> Body {
    Body::from_mesh(ClosedMesh::try_from(triangles).unwrap())
}

/// Sections with two discs or one ring.
pub(crate) fn torus() -> TriangleMesh {
    TriangleMesh::torus(2.0, 0.8, 24, 12)
}

/// The surface of unit cells on a grid, as triangles: any solid of unit cubes that do not touch in edges or corners
/// only.
pub(crate) fn cubes(cells: &[[i32; 3]]) -> TriangleMesh {
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    for cell in cells {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut across = *cell;
                across[axis] += 2 * side - 1;
                if cells.contains(&across) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let first = u32::try_from(mesh.vertices.len()).unwrap();
                for (du, dv) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    let mut corner = *cell;
                    corner[axis] += side;
                    corner[u] += du;
                    corner[v] += dv;
                    mesh.vertices.push(Point3::from(corner.map(f64::from)));
                }
                let faces = if side == 1 {
                    [[0, 1, 2], [0, 2, 3]]
                } else {
                    [[0, 2, 1], [0, 3, 2]]
                };
                mesh.triangles
                    .extend(faces.map(|corners| corners.map(|corner: u32| first + corner)));
            }
        }
    }
    mesh.weld();
    mesh
}

/// A cube with six arms: up to five disjoint profiles.
pub(crate) fn jack() -> TriangleMesh {
    let mut cells = vec![[0, 0, 0]];
    for axis in 0..3 {
        for reach in [-3, -2, -1, 1, 2, 3] {
            let mut cell = [0, 0, 0];
            cell[axis] = reach;
            cells.push(cell);
        }
    }
    cubes(&cells)
}

/// Five cells in an L.
pub(crate) fn angle() -> TriangleMesh {
    cubes(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [0, 2, 0]])
}

/// A cube of three cells an edge without its middle: an inner void.
pub(crate) fn hollow_cube() -> TriangleMesh {
    let all = (0..27).map(|k| [k % 3, k / 3 % 3, k / 9]);
    cubes(&all.filter(|cell| *cell != [1, 1, 1]).collect::<Vec<_>>())
}

/// A mesh turned, stretched and moved.
pub(crate) fn placed(mesh: &TriangleMesh, turn: [f64; 3], scale: f64, shift: [f64; 3]) -> TriangleMesh {
    let rotation = Rotation3::from_euler_angles(turn[0], turn[1], turn[2]);
    mesh.mapped(|p| Point3::from(scale * (rotation * p.coords) + Vector3::from(shift)))
}
