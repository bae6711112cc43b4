//! Solids grown around measurements: measurements are kept, grown voxels are texels of the exemplar, and the result
//! does not depend on the number of threads.

use ndarray::{Array3, Array4};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_grow::{
    GrowError, GrowOptions, Grown, LevelOptions, Planes, Search, Voxels, grow, grow_image, synthesize_by_levels,
};
use stereology_metrics::seams;
use stereology_shape::{ClosedMesh, TriangleMesh};

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Grains of three greys.
fn stone(side: usize) -> Array3<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let grains: Vec<[f64; 3]> = (0..side * side / 30)
        .map(|_| [0; 3].map(|_| rng.random::<f64>()))
        .collect();
    Array3::from_shape_fn((side, side, 1), |(y, x, _)| {
        let (y, x) = (y as f64 / side as f64, x as f64 / side as f64);
        let near = grains
            .iter()
            .min_by(|a, b| (a[0] - y).hypot(a[1] - x).total_cmp(&(b[0] - y).hypot(b[1] - x)));
        ((near.unwrap()[2] * 3.0) as u8 * 100 + 20) as f32
    })
}

fn grown(mask: &Array3<bool>, measured: &[([usize; 3], Vec<f32>)], options: &GrowOptions) -> Grown {
    grow(mask.view(), stone(64).view(), measured, options, &go).unwrap()
}

/// The voxels of a spherical mesh have the sphere's volume and its symmetry.
#[test]
fn voxels_are_the_centres_inside() {
    let mesh = ClosedMesh::try_from(TriangleMesh::icosphere(2.0, 4)).unwrap();
    let voxels = Voxels::of_mesh(&mesh, 40).unwrap();
    let volume = voxels.inside.iter().filter(|v| **v).count() as f64 * voxels.spacing.powi(3);
    assert!((volume / mesh.volume() - 1.0).abs() < 0.01);
    let straight: Vec<bool> = voxels.inside.iter().copied().collect();
    let turned: Vec<bool> = straight.iter().rev().copied().collect();
    assert!(
        turned.iter().zip(&straight).filter(|(a, b)| a != b).count() < 40,
        "a ball is symmetric"
    );
    let centre = nalgebra::Point3::new(0.01, 0.01, 0.01);
    assert_eq!(voxels.voxel_at(&centre), Some([20, 20, 20]));
    let (near, distance) = voxels
        .nearest_inside(&nalgebra::Point3::new(1.0, 0.0, 0.0), 2.0)
        .unwrap();
    assert!(voxels.inside[near] && distance < 1.5);
    assert!(
        voxels
            .nearest_inside(&nalgebra::Point3::new(1.5, 0.0, 0.0), 2.0)
            .is_none()
    );
    assert_eq!(Voxels::of_mesh(&mesh, 0), Err(GrowError::Resolution { resolution: 0 }));
    let sheet = ClosedMesh::try_from(TriangleMesh::cuboid([1.0, 1.0, 1e-6])).unwrap();
    let _ = Voxels::of_mesh(&sheet, 8).map(|v| assert!(v.inside.iter().any(|i| *i)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Measured values are kept to the bit at any place; every other voxel inside is a texel of the exemplar, and
    /// voxels outside stay 0.
    #[test]
    fn measurements_stay_and_the_mask_is_filled(
        places in prop::collection::btree_map((0_usize..12, 0_usize..12, 0_usize..12), 0_u8..255, 0..20),
        window in prop::sample::select(vec![0_usize, 3, 5]),
        seeds in 1_usize..4,
        oblique in any::<bool>(),
    ) {
        let ball = |z: usize, y: usize, x: usize| [z, y, x].iter().map(|&c| (c as f64 - 5.5).powi(2)).sum::<f64>() < 30.0;
        let mask = Array3::from_shape_fn((12, 12, 12), |(z, y, x)| ball(z, y, x));
        let measured: Vec<_> = places
            .iter()
            .filter(|((z, y, x), _)| ball(*z, *y, *x))
            .map(|((z, y, x), v)| ([*z, *y, *x], vec![f32::from(*v) + 0.5]))
            .collect();
        let planes = if oblique { Planes::Oblique } else { Planes::Axis };
        let options = GrowOptions::default().with_window(window).with_seeds(seeds).with_planes(planes);
        let made = grown(&mask, &measured, &options);
        prop_assert_eq!((made.filled, made.fixed_changed, made.measured), (made.inside, 0, measured.len()));
        for ((z, y, x), inside) in mask.indexed_iter() {
            let value = made.values[[z, y, x, 0]];
            let given = measured.iter().find(|(at, _)| *at == [z, y, x]);
            let own = [20.0, 120.0, 220.0].contains(&value);
            let right = match (inside, given) {
                (false, _) => value == 0.0,
                (true, Some((_, v))) => value == v[0],
                (true, None) => own,
            };
            prop_assert!(right, "{value}");
            prop_assert_eq!(made.labels[[z, y, x]] > 0, *inside);
        }
        prop_assert!(made.labels.iter().all(|l| (*l as usize) <= made.cells));
    }
}

/// Same seed, same bits at one thread and at several; another seed, another stone.
#[test]
fn the_same_at_any_number_of_threads() {
    let mask = Array3::from_elem((20, 20, 20), true);
    let options = GrowOptions::default().with_seeds(5);
    let with = |threads: usize, options: &GrowOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| grown(&mask, &[], options))
    };
    let one = with(1, &options);
    assert_eq!(one, with(2, &options));
    assert_eq!(one, with(8, &options));
    assert_ne!(one.values, with(1, &options.with_seed(1)).values);
}

