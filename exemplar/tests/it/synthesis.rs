//! Laws of solids from exemplars that hold for any image.

use ndarray::{Array2, Array3, Array4};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use stereology_exemplar::{
    Domain, Exemplar, FixedVoxel, Method, Scan, Search, Solid, SolidError, SolidOptions, Solver, Views,
    synthesize_solid,
};

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn made(exemplars: &[Exemplar], domain: &Domain, options: &SolidOptions) -> Solid {
    synthesize_solid(exemplars, domain, options, &go).unwrap()
}

/// Wavy layers of varying strength.
fn layers(side: usize) -> Array2<f32> {
    Array2::from_shape_fn((side, side), |(z, x)| {
        let (z, x) = (z as f32, x as f32);
        0.5 + (0.3 + 0.1 * (0.13 * x).sin())
            * (0.9 * z + 1.5 * (0.11 * x).sin() + 0.4 * (0.31 * x + 0.05 * z).cos()).sin()
    })
}

/// A section of overlapping discs: true in the pores between them.
fn discs(side: usize, seed: u64) -> Array2<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let centres: Vec<[f64; 3]> = (0..side * side / 40)
        .map(|_| {
            [
                rng.random::<f64>() * side as f64,
                rng.random::<f64>() * side as f64,
                2.0 + 2.0 * rng.random::<f64>(),
            ]
        })
        .collect();
    Array2::from_shape_fn((side, side), |(y, x)| {
        u32::from(centres.iter().all(|c| (c[0] - y as f64).hypot(c[1] - x as f64) > c[2]))
    })
}

/// A field of period 8 without mirror symmetry: slow increase and fast decrease along rows and columns.
fn chiral(z: usize, x: usize) -> f32 {
    let saw = |i: usize| (i % 8) as f32 / 8.0;
    0.6 * saw(z) + 0.3 * saw(x + z / 2) + 0.1 * saw(2 * z + 5 * x)
}

fn small() -> SolidOptions {
    SolidOptions::default().with_levels(1).with_iterations(3)
}

/// The solid v(z, y, x) = f(z, x + y), whose slices of constant y and of constant x equal f.
fn woven(side: usize) -> Array3<f32> {
    Array3::from_shape_fn((side, side, side), |(z, y, x)| chiral(z, (x + y) % side))
}

fn all_given(volume: &Array3<f32>) -> Vec<FixedVoxel> {
    volume
        .indexed_iter()
        .map(|((z, y, x), &v)| ([z, y, x], vec![v]))
        .collect()
}

/// A solid whose slices equal the exemplar has energy 0; its mirror image has not.
#[test]
fn slices_of_the_exemplar_cost_nothing() {
    let exemplar = Exemplar::grey(Array2::from_shape_fn((40, 40), |(z, x)| chiral(z, x)).view()).unwrap();
    let options = small()
        .with_search(Search::Exact)
        .with_views(Views::Two)
        .with_iterations(1)
        .with_method(Method::Kopf);
    let energy = |volume: &Array3<f32>| {
        let domain = Domain::new([16; 3]).unwrap().with_fixed(all_given(volume)).unwrap();
        made(std::slice::from_ref(&exemplar), &domain, &options).levels[0].energies[0]
    };
    let volume = woven(16);
    assert_eq!(energy(&volume), 0.0);
    for axis in 0..3 {
        let mut mirrored = volume.clone();
        mirrored.invert_axis(ndarray::Axis(axis));
        let cost = energy(&mirrored.as_standard_layout().into_owned());
        // Reflected in x or y alone, one family of slices is f of x - y, with reversed rows.
        assert!(cost > 0.1, "{axis}: {cost}");
    }
}

/// Either solver restores missing parts of such a solid exactly, so votes come from the right places.
#[test]
fn holes_close_exactly() {
    let exemplar = Exemplar::grey(Array2::from_shape_fn((40, 40), |(z, x)| chiral(z, x)).view()).unwrap();
    let volume = woven(16);
    let hole = |at: &[usize; 3]| at.iter().all(|i| (6..9).contains(i));
    let given: Vec<FixedVoxel> = all_given(&volume).into_iter().filter(|(at, _)| !hole(at)).collect();
    let domain = Domain::new([16; 3]).unwrap().with_fixed(given).unwrap();
    for solver in [Solver::Batch, Solver::Sequential] {
        let options = small()
            .with_search(Search::Exact)
            .with_views(Views::Two)
            .with_iterations(5)
            .with_method(Method::Kopf)
            .with_solver(solver);
        let solid = made(std::slice::from_ref(&exemplar), &domain, &options);
        for ((z, y, x), v) in volume.indexed_iter() {
            let found = solid.values[[z, y, x, 0]];
            assert!(
                (found - v).abs() < 0.02,
                "{solver:?} {z} {y} {x}: {found} instead of {v}"
            );
        }
    }
}

