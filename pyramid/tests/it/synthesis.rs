use ndarray::{Array2, Array3, Array4, ArrayView4, Axis};
use std::ops::ControlFlow;
use stereology_pyramid::{
    Cut, Edges, Exemplar, Matching, Mode, SteerablePyramid, TextureError, TextureOptions, TextureReport, cut_variances,
    synthesize_image, synthesize_image_with_report, synthesize_oriented_volume, synthesize_volume,
    synthesize_volume_with_report,
};

const GO: &(dyn Fn(f64) -> ControlFlow<()> + Sync) = &|_| ControlFlow::Continue(());
const WATCH: &(dyn Fn(f64, &TextureReport) -> ControlFlow<()> + Sync) = &|_, _| ControlFlow::Continue(());

/// A speckled, blurred, periodic image with skewed values about zero: (y, x, channel).
fn speckle(n: usize, channels: usize) -> Array3<f32> {
    let hash = |y: usize, x: usize, c: usize| {
        let mut h = (y * 0x9E37_79B1 + x * 0x85EB_CA6B + c * 0xC2B2_AE35 + 1) as u64;
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D_2C1B_3C6D);
        h = (h ^ (h >> 29)).wrapping_mul(0x297A_2D39_297A_2D39);
        ((h >> 40) as f32 / (1_u64 << 24) as f32).powi(3) - 0.25
    };
    Array3::from_shape_fn((n, n, channels), |(y, x, c)| {
        let around = [(0, 0, 2.0), (1, 0, 1.0), (0, 1, 1.0), (n - 1, 0, 1.0), (0, n - 1, 1.0)];
        around
            .iter()
            .map(|&(dy, dx, w)| {
                w * (hash((y + dy) % n, (x + dx) % n, 0) + 0.3 * hash((y + dy) % n, (x + dx) % n, c + 1))
            })
            .sum::<f32>()
            / 6.0
    })
}

/// Mean squares of the pyramid bands of all slices along an axis, with orientations pooled.
fn band_variances(volume: ArrayView4<'_, f32>, axis: usize) -> Vec<f64> {
    let plane = volume.index_axis(Axis(3), 0);
    let mut sums = vec![0.0; 4];
    for slice in plane.axis_iter(Axis(axis)) {
        sums.iter_mut()
            .zip(image_variances(&slice.to_owned()))
            .for_each(|(sum, v)| *sum += v / plane.len_of(Axis(axis)) as f64);
    }
    sums
}

fn image_variances(image: &Array2<f32>) -> Vec<f64> {
    let shape = [image.nrows(), image.ncols()];
    let bands = SteerablePyramid::new(shape, 2, 4)
        .and_then(|pyramid| pyramid.build(image.view()))
        .expect("finite, large enough");
    let all = bands.summaries();
    let pooled = |level| {
        all.iter()
            .filter(|b| b.orientation.is_some() && b.level == level)
            .map(|b| b.mean_square / 4.0)
            .sum()
    };
    vec![all[0].mean_square, pooled(0), pooled(1), all[9].mean_square]
}

/// Slices along every axis have the band variances of the exemplar within 3 %; those of the 1995 method do not.
#[test]
fn slices_have_the_band_variances_of_the_exemplar() {
    let exemplar = speckle(64, 1);
    let wanted = image_variances(&exemplar.index_axis(Axis(2), 0).to_owned());
    let worst = |mode| {
        let options = TextureOptions::default().with_mode(mode);
        let volume = synthesize_volume(&Exemplar::new(exemplar.view()), [32, 32, 32], &options, GO).unwrap();
        (0..3)
            .flat_map(|axis| {
                band_variances(volume.view(), axis)
                    .into_iter()
                    .zip(&wanted)
                    .take(3)
                    .map(|(v, w)| (v / w).ln().abs())
                    .collect::<Vec<_>>()
            })
            .fold(0.0, f64::max)
    };
    let (slices, spectrum, volume) = (worst(Mode::Slices), worst(Mode::Spectrum), worst(Mode::Volume));
    assert!(slices < 0.03, "slices: {slices}");
    assert!(spectrum < 0.15, "spectrum: {spectrum}");
    assert!(volume > 0.2, "volume: {volume}");
}