/// Connected measurements are one seed; components of a mask without a seed get one and are counted.
#[test]
fn cells_are_counted() {
    let mut mask = Array3::from_elem((6, 6, 13), true);
    mask.index_axis_mut(ndarray::Axis(2), 6).fill(false);
    let measured = vec![
        ([0, 0, 0], vec![20.0]),
        ([1, 1, 1], vec![20.0]),
        ([5, 5, 5], vec![120.0]),
    ];
    let made = grown(&mask, &measured, &GrowOptions::default());
    assert_eq!((made.cells, made.added_seeds, made.filled), (3, 1, made.inside));
    assert_eq!(made.labels[[0, 0, 0]], made.labels[[1, 1, 1]]);
}

/// The tree finds nearly the distances that comparing every window finds.
#[test]
fn the_tree_is_nearly_exact() {
    let mask = Array3::from_elem((16, 16, 16), true);
    let options = GrowOptions::default().with_seeds(3);
    let exact = grown(&mask, &[], &options.with_search(Search::Exact));
    let tree = grown(&mask, &[], &options);
    assert!(
        tree.mean_distance < 1.15 * exact.mean_distance,
        "{} {}",
        tree.mean_distance,
        exact.mean_distance
    );
}

/// Windows make neighbouring voxels similar, and cells show seams; with the histogram alone there is no texture, so
/// there are no seams.
#[test]
fn windows_make_texture() {
    let mask = Array3::from_elem((24, 24, 24), true);
    let inside = |window: usize| {
        let made = grown(&mask, &[], &GrowOptions::default().with_seeds(6).with_window(window));
        seams(made.values.view(), made.labels.view())
    };
    let (noise, textured) = (inside(0), inside(5));
    assert!(textured.inside < 0.7 * noise.inside, "{textured:?} {noise:?}");
    assert!((noise.visibility().unwrap() - 1.0).abs() < 0.1);
    assert!(textured.visibility().unwrap() > 1.0);
}

