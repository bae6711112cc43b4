//! The nearest point of a mesh: a tree of boxes over its triangles.

use nalgebra::{Point3, Vector3};

use crate::mesh::index::index;
use crate::mesh::triangle_mesh::TriangleMesh;

/// A tree of bounding boxes of the triangles, split at the median of the longest side.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    /// Corners of the triangles in the order of the leaves.
    triangles: Vec<[Point3<f64>; 3]>,
}

#[derive(Clone, Debug)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    /// First triangle of a leaf, or the second child of an inner node; the first child follows its parent.
    start: u32,
    /// Number of triangles of a leaf; 0 for an inner node.
    count: u32,
}

const LEAF: usize = 4;

impl BoxTree {
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let mut triangles: Vec<[Point3<f64>; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let mut nodes = Vec::new();
        split(&mut nodes, &mut triangles, 0);
        Self { nodes, triangles }
    }

    /// Distance from `p` to the nearest triangle. Cost: about log T.
    pub(crate) fn distance(&self, p: &Point3<f64>) -> f64 {
        let mut best = f64::INFINITY;
        // Depth is at most log2 of the number of triangles, so 64 entries always suffice.
        let mut stack = [(0_u32, 0.0_f64); 64];
        let mut top = 1;
        stack[0] = (0, self.nodes[0].distance_squared(p));
        while top > 0 {
            top -= 1;
            let (at, lower_bound) = stack[top];
            if lower_bound >= best {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for corners in &self.triangles[node.start as usize..][..node.count as usize] {
                    best = best.min(triangle_distance_squared(corners, p));
                }
                continue;
            }
            let halves = [at + 1, node.start].map(|child| (child, self.nodes[child as usize].distance_squared(p)));
            let nearer_first = halves[0].1 <= halves[1].1;
            for half in if nearer_first { [halves[1], halves[0]] } else { halves } {
                if half.1 < best {
                    stack[top] = half;
                    top += 1;
                }
            }
        }
        best.sqrt()
    }
}

impl Node {
    fn distance_squared(&self, p: &Point3<f64>) -> f64 {
        let outside = (self.low - p).sup(&(p - self.high)).sup(&Vector3::zeros());
        outside.norm_squared()
    }
}

fn split(nodes: &mut Vec<Node>, triangles: &mut [[Point3<f64>; 3]], first: usize) {
    let corner = triangles[0][0];
    let (low, high) = triangles
        .iter()
        .flatten()
        .fold((corner, corner), |(low, high), p| (low.inf(p), high.sup(p)));
    let at = nodes.len();
    if triangles.len() <= LEAF {
        nodes.push(Node {
            low,
            high,
            start: index(first),
            count: index(triangles.len()),
        });
        return;
    }
    nodes.push(Node {
        low,
        high,
        start: 0,
        count: 0,
    });
    let axis = (high - low).imax();
    let middle = triangles.len() / 2;
    let centre = |corners: &[Point3<f64>; 3]| corners.iter().map(|p| p[axis]).sum::<f64>();
    triangles.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)));
    let (left, right) = triangles.split_at_mut(middle);
    split(nodes, left, first);
    nodes[at].start = index(nodes.len());
    split(nodes, right, first + middle);
}

/// Squared distance from a point to a triangle (Ericson 2005, *Real-Time Collision Detection*, 5.1.5).
fn triangle_distance_squared([a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.norm_squared();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.norm_squared();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).norm_squared();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.norm_squared();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).norm_squared();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (bp - (c - b) * w).norm_squared();
    }
    let scale = 1.0 / (va + vb + vc);
    (ap - ab * (vb * scale) - ac * (vc * scale)).norm_squared()
}
