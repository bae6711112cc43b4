//! Voids are exactly at their particles.

use std::ops::ControlFlow;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::Array3;
use proptest::prelude::*;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, TriangleMesh, UnitBody};
use stereology_volume::{CarveOptions, Solid, SolidError};

/// A bubble and a rock, in a box of side 20.
fn foam(size: f64) -> Solid {
    let bodies = vec![
        UnitBody::new(&Body::sphere(1.0).unwrap()),
        UnitBody::new(&Body::rock(3)),
    ];
    let at = |shape, size, x| Particle {
        shape,
        size,
        category: 0,
        position: Point3::new(x, 10.0, 11.0),
        orientation: UnitQuaternion::identity(),
    };
    let particles = vec![at(1, 4.0, 2.5), at(0, size, 12.0)];
    let period = PeriodicBox::new(Vector3::repeat(20.0)).unwrap();
    Solid::new(
        Arrangement::new(bodies, particles, period).unwrap(),
        vec![[0.5; 3]; 2],
        [0.8; 3],
        None,
    )
    .unwrap()
}

proptest! {
    #[test]
    fn a_point_in_a_bubble_has_no_alpha(size in 2.0..14.0_f64, p in prop::array::uniform3(-30.0..30.0_f64)) {
        let foam = foam(size).with_voids(&[0]).unwrap();
        let p = Point3::from(p);
        prop_assert_eq!(foam.is_void_at(&p), foam.id_at(&p) == Some(1));
        let nearest = foam.period().nearest(p - Point3::new(12.0, 10.0, 11.0)).norm();
        prop_assert!((foam.void_distance_at(&p) - (nearest - 0.5 * size)).abs() < 1e-9);
    }
}

#[test]
fn masks_have_the_volume_of_the_bubble() {
    let foam = foam(12.0).with_voids(&[0]).unwrap();
    let grid = foam.voxel_grid(60);
    let mut mask = Array3::<u8>::zeros((60, 60, 1));
    let clear: usize = (0..60)
        .map(|z| {
            foam.fill_alpha(&grid, z, mask.view_mut());
            mask.iter().filter(|alpha| **alpha == 0).count()
        })
        .sum();
    let volume = clear as f64 * grid.spacing.iter().product::<f64>();
    let ball = std::f64::consts::PI / 6.0 * 12.0_f64.powi(3);
    assert!((volume / ball - 1.0).abs() < 0.01, "{volume} {ball}");
}

#[test]
fn carved_meshes_have_holes() {
    let foam = foam(8.0);
    let mesh = TriangleMesh::cuboid([12.0; 3]).mapped(|p| p + Vector3::new(12.0, 10.0, 11.0 + 4.0));
    let carve = |solid: &Solid| {
        let options = CarveOptions::default();
        solid
            .carve(&mesh, &|p| *p, &options, &|_| ControlFlow::Continue(()))
            .unwrap()
            .coloured
    };
    assert!(carve(&foam).colours.iter().all(|colour| colour[3] == 1.0));
    let hollow = foam.with_voids(&[0]).unwrap();
    let carved = carve(&hollow);
    for (vertex, colour) in carved.mesh.vertices.iter().zip(&carved.colours) {
        assert_eq!(colour[3] == 0.0, hollow.is_void_at(vertex));
    }
    assert!(carved.colours.iter().any(|colour| colour[3] == 0.0));
}

#[test]
fn voids_must_be_existing_shapes() {
    assert_eq!(
        foam(5.0).with_voids(&[0, 2]).unwrap_err(),
        SolidError::Void { shape: 2, bodies: 2 }
    );
    assert_eq!(foam(5.0).with_voids(&[1, 0, 1]).unwrap().voids(), [0, 1]);
    assert!(
        foam(5.0)
            .with_voids(&[0])
            .unwrap()
            .with_voids(&[])
            .unwrap()
            .voids()
            .is_empty()
    );
}
