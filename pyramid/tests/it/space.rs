use nalgebra::{Unit, Vector3};
use ndarray::{Array2, Array3, Axis};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_pyramid::{Axes, Gain, PyramidError, SteerablePyramid, VolumePyramid, cut_band, cut_variances};

fn noise(seed: u64, shape: [usize; 3]) -> Array3<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Array3::from_shape_simple_fn(shape, || rng.random::<f64>())
}

fn family() -> impl Strategy<Value = Axes> {
    prop::sample::select(vec![
        Axes::Isotropic,
        Axes::Octahedron,
        Axes::Icosahedron,
        Axes::Dodecahedron,
    ])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Bands reconstruct the volume at any size and spacing, in both precisions, for every family of axes.
    #[test]
    fn volumes_are_reconstructed(z in 8_usize..20, y in 8_usize..20, x in 8_usize..20, wide in 1.0_f64..4.0, axes in family(), seed in 0_u64..99) {
        let (shape, spacing) = ([z, y, x], [wide, 1.0, 1.0]);
        let volume = noise(seed, shape);
        let pyramid = VolumePyramid::new(shape, spacing, 1, axes).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(volume.view()).unwrap());
        prop_assert!(volume.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1e-12));
        let single = volume.mapv(|v| v as f32);
        let pyramid = VolumePyramid::new(shape, spacing, 1, axes).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(single.view()).unwrap());
        prop_assert!(single.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 2e-6));
    }

    /// Pyramids with several levels reconstruct the volume, also at odd and unequal sides.
    #[test]
    fn volumes_are_reconstructed_from_several_levels(z in 16_usize..40, y in 16_usize..40, x in 16_usize..40, axes in family(), seed in 0_u64..99) {
        let volume = noise(seed, [z, y, x]);
        let pyramid = VolumePyramid::new([z, y, x], [1.0; 3], 2, axes).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(volume.view()).unwrap());
        prop_assert!(volume.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1e-12));
        let single = volume.mapv(|v| v as f32);
        let pyramid = VolumePyramid::new([z, y, x], [1.0; 3], 2, axes).unwrap();
        let back = pyramid.reconstruct(&pyramid.build(single.view()).unwrap());
        prop_assert!(single.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 2e-6));
    }

    /// Every family of axes is tight: Σ (v·u)^2p = n/(2p + 1) for every direction u.
    #[test]
    fn axes_are_tight(a in -1.0_f64..1.0, b in -1.0_f64..1.0, c in 0.1_f64..1.0) {
        let u = Vector3::new(a, b, c).normalize();
        for (axes, p) in [(Axes::Octahedron, 1), (Axes::Icosahedron, 2), (Axes::Dodecahedron, 2)] {
            let vectors = axes.vectors();
            let sum: f64 = vectors.iter().map(|v| v.dot(&u).powi(2 * p)).sum();
            prop_assert!((sum - vectors.len() as f64 / f64::from(2 * p + 1)).abs() < 1e-12);
        }
    }

    /// A band steered to any axis is that of a filter along the axis: for a wave, (axis · direction)^p times the band
    /// along the direction of the wave.
    #[test]
    fn volumes_steer_to_any_axis(a in -1.0_f64..1.0, b in -1.0_f64..1.0, c in 0.1_f64..1.0, pick in 0_usize..3) {
        let (axes, p) = [(Axes::Octahedron, 1), (Axes::Icosahedron, 2), (Axes::Dodecahedron, 2)][pick];
        let direction = Unit::new_normalize(Vector3::new(3.0, -2.0, 1.0));
        let wave = Array3::from_shape_fn((16, 16, 16), |(z, y, x)| {
            (std::f64::consts::TAU * (3.0 * x as f64 - 2.0 * y as f64 + z as f64) / 16.0).cos()
        });
        let bands = VolumePyramid::new([16; 3], [1.0; 3], 1, axes).unwrap().build(wave.view()).unwrap();
        let axis = Unit::new_normalize(Vector3::new(a, b, c));
        let (own, steered) = (bands.steered(0, &direction), bands.steered(0, &axis));
        let factor = axis.dot(&direction).powi(p);
        prop_assert!(own.iter().zip(&steered).all(|(o, s)| (factor * o - s).abs() < 1e-12));
    }

    /// Images are steered to any angle: the band of a wave is the band along the wave times cos^p of the angle between.
    #[test]
    fn images_steer_to_any_angle(angle in -3.2_f64..3.2, k in 1_usize..8) {
        let wave = Array2::from_shape_fn((32, 32), |(y, x)| (std::f64::consts::TAU * (4.0 * x as f64 + 3.0 * y as f64) / 32.0).cos());
        let bands = SteerablePyramid::new([32, 32], 1, k).unwrap().build(wave.view()).unwrap();
        let own = 3.0_f64.atan2(4.0);
        let (along, steered) = (bands.steered(0, own), bands.steered(0, angle));
        let factor = (angle - own).cos().powi(k as i32 - 1);
        prop_assert!(along.iter().zip(&steered).all(|(o, s)| (factor * o - s).abs() < 1e-12));
    }

    /// Images of any size and spacing are reconstructed, with or without gain, from real and complex bands.
    #[test]
    fn images_are_reconstructed_with_spacing_and_gain(h in 8_usize..50, w in 8_usize..50, wide in 0.2_f64..5.0, k in 1_usize..6, seed in 0_u64..99) {
        let image = noise(seed, [1, h, w]).index_axis_move(Axis(0), 0);
        for gain in [Gain::None, Gain::Pyrtools] {
            let pyramid = SteerablePyramid::with_spacing([h, w], [wide, 1.0], 1, k).unwrap().with_gain(gain);
            let bands = pyramid.build_complex(image.view()).unwrap();
            let back = pyramid.reconstruct(bands.real());
            prop_assert!(image.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1e-12));
        }
    }
}

