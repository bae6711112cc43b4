//! Which triangles share which edges, and whether their orientations agree.

use crate::mesh::index::index;
use crate::mesh::mesh_error::MeshError;
use crate::mesh::triangle_mesh::TriangleMesh;

/// For each triangle, the triangle across its edges 0→1, 1→2, 2→0.
pub(crate) type Neighbours = Vec<[u32; 3]>;

/// One side of an edge: the edge's vertices (lower first) and the triangle and corner where it starts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    edge: (u32, u32),
    triangle: u32,
    corner: u8,
}

/// All sides, sorted: a counting sort by the lower vertex, then a sort of each vertex's few sides.
fn sorted_sides(mesh: &TriangleMesh) -> Vec<Side> {
    let vertices = mesh
        .triangles
        .iter()
        .flatten()
        .max()
        .map_or(0, |&most| most as usize + 1);
    let mut starts = vec![0_usize; vertices + 1];
    for &[a, b, c] in &mesh.triangles {
        for lower in [a.min(b), b.min(c), c.min(a)] {
            starts[lower as usize + 1] += 1;
        }
    }
    for v in 1..starts.len() {
        starts[v] += starts[v - 1];
    }
    let mut next = starts.clone();
    let none = Side {
        edge: (0, 0),
        triangle: 0,
        corner: 0,
    };
    let mut sides = vec![none; 3 * mesh.triangles.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for corner in 0..3_u8 {
            let k = usize::from(corner);
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let place = &mut next[a.min(b) as usize];
            sides[*place] = Side {
                edge: (a.min(b), a.max(b)),
                triangle: index(t),
                corner,
            };
            *place += 1;
        }
    }
    for ends in starts.windows(2) {
        sides[ends[0]..ends[1]].sort_unstable();
    }
    sides
}

/// Pairs the triangles across their edges.
///
/// # Errors
///
/// The first edge with one side ([`MeshError::OpenEdge`]) or with more than two ([`MeshError::NonManifoldEdge`]), and
/// their number.
pub(crate) fn neighbours(mesh: &TriangleMesh) -> Result<Neighbours, MeshError> {
    let sides = sorted_sides(mesh);
    let mut across = vec![[u32::MAX; 3]; mesh.triangles.len()];
    let (mut open, mut crowded) = (Vec::new(), Vec::new());
    for group in sides.chunk_by(|a, b| a.edge == b.edge) {
        match group {
            [one, two] => {
                across[one.triangle as usize][usize::from(one.corner)] = two.triangle;
                across[two.triangle as usize][usize::from(two.corner)] = one.triangle;
            }
            [one] => open.push(*one),
            more => crowded.push((more[0], more.len())),
        }
    }
    let place = |side: &Side| {
        let (a, b) = side.edge;
        [a, b].map(|i| mesh.vertices[i as usize].coords.into())
    };
    if let Some(side) = open.first() {
        let [from, to] = place(side);
        return Err(MeshError::OpenEdge {
            triangle: side.triangle as usize,
            from,
            to,
            count: open.len(),
        });
    }
    if let Some((side, triangles)) = crowded.first() {
        let [from, to] = place(side);
        return Err(MeshError::NonManifoldEdge {
            from,
            to,
            triangles: *triangles,
            count: crowded.len(),
        });
    }
    Ok(across)
}

/// Pairs the triangles across edges that have exactly two; `u32::MAX` across other edges.
pub(crate) fn known_neighbours(mesh: &TriangleMesh) -> Neighbours {
    let mut across = vec![[u32::MAX; 3]; mesh.triangles.len()];
    for group in sorted_sides(mesh).chunk_by(|a, b| a.edge == b.edge) {
        if let [one, two] = group {
            across[one.triangle as usize][usize::from(one.corner)] = two.triangle;
            across[two.triangle as usize][usize::from(two.corner)] = one.triangle;
        }
    }
    across
}

