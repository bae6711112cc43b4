//! Voxels: volumes and slabs of spheres within the bounds of discretisation, channels that agree, the same bytes at any
//! number of threads.

use crate::spheres::{mixture, spheres};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::{Array3, Array4, Axis as ArrayAxis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use std::fs;
use std::ops::ControlFlow;
use stereology_grid::{Format, GridError, read_npy};
use stereology_shape::{
    Arrangement, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody, isotropic_rotation,
};
use stereology_volume::{Axis, Channel, Lookup, Residual, SlicePlane, Solid, VoxelGrid};

fn ids(solid: &Solid, n: usize) -> Array3<u32> {
    let grid = solid.voxel_grid(n);
    let [nx, ny, nz] = grid.counts;
    let mut ids = Array3::zeros((nz, ny, nx));
    for (z, slab) in ids.outer_iter_mut().enumerate() {
        solid.fill_ids(&grid, z, slab.insert_axis(ArrayAxis(2)));
    }
    ids
}

/// Voxels not cut by the surface are correct, so the error of a sphere's volume in voxels is less than the shell within
/// half a voxel's diagonal δ of its surface. The errors of many spheres cancel: their sum is within a hundredth of the
/// sum of the shells.
#[test]
fn the_fraction_of_voxels_is_the_volume_of_the_spheres() {
    let n = 96;
    for seed in 0..3 {
        let solid = spheres(seed);
        let ids = ids(&solid, n);
        let edge = 8.0 / n as f64;
        let delta = 0.5 * 3.0_f64.sqrt() * edge;
        let (mut error, mut shells) = (0.0, 0.0);
        for (i, sphere) in solid.particles().iter().enumerate() {
            let r = 0.5 * sphere.size;
            let volume = ids.iter().filter(|&&id| id as usize == i + 1).count() as f64 * edge.powi(3);
            let shell = 4.0 / 3.0 * PI * ((r + delta).powi(3) - (r - delta).powi(3));
            let off = volume - 4.0 / 3.0 * PI * r.powi(3);
            assert!(off.abs() < 0.5 * shell, "{off} {shell}");
            error += off;
            shells += shell;
        }
        assert!(error.abs() < 0.01 * shells, "{error} {shells}");
    }
}

/// A slab of voxels is the section at the z of its centres: circles of area π (r² − h²) within the ring of half a
/// pixel's diagonal.
#[test]
fn slabs_of_voxels_are_sections() {
    let n = 96;
    let solid = spheres(3);
    let ids = ids(&solid, n);
    let edge = 8.0 / n as f64;
    for (z, slab) in ids.outer_iter().enumerate() {
        for (i, area) in solid.section_profiles(Axis::Z, (z as f64 + 0.5) * edge) {
            let voxels = slab.iter().filter(|&&id| id as usize == i + 1).count() as f64 * edge * edge;
            let ring = 2.0 * PI * (area / PI).sqrt() * 2.0_f64.sqrt() * edge + PI * edge * edge;
            assert!((voxels - area).abs() <= ring);
        }
    }
}

/// A slice with pixels as large as voxels shows the slab, along every axis of the array (z, y, x).
#[test]
fn slices_are_slabs_of_the_array() {
    let solid = mixture(1);
    let n = 64;
    let grid = solid.voxel_grid(n);
    let ids = ids(&solid, n);
    let [nx, ny, nz] = grid.counts.map(|n| u32::try_from(n).unwrap());
    for (axis, array_axis, width, height) in [(Axis::X, 2, ny, nz), (Axis::Y, 1, nx, nz), (Axis::Z, 0, nx, ny)] {
        let plane = SlicePlane::across(axis, 5.5 * grid.spacing[axis.index()]);
        let slice = solid.slice_ids(&plane, width, height, grid.spacing[0]).unwrap();
        assert_eq!(slice, ids.index_axis(ArrayAxis(array_axis), 5));
    }
}

#[test]
fn channels_agree_in_files() {
    let solid = mixture(2);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let file = folder.path().join(format!("{name}.npy"));
        solid
            .write_voxels(
                &file,
                Format::Npy,
                &solid.voxel_grid(32),
                name.parse().unwrap(),
                &|_| ControlFlow::Continue(()),
            )
            .unwrap();
        file
    };
    let ids = read_npy::<u32>(write("id")).unwrap();
    let categories = read_npy::<u8>(write("category")).unwrap();
    let distances = read_npy::<f32>(write("distance")).unwrap();
    let colours = read_npy::<u8>(write("rgb")).unwrap();
    assert_eq!(ids.shape(), [32, 8, 16]);
    assert_eq!(colours.shape(), [32, 8, 16, 3]);
    for (((&id, &category), &distance), rgb) in ids
        .iter()
        .zip(&categories)
        .zip(&distances)
        .zip(colours.as_slice().unwrap().chunks(3))
    {
        let particle = (id > 0).then(|| id as usize - 1);
        assert_eq!(category, particle.map_or(0, |i| solid.particles()[i].category + 1));
        assert!(distance.abs() < 1e-6 || (distance < 0.0) == particle.is_some());
        let colour = particle.map_or(solid.binder(), |i| solid.colours()[i]);
        for c in 0..3 {
            assert!((colour[c] * 255.0 - f32::from(rgb[c])).abs() <= 0.5 + 1e-4);
        }
    }
}

