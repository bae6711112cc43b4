//! Representations of bodies while they are packed.

use crate::convex_parts::ConvexParts;
use nalgebra::{Point3, Vector3};
use stereology_shape::{ClosedMesh, UnitBody, convex_hull};

/// Representation of a mesh while it is packed. The certificate always checks the body itself.
///
/// "Annealing times can also be improved by substituting simpler proxy meshes for complex particle shapes": Jagnow et
/// al. 2004, section 5. Every proxy contains its body, so if the proxies do not overlap, the bodies do not either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Proxy {
    /// The body itself if it is convex, otherwise its convex parts: particles can enter the concavities of others.
    #[default]
    Parts,
    /// The convex hull: about twenty times faster, but concavities stay empty.
    Hull,
    /// The intersection of 26 half-spaces around the body, one for each direction to a corner, edge and face of a cube:
    /// for meshes of many thousand vertices.
    Outline,
}

/// A convex part of a body, in unit coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Vector from the centroid of the body to that of the part.
    pub(crate) centre: Vector3<f64>,
    /// Vertices relative to `centre`.
    pub(crate) points: Vec<Vector3<f64>>,
    /// Distance of the farthest vertex.
    pub(crate) reach: f64,
}

/// The parts of a body and their largest distance from its centroid when swollen by up to a twentieth; no parts if the
/// body represents itself.
#[derive(Clone, Debug)]
pub(crate) struct StandIn {
    pub(crate) parts: Vec<Part>,
    pub(crate) reach: f64,
}

impl StandIn {
    pub(crate) fn of(body: &UnitBody, proxy: Proxy, tolerance: f64) -> Self {
        let hulls = match (proxy, body.mesh()) {
            (Proxy::Parts, Some(_)) if !body.is_convex() => ConvexParts::of(body, tolerance).hulls().to_vec(),
            (Proxy::Outline, Some(_)) => outline(body).into_iter().collect(),
            _ => Vec::new(),
        };
        let parts: Vec<Part> = hulls.iter().map(Part::new).collect();
        let reach = parts
            .iter()
            .flat_map(|part| part.points.iter().map(|p| (part.centre + p).norm() + 0.05 * p.norm()))
            .fold(0.0, f64::max);
        Self {
            reach: if parts.is_empty() {
                body.bounding_radius()
            } else {
                reach
            },
            parts,
        }
    }
}

impl Part {
    fn new(hull: &ClosedMesh) -> Self {
        let centre = hull.centroid().coords;
        let points: Vec<Vector3<f64>> = hull.vertices().iter().map(|v| v.coords - centre).collect();
        let reach = points.iter().map(Vector3::norm).fold(0.0, f64::max);
        Self { centre, points, reach }
    }
}

/// The polytope between the tangent planes of 26 directions.
///
/// Computed as the polar dual of the hull of the poles `n / h` of the planes: each face of that hull is a corner of the
/// polytope.
fn outline(body: &UnitBody) -> Option<ClosedMesh> {
    let inner = body.mesh()?.hull();
    let middle = inner.vertices.iter().map(|v| v.coords).sum::<Vector3<f64>>() / inner.vertices.len() as f64;
    let mut poles = Vec::with_capacity(26);
    for k in 0..27 {
        let direction = Vector3::new(k % 3, k / 3 % 3, k / 9).map(|i| f64::from(i) - 1.0);
        if let Some(normal) = direction.try_normalize(0.5) {
            let height = normal.dot(&(body.support(&normal).coords - middle));
            // Slightly enlarged, so that the body stays inside in spite of rounding.
            poles.push(Point3::from(normal / (height * (1.0 + 1e-9))));
        }
    }
    let dual = convex_hull(&poles).ok()?;
    let corners: Vec<Point3<f64>> = dual
        .triangles()
        .iter()
        .filter_map(|triangle| {
            let [p, q, r] = triangle.map(|v| dual.vertices()[v as usize]);
            let normal = (q - p).cross(&(r - p)).try_normalize(0.0)?;
            Some(Point3::from(middle + normal / normal.dot(&p.coords)))
        })
        .collect();
    convex_hull(&corners).ok()
}

#[cfg(test)]
mod tests {
    use super::{Proxy, StandIn};
    use nalgebra::Vector3;
    use stereology_shape::{Body, UnitBody};

    /// In every direction an outline extends at least as far as its body and not much farther.
    #[test]
    fn outlines_contain_their_bodies() {
        for body in [
            Body::rock(4),
            Body::cylinder(1.0, 2.0).unwrap(),
            Body::cuboid([1.0, 2.0, 3.0]).unwrap(),
        ] {
            let body = UnitBody::new(&body);
            let stand_in = StandIn::of(&body, Proxy::Outline, 0.05);
            let part = &stand_in.parts[0];
            for k in 0..500_u32 {
                let (z, angle) = (f64::from(k) / 250.0 - 1.0, 2.4 * f64::from(k));
                let around = (1.0 - z * z).max(0.0).sqrt();
                let normal = Vector3::new(around * angle.cos(), around * angle.sin(), z);
                let reach = part
                    .points
                    .iter()
                    .map(|p| normal.dot(&(p + part.centre)))
                    .fold(0.0, f64::max);
                let own = normal.dot(&body.support(&normal).coords);
                assert!(own <= reach && reach < 1.6 * own, "{own} {reach}");
            }
        }
    }
}