/// The step across the wrap is like any other step, along all axes, and the sides need not be equal.
#[test]
fn volumes_are_periodic_without_a_seam() {
    let exemplar = speckle(48, 3);
    for mode in [Mode::Slices, Mode::Oriented, Mode::Spectrum, Mode::Volume] {
        let options = TextureOptions::default().with_mode(mode).with_iterations(2);
        let volume: Array4<f32> =
            synthesize_volume(&Exemplar::new(exemplar.view()), [24, 33, 20], &options, GO).unwrap();
        assert_eq!(volume.dim(), (24, 33, 20, 3));
        for axis in 0..3 {
            let n = volume.len_of(Axis(axis));
            let mut steps: Vec<f32> = (0..n)
                .map(|i| {
                    (&volume.index_axis(Axis(axis), i) - &volume.index_axis(Axis(axis), (i + 1) % n))
                        .mapv(f32::abs)
                        .mean()
                        .unwrap()
                })
                .collect();
            let wrap = steps[n - 1];
            steps.sort_by(f32::total_cmp);
            assert!(
                wrap < 1.3 * steps[n / 2],
                "{mode:?}, axis {axis}: {wrap} compared with {}",
                steps[n / 2]
            );
        }
    }
}

/// Every channel of the result has the mean and the quantiles of the exemplar.
#[test]
fn channels_have_the_exemplar_distribution() {
    let exemplar = speckle(40, 3);
    for matching in [Matching::Table, Matching::Exact] {
        let options = TextureOptions::default().with_matching(matching).with_iterations(2);
        let image = synthesize_image(&Exemplar::new(exemplar.view()), [40, 40], &options, GO).unwrap();
        for c in 0..3 {
            let sorted = |a: &Array3<f32>| {
                let mut v = a.index_axis(Axis(2), c).iter().copied().collect::<Vec<_>>();
                v.sort_by(f32::total_cmp);
                v
            };
            let (found, wanted) = (sorted(&image), sorted(&exemplar));
            // The target is the periodic component of the exemplar, which is nearly the exemplar, since this one is
            // periodic.
            let distance = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).sum::<f32>() / 1600.0;
            assert!(distance < 0.05 * exemplar.std(0.0), "{distance}");
            let mean = |v: &[f32]| v.iter().map(|&v| f64::from(v)).sum::<f64>() / 1600.0;
            assert!((mean(&found) - mean(&wanted)).abs() < 1e-4);
        }
    }
}

/// Pixels outside the mask are never read: any values there, including NaN, give the same bits.
#[test]
fn pixels_outside_the_mask_are_never_read() {
    let exemplar = speckle(48, 3);
    let mask = Array2::from_shape_fn((48, 48), |(y, x)| (y as f32 - 20.0).hypot(x as f32 - 30.0) > 11.0);
    let replaced = |value: f32| {
        let mut image = exemplar.clone();
        for (mut pixel, &inside) in image.lanes_mut(Axis(2)).into_iter().zip(&mask) {
            if !inside {
                pixel.fill(value);
            }
        }
        let options = TextureOptions::default().with_iterations(2);
        synthesize_volume(
            &Exemplar::new(image.view()).with_mask(mask.view()),
            [16, 16, 16],
            &options,
            GO,
        )
        .unwrap()
    };
    let (nan, large) = (replaced(f32::NAN), replaced(9.0));
    assert_eq!(nan, large);
    assert!(nan.iter().all(|v| v.abs() < 1.0));
}

