//! Laws that every rendered image obeys.

use image::RgbImage;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use stereology_render::{
    BlockOptions, Camera, Material, RenderError, RenderOptions, render_block, render_material, render_mesh,
};
use stereology_shape::TriangleMesh;

const FLOATING: RenderOptions = RenderOptions {
    width: 120,
    height: 90,
    samples: 2,
    background: [0.0; 3],
    ground: false,
    gloss: 0.0,
};

fn bright_pixels(image: &RgbImage) -> f64 {
    // A pixel on the rim is partly background; the object is brighter than the middle of the scale.
    image.pixels().filter(|p| p.0[0] > 90).count() as f64
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// A sphere of radius R at distance d projects to a disc of radius R / √(d² − R²) at distance 1, for every position
    /// of the camera.
    #[test]
    fn a_ball_is_a_disc(azimuth in -180.0..180.0_f64, elevation in -80.0..80.0_f64, distance in 3.0..9.0_f64, up_is_z in any::<bool>()) {
        let ball = TriangleMesh::icosphere(2.0, 4);
        let up = if up_is_z { Vector3::z_axis() } else { Vector3::y_axis() };
        let camera = Camera { azimuth, elevation, distance: Some(distance), field_of_view: 50.0, up };
        let image = render_mesh(&ball, &|_| [1.0; 3], &camera, &FLOATING).unwrap();
        let radius = 45.0 / 25.0_f64.to_radians().tan() / (distance * distance - 1.0).sqrt();
        let disc = PI * radius * radius;
        // The 2π radius pixels of the rim are partly bright; the icosphere is 0.3 % smaller than the sphere.
        prop_assert!((bright_pixels(&image) - disc).abs() < 0.006 * disc + 1.0 * PI * radius);
    }
}

/// Three faces are visible, each with the colour at its points: the top unchanged, the sides darker.
#[test]
fn a_block_shows_three_faces() {
    let sides = Vector3::new(2.0, 3.0, 1.5);
    let faces = |p: &Point3<f64>| {
        assert!((0..3).all(|k| (-1e-9..=sides[k] + 1e-9).contains(&p[k])), "{p}");
        if p.z > sides.z - 1e-9 {
            [1.0, 0.0, 0.0]
        } else if p.y < 1e-9 {
            [0.0, 1.0, 0.0]
        } else {
            [0.0, 0.0, 1.0]
        }
    };
    let image = render_block(&faces, sides, &BlockOptions::default().with_size(160, 120)).unwrap();
    let most = |channel: usize| {
        let others = [(channel + 1) % 3, (channel + 2) % 3];
        let own = image.pixels().filter(|p| others.iter().all(|&c| p.0[c] == 0));
        own.fold((0, 0_u8), |(count, most), p| (count + 1, most.max(p.0[channel])))
    };
    let [top, front, side] = [0, 1, 2].map(most);
    assert!(
        top.0 > 1000 && front.0 > 1000 && side.0 > 1000,
        "{top:?} {front:?} {side:?}"
    );
    assert!(
        top.1 >= 253 && front.1 < 250 && side.1 < front.1,
        "{top:?} {front:?} {side:?}"
    );
}

/// The floor of a pit receives less light of the sky than a table.
#[test]
fn cavities_are_darker() {
    let slab = |low: [f64; 3], high: [f64; 3]| {
        let (low, high) = (Vector3::from(low), Vector3::from(high));
        TriangleMesh::cuboid((high - low).into()).mapped(|p| p + 0.5 * (low + high))
    };
    let table = slab([-3.0, -3.0, -0.5], [3.0, 3.0, 0.0]);
    let walls = [
        slab([-3.0, 1.0, 0.0], [3.0, 1.2, 2.0]),
        slab([-3.0, -1.2, 0.0], [3.0, -1.0, 2.0]),
        slab([1.0, -1.0, 0.0], [1.2, 1.0, 2.0]),
        slab([-1.2, -1.0, 0.0], [-1.0, 1.0, 2.0]),
    ];
    let pit = walls.iter().fold(table.clone(), TriangleMesh::with);
    let camera = Camera {
        elevation: 89.0,
        distance: Some(12.0),
        up: Vector3::z_axis(),
        ..Camera::default()
    };
    let middle = |mesh| {
        render_mesh(mesh, &|_| [0.7; 3], &camera, &FLOATING)
            .unwrap()
            .get_pixel(60, 45)
            .0[0]
    };
    assert!(
        middle(&table) >= 176 && middle(&pit) < 140,
        "{} {}",
        middle(&table),
        middle(&pit)
    );
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let torus = TriangleMesh::torus(2.0, 0.7, 40, 20);
    let stripes = |p: &Point3<f64>| {
        if (9.0 * p.x).sin() > 0.0 {
            [0.9, 0.8, 0.7]
        } else {
            [0.3, 0.2, 0.2]
        }
    };
    let image = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = RenderOptions::default().with_size(90, 70);
        pool.install(|| render_mesh(&torus, &stripes, &Camera::default(), &options).unwrap())
    };
    assert!(image(1) == image(3));
}

