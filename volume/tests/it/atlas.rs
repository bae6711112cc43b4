//! A baked atlas shows the solid's colours on the mesh.

use std::ops::ControlFlow;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::Array4;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, Texture, TriangleMesh, UnitBody};
use stereology_volume::{BakeOptions, Baked, CarveError, Residual, Solid};

/// Four coloured balls in a box of side 10 that touch nothing.
fn balls() -> Solid {
    let ball = |x: f64, y: f64, z: f64| Particle {
        shape: 0,
        size: 4.4,
        category: 0,
        position: Point3::new(x, y, z),
        orientation: UnitQuaternion::identity(),
    };
    let particles = vec![
        ball(2.5, 2.5, 2.5),
        ball(7.5, 7.5, 2.5),
        ball(2.5, 7.5, 7.5),
        ball(7.5, 2.5, 7.5),
    ];
    let colours = vec![[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9], [0.9, 0.9, 0.1]];
    let sphere = UnitBody::new(&Body::sphere(1.0).unwrap());
    let period = PeriodicBox::new(Vector3::repeat(10.0)).unwrap();
    Solid::new(
        Arrangement::new(vec![sphere], particles, period).unwrap(),
        colours,
        [0.5; 3],
        None,
    )
    .unwrap()
}

fn bake(solid: &Solid, mesh: &TriangleMesh, pixels: u32) -> Baked {
    let options = BakeOptions {
        pixels,
        ..BakeOptions::default()
    };
    solid
        .bake(mesh, &|p| *p, &options, &|_| ControlFlow::Continue(()))
        .unwrap()
}

/// Bilinear filtering, as in a viewer.
fn bilinear(texture: &Texture, [u, v]: [f64; 2]) -> [f64; 4] {
    let (x, y) = (u * f64::from(texture.width) - 0.5, v * f64::from(texture.height) - 0.5);
    let mut colour = [0.0; 4];
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let weight = (1.0 - (x - x.floor() - dx).abs()) * (1.0 - (y - y.floor() - dy).abs());
        #[allow(clippy::cast_possible_truncation, reason = "clamped to the picture")]
        let inside = |x: f64, side: u32| x.clamp(0.0, f64::from(side - 1)) as usize;
        let at =
            inside(y.floor() + dy, texture.height) * texture.width as usize + inside(x.floor() + dx, texture.width);
        (0..4).for_each(|c| colour[c] += weight * f64::from(texture.rgba[4 * at + c]) / 255.0);
    }
    colour
}

/// The three corners of each triangle, then random points of it: on the mesh, and in the texture.
fn seen_points(baked: &Baked, each: usize) -> Vec<(Point3<f64>, [f64; 2])> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut points = Vec::new();
    let textured = &baked.textured;
    for (triangle, uvs) in textured.mesh.triangles.iter().zip(&textured.uvs) {
        let corners = triangle.map(|i| textured.mesh.vertices[i as usize]);
        for i in 0..3 + each {
            let mut w = [0.0; 3];
            if i < 3 {
                w[i] = 1.0;
            } else {
                w = [rng.random::<f64>(), rng.random(), rng.random()].map(|u| -(1.0 - u).ln());
                let sum: f64 = w.iter().sum();
                w = w.map(|w| w / sum);
            }
            let point = (0..3).fold(Vector3::zeros(), |p, k| p + w[k] * corners[k].coords);
            let uv = [0, 1].map(|c| (0..3).map(|k| w[k] * uvs[k][c]).sum());
            points.push((Point3::from(point), uv));
        }
    }
    points
}

/// A mesh somewhere in the middle of the box.
fn somewhere(body: &Body, scale: f64) -> TriangleMesh {
    let mut mesh = body.mesh().unwrap().as_triangle_mesh().clone();
    mesh.vertices
        .iter_mut()
        .for_each(|v| *v = Point3::from(scale * v.coords) + Vector3::new(4.7, 5.1, 4.4));
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]

    /// Farther from any border than the texels that a lookup blends, the texture has the solid's colour to rounding, at
    /// corners and edges too; elsewhere it is between the nearby colours.
    #[test]
    fn the_texture_shows_the_solid(seed in 0_u64..99, edges in prop::array::uniform3(3.0..9.0_f64), pixels in 150_u32..400) {
        let solid = balls();
        for mesh in [somewhere(&Body::cuboid(edges).unwrap(), 1.0), somewhere(&Body::rock(seed), 6.0)] {
            let baked = bake(&solid, &mesh, pixels);
            // A lookup at the edge of a texel blends points up to 3/2 texels away along each axis.
            let blur = 1.5 * 2.0_f64.sqrt() * baked.texel;
            let (mut error, mut near, mut count) = (0.0, 0.0, 0.0);
            for (p, uv) in seen_points(&baked, 40) {
                prop_assert!(uv.iter().all(|x| (0.0..=1.0).contains(x)));
                let (seen, truth) = (bilinear(&baked.textured.texture, uv), solid.colour_at(&p));
                let off = (0..3).map(|c| (seen[c] - f64::from(truth[c])).abs()).fold(0.0, f64::max);
                prop_assert!((seen[3] - 1.0).abs() < 1e-9);
                if solid.distance_at(&p).abs() > blur {
                    prop_assert!(off < 0.5 / 255.0 + 1e-6, "{} at {} {:?}", off, p, uv);
                } else {
                    near += 1.0;
                    error += off;
                }
                count += 1.0;
            }
            prop_assert!(near / count < 0.4, "{} of {}", near, count);
            prop_assert!(error / count < 0.06, "{}", error / count);
        }
    }
}