/// Real and imaginary part of an oriented band have the same power.
#[test]
fn parts_of_complex_bands_have_equal_power() {
    let image = noise(3, [1, 40, 33]).index_axis_move(Axis(0), 0);
    for k in [3, 4] {
        let bands = SteerablePyramid::new([40, 33], 2, k)
            .unwrap()
            .build_complex(image.view())
            .unwrap();
        for b in 0..k {
            let band = bands.oriented(1, b);
            let power =
                |of: fn(&stereology_spectrum::Complex<f64>) -> f64| band.iter().map(|c| of(c).powi(2)).sum::<f64>();
            assert!((power(|c| c.re) / power(|c| c.im) - 1.0).abs() < 1e-9);
        }
    }
}

/// With the gain of pyrtools, coefficients of level l of 64 x 64 are 4^l times those without.
#[test]
fn gain_is_the_ratio_of_samples() {
    let image = noise(1, [1, 64, 64]).index_axis_move(Axis(0), 0);
    let plain = SteerablePyramid::new([64, 64], 3, 4).unwrap();
    let (a, b) = (
        plain.build(image.view()).unwrap(),
        plain.clone().with_gain(Gain::Pyrtools).build(image.view()).unwrap(),
    );
    for level in 0..3 {
        let ratio = 4.0_f64.powi(level as i32);
        assert!(
            a.oriented(level, 1)
                .iter()
                .zip(b.oriented(level, 1))
                .all(|(a, b)| (ratio * a - b).abs() < 1e-12)
        );
    }
}

/// Cuts along the axes are the slices: `cut_variances` gives the mean squares of the bands of all slices, and
/// `cut_band` their values.
#[test]
fn cuts_along_axes_are_slices() {
    let volume = noise(8, [16, 16, 16]).mapv(|v| v as f32 - 0.5);
    let pyramid = SteerablePyramid::<f32>::new([16, 16], 2, 4).unwrap();
    let normals = [Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
    let found = cut_variances(volume.view(), &normals, 2).unwrap();
    for (axis, found) in found.iter().enumerate() {
        let mut sums = [0.0; 4];
        for slice in volume.axis_iter(Axis(axis)) {
            for band in pyramid.build(slice).unwrap().summaries() {
                let at = match band.orientation {
                    None if band.level == 0 => 0,
                    None => 3,
                    Some(_) => 1 + band.level,
                };
                sums[at] += band.mean_square / 16.0;
            }
        }
        for (found, sum) in found.iter().zip(sums) {
            assert!((found / sum - 1.0).abs() < 1e-4, "axis {axis}: {found} for {sum}");
        }
    }
    // On planes normal to z, each band is that of one orientation of the slices, up to its sign.
    let slice = pyramid.build(volume.index_axis(Axis(0), 5)).unwrap();
    for b in 0..4 {
        let cut = cut_band(volume.view(), &normals[0], 0, b, 4).unwrap();
        let cut = cut.index_axis(Axis(0), 5);
        let same = (0..4).any(|o| {
            [1.0, -1.0].iter().any(|sign| {
                slice
                    .oriented(0, o)
                    .iter()
                    .zip(cut)
                    .all(|(s, c)| (s - sign * c).abs() < 1e-4)
            })
        });
        assert!(same, "orientation {b}");
    }
}

/// Invalid volumes are refused with a specific error.
#[test]
fn bad_volumes_are_refused() {
    assert!(matches!(
        VolumePyramid::<f64>::new([7, 9, 9], [1.0; 3], 1, Axes::Isotropic),
        Err(PyramidError::VolumeLevels { most: 0, .. })
    ));
    for spacing in [[0.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [1e9, 1.0, 1.0]] {
        assert!(matches!(
            VolumePyramid::<f64>::new([16; 3], spacing, 1, Axes::Isotropic),
            Err(PyramidError::Spacing { .. })
        ));
    }
    assert!(matches!(
        SteerablePyramid::<f64>::with_spacing([16; 2], [-1.0, 1.0], 1, 4),
        Err(PyramidError::Spacing { .. })
    ));
    let pyramid = VolumePyramid::new([8; 3], [1.0; 3], 1, Axes::Octahedron).unwrap();
    assert!(matches!(
        pyramid.build(Array3::zeros((8, 8, 9)).view()),
        Err(PyramidError::VolumeShape { .. })
    ));
    let mut bad = Array3::zeros((8, 8, 8));
    bad[[1, 2, 3]] = f64::INFINITY;
    assert_eq!(
        pyramid.build(bad.view()).unwrap_err(),
        PyramidError::VolumeNotFinite { at: [1, 2, 3] }
    );
    let flat = Array3::zeros((8, 8, 8));
    assert!(cut_variances(flat.view(), &[], 2).is_err());
    assert!(cut_band(flat.view(), &Vector3::x_axis(), 0, 4, 4).is_err());
}