/// Under a mask with many holes the statistics are those of the whole texture, as required for the binder of a
/// photograph.
#[test]
fn a_masked_texture_keeps_its_band_variances() {
    let exemplar = speckle(128, 1);
    let wanted = image_variances(&exemplar.index_axis(Axis(2), 0).to_owned());
    let mut holed = exemplar.clone();
    let hole = |y: usize, x: usize| ((y % 24) as f32 - 12.0).hypot((x % 26) as f32 - 13.0) < 8.5;
    let mask = Array2::from_shape_fn((128, 128), |(y, x)| !hole(y, x));
    holed
        .indexed_iter_mut()
        .filter(|((y, x, _), _)| hole(*y, *x))
        .for_each(|(_, v)| *v = 5.0);
    let options = TextureOptions::default().with_levels(2).with_iterations(4);
    let binder = Exemplar::new(holed.view()).with_mask(mask.view());
    let volume = synthesize_volume(&binder, [32, 32, 32], &options, GO).unwrap();
    for axis in 0..3 {
        for (found, wanted) in band_variances(volume.view(), axis).iter().zip(&wanted).take(3) {
            assert!((found / wanted).ln().abs() < 0.15, "{found} for {wanted}");
        }
    }
}

/// The same seed gives the same bits at any number of threads; another seed gives another texture.
#[test]
fn same_bits_at_any_number_of_threads() {
    let exemplar = speckle(40, 3);
    let with = |threads: usize, seed: u64, mode: Mode| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = TextureOptions::default()
            .with_mode(mode)
            .with_iterations(2)
            .with_seed(seed);
        pool.install(|| synthesize_volume(&Exemplar::new(exemplar.view()), [24, 24, 24], &options, GO).unwrap())
    };
    for mode in [Mode::Slices, Mode::Oriented, Mode::Spectrum, Mode::Volume] {
        assert_eq!(with(1, 5, mode), with(3, 5, mode));
    }
    assert_ne!(with(1, 5, Mode::Slices), with(1, 6, Mode::Slices));
}

/// A constant exemplar gives a constant texture; a constant channel among others stays constant.
#[test]
fn constant_channels_are_kept() {
    let mut exemplar = speckle(32, 3);
    exemplar.index_axis_mut(Axis(2), 1).fill(0.4);
    let volume = synthesize_volume(
        &Exemplar::new(exemplar.view()),
        [16, 16, 16],
        &TextureOptions::default(),
        GO,
    )
    .unwrap();
    assert!(volume.index_axis(Axis(3), 1).iter().all(|v| (v - 0.4).abs() < 1e-5));
    exemplar.fill(0.7);
    for mode in [Mode::Slices, Mode::Oriented, Mode::Spectrum, Mode::Volume] {
        let options = TextureOptions::default().with_mode(mode);
        let (volume, report) =
            synthesize_volume_with_report(&Exemplar::new(exemplar.view()), [8, 8, 8], &options, WATCH).unwrap();
        assert!(volume.iter().all(|v| (v - 0.7).abs() < 1e-6));
        assert_eq!(report.findings[0].code, "constant-exemplar");
    }
}