/// The connected components of the surface, each a list of triangles, ordered by their lowest triangle.
pub(crate) fn components(across: &Neighbours) -> Vec<Vec<u32>> {
    let mut seen = vec![false; across.len()];
    let mut parts = Vec::new();
    for start in 0..across.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut part = vec![index(start)];
        let mut next = 0;
        while let Some(&t) = part.get(next) {
            next += 1;
            for &other in &across[t as usize] {
                if !std::mem::replace(&mut seen[other as usize], true) {
                    part.push(other);
                }
            }
        }
        parts.push(part);
    }
    parts
}

/// Reverses triangles so that neighbours have the same orientation (the minority of each component is reversed);
/// returns their number. `across` is updated.
///
/// # Errors
///
/// [`MeshError::NotOrientable`] if no choice is consistent (a Klein bottle).
pub(crate) fn orient(mesh: &mut TriangleMesh, across: &mut Neighbours, parts: &[Vec<u32>]) -> Result<usize, MeshError> {
    // None: not reached yet. Some(true): to be reversed if the component's first triangle stays.
    let mut turned: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut total = 0;
    for part in parts {
        turned[part[0] as usize] = Some(false);
        // Components are listed breadth first, so the previous triangle is always decided.
        for &t in part {
            let t = t as usize;
            let own = turned[t].expect("a part lists its triangles breadth first");
            for (k, &other) in across[t].iter().enumerate() {
                let (a, b) = (mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
                let other = other as usize;
                let agrees = has_directed_edge(mesh.triangles[other], b, a);
                let wanted = own == agrees;
                match turned[other] {
                    None => turned[other] = Some(wanted),
                    Some(found) if found != wanted => {
                        let place = [a, b].map(|i| mesh.vertices[i as usize].coords.into());
                        return Err(MeshError::NotOrientable {
                            from: place[0],
                            to: place[1],
                        });
                    }
                    Some(_) => {}
                }
            }
        }
        let minority = part.iter().filter(|&&t| turned[t as usize] == Some(true)).count();
        let flip = if 2 * minority > part.len() {
            Some(false)
        } else {
            Some(true)
        };
        for &t in part {
            if turned[t as usize] == flip {
                turn(mesh, across, t as usize);
                total += 1;
            }
        }
    }
    Ok(total)
}

/// Reverses triangle `t` and keeps its list of neighbours in the order of its edges.
pub(crate) fn turn(mesh: &mut TriangleMesh, across: &mut Neighbours, t: usize) {
    mesh.triangles[t].swap(1, 2);
    across[t].swap(0, 2);
}

fn has_directed_edge(triangle: [u32; 3], from: u32, to: u32) -> bool {
    (0..3).any(|k| triangle[k] == from && triangle[(k + 1) % 3] == to)
}

/// Drops triangles that use a vertex twice; returns how many.
pub(crate) fn drop_degenerate(mesh: &mut TriangleMesh) -> usize {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|&[a, b, c]| a != b && b != c && a != c);
    before - mesh.triangles.len()
}

/// Drops triangles that are there more than once, keeping one where the surface needs it to stay closed (a flap of two
/// goes altogether); returns how many went.
pub(crate) fn drop_duplicates(mesh: &mut TriangleMesh) -> usize {
    let mut order: Vec<([u32; 3], u32)> = Vec::with_capacity(mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let mut key = *corners;
        key.sort_unstable();
        order.push((key, index(t)));
    }
    order.sort_unstable();
    if order.windows(2).all(|pair| pair[0].0 != pair[1].0) {
        return 0;
    }
    let sides = sorted_sides(mesh);
    let edge_uses = |a: u32, b: u32| {
        let from = sides.partition_point(|side| side.edge < (a, b));
        sides[from..].iter().take_while(|side| side.edge == (a, b)).count()
    };
    let mut keep = vec![true; mesh.triangles.len()];
    for group in order.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        let [a, b, c] = group[0].0;
        let needed = [(a, b), (b, c), (a, c)]
            .iter()
            .any(|&(a, b)| (edge_uses(a, b) - group.len()) % 2 == 1);
        for &(_, t) in &group[usize::from(needed)..] {
            keep[t as usize] = false;
        }
    }
    let before = mesh.triangles.len();
    let mut kept = keep.iter();
    mesh.triangles.retain(|_| *kept.next().expect("one mark a triangle"));
    before - mesh.triangles.len()
}