/// The object casts a shadow on the ground, and far from the object the ground equals the background.
#[test]
fn the_ground_shows_a_shadow_only() {
    let ball = TriangleMesh::icosphere(2.0, 3);
    let options = RenderOptions {
        background: [0.9; 3],
        ground: true,
        ..FLOATING
    };
    let image = render_mesh(&ball, &|_| [0.9, 0.0, 0.0], &Camera::default(), &options).unwrap();
    let ground = image.pixels().filter(|p| p.0[0] == p.0[1]);
    let darkest = ground.map(|p| p.0[0]).min().unwrap();
    assert!(darkest < 190, "{darkest}");
    for (x, y) in [(0, 0), (119, 0)] {
        assert!(image.get_pixel(x, y).0[0].abs_diff(230) <= 1);
    }
}

#[test]
fn rendering_can_be_cancelled() {
    let ball = TriangleMesh::icosphere(1.0, 1);
    let stop = |_| ControlFlow::Break(());
    let cancelled = render_material(
        &ball,
        &Material::new(&|_| [0.5; 3]),
        &Camera::default(),
        &FLOATING,
        &stop,
    );
    assert_eq!(cancelled.unwrap_err(), RenderError::Cancelled);
}

/// A block with a void at its end is rendered like the shorter block.
#[test]
fn a_void_is_cut_away() {
    let whole = TriangleMesh::cuboid([2.0, 2.0, 2.0]);
    let rest = TriangleMesh::cuboid([2.0, 2.0, 1.3]).mapped(|p| p - Vector3::new(0.0, 0.0, 0.35));
    let end = |p: &Point3<f64>| 0.3 - p.z;
    let colour = |p: &Point3<f64>| {
        if (7.0 * p.x).sin() > 0.0 {
            [0.9, 0.5, 0.3]
        } else {
            [0.3, 0.4, 0.6]
        }
    };
    let camera = Camera {
        distance: Some(8.0),
        up: Vector3::z_axis(),
        elevation: 40.0,
        ..Camera::default()
    };
    let target = |mesh: &TriangleMesh, material: &Material<'_>| {
        // The camera is directed at the centre of the mesh: degenerate triangles at two far corners give both the same
        // centre.
        let corner = |s: f64| TriangleMesh {
            vertices: vec![Point3::new(s, s, s); 3],
            triangles: vec![[0, 1, 2]],
        };
        let mesh = mesh.clone().with(&corner(1.0)).with(&corner(-1.0));
        render_material(&mesh, material, &camera, &FLOATING, &|_| ControlFlow::Continue(())).unwrap()
    };
    let hollow = target(&whole, &Material::new(&colour).with_voids(&end));
    let cut = target(&rest, &Material::new(&colour));
    let off: u32 = hollow
        .iter()
        .zip(cut.iter())
        .map(|(a, b)| u32::from(a.abs_diff(*b)))
        .sum();
    let mean = f64::from(off) / hollow.len() as f64;
    assert!(mean < 0.6, "{mean}");
    let solid = target(&whole, &Material::new(&colour));
    let off: u32 = solid
        .iter()
        .zip(cut.iter())
        .map(|(a, b)| u32::from(a.abs_diff(*b)))
        .sum();
    assert!(f64::from(off) / solid.len() as f64 > 5.0);
}
