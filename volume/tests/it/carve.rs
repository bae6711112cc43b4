//! A carved mesh is the same surface, without gaps, in the solid's colours.

use std::ops::ControlFlow;

use nalgebra::{Point3, UnitQuaternion, Vector3, center};
use ndarray::Array4;
use proptest::prelude::*;
use stereology_shape::{Arrangement, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody};
use stereology_volume::{CarveError, CarveOptions, Carved, Residual, Solid};

fn solid(size: f64) -> Solid {
    let particle = Particle {
        shape: 0,
        size,
        category: 0,
        position: Point3::new(9.0, 10.0, 11.0),
        orientation: UnitQuaternion::identity(),
    };
    let sphere = UnitBody::new(&Body::sphere(1.0).unwrap());
    let ripple = Array4::from_shape_fn((20, 20, 20, 3), |(z, y, x, c)| {
        if c == 0 { 0.01 * ((x + y + z) % 5) as f32 } else { 0.0 }
    });
    let residual = Residual {
        particles: ripple.clone(),
        binder: ripple,
        voxel: 1.0,
    };
    let period = PeriodicBox::new(Vector3::repeat(20.0)).unwrap();
    Solid::new(
        Arrangement::new(vec![sphere], vec![particle], period).unwrap(),
        vec![[0.9, 0.2, 0.1]],
        [0.3, 0.3, 0.8],
        Some(residual),
    )
    .unwrap()
}

fn carve(solid: &Solid, mesh: &TriangleMesh, options: &CarveOptions) -> Carved {
    solid
        .carve(mesh, &|p| *p, options, &|_| ControlFlow::Continue(()))
        .unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Bisection keeps a closed mesh closed, its volume and surface to rounding, and its triangles no worse than half
    /// the smallest angle.
    #[test]
    fn the_surface_does_not_change(size in 2.0..16.0_f64, edges in prop::array::uniform3(4.0..15.0_f64), seed in 0_u64..99) {
        let solid = solid(size);
        for body in [Body::cuboid(edges).unwrap(), Body::rock(seed)] {
            let before = body.mesh().unwrap().clone();
            let mut mesh = before.as_triangle_mesh().clone();
            mesh.vertices.iter_mut().for_each(|v| *v += Vector3::repeat(9.0));
            let before = ClosedMesh::try_from(mesh.clone()).unwrap();
            let carved = carve(&solid, &mesh, &CarveOptions::default()).coloured;
            let after = ClosedMesh::try_from(carved.mesh.clone()).unwrap();
            prop_assert!((after.volume() / before.volume() - 1.0).abs() < 1e-9);
            prop_assert!((after.surface_area() / before.surface_area() - 1.0).abs() < 1e-9);
            for (v, colour) in carved.mesh.vertices.iter().zip(&carved.colours) {
                prop_assert_eq!(&solid.colour_at(v)[..], &colour[..3]);
                prop_assert_eq!(colour[3], 1.0);
            }
            prop_assert_eq!(carved.normals.len(), carved.mesh.triangles.len());
        }
    }
}

/// Every edge of two voxels and more shows the colours between its ends.
#[test]
fn edges_resolve_the_texture() {
    let solid = solid(9.0);
    let mut cube = TriangleMesh::cuboid([16.0, 16.0, 0.5]);
    cube.vertices
        .iter_mut()
        .for_each(|v| *v += Vector3::new(10.0, 10.0, 11.0));
    let carved = carve(&solid, &cube, &CarveOptions::default());
    assert_eq!(carved.coarse_edges, 0);
    let mesh = &carved.coloured.mesh;
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let [a, b] = [triangle[k] as usize, triangle[(k + 1) % 3] as usize];
            let [p, q] = [mesh.vertices[a], mesh.vertices[b]];
            if (q - p).norm() >= 2.0 {
                let seen = solid.colour_at(&center(&p, &q));
                let between = |c: usize| 0.5 * (carved.coloured.colours[a][c] + carved.coloured.colours[b][c]);
                // For an odd number of steps the middle was not sampled; the ripple adds its own 0.04.
                assert!((0..3).all(|c| (seen[c] - between(c)).abs() < 0.09), "{p} {q}");
            }
        }
    }
    let few = carve(
        &solid,
        &cube,
        &CarveOptions {
            most_triangles: 200,
            ..CarveOptions::default()
        },
    );
    assert!(few.coarse_edges > 0 && few.coloured.mesh.triangles.len() < 400);
}

#[test]
fn invalid_input_of_carving_is_an_error() {
    let solid = solid(9.0);
    let refused = |mesh: &TriangleMesh, options: CarveOptions| {
        solid
            .carve(mesh, &|p| *p, &options, &|_| ControlFlow::Continue(()))
            .unwrap_err()
    };
    let cube = TriangleMesh::cuboid([1.0; 3]);
    let empty = TriangleMesh {
        triangles: Vec::new(),
        ..cube.clone()
    };
    assert_eq!(refused(&empty, CarveOptions::default()), CarveError::Empty);
    let mut broken = cube.clone();
    broken.triangles[3][1] = 99;
    assert_eq!(
        refused(&broken, CarveOptions::default()),
        CarveError::Index {
            triangle: 3,
            vertices: 8
        }
    );
    let mut nowhere = cube.clone();
    nowhere.vertices[2].x = f64::NAN;
    assert_eq!(refused(&nowhere, CarveOptions::default()), CarveError::NoSize);
    assert!(matches!(
        refused(
            &cube,
            CarveOptions {
                detail: Some(0.0),
                ..CarveOptions::default()
            }
        ),
        CarveError::Options { .. }
    ));
    let stopped = solid.carve(&cube, &|p| *p, &CarveOptions::default(), &|_| ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), CarveError::Cancelled);
}