/// Invalid input is refused with a specific error, before memory is allocated.
#[test]
fn bad_input_is_refused() {
    let options = TextureOptions::default();
    let exemplar = speckle(16, 3);
    let make = |image: &Array3<f32>, size| synthesize_volume(&Exemplar::new(image.view()), size, &options, GO);
    assert!(matches!(
        make(&speckle(7, 3), [16; 3]),
        Err(TextureError::ExemplarTooSmall { height: 7, width: 7 })
    ));
    assert!(matches!(
        make(&exemplar, [16, 7, 16]),
        Err(TextureError::ResultTooSmall { .. })
    ));
    assert!(
        matches!(make(&exemplar, [1_000_000; 3]), Err(TextureError::TooLarge { bytes, .. }) if bytes > 10_u128.pow(19))
    );
    assert!(matches!(
        make(&exemplar, [usize::MAX; 3]),
        Err(TextureError::TooLarge { .. })
    ));
    assert!(matches!(
        make(&Array3::zeros((16, 16, 0)), [16; 3]),
        Err(TextureError::NoChannels)
    ));
    let mut bad = exemplar.clone();
    bad[[3, 4, 1]] = f32::NAN;
    assert_eq!(make(&bad, [16; 3]), Err(TextureError::NotFinite { row: 3, column: 4 }));
    let with = |mask: &Array2<bool>| {
        synthesize_volume(
            &Exemplar::new(exemplar.view()).with_mask(mask.view()),
            [16; 3],
            &options,
            GO,
        )
    };
    assert!(matches!(
        with(&Array2::from_elem((16, 15), true)),
        Err(TextureError::MaskShape { .. })
    ));
    assert!(matches!(
        with(&Array2::from_elem((16, 16), false)),
        Err(TextureError::MaskTooSmall { selected: 0, .. })
    ));
    let stop = |_: f64| ControlFlow::Break(());
    assert_eq!(
        synthesize_volume(&Exemplar::new(exemplar.view()), [16; 3], &options, &stop),
        Err(TextureError::Cancelled)
    );
    let none = options.clone().with_orientations(0);
    assert!(matches!(
        synthesize_image(&Exemplar::new(exemplar.view()), [16; 2], &none, GO),
        Err(TextureError::Options { .. })
    ));
}

/// Cuts along face and space diagonals have the band variances of the exemplar as accurately as slices, and other cuts
/// nearly.
#[test]
fn oblique_cuts_match_as_well_as_slices() {
    let exemplar = speckle(64, 1);
    let wanted = image_variances(&exemplar.index_axis(Axis(2), 0).to_owned());
    let options = TextureOptions::default().with_cuts(Cut::All);
    let made = synthesize_volume(&Exemplar::new(exemplar.view()), [32; 3], &options, GO).unwrap();
    let error = |normal: [f64; 3]| {
        let normal = nalgebra::Unit::new_normalize(nalgebra::Vector3::from(normal));
        let found = &cut_variances(made.index_axis(Axis(3), 0), &[normal], 2).unwrap()[0];
        (1..3)
            .map(|band| (found[band] / (4.0 * wanted[band])).ln().abs())
            .fold(0.0, f64::max)
    };
    let axis = error([1.0, 0.0, 0.0]);
    assert!(axis < 0.03, "{axis}");
    for normal in [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.3, 0.5, 0.8]] {
        let oblique = error(normal);
        assert!(oblique < 1.3 * axis, "{normal:?}: {oblique} compared with {axis}");
    }
}