/// Mean cube of steps along an axis: negative if values increase slowly and decrease fast.
fn lean(volume: &Array4<f32>, axis: usize) -> f32 {
    let (nz, ny, nx, _) = volume.dim();
    let n = [nz, ny, nx];
    let steps = volume.indexed_iter().map(|((z, y, x, _), v)| {
        let mut at = [z, y, x];
        at[axis] = (at[axis] + 1) % n[axis];
        (volume[[at[0], at[1], at[2], 0]] - v).powi(3)
    });
    steps.sum::<f32>() / volume.len() as f32
}

/// Rows of an exemplar run along z; columns of the first along x, of the second along y; rows of the third along y and
/// its columns along x.
#[test]
fn exemplars_lie_as_documented() {
    let saw = |i: usize, turned: bool| {
        let rise = (i % 8) as f32 / 7.0;
        if turned { 1.0 - rise } else { rise }
    };
    let picture = |rows: bool, columns: bool| {
        let values = Array2::from_shape_fn((40, 40), |(r, c)| 0.5 * saw(r, rows) + 0.5 * saw(c, columns));
        Exemplar::grey(values.view()).unwrap()
    };
    let domain = Domain::new([16; 3]).unwrap();
    // Increasing along z and x, decreasing along y.
    let options = SolidOptions::default().with_levels(2).with_views(Views::Two);
    let solid = made(&[picture(false, false), picture(false, true)], &domain, &options);
    let [z, y, x] = [0, 1, 2].map(|axis| lean(&solid.values, axis));
    assert!(z < 0.0 && x < 0.0 && y > 0.0, "{z} {y} {x}");
    let options = options.with_views(Views::Three);
    let solid = made(
        &[picture(false, false), picture(false, true), picture(true, false)],
        &domain,
        &options,
    );
    let [z, y, x] = [0, 1, 2].map(|axis| lean(&solid.values, axis));
    assert!(z < 0.0 && x < 0.0 && y > 0.0, "{z} {y} {x}");
}

/// Both solvers give the same bits with any number of threads.
#[test]
fn threads_do_not_matter() {
    let exemplar = [Exemplar::grey(layers(48).view()).unwrap()];
    let domain = Domain::new([20, 18, 22]).unwrap();
    for method in [Method::Best, Method::ChenWang] {
        let options = SolidOptions::default()
            .with_method(method)
            .with_iterations(2)
            .with_levels(2)
            .with_seed(3);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| made(&exemplar, &domain, &options))
        };
        let one = with(1);
        assert!(one == with(2) && one == with(8), "{method:?}");
    }
}

/// Every voxel is a pixel of the exemplar, all pixels are used, contrast and grey levels are kept; means lose contrast.
#[test]
fn best_keeps_the_histogram_and_averaging_does_not() {
    let picture = layers(64);
    let exemplar = [Exemplar::grey(picture.view()).unwrap()];
    let domain = Domain::new([24; 3]).unwrap();
    let deviation = |values: &mut dyn Iterator<Item = f32>| {
        let values: Vec<f32> = values.collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt()
    };
    let wanted = deviation(&mut picture.iter().copied());
    let of = |method| {
        let options = SolidOptions::default().with_views(Views::Two).with_method(method);
        made(&exemplar, &domain, &options)
    };
    let best = of(Method::Best);
    let ratio = deviation(&mut best.values.iter().copied()) / wanted;
    assert!((0.95..1.05).contains(&ratio), "{ratio}");
    assert!(best.perplexity > 0.3, "{}", best.perplexity);
    for ((z, y, x), &source) in best.sources.indexed_iter() {
        let source = source as usize;
        assert_eq!(best.values[[z, y, x, 0]], picture[[source / 64, source % 64]]);
    }
    let averaged = deviation(&mut of(Method::WeiLevoy).values.iter().copied()) / wanted;
    assert!(averaged < 0.8, "{averaged}");
}

