//! Bounding volume hierarchy of triangles with four children per node, in single precision.
//!
//! The tree is built by the crate `bvh` (surface area heuristic); every second level of it is removed, so that a ray
//! tests four boxes at once. Boxes are enlarged by more than the rounding error of a ray, so no box that a ray touches
//! is missed; the caller tests the triangles in double precision.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use nalgebra::{Point3, Vector3};

/// A hierarchy of bounding boxes of triangles.
pub(crate) struct Hierarchy {
    nodes: Vec<Node>,
    /// Origin and unit of length of the boxes: all coordinates lie in −1..1.
    middle: Point3<f64>,
    reach: f64,
    /// Largest number of boxes on the stack during a traversal.
    most_waiting: usize,
}

/// Four boxes and their children.
struct Node {
    /// By axis: low and high sides.
    sides: [[[f32; 4]; 2]; 3],
    child: [u32; 4],
}

/// Bit of a child that is a triangle rather than a node.
const TRIANGLE: u32 = 1 << 31;
/// A stack of up to this many boxes needs no heap memory: a tree of 20 levels.
const FEW_WAITING: usize = 64;
/// More than the rounding error of a ray of length 4 in single precision.
const MARGIN: f32 = 2e-6;

struct Facet {
    bounds: Aabb<f64, 3>,
    node: usize,
}

impl Bounded<f64, 3> for Facet {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.bounds
    }
}

impl BHShape<f64, 3> for Facet {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Hierarchy {
    /// Of at least one triangle; not all corners coincide.
    pub(crate) fn new(corners: &[[Point3<f64>; 3]]) -> Self {
        let mut facets: Vec<Facet> = corners
            .iter()
            .map(|[a, b, c]| Facet {
                bounds: Aabb::with_bounds(a.inf(b).inf(c), a.sup(b).sup(c)),
                node: 0,
            })
            .collect();
        let (low, high) = facets
            .iter()
            .map(|facet| (facet.bounds.min, facet.bounds.max))
            .fold((corners[0][0], corners[0][0]), |(low, high), (min, max)| {
                (low.inf(&min), high.sup(&max))
            });
        let mut hierarchy = Self {
            nodes: Vec::with_capacity(corners.len() / 2 + 1),
            middle: nalgebra::center(&low, &high),
            reach: 0.5 * (high - low).norm(),
            most_waiting: 0,
        };
        let tree = Bvh::build(&mut facets);
        hierarchy.take(&tree.nodes, &facets, 0, 1);
        hierarchy
    }

    /// Adds a node of the binary tree together with its grandchildren at level `floor`; returns the number of the new
    /// node.
    #[allow(clippy::cast_possible_truncation, reason = "meshes have fewer than 2^31 triangles")]
    fn take(&mut self, tree: &[BvhNode<f64, 3>], facets: &[Facet], root: usize, floor: usize) -> u32 {
        // A traversal replaces a node on the stack by up to four children.
        self.most_waiting = self.most_waiting.max(3 * floor + 1);
        let mut below = vec![(root, facets_bounds(tree, facets, root))];
        while below.len() < 4 {
            // Replace the largest box that is a node by its two children.
            let opened = below
                .iter()
                .enumerate()
                .filter(|(_, (index, _))| matches!(tree[*index], BvhNode::Node { .. }))
                .max_by(|a, b| area(&a.1.1).total_cmp(&area(&b.1.1)).then(b.0.cmp(&a.0)))
                .map(|(place, _)| place);
            let Some(place) = opened else { break };
            if let BvhNode::Node {
                child_l_index,
                child_l_aabb,
                child_r_index,
                child_r_aabb,
                ..
            } = &tree[below[place].0]
            {
                below[place] = (*child_l_index, *child_l_aabb);
                below.push((*child_r_index, *child_r_aabb));
            }
        }
        let number = self.nodes.len();
        self.nodes.push(Node {
            sides: [[[f32::INFINITY; 4], [f32::NEG_INFINITY; 4]]; 3],
            child: [0; 4],
        });
        for (k, (index, bounds)) in below.into_iter().enumerate() {
            let child = match &tree[index] {
                BvhNode::Leaf { shape_index, .. } => TRIANGLE | *shape_index as u32,
                BvhNode::Node { .. } => self.take(tree, facets, index, floor + 1),
            };
            let [low, high] = [bounds.min, bounds.max].map(|p| ((p - self.middle) / self.reach).map(|x| x as f32));
            let node = &mut self.nodes[number];
            node.child[k] = child;
            for axis in 0..3 {
                node.sides[axis][0][k] = low[axis] - MARGIN;
                node.sides[axis][1][k] = high[axis] + MARGIN;
            }
        }
        number as u32
    }

