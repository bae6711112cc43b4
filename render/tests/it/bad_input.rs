//! Invalid input is refused with a reason.

use nalgebra::{Point3, Vector3};
use std::ops::ControlFlow;
use stereology_render::{
    BlockOptions, Camera, Material, RenderError, RenderOptions, render_block, render_material, render_mesh,
};
use stereology_shape::TriangleMesh;

fn refused(mesh: &TriangleMesh, camera: Camera, options: RenderOptions) -> RenderError {
    render_mesh(mesh, &|_| [0.5; 3], &camera, &options).unwrap_err()
}

#[test]
fn broken_meshes() {
    let small = RenderOptions::default().with_size(8, 8);
    let refused = |mesh: &TriangleMesh| refused(mesh, Camera::default(), small);
    let cube = TriangleMesh::cuboid([1.0; 3]);
    assert_eq!(refused(&TriangleMesh::default()), RenderError::Empty);
    let mut beyond = cube.clone();
    beyond.triangles[3][1] = 99;
    assert_eq!(
        refused(&beyond),
        RenderError::Index {
            triangle: 3,
            vertices: 8
        }
    );
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut mesh = cube.clone();
        mesh.vertices[5].y = bad;
        assert_eq!(refused(&mesh), RenderError::Vertices { vertex: Some(5) });
    }
    assert_eq!(
        refused(&cube.mapped(|_| Point3::origin())),
        RenderError::Vertices { vertex: None }
    );
}

/// Open meshes and triangles without area are rendered.
#[test]
fn poor_meshes_are_rendered() {
    let small = RenderOptions::default().with_size(16, 16);
    let mut poor = TriangleMesh::cuboid([1.0; 3]);
    poor.triangles.truncate(7);
    poor.triangles.push([0, 0, 0]);
    poor.triangles.push([0, 1, 1]);
    assert!(render_mesh(&poor, &|_| [f32::NAN, 2.0, -1.0], &Camera::default(), &small).is_ok());
    for size in [1e-30, 1e30] {
        assert!(render_mesh(&poor.mapped(|p| p * size), &|_| [0.5; 3], &Camera::default(), &small).is_ok());
    }
}

#[test]
fn impossible_options() {
    let cube = TriangleMesh::cuboid([1.0; 3]);
    let (camera, options) = (Camera::default(), RenderOptions::default());
    for (camera, options) in [
        (
            Camera {
                elevation: 90.0,
                ..camera
            },
            options,
        ),
        (
            Camera {
                azimuth: f64::NAN,
                ..camera
            },
            options,
        ),
        (
            Camera {
                field_of_view: 0.0,
                ..camera
            },
            options,
        ),
        (
            Camera {
                distance: Some(-1.0),
                ..camera
            },
            options,
        ),
        (camera, options.with_size(0, 5)),
        (camera, options.with_size(u32::MAX, u32::MAX)),
        (camera, options.with_samples(0)),
        (camera, RenderOptions { gloss: 2.0, ..options }),
    ] {
        assert!(matches!(refused(&cube, camera, options), RenderError::Options { .. }));
    }
    let sides = Vector3::new(1.0, 0.0, 1.0);
    let refused = render_block(&|_| [0.5; 3], sides, &BlockOptions::default());
    assert!(matches!(refused, Err(RenderError::Sides { .. })));
}

/// Distances to voids may be infinite where there is no void, on either side of a wall; a distance of NaN ends a ray.
#[test]
fn distances_that_are_infinite_or_nan() {
    let cube = TriangleMesh::cuboid([1.0; 3]);
    let options = RenderOptions::default().with_size(48, 48);
    let image = |distance: &(dyn Fn(&Point3<f64>) -> f64 + Sync)| {
        let material = Material::new(&|_| [0.7; 3]).with_voids(distance);
        render_material(&cube, &material, &Camera::default(), &options, &|_| {
            ControlFlow::Continue(())
        })
        .unwrap()
    };
    let ball = |p: &Point3<f64>| (p - Point3::new(0.0, 0.5, 0.0)).norm() - 0.35;
    // The wall of the void lies in the plane beyond which the distance is infinite.
    let walled = |p: &Point3<f64>| if p.x > 0.0 { f64::INFINITY } else { ball(p).max(p.x) };
    let whole = image(&|_| f64::INFINITY);
    assert_ne!(image(&walled), whole);
    image(&|p| if p.z > 0.1 { f64::NAN } else { ball(p) });
    image(&|p| if p.x > 0.1 { f64::NEG_INFINITY } else { ball(p) });
}
