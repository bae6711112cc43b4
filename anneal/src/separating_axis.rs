//! The separating-axis test: all directions that can separate two polytopes, for pairs that the search does not decide.

use crate::difference::{Posed, Solid};
use crate::gauge::Gauge;
use nalgebra::Vector3;

/// Largest quotient `n·d / (h_A(n) + h_B(−n))` over all face normals of both hulls and all cross products of their
/// edges, and its direction.
///
/// For two polytopes this is the exact gauge, because the difference body has no other faces. `None` if a body is not a
/// mesh. Cost: edges × edges.
pub(crate) fn best_axis(a: &Posed<'_>, b: &Posed<'_>, d: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
    let of_a = Directions::of(a)?;
    let of_b = Directions::of(b)?;
    let mut best = (f64::NEG_INFINITY, Vector3::zeros());
    let mut evaluate = |axis: Vector3<f64>| {
        let Some(axis) = axis.try_normalize(1e-12) else { return };
        let axis = if axis.dot(d) < 0.0 { -axis } else { axis };
        let (value, _) = Gauge::along(a, b, d, &axis);
        if value > best.0 {
            best = (value, axis);
        }
    };
    of_a.faces.iter().chain(&of_b.faces).copied().for_each(&mut evaluate);
    for e in &of_a.edges {
        for f in &of_b.edges {
            evaluate(e.cross(f));
        }
    }
    Some(best)
}

/// The least depth of an overlap along the face normals of two hulls; `None` if a body is not a mesh or has many faces.
///
/// Where the line of centres leaves the difference body through an edge or a corner, as for aligned cubes, many
/// directions have the same quotient but different depths; the least depth is that of a face. Cost: faces × vertices.
pub(crate) fn depth_across_faces(a: &Posed<'_>, b: &Posed<'_>, d: &Vector3<f64>) -> Option<f64> {
    const FACES: usize = 200;
    let mut least = f64::INFINITY;
    for (posed, other, outwards) in [(a, b, 1.0), (b, a, -1.0)] {
        let Solid::Body(body) = posed.solid else { return None };
        let hull = body.mesh()?.hull();
        if hull.triangles.len() > FACES {
            return None;
        }
        for triangle in &hull.triangles {
            let [p, q, r] = triangle.map(|v| hull.vertices[v as usize]);
            let Some(normal) = (q - p).cross(&(r - p)).try_normalize(0.0) else {
                continue;
            };
            let own = posed.size * normal.dot(&p.coords);
            let normal = posed.rotation * normal;
            least = least.min(own + other.reach(&-normal) - outwards * normal.dot(d));
        }
    }
    Some(least)
}

/// Face normals and edge directions of a hull in world axes, without parallel duplicates.
struct Directions {
    faces: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
}

impl Directions {
    fn of(posed: &Posed<'_>) -> Option<Self> {
        let Solid::Body(body) = posed.solid else { return None };
        let hull = body.mesh()?.hull();
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

#[cfg(test)]
mod tests {
    use super::best_axis;
    use crate::difference::{Posed, Solid};
    use crate::gauge::{Gauge, Search};
    use nalgebra::{Matrix3, Vector3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use stereology_shape::{Body, UnitBody, isotropic_rotation};

    const SEARCH: Search = Search {
        enough: f64::INFINITY,
        precision: 1e-13,
        steps: 200,
    };

    /// The portal search and the separating axes give the same number, for deep overlaps and for separate bodies.
    #[test]
    fn searching_finds_the_best_axis() {
        let bodies = [Body::rock(1), Body::rock(2), Body::cuboid([1.0, 2.0, 0.3]).unwrap()];
        let bodies: Vec<UnitBody> = bodies.iter().map(UnitBody::new).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for case in 0..60 {
            let turns: [Matrix3<f64>; 2] =
                std::array::from_fn(|_| isotropic_rotation(&mut rng).to_rotation_matrix().into_inner());
            let a = Posed {
                solid: Solid::Body(&bodies[case % 3]),
                size: 1.0,
                rotation: &turns[0],
            };
            let b = Posed {
                solid: Solid::Body(&bodies[case / 3 % 3]),
                size: 0.7,
                rotation: &turns[1],
            };
            let d = Vector3::from_fn(|_, _| 2.0 * rng.random::<f64>() - 1.0);
            let found = Gauge::search(&a, &b, &d, &SEARCH);
            let (expected, _) = best_axis(&a, &b, &d).unwrap();
            assert!(
                (found.value / expected - 1.0).abs() < 1e-9,
                "{case}: {} {expected}",
                found.value
            );
            assert!(found.at_most >= expected * (1.0 - 1e-12));
        }
    }

    /// For aligned cubes the ray meets corners and edges of the difference body, and the gauge is the largest
    /// component.
    #[test]
    fn aligned_cubes_have_the_largest_component() {
        let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
        let turn = Matrix3::identity();
        let posed = Posed {
            solid: Solid::Body(&cube),
            size: cube.body().size(),
            rotation: &turn,
        };
        for k in 1..125_i32 {
            let d = Vector3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25)) * 0.25;
            let found = Gauge::search(&posed, &posed, &d, &SEARCH);
            let (axis, _) = best_axis(&posed, &posed, &d).unwrap();
            assert!((axis - d.max()).abs() < 1e-12, "{d:?}");
            assert!((found.value - d.max()).abs() < 1e-9 || found.at_most > d.max(), "{d:?}");
        }
    }

    /// The contact points of both shrunken bodies coincide in world coordinates.
    #[test]
    fn bodies_meet_in_one_point() {
        let rock = UnitBody::new(&Body::rock(5));
        let ball = UnitBody::new(&Body::ellipsoid([1.0, 0.7, 0.5]).unwrap());
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..50 {
            let turns: [Matrix3<f64>; 2] =
                std::array::from_fn(|_| isotropic_rotation(&mut rng).to_rotation_matrix().into_inner());
            let a = Posed {
                solid: Solid::Body(&rock),
                size: 1.0,
                rotation: &turns[0],
            };
            let b = Posed {
                solid: Solid::Body(&ball),
                size: 1.3,
                rotation: &turns[1],
            };
            let d = Vector3::from_fn(|_, _| 2.0 * rng.random::<f64>() - 1.0);
            let found = Gauge::search(&a, &b, &d, &SEARCH);
            let gap = d + found.on_b * found.value - found.on_a * found.value;
            assert!(gap.norm() < 1e-5, "{gap:?}");
        }
    }
}