/// Matches found by coherence are nearly as good as those of the exact search.
#[test]
fn coherence_comes_near_exact_search() {
    let exemplar = [Exemplar::grey(layers(40).view()).unwrap()];
    let domain = Domain::new([13; 3]).unwrap();
    let energy = |search| {
        let of = |seed| {
            let options = SolidOptions::default()
                .with_views(Views::Two)
                .with_levels(2)
                .with_search(search)
                .with_seed(seed);
            *made(&exemplar, &domain, &options).levels[1].energies.last().unwrap()
        };
        (of(0) + of(1) + of(2)) / 3.0
    };
    let (exact, coherent) = (energy(Search::Exact), energy(Search::KCoherence));
    assert!(coherent <= 1.03 * exact, "{coherent} {exact}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    /// The solid has the phases' fractions to the voxel, V_V = A_A, also for a section of overlapping spheres.
    #[test]
    fn fractions_are_exact(seed in 0_u64..1000, nz in 10_usize..20) {
        let map = discs(40, seed);
        let exemplar = [Exemplar::phase_map(map.view()).unwrap()];
        let options = SolidOptions::default().with_iterations(2).with_seed(seed);
        let solid = made(&exemplar, &Domain::new([nz, 12, 14]).unwrap(), &options);
        let share = map.iter().filter(|v| **v == 1).count() as f64 / map.len() as f64;
        let found = solid.values.iter().filter(|v| **v == 1.0).count() as f64;
        prop_assert!((found - share * solid.values.len() as f64).abs() <= 0.5, "{found} of {}", solid.values.len());
        prop_assert!(solid.values.iter().all(|v| *v == 0.0 || *v == 1.0));
    }

    /// Every method keeps fixed voxels and writes nothing outside the mask.
    #[test]
    fn constraints_hold(seed in 0_u64..1000, which in 0_usize..4) {
        let method = [Method::Best, Method::WeiLevoy, Method::Kopf, Method::ChenWang][which];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mask = Array3::from_shape_fn((14, 15, 16), |(z, y, x)| (z as f64 - 7.0).hypot(y as f64 - 7.0).hypot(x as f64 - 8.0) < 6.5);
        let inside: Vec<[usize; 3]> = mask.indexed_iter().filter(|(_, i)| **i).map(|((z, y, x), _)| [z, y, x]).collect();
        let given: Vec<FixedVoxel> = (0..20)
            .map(|_| inside[rng.random_range(0..inside.len())])
            .map(|at| (at, vec![(at[0] * 100 + at[2]) as f32 / 1500.0]))
            .collect();
        let domain = Domain::new([14, 15, 16]).unwrap().with_mask(mask.view()).unwrap().with_fixed(given.clone()).unwrap();
        let exemplar = [Exemplar::grey(layers(40).view()).unwrap()];
        let options = SolidOptions::default().with_method(method).with_iterations(2).with_seed(seed);
        let solid = made(&exemplar, &domain, &options);
        for ((z, y, x), inside) in mask.indexed_iter() {
            let outside = solid.values[[z, y, x, 0]] == 0.0 && solid.sources[[z, y, x]] == u32::MAX;
            prop_assert!(*inside || outside);
            prop_assert!(!*inside || solid.sources[[z, y, x]] != u32::MAX);
        }
        for (at, value) in given {
            prop_assert_eq!(solid.values[[at[0], at[1], at[2], 0]], value[0]);
        }
    }
}

/// Every scan, search and solver makes a solid of colours with features, bounded or not.
#[test]
fn all_ways_lead_to_a_solid() {
    let picture = Array3::from_shape_fn((32, 32, 3), |(y, x, c)| ((y * (c + 1) + x * x) % 13) as f32 / 13.0);
    let features = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((y + x) % 7) as f32 / 7.0);
    let exemplar = Exemplar::colour(picture.view())
        .unwrap()
        .with_features(features.view(), 0.5)
        .unwrap();
    for scan in [Scan::Lexicographic, Scan::Random, Scan::Morton, Scan::Hilbert] {
        for search in [Search::Tsvq, Search::KCoherence] {
            let options = SolidOptions::default()
                .with_method(Method::ChenWang)
                .with_scan(scan)
                .with_search(search)
                .with_causal(scan == Scan::Lexicographic)
                .with_iterations(1)
                .with_levels(2);
            let solid = made(
                std::slice::from_ref(&exemplar),
                &Domain::new([6, 7, 8]).unwrap().open(),
                &options,
            );
            assert_eq!(solid.values.dim(), (6, 7, 8, 3));
            assert!(solid.values.iter().all(|v| (0.0..=1.0).contains(v)));
        }
    }
}

