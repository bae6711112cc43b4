//! Invalid solids and images are errors with a reason.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::Array4;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
use stereology_volume::{Axis, Residual, SlicePlane, Solid, SolidError};

const GREY: [f32; 3] = [0.5; 3];

fn particle() -> Particle {
    Particle {
        shape: 0,
        size: 1.0,
        category: 0,
        position: Point3::origin(),
        orientation: UnitQuaternion::identity(),
    }
}

fn solid(particles: Vec<Particle>, colours: Vec<[f32; 3]>, residual: Option<Residual>) -> Result<Solid, SolidError> {
    let bodies = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let period = PeriodicBox::new(Vector3::repeat(4.0)).unwrap();
    let arrangement = Arrangement::new(bodies, particles, period).unwrap();
    Solid::new(arrangement, colours, GREY, residual)
}

fn refused(particle: Particle) -> SolidError {
    solid(vec![particle], vec![GREY], None).unwrap_err()
}

#[test]
fn particles_that_do_not_make_a_solid_are_reported() {
    assert!(matches!(
        refused(Particle {
            size: 9.0,
            ..particle()
        }),
        SolidError::TooLarge { .. }
    ));
    assert!(matches!(
        refused(Particle {
            category: 255,
            ..particle()
        }),
        SolidError::Category { .. }
    ));
    let crowd = vec![
        Particle {
            size: 4.0,
            ..particle()
        };
        1000
    ];
    assert!(matches!(
        solid(crowd, vec![GREY; 1000], None),
        Err(SolidError::Crowded { .. })
    ));
}

#[test]
fn colours_are_one_per_particle_and_finite() {
    assert!(matches!(
        solid(vec![particle()], vec![], None),
        Err(SolidError::Colours { .. })
    ));
    let nan = vec![[0.0, f32::NAN, 0.0]];
    assert!(matches!(
        solid(vec![particle()], nan, None),
        Err(SolidError::Colour { particle: Some(0) })
    ));
}

#[test]
fn residuals_fit_the_box() {
    let residual = |shape: (usize, usize, usize, usize), voxel: f64| {
        let field = Array4::<f32>::zeros(shape);
        solid(
            vec![],
            vec![],
            Some(Residual {
                binder: field.clone(),
                particles: field,
                voxel,
            }),
        )
    };
    assert!(residual((4, 8, 16, 3), 0.25).is_ok());
    for (shape, voxel) in [
        ((0, 4, 4, 3), 1.0),
        ((4, 4, 4, 1), 1.0),
        ((4, 4, 4, 3), 0.0),
        ((4, 4, 4, 3), f64::NAN),
    ] {
        assert!(matches!(
            residual(shape, voxel),
            Err(SolidError::Residual { part: "binder", .. })
        ));
    }
    assert!(matches!(
        residual((3, 4, 4, 3), 1.0),
        Err(SolidError::Period { axis: 'z', .. })
    ));
    assert!(matches!(
        residual((4, 4, 8, 3), 1.0),
        Err(SolidError::Period { axis: 'x', .. })
    ));
}

#[test]
fn invalid_images_and_planes_are_errors() {
    let solid = solid(vec![], vec![], None).unwrap();
    let plane = SlicePlane::across(Axis::X, 1.0);
    for (width, height, pixel) in [(0, 1, 1.0), (u32::MAX, u32::MAX, 1.0), (1, 1, 0.0), (1, 1, f64::NAN)] {
        assert!(matches!(
            solid.slice(&plane, width, height, pixel),
            Err(SolidError::Picture { .. })
        ));
        assert!(matches!(
            solid.slice_ids(&plane, width, height, pixel),
            Err(SolidError::Picture { .. })
        ));
    }
    for normal in [Vector3::zeros(), Vector3::new(0.0, f64::NAN, 1.0)] {
        assert!(matches!(
            SlicePlane::oblique(normal, 0.0),
            Err(SolidError::Plane { .. })
        ));
    }
    for normal in [Vector3::new(1e-300, 0.0, 0.0), Vector3::new(1e300, -1e300, 0.0)] {
        let p = SlicePlane::oblique(normal, 1.0).unwrap().point(2.0, 3.0);
        assert!((p.coords.dot(&(normal / normal.amax()).normalize()) - 1.0).abs() < 1e-12);
    }
    // Points at infinity have no position in the box; any result is valid, but no panic.
    let _ = solid.id_at(&Point3::new(f64::NAN, f64::INFINITY, 1e300));
}