    /// Visits the triangles whose boxes a ray meets between its origin and `far`, near boxes first.
    ///
    /// `visit` returns the new limit of the distance, or `None` to end. `direction` has length 1; a ray with NaN or
    /// infinite coordinates meets nothing.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "boxes have a margin for single precision"
    )]
    pub(crate) fn visit(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        far: f64,
        mut visit: impl FnMut(usize) -> Option<f64>,
    ) {
        let offset = (origin - self.middle) / self.reach;
        // A ray with NaN would meet every box, including unused ones.
        if !offset.iter().chain(direction.iter()).all(|x| x.is_finite()) {
            return;
        }
        // Far origins exceed single precision: start where the ray comes near the bounding sphere.
        let skipped = (-offset.dot(direction) - 1.5).max(0.0);
        let start = (offset + skipped * direction).map(|x| x as f32);
        let inverse = direction.map(|x| (x as f32).recip());
        let limit = |far: f64| (far / self.reach - skipped) as f32 + 2.0 * MARGIN;
        let mut far = limit(far);
        let (mut few, mut many) = ([(0_u32, 0.0_f32); FEW_WAITING], Vec::new());
        let stack = if self.most_waiting <= FEW_WAITING {
            &mut few[..]
        } else {
            many.resize(self.most_waiting, (0, 0.0));
            &mut many[..]
        };
        // The stack starts with the root.
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (child, near) = stack[waiting];
            if near > far {
                continue;
            }
            if child & TRIANGLE != 0 {
                match visit((child & !TRIANGLE) as usize) {
                    Some(wanted) => far = limit(wanted),
                    None => return,
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let entries = node.entries(&start, &inverse, far);
            let first = waiting;
            for (k, &entry) in entries.iter().enumerate() {
                if entry < f32::INFINITY {
                    // Keep the farthest at the bottom of the stack.
                    let mut place = waiting;
                    while place > first && stack[place - 1].1 < entry {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = (node.child[k], entry);
                    waiting += 1;
                }
            }
        }
    }
}

impl Node {
    /// Distance at which a ray enters each box before `far`; infinite where it does not.
    fn entries(&self, start: &Vector3<f32>, inverse: &Vector3<f32>, far: f32) -> [f32; 4] {
        let (mut near, mut end) = ([0.0_f32; 4], [far; 4]);
        for axis in 0..3 {
            let (from, by) = (start[axis], inverse[axis]);
            let back = usize::from(by < 0.0);
            let (first, last) = (&self.sides[axis][back], &self.sides[axis][1 - back]);
            let along = |sides: &[f32; 4]| sides.map(|side| (side - from) * by);
            // A ray in the plane of a side gives 0 · ∞ = NaN, which compares false: such a side does not bound the
            // interval.
            near = larger(along(first), near);
            end = smaller(along(last), end);
        }
        std::array::from_fn(|k| if near[k] <= end[k] { near[k] } else { f32::INFINITY })
    }
}

/// The larger of each pair, the second where either is NaN: one instruction for all four.
fn larger(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
}

/// The smaller of each pair, likewise.
fn smaller(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
}

fn facets_bounds(tree: &[BvhNode<f64, 3>], facets: &[Facet], index: usize) -> Aabb<f64, 3> {
    match &tree[index] {
        BvhNode::Leaf { shape_index, .. } => facets[*shape_index].bounds,
        BvhNode::Node {
            child_l_aabb,
            child_r_aabb,
            ..
        } => child_l_aabb.join(child_r_aabb),
    }
}

fn area(bounds: &Aabb<f64, 3>) -> f64 {
    let d = bounds.max - bounds.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}