/// Every iteration is reported to the caller, who can cancel after any.
#[test]
fn iterations_are_reported() {
    let exemplar = speckle(32, 1);
    let options = TextureOptions::default().with_iterations(4);
    let reported = std::sync::Mutex::new(Vec::new());
    let watch = |_: f64, report: &TextureReport| {
        reported.lock().unwrap().push(report.slice_errors.len());
        if report.slice_errors.len() < 3 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let stopped = synthesize_volume_with_report(&Exemplar::new(exemplar.view()), [16; 3], &options, &watch);
    assert_eq!(stopped.unwrap_err(), TextureError::Cancelled);
    let mut reported = reported.into_inner().unwrap();
    reported.dedup();
    assert_eq!(reported, [0, 1, 2, 3]);
    let (_, report) = synthesize_volume_with_report(&Exemplar::new(exemplar.view()), [16; 3], &options, WATCH).unwrap();
    assert_eq!((report.band_errors.len(), report.slice_errors.len()), (4, 4));
    assert!(report.final_error < report.slice_errors[0], "{report:?}");
}

/// The error reports the number of bytes that suffice as a limit.
#[test]
fn the_error_reports_the_bytes_required() {
    let exemplar = speckle(16, 3);
    let make = |limit: u64| {
        let options = TextureOptions::default().with_iterations(1).with_memory_limit(limit);
        synthesize_volume(&Exemplar::new(exemplar.view()), [16; 3], &options, GO)
    };
    let Err(TextureError::TooLarge { bytes, limit: 1000, .. }) = make(1000) else {
        panic!("16 cubed does not fit into 1000 bytes")
    };
    assert!(make(u64::try_from(bytes).unwrap()).is_ok());
    assert!(
        make(u64::try_from(bytes).unwrap() - 1)
            .unwrap_err()
            .to_string()
            .contains(&bytes.to_string())
    );
}

/// Too many levels are reduced to the largest possible number, and a finding reports it, for images and volumes.
#[test]
fn too_many_levels_are_reduced() {
    let exemplar = speckle(32, 1);
    let options = TextureOptions::default().with_iterations(1).with_levels(40);
    let made = Exemplar::new(exemplar.view());
    let (_, volume) = synthesize_volume_with_report(&made, [16; 3], &options, WATCH).unwrap();
    let (_, image) = synthesize_image_with_report(&made, [16, 40], &options, WATCH).unwrap();
    for report in [volume, image] {
        assert_eq!((report.levels, report.findings[0].code), (2, "levels-reduced"));
        assert!(
            report.findings[0].message.contains("40"),
            "{}",
            report.findings[0].message
        );
    }
}

/// Slices along each axis look like their exemplar: stripes stay stripes, with the correct direction.
#[test]
fn slices_along_each_axis_match_their_exemplar() {
    let base = speckle(48, 1);
    let stripes = Array3::from_shape_fn((48, 48, 1), |(z, x, _)| {
        (std::f32::consts::TAU * z as f32 / 6.0).sin() + base[[z, x, 0]]
    });
    let exemplars = [Exemplar::new(base.view()), Exemplar::new(stripes.view())];
    let options = TextureOptions::default().with_iterations(4);
    let (volume, report) = synthesize_oriented_volume(&exemplars, [24; 3], &options, WATCH).unwrap();
    assert_eq!(report.slice_errors.len(), 4);
    let step = |axis: usize| -> f32 {
        let n = 24;
        let at = |i: usize| volume.index_axis(Axis(axis), i % n);
        (0..n).map(|i| (&at(i) - &at(i + 1)).mapv(f32::abs).sum()).sum()
    };
    assert!(
        step(0) > 1.3 * step(1) && step(0) > 1.3 * step(2),
        "{} {} {}",
        step(0),
        step(1),
        step(2)
    );
    let none = synthesize_oriented_volume(&[], [24; 3], &options, WATCH);
    assert!(matches!(none, Err(TextureError::Exemplars { found: 0 })));
    let other = speckle(48, 3);
    let mixed = synthesize_oriented_volume(&[exemplars[0], Exemplar::new(other.view())], [24; 3], &options, WATCH);
    assert!(matches!(
        mixed,
        Err(TextureError::ChannelsDiffer { expected: 1, found: 3 })
    ));
}

/// Both treatments of edges give the band variances of a texture without edges; without treatment a jump at the edge
/// changes them.
#[test]
fn treatments_of_edges_remove_their_effect() {
    let tile = speckle(64, 1);
    let ramp = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| tile[[y, x, 0]] + 0.02 * x as f32);
    let wanted = image_variances(&tile.index_axis(Axis(2), 0).to_owned())[1];
    let error = |edges| {
        let options = TextureOptions::default().with_edges(edges).with_levels(2);
        let made = synthesize_image(&Exemplar::new(ramp.view()), [96, 96], &options, GO).unwrap();
        (image_variances(&made.index_axis(Axis(2), 0).to_owned())[1] / wanted)
            .ln()
            .abs()
    };
    let [periodic, mirror, wrap] = [Edges::PeriodicComponent, Edges::Mirror, Edges::Wrap].map(error);
    assert!(periodic < 0.1 && mirror < 0.1, "{periodic} {mirror}");
    assert!(wrap > 1.5 * periodic.max(mirror), "{wrap}");
}
