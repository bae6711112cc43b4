//! Fits and bootstraps of ten bins of spheres; bootstraps on one thread.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;
use std::hint::black_box;
use std::time::Duration;
use stereology_unfold::{
    Bootstrap, Kernel, Method, ProfileCounts, ReportedEdgesError, SizeBins, UnfoldOptions, capped_kernel, equal_edges,
    unfold,
};

fn spheres(rows: usize) -> (Kernel, Vec<f64>) {
    let (profile_edges, size_edges) = (equal_edges(1.0, rows), equal_edges(1.0, 10));
    let below = |d: f64, diameter: f64| diameter - (diameter * diameter - d.min(diameter).powi(2)).sqrt();
    let matrix = DMatrix::from_fn(rows, 10, |i, j| {
        below(profile_edges[i + 1], size_edges[j + 1]) - below(profile_edges[i], size_edges[j + 1])
    });
    let sizes = SizeBins::upper_edge(&size_edges).expect("edges increase");
    (
        Kernel::new(matrix, sizes, 0.5).expect("a kernel of spheres"),
        profile_edges,
    )
}

/// Ten reported bins of 40, a hundred profile bins.
fn fine() -> (Kernel, Vec<f64>) {
    let (profile_edges, edges) = (equal_edges(1.0, 100), equal_edges(1.0, 10));
    let sizes = SizeBins::integrated(&equal_edges(1.0, 40))
        .map_err(ReportedEdgesError::from)
        .and_then(|bins| bins.reported_in(&edges));
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let kernel = capped_kernel(&law, 1.0, 0.0, &profile_edges, sizes.expect("edges increase"), 0.5);
    (kernel.expect("a kernel of spheres"), profile_edges)
}

/// Some 1200 profiles of spheres whose diameters lie about 0.55.
fn single_mode() -> Vec<f64> {
    let mut profiles = Vec::new();
    let mut state = 0.5_f64;
    let mut next = || {
        // Golden ratio: evenly spread, the same everywhere.
        state = (state + 0.618_033_988_749_895).fract();
        state
    };
    while profiles.len() < 1200 {
        let diameter = 0.55 + 0.15 * 1.7 * (next() + next() + next() + next() - 2.0);
        let depth = next() - 0.5;
        let chord = diameter * diameter - 4.0 * depth * depth;
        if diameter > 0.0 && chord > 0.0 {
            profiles.push(chord.sqrt());
        }
    }
    profiles
}

fn bench_unfold(c: &mut Criterion) {
    let mut group = c.benchmark_group("unfold");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    let sizes = single_mode();
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let paper = (spheres(10), Method::Paper);
    let others = [
        Method::Auto,
        Method::Penalised,
        Method::Sparse,
        Method::Em,
        Method::Ems,
        Method::Nnls,
    ];
    for ((kernel, edges), method) in std::iter::once(paper).chain(others.map(|method| (fine(), method))) {
        let counts = ProfileCounts::from_sizes(&sizes, None, &edges, 1440.0).expect("sizes fit the edges");
        let options = UnfoldOptions::default().with_method(method);
        group.bench_function(method.name(), |b| {
            b.iter(|| unfold(black_box(&counts), &kernel, &options));
        });
        let options = options.with_bootstrap(Bootstrap::default());
        group.bench_function(format!("{}_bootstrap_200", method.name()), |b| {
            b.iter(|| one_thread.install(|| unfold(black_box(&counts), &kernel, &options)));
        });
    }
    let million: Vec<f64> = (1..=1_000_000).map(|k| f64::from(k) / 1e6).collect();
    let edges = equal_edges(1.0, 100);
    let (kernel, _) = fine();
    group.bench_function("count_and_fit_1000000_profiles", |b| {
        b.iter(|| {
            let counts = ProfileCounts::from_sizes(black_box(&million), None, &edges, 100.0);
            counts.map(|counts| unfold(&counts, &kernel, &UnfoldOptions::default()))
        });
    });
    group.finish();
}

criterion_group!(benches, bench_unfold);
criterion_main!(benches);