/// All channels of a voxel (such as chemistry) come from one texel.
#[test]
fn channels_come_from_one_texel() {
    let grey = stone(48);
    let both = Array3::from_shape_fn((48, 48, 2), |(y, x, c)| {
        grey[[y, x, 0]] * if c == 0 { 1.0 } else { -0.01 }
    });
    let mask = Array3::from_elem((8, 8, 8), true);
    let measured = vec![([1, 1, 1], vec![220.0, -2.2])];
    let made: Array4<f32> = grow(mask.view(), both.view(), &measured, &GrowOptions::default(), &go)
        .unwrap()
        .values;
    assert!(
        made.lanes(ndarray::Axis(3))
            .into_iter()
            .all(|v| (v[1] + 0.01 * v[0]).abs() < 1e-5)
    );
    let wrong = vec![([1, 1, 1], vec![220.0])];
    assert!(matches!(
        grow(mask.view(), both.view(), &wrong, &GrowOptions::default(), &go),
        Err(GrowError::Value {
            number: 1,
            channels: 2,
            ..
        })
    ));
}

/// Invalid inputs are refused with the error that describes them.
#[test]
fn invalid_inputs_are_refused() {
    let mask = Array3::from_elem((4, 4, 4), true);
    let picture = stone(16);
    let refused =
        |mask: &Array3<bool>, picture: &Array3<f32>, measured: &[([usize; 3], Vec<f32>)], options: GrowOptions| {
            grow(mask.view(), picture.view(), measured, &options, &go).unwrap_err()
        };
    let plain = GrowOptions::default().with_seeds(1);
    let small = Array3::from_shape_fn((4, 40, 1), |(y, x, _)| (y * x) as f32);
    assert!(matches!(
        refused(&mask, &small, &[], plain),
        GrowError::ExemplarTooSmall { window: 5, .. }
    ));
    assert_eq!(
        refused(&mask, &Array3::from_elem((9, 9, 1), 3.0), &[], plain),
        GrowError::ConstantExemplar
    );
    assert_eq!(
        refused(&mask, &picture, &[], plain.with_window(4)),
        GrowError::Window { window: 4 }
    );
    assert_eq!(
        refused(&mask, &picture, &[], GrowOptions::default()),
        GrowError::NoSeeds
    );
    assert_eq!(
        refused(&Array3::from_elem((4, 4, 4), false), &picture, &[], plain),
        GrowError::EmptyMask
    );
    let at = |voxel, value: f32| (voxel, vec![value]);
    assert!(matches!(
        refused(&mask, &picture, &[at([0, 0, 9], 1.0)], plain),
        GrowError::OutsideMask {
            number: 1,
            at: [9, 0, 0],
            ..
        }
    ));
    let both = [at([1, 1, 1], 1.0), at([0, 0, 0], 1.0), at([1, 1, 1], 2.0)];
    assert!(matches!(
        refused(&mask, &picture, &both, plain),
        GrowError::Contradicting {
            first: 1,
            second: 3,
            ..
        }
    ));
    let mut holed = picture.clone();
    holed[[2, 3, 0]] = f32::NAN;
    assert_eq!(
        refused(&mask, &holed, &[], plain),
        GrowError::NotFinite { row: 2, column: 3 }
    );
    let stopped = grow(mask.view(), picture.view(), &[], &plain, &|_| ControlFlow::Break(()));
    assert_eq!(stopped, Err(GrowError::Cancelled));
    let levels = LevelOptions::default().with_levels(9);
    assert!(matches!(
        synthesize_by_levels(picture.view(), [9, 9], &levels, &go),
        Err(GrowError::Levels { most: 2, .. })
    ));
}

/// Every pixel of a grown image is a texel of the exemplar.
#[test]
fn images_are_made_of_texels() {
    let exemplar = stone(50);
    let one = grow_image(exemplar.view(), [40, 60], &GrowOptions::default().with_window(7), &go).unwrap();
    let other = synthesize_by_levels(exemplar.view(), [40, 60], &LevelOptions::default(), &go).unwrap();
    for made in [one, other] {
        assert_eq!(made.dim(), (40, 60, 1));
        assert!(made.iter().all(|v| [20.0, 120.0, 220.0].contains(v)));
    }
}
