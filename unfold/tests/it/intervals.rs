//! Bootstrap intervals: repeatable, around the estimate, about as wide as the estimates scatter.

use crate::experiment::{AREA, Design};
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

/// The mean width of nominal 90 % intervals of the total is near 3.3 standard deviations of the total over samples; they cover the truth
/// somewhat too seldom (true coverage of this case near .9; below 70 of 100 once in 10^8).
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
