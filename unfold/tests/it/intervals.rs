//! Bootstrap intervals: repeatable, around the estimate, about as wide as the estimates scatter.

use crate::experiment::{AREA, DISTRIBUTIONS, Design};
use crate::spheres;
use std::ops::ControlFlow;
use stereology_unfold::{
    Bootstrap, Method, ProfileCounts, UnfoldError, UnfoldOptions, Unfolding, equal_edges, unfold, unfold_types,
    unfold_with_progress,
};

fn problem(seed: u64) -> (ProfileCounts, stereology_unfold::Kernel) {
    let edges = equal_edges(1.0, 10);
    let profiles = Design::new("constant", 1300.0).profiles(seed);
    (
        ProfileCounts::from_sizes(&profiles, None, &edges, AREA).unwrap(),
        spheres::integrated(&edges, &edges),
    )
}

fn options(replicates: usize) -> UnfoldOptions {
    let bootstrap = Bootstrap {
        replicates,
        ..Bootstrap::default()
    };
    UnfoldOptions::default()
        .with_method(Method::Nnls)
        .with_bootstrap(bootstrap)
}

fn width(found: &Unfolding) -> f64 {
    let interval = found.total.interval.unwrap();
    assert!(interval.lower <= found.total.value && found.total.value <= interval.upper);
    interval.upper - interval.lower
}

/// The intervals are the same bits at any number of threads.
#[test]
fn same_bits_at_any_number_of_threads() {
    let (counts, kernel) = problem(1);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| unfold(&counts, &kernel, &options(40)).unwrap())
    };
    assert_eq!(run(1), run(3));
}

/// So are those of the smooth estimate, each thread with room of its own; and they lie about the estimate, not below
/// zero.
#[test]
fn smooth_intervals_are_the_same_bits_at_any_number_of_threads() {
    let (kernel, edges) = spheres::fine(&equal_edges(1.0, 10));
    let profiles = Design::new("lognormal", 1150.0).profiles(4);
    let counts = ProfileCounts::from_sizes(&profiles, None, &edges, AREA).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = options(60).with_method(Method::Auto);
        pool.install(|| unfold(&counts, &kernel, &options).unwrap())
    };
    let found = run(1);
    assert_eq!(found, run(3));
    assert_eq!(found.method, Method::Penalised);
    for (density, interval) in found.number_density.iter().zip(found.intervals.as_ref().unwrap()) {
        let (density, interval) = (density.unwrap(), interval.unwrap());
        assert!(0.0 <= interval.lower && interval.lower <= density && density <= interval.upper);
    }
    let passing: Vec<f64> = found.distribution.passing.iter().map(|of| of.value).collect();
    assert!(passing.is_sorted() && passing[0] < 1e-12 && (passing[10] - 1.0).abs() < 1e-12);
    // V_V = A_A within the noise of the counts: some 4 %.
    assert!((found.area_fraction.expected / found.area_fraction.observed - 1.0).abs() < 0.05);
    let surface = found.surface_density.unwrap();
    assert!(surface.value > 0.0 && surface.interval.unwrap().upper >= surface.value);
}

/// Nominal 90 % intervals of the default hold the truth, on the figure's distributions pooled: by the table of coverage
/// 92, 90, 90 and 87 % of (total, mean size, volume fraction, bins). Of 4 × 25 intervals fewer than 74 happens once in
/// 10^6 at 90 %.
#[test]
fn smooth_intervals_cover() {
    let (kernel, edges) = spheres::fine(&equal_edges(1.0, 10));
    let mut held = [0; 2];
    for (name, profiles) in DISTRIBUTIONS {
        let design = Design::new(name, profiles);
        let truth: f64 = design.densities(10).iter().sum();
        let fractions: Vec<f64> = design.densities(200);
        let volume: f64 = fractions
            .iter()
            .enumerate()
            .map(|(k, n)| n * std::f64::consts::PI / 6.0 * ((k as f64 + 0.5) / 200.0).powi(3))
            .sum();
        for seed in 0..25 {
            let counts = ProfileCounts::from_sizes(&design.profiles(500 + seed), None, &edges, AREA).unwrap();
            let found = unfold(&counts, &kernel, &options(60).with_method(Method::Auto)).unwrap();
            for (held, (estimate, truth)) in held
                .iter_mut()
                .zip([(found.total, truth), (found.volume_fraction, volume)])
            {
                let interval = estimate.interval.unwrap();
                *held += usize::from(interval.lower <= truth && truth <= interval.upper);
            }
        }
    }
    println!("held of 100: total {}, volume fraction {}", held[0], held[1]);
    assert!(held.iter().all(|&held| held >= 74), "{held:?}");
}

/// The mean width of nominal 90 % intervals of the total is near 3.3 standard deviations of the total over samples;
/// they cover the truth somewhat too seldom (true coverage of this case near .9; below 70 of 100 once in 10^8).
#[test]
fn intervals_are_as_wide_as_estimates_scatter() {
    let truth: f64 = Design::new("constant", 1300.0).densities(10).iter().sum();
    let found: Vec<Unfolding> = (0..100)
        .map(|seed| {
            let (counts, kernel) = problem(seed);
            unfold(&counts, &kernel, &options(60)).unwrap()
        })
        .collect();
    let mean = found.iter().map(|one| one.total.value).sum::<f64>() / 100.0;
    let deviation = (found.iter().map(|one| (one.total.value - mean).powi(2)).sum::<f64>() / 99.0).sqrt();
    let widths = found.iter().map(width).sum::<f64>() / 100.0;
    assert!((2.2..4.4).contains(&(widths / deviation)), "{}", widths / deviation);
    let covered = found
        .iter()
        .filter(|one| {
            one.total
                .interval
                .is_some_and(|interval| interval.lower <= truth && truth <= interval.upper)
        })
        .count();
    println!("coverage of the total: {covered} of 100");
    assert!(covered >= 70, "{covered}");
}

/// Two halves of the same material, labelled, sum to an interval that is narrower than the sum of theirs.
#[test]
fn independent_types_add_in_quadrature() {
    let types = [problem(3), problem(4)];
    let found = unfold_types(&types, &options(100)).unwrap();
    let apart: f64 = found.types.iter().map(width).sum();
    let together = found.total.interval.unwrap();
    let ratio = (together.upper - together.lower) / apart;
    assert!((0.5..0.95).contains(&ratio), "{ratio}");
    assert_eq!(found.intervals.unwrap().len(), 10);
}

#[test]
fn bootstrap_can_be_cancelled() {
    let (counts, kernel) = problem(1);
    let cancelled = unfold_with_progress(&counts, &kernel, &options(40), &|_| ControlFlow::Break(()));
    assert_eq!(cancelled, Err(UnfoldError::Cancelled));
}