/// Voxels are filled row by row; each equals the result at its centre, bit for bit: spheres, ellipsoids, boxes with
/// faces along the rows, rocks, and tori, which have no chords; overlapping, extending beyond the box, some of them
/// voids, read in every way between the residual's voxels.
#[test]
fn rows_of_voxels_are_their_points() {
    let torus = TriangleMesh::torus(2.0, 0.8, 24, 12);
    let bodies = [
        Body::sphere(1.0).unwrap(),
        Body::ellipsoid([1.0, 0.5, 0.3]).unwrap(),
        Body::cuboid([1.0, 2.0, 0.5]).unwrap(),
        Body::rock(3),
        Body::from_mesh(ClosedMesh::try_from(torus).unwrap()),
    ];
    let bodies: Vec<UnitBody> = bodies.iter().map(UnitBody::new).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let particles: Vec<Particle> = (0..60)
        .map(|i| Particle {
            shape: i % 5,
            size: 0.5 + 2.0 * rng.random::<f64>(),
            category: 0,
            position: Point3::from(Vector3::from_fn(|_, _| 8.0 * rng.random::<f64>())),
            // Some are axis-aligned, with faces through the centres of voxels.
            orientation: if i % 3 == 0 {
                UnitQuaternion::identity()
            } else {
                isotropic_rotation(&mut rng)
            },
        })
        .collect();
    let mut colour = || [rng.random(), rng.random(), rng.random()];
    let colours = particles.iter().map(|_| colour()).collect();
    let noise: Array4<f32> = Array4::from_shape_simple_fn((4, 4, 4, 3), || 0.3 * colour()[0]);
    let residual = Residual {
        particles: noise.mapv(|v| -v),
        binder: noise,
        voxel: 1.0,
    };
    let period = PeriodicBox::new(Vector3::new(8.0, 4.0, 8.0)).unwrap();
    let solid = Solid::new(
        Arrangement::new(bodies, particles, period).unwrap(),
        colours,
        [0.5; 3],
        Some(residual),
    )
    .unwrap()
    .with_voids(&[1])
    .unwrap();
    for lookup in [Lookup::Nearest, Lookup::Trilinear, Lookup::VarianceKept] {
        let solid = solid.clone().with_lookup(lookup);
        for n in [3, 32, 61] {
            let grid = solid.voxel_grid(n);
            let [nx, ny, nz] = grid.counts;
            for z in 0..nz {
                let (mut ids, mut rgb) = (Array3::zeros((ny, nx, 1)), Array3::zeros((ny, nx, 3)));
                let mut alpha = Array3::zeros((ny, nx, 1));
                solid.fill_ids(&grid, z, ids.view_mut());
                solid.fill_rgb(&grid, z, rgb.view_mut());
                solid.fill_alpha(&grid, z, alpha.view_mut());
                for (y, x) in (0..ny).flat_map(|y| (0..nx).map(move |x| (y, x))) {
                    let p = grid.centre([x, y, z]);
                    let id = solid.id_at(&p).map_or(0, |id| u32::try_from(id).unwrap() + 1);
                    assert_eq!(ids[[y, x, 0]], id, "{p}");
                    assert_eq!(alpha[[y, x, 0]] == 0, solid.is_void_at(&p), "{p}");
                    let colour = solid.colour_at(&p).map(|c| (c * 255.0).round().clamp(0.0, 255.0));
                    (0..3).for_each(|c| assert_eq!(f32::from(rgb[[y, x, c]]), colour[c], "{p}"));
                }
            }
        }
    }
}

