//! The separating-axis test: for polytopes that a search cannot settle, every direction that could part them.

use crate::difference::Posed;
use crate::gauge::Gauge;
use nalgebra::Vector3;

/// Largest quotient `n·d / (h_A(n) + h_B(−n))` over all face normals of both hulls and all cross products of their edges, and its direction.
///
/// For two polytopes this is the exact gauge: the difference body has no other faces. `None` if a body is no mesh. Cost: edges × edges.
pub(crate) fn best_axis(a: &Posed<'_>, b: &Posed<'_>, d: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
    let of_a = Directions::of(a)?;
    let of_b = Directions::of(b)?;
    let mut best = (f64::NEG_INFINITY, Vector3::zeros());
    let mut ask = |axis: Vector3<f64>| {
        let Some(axis) = axis.try_normalize(1e-12) else { return };
        let axis = if axis.dot(d) < 0.0 { -axis } else { axis };
        let (value, _) = Gauge::along(a, b, d, &axis);
        if value > best.0 {
            best = (value, axis);
        }
    };
    of_a.faces.iter().chain(&of_b.faces).copied().for_each(&mut ask);
    for e in &of_a.edges {
        for f in &of_b.edges {
            ask(e.cross(f));
        }
    }
    Some(best)
}

/// Face normals and edge directions of a hull in world axes, parallel ones once.
struct Directions {
    faces: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
}

impl Directions {
    fn of(posed: &Posed<'_>) -> Option<Self> {
        let hull = posed.body.mesh()?.hull();
        let (mut faces, mut edges) = (Vec::new(), Vec::new());
        for triangle in &hull.triangles {
            let [p, q, r] = triangle.map(|v| hull.vertices[v as usize]);
            add(&mut faces, (q - p).cross(&(r - p)));
            for edge in [q - p, r - q, p - r] {
                add(&mut edges, edge);
            }
        }
        let turn = |list: Vec<Vector3<f64>>| list.into_iter().map(|v| posed.rotation * v).collect();
        Some(Self {
            faces: turn(faces),
            edges: turn(edges),
        })
    }
}

fn add(list: &mut Vec<Vector3<f64>>, direction: Vector3<f64>) {
    if let Some(unit) = direction.try_normalize(0.0)
        && list.iter().all(|known| known.cross(&unit).norm_squared() > 1e-24)
    {
        list.push(unit);
    }
}
