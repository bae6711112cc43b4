//! Closed meshes that the figures carve from solids: vases, bowls, columns, knots; z points up.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use stereology::shape::TriangleMesh;

/// Vertices around the axis of a body of revolution, and around a tube.
const AROUND: u32 = 192;

/// The body of revolution of an outline [radius, height] about the z axis. The outline begins and ends on the axis and
/// runs up the outer side.
fn turned_body(outline: &[[f64; 2]]) -> TriangleMesh {
    turned_with(outline, |_| 1.0)
}

/// [`turned_body`] with its radius multiplied by `share` of the angle, for flutes and corners.
fn turned_with(outline: &[[f64; 2]], share: impl Fn(f64) -> f64) -> TriangleMesh {
    let rings = &outline[1..outline.len() - 1];
    let ends = [outline[0], outline[outline.len() - 1]].map(|[_, z]| Point3::new(0.0, 0.0, z));
    let on_rings = rings.iter().flat_map(|&[radius, z]| {
        let share = &share;
        (0..AROUND).map(move |k| {
            let angle = TAU * f64::from(k) / f64::from(AROUND);
            let r = radius * share(angle);
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        })
    });
    let vertices: Vec<Point3<f64>> = ends.into_iter().chain(on_rings).collect();
    let at = |ring: u32, k: u32| 2 + ring * AROUND + k % AROUND;
    let last = rings.len() as u32 - 1;
    let mut triangles = Vec::new();
    for k in 0..AROUND {
        triangles.push([0, at(0, k + 1), at(0, k)]);
        triangles.push([1, at(last, k), at(last, k + 1)]);
        for ring in 0..last {
            triangles.push([at(ring, k), at(ring, k + 1), at(ring + 1, k)]);
            triangles.push([at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    TriangleMesh { vertices, triangles }
}

/// A smooth outline through `f(t)`, t from 0 to 1.
fn along(f: impl Fn(f64) -> [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    const STEPS: u32 = 120;
    (0..=STEPS).map(move |i| f(f64::from(i) / f64::from(STEPS)))
}

/// A vase, open at the top: foot, belly, neck and lip.
pub fn vase(height: f64) -> TriangleMesh {
    let wall = 0.035;
    let outside = |t: f64| 0.20 + 0.13 * (TAU * (0.75 * t + 0.02)).sin() + 0.05 * t * t * t + 0.02 * (1.0 - t);
    let inside = move |t: f64| [(outside(t) - wall).max(0.01), wall + (1.0 - wall) * t];
    let outline: Vec<[f64; 2]> = std::iter::once([0.0, 0.0])
        .chain(along(move |t| [outside(t), t]))
        .chain(along(move |t| inside(1.0 - t)))
        .chain([[0.0, wall]])
        .map(|[radius, z]| [height * radius, height * z])
        .collect();
    turned_body(&outline)
}

/// A bowl of this radius at its lip.
pub fn bowl(radius: f64) -> TriangleMesh {
    let foot = 0.34;
    let outside = move |t: f64| [foot + (1.0 - foot) * t.sqrt(), 0.05 + 0.55 * t * (0.4 + 0.6 * t)];
    let inside = move |t: f64| [(1.0 - 0.07) * t, 0.13 + 0.47 * t.powf(2.4)];
    let outline: Vec<[f64; 2]> = [[0.0, 0.0], [foot, 0.0]]
        .into_iter()
        .chain(along(outside))
        .chain(along(move |t| inside(1.0 - t)))
        .map(|[r, z]| [radius * r, radius * z])
        .collect();
    turned_body(&outline)
}

/// A round slab whose edge is rounded.
pub fn slab(radius: f64, height: f64) -> TriangleMesh {
    let edge = 0.5 * height;
    let round = move |t: f64| {
        let angle = TAU * 0.5 * (t - 0.5);
        [radius - edge + edge * angle.cos(), edge + edge * angle.sin()]
    };
    let outline: Vec<[f64; 2]> = std::iter::once([0.0, 0.0])
        .chain(along(round))
        .chain([[0.0, height]])
        .collect();
    turned_body(&outline)
}

/// A fluted column with base and capital.
pub fn column(radius: f64, height: f64) -> TriangleMesh {
    let swell = move |t: f64| {
        let end = 0.22 * ((-40.0 * t).exp() + (-40.0 * (1.0 - t)).exp());
        [radius * (1.0 - 0.12 * t + end), height * t]
    };
    let outline: Vec<[f64; 2]> = std::iter::once([0.0, 0.0])
        .chain(along(swell))
        .chain([[0.0, height]])
        .collect();
    turned_with(&outline, |angle| 1.0 - 0.045 * (10.0 * angle).sin().abs())
}

/// A trefoil knot of a tube, its axis along z; it reaches 3 `scale` + `tube` from the axis. Tubes wider than 0.6
/// `scale` run into one another.
pub fn knot(scale: f64, tube: f64) -> TriangleMesh {
    const ALONG: u32 = 480;
    const ACROSS: u32 = 64;
    let curve = |t: f64| {
        scale
            * Vector3::new(
                t.sin() + 2.0 * (2.0 * t).sin(),
                t.cos() - 2.0 * (2.0 * t).cos(),
                -(3.0 * t).sin(),
            )
    };
    let step = TAU / f64::from(ALONG);
    let mut vertices = Vec::new();
    for i in 0..ALONG {
        let t = step * f64::from(i);
        let tangent = (curve(t + 0.5 * step) - curve(t - 0.5 * step)).normalize();
        // The knot never runs along its axis.
        let a = tangent.cross(&Vector3::z()).normalize();
        let b = tangent.cross(&a);
        for k in 0..ACROSS {
            let angle = TAU * f64::from(k) / f64::from(ACROSS);
            vertices.push(Point3::from(curve(t) + tube * (angle.cos() * a + angle.sin() * b)));
        }
    }
    let at = |i: u32, k: u32| i % ALONG * ACROSS + k % ACROSS;
    let triangles = (0..ALONG)
        .flat_map(|i| (0..ACROSS).map(move |k| [i, k]))
        .flat_map(|[i, k]| {
            [
                [at(i, k), at(i, k + 1), at(i + 1, k)],
                [at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)],
            ]
        })
        .collect();
    TriangleMesh { vertices, triangles }
}

#[cfg(test)]
mod tests {
    use stereology::shape::ClosedMesh;

    #[test]
    fn all_are_closed_and_turned_outwards() {
        for mesh in [
            super::vase(1.0),
            super::bowl(1.0),
            super::slab(1.0, 0.1),
            super::column(0.2, 1.0),
            super::knot(1.0, 0.6),
        ] {
            let closed = ClosedMesh::try_from(mesh).expect("a closed mesh");
            assert!(closed.repairs().is_empty(), "{:?}", closed.repairs());
        }
    }
}