/// Every invalid input has its own error.
#[test]
fn invalid_inputs_are_refused() {
    let exemplar = Exemplar::grey(layers(32).view()).unwrap();
    let domain = Domain::new([16; 3]).unwrap();
    let fails = |exemplars: &[Exemplar], domain: &Domain, options: &SolidOptions| {
        synthesize_solid(exemplars, domain, options, &go).unwrap_err()
    };
    let options = SolidOptions::default();
    let one = std::slice::from_ref(&exemplar);
    let tiny = Exemplar::grey(layers(6).view()).unwrap();
    assert!(matches!(
        fails(&[tiny], &domain, &options),
        SolidError::ExemplarTooSmall { height: 6, side: 7, .. }
    ));
    assert_eq!(
        Exemplar::grey(Array2::ones((20, 20)).view()),
        Err(SolidError::ConstantExemplar)
    );
    assert_eq!(
        Exemplar::phase_map(Array2::ones((20, 20)).view()),
        Err(SolidError::ConstantExemplar)
    );
    let mut holed = layers(20);
    holed[[3, 4]] = f32::NAN;
    assert_eq!(
        Exemplar::grey(holed.view()),
        Err(SolidError::NotFinite { row: 3, column: 4 })
    );
    assert!(matches!(
        fails(one, &domain, &options.clone().with_levels(6)),
        SolidError::Levels { asked: 6, most: 3, .. }
    ));
    assert!(matches!(
        fails(one, &domain, &options.clone().with_neighbourhood(6)),
        SolidError::Neighbourhood { side: 6 }
    ));
    assert!(matches!(
        fails(one, &domain, &options.clone().with_iterations(0)),
        SolidError::Option { .. }
    ));
    assert!(matches!(
        fails(one, &domain, &options.clone().with_causal(true)),
        SolidError::Mismatch { .. }
    ));
    assert_eq!(fails(&[], &domain, &options), SolidError::Exemplars { found: 0 });
    let phases = Exemplar::phase_map(discs(32, 1).view()).unwrap();
    assert!(matches!(
        fails(&[exemplar.clone(), phases.clone()], &domain, &options),
        SolidError::Mismatch { .. }
    ));
    assert!(matches!(Domain::new([0, 4, 4]), Err(SolidError::Size { .. })));
    assert!(matches!(Domain::new([4096; 3]), Err(SolidError::Size { .. })));
    let nothing = Array3::from_elem((16, 16, 16), false);
    assert_eq!(domain.clone().with_mask(nothing.view()), Err(SolidError::EmptyMask));
    assert!(matches!(
        domain.clone().with_mask(Array3::from_elem((8, 8, 8), true).view()),
        Err(SolidError::MaskShape { .. })
    ));
    let given = |fixed: Vec<FixedVoxel>| domain.clone().with_fixed(fixed);
    assert!(matches!(
        given(vec![([1, 2, 16], vec![0.0])]),
        Err(SolidError::FixedOutside { .. })
    ));
    assert!(matches!(
        given(vec![([1, 2, 3], vec![0.0]), ([1, 2, 3], vec![0.1])]),
        Err(SolidError::FixedTwice { at: [1, 2, 3], .. })
    ));
    assert!(given(vec![([1, 2, 3], vec![0.1]), ([1, 2, 3], vec![0.1])]).is_ok());
    let colours = given(vec![([1, 2, 3], vec![0.1, 0.2, 0.3])]).unwrap();
    assert!(matches!(
        fails(one, &colours, &options),
        SolidError::FixedValue { channels: 1, .. }
    ));
    let no_phase = given(vec![([1, 2, 3], vec![7.0])]).unwrap();
    assert!(matches!(
        fails(&[phases], &no_phase, &options),
        SolidError::FixedValue { .. }
    ));
    let stop = synthesize_solid(one, &domain, &options, &|_| ControlFlow::Break(()));
    assert_eq!(stop, Err(SolidError::Cancelled));
}