/// The two triangles of a face of a cube share a chart, and few texels are unused.
#[test]
fn little_of_the_texture_is_unused() {
    let solid = balls();
    let cube = bake(&solid, &somewhere(&Body::cuboid([6.0; 3]).unwrap(), 1.0), 512);
    assert_eq!(cube.charts, 6);
    assert!((cube.texel - 6.0 / 168.0).abs() < 1e-6, "{}", cube.texel);
    let mesh = TriangleMesh::icosphere(3.0, 4);
    let ball = bake(&solid, &mesh, 1024);
    assert!(ball.charts < mesh.triangles.len() * 11 / 20, "{}", ball.charts);
    assert!(ball.used > 0.9, "{}", ball.used);
}

/// Voids are cut out where alpha is below one half; without voids nothing is.
#[test]
fn voids_are_holes() {
    let foam = balls().with_voids(&[0]).unwrap();
    let mesh = somewhere(&Body::cuboid([6.0; 3]).unwrap(), 1.0);
    let baked = bake(&foam, &mesh, 300);
    for (p, uv) in seen_points(&baked, 200) {
        let alpha = bilinear(&baked.textured.texture, uv)[3];
        if foam.distance_at(&p).abs() > 1.5 * 2.0_f64.sqrt() * baked.texel {
            let truth = if foam.is_void_at(&p) { 0.0 } else { 1.0 };
            assert!((alpha - truth).abs() < 1e-9, "{alpha} at {p}");
        }
    }
    assert!(!baked.textured.texture.is_opaque());
}

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let solid = balls();
    let mesh = somewhere(&Body::rock(3), 6.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake(&solid, &mesh, 333)).textured
    };
    assert!(with(1) == with(3));
}

/// Open meshes, edges of three triangles, slivers, lines and points all get a chart.
#[test]
fn any_triangles_can_be_baked() {
    let solid = balls();
    let at = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let mesh = TriangleMesh {
        vertices: vec![
            at(0.0, 0.0, 0.0),
            at(4.0, 0.0, 0.0),
            at(0.0, 3.0, 0.0),
            at(0.0, -3.0, 1.0),
            at(1.0, 0.0, 3.0),
            at(2.0, 0.0, 0.0),
            at(3.0, 1e-12, 0.0),
        ],
        triangles: vec![
            [0, 1, 2],
            [0, 1, 3],
            [0, 1, 4],
            [0, 5, 1],
            [0, 6, 1],
            [2, 2, 2],
            [2, 2, 3],
            [0, 2, 1],
        ],
    };
    let baked = bake(&solid, &mesh, 200);
    for (p, uv) in seen_points(&baked, 100) {
        let (seen, truth) = (bilinear(&baked.textured.texture, uv), solid.colour_at(&p));
        if solid.distance_at(&p).abs() > 1.5 * 2.0_f64.sqrt() * baked.texel {
            assert!(
                (0..3).all(|c| (seen[c] - f64::from(truth[c])).abs() < 0.003),
                "{p} {uv:?}"
            );
        }
    }
}

/// The coarseness of the texture is measured in voxels of the residual.
#[test]
fn coarseness_is_reported() {
    let ripple = Array4::from_elem((20, 20, 20, 3), 0.01_f32);
    let residual = Residual {
        particles: ripple.clone(),
        binder: ripple,
        voxel: 0.5,
    };
    let period = PeriodicBox::new(Vector3::repeat(10.0)).unwrap();
    let solid = Solid::new(
        Arrangement::new(vec![], vec![], period).unwrap(),
        vec![],
        [0.3; 3],
        Some(residual),
    )
    .unwrap();
    let baked = bake(&solid, &TriangleMesh::cuboid([5.0; 3]), 96);
    assert!((baked.coarseness.unwrap() - baked.texel / 0.5).abs() < 1e-12);
    assert_eq!(bake(&balls(), &TriangleMesh::cuboid([5.0; 3]), 96).coarseness, None);
}

#[test]
fn invalid_input_of_baking_is_an_error() {
    let solid = balls();
    let refused = |mesh: &TriangleMesh, pixels: u32| {
        let options = BakeOptions {
            pixels,
            ..BakeOptions::default()
        };
        let baked = solid.bake(mesh, &|p| *p, &options, &|_| ControlFlow::Continue(()));
        baked.unwrap_err()
    };
    let ball = TriangleMesh::icosphere(3.0, 4);
    for pixels in [0, 16_385] {
        assert_eq!(refused(&ball, pixels), CarveError::Pixels { pixels });
    }
    // The reported side is sufficient, and one texel less is not.
    let CarveError::Crowded { enough, .. } = refused(&ball, 20) else {
        panic!("not crowded")
    };
    let enough = u32::try_from(enough).unwrap();
    assert!(matches!(refused(&ball, enough - 1), CarveError::Crowded { .. }));
    bake(&solid, &ball, enough);
    let mut empty = ball.clone();
    empty.triangles.clear();
    assert_eq!(refused(&empty, 100), CarveError::Empty);
    let mut point = ball.clone();
    point.vertices.iter_mut().for_each(|v| *v = Point3::origin());
    assert_eq!(refused(&point, 100), CarveError::NoSize);
    let tiny = solid.bake(&ball, &|_| Point3::origin(), &BakeOptions::default(), &|_| {
        ControlFlow::Continue(())
    });
    assert_eq!(tiny.unwrap_err(), CarveError::NoSize);
    let stopped = solid.bake(&ball, &|p| *p, &BakeOptions::default(), &|_| ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), CarveError::Cancelled);
}