/// Slabs may have any memory layout, here with y as the fastest axis.
#[test]
fn slabs_may_have_any_strides() {
    let solid = mixture(2);
    let grid = solid.voxel_grid(32);
    let [nx, ny, _] = grid.counts;
    let (mut plain, mut strange) = (Array3::zeros((ny, nx, 3)), Array3::zeros((nx, ny, 3)));
    solid.fill_rgb(&grid, 5, plain.view_mut());
    solid.fill_rgb(&grid, 5, strange.view_mut().permuted_axes([1, 0, 2]));
    assert!(plain.iter().any(|byte| *byte != plain[[0, 0, 0]]));
    assert_eq!(strange.permuted_axes([1, 0, 2]), plain);
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let solid = mixture(3);
    let folder = tempfile::tempdir().unwrap();
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let file = folder.path().join("v.nrrd");
            solid
                .write_voxels(&file, Format::Nrrd, &solid.voxel_grid(40), Channel::Rgb, &|_| {
                    ControlFlow::Continue(())
                })
                .unwrap();
            let slice = solid.slice(&SlicePlane::across(Axis::Y, 1.0), 70, 90, 0.1).unwrap();
            (fs::read(file).unwrap(), slice)
        })
    };
    assert!(bytes(1) == bytes(3));
}

#[test]
fn cancelling_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let stop = |done: f64| {
        if done > 0.5 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let file = folder.path().join("v.tif");
    let solid = spheres(0);
    let cancelled = solid.write_voxels(file, Format::Tiff, &solid.voxel_grid(16), Channel::Id, &stop);
    assert!(matches!(cancelled, Err(GridError::Cancelled)));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The box filter keeps the mean colour at any resolution: that of the sphere's volume fraction, to the resolution of
/// its points.
#[test]
fn a_filtered_volume_has_the_solids_mean_colour() {
    let particle = Particle {
        shape: 0,
        size: 6.0,
        category: 0,
        position: Point3::new(4.1, 5.2, 6.3),
        orientation: UnitQuaternion::identity(),
    };
    let period = PeriodicBox::new(Vector3::repeat(10.0)).unwrap();
    let sphere = UnitBody::new(&Body::sphere(1.0).unwrap());
    let solid = Solid::new(
        Arrangement::new(vec![sphere], vec![particle], period).unwrap(),
        vec![[1.0; 3]],
        [0.0; 3],
        None,
    )
    .unwrap();
    let share = PI * 36.0 / 1000.0;
    for (voxels, samples) in [(4, 16), (8, 8), (16, 4)] {
        let grid = VoxelGrid {
            samples,
            ..solid.voxel_grid(voxels)
        };
        let mut sum = 0.0;
        for z in 0..voxels {
            let mut slab = Array3::zeros((voxels, voxels, 3));
            solid.fill_rgb(&grid, z, slab.view_mut());
            sum += slab.iter().map(|&v: &u8| f64::from(v) / 255.0).sum::<f64>();
        }
        let mean = sum / (3.0 * (voxels as f64).powi(3));
        assert!((mean / share - 1.0).abs() < 0.01, "{voxels}: {mean} {share}");
    }
}
