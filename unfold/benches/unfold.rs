//! Fits and bootstraps of ten bins of spheres.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;
use std::hint::black_box;
use std::time::Duration;
use stereology_unfold::{Bootstrap, Kernel, Method, ProfileCounts, SizeBins, UnfoldOptions, equal_edges, unfold};

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

fn bench_unfold(c: &mut Criterion) {
    let mut group = c.benchmark_group("unfold");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    for rows in [10, 100] {
        let (kernel, edges) = spheres(rows);
        let sizes: Vec<f64> = (1..=1200).map(|k| (f64::from(k * 7 % 1201) / 1201.0).sqrt()).collect();
        let counts = ProfileCounts::from_sizes(&sizes, None, &edges, 100.0).expect("sizes fit the edges");
        for method in [Method::Paper, Method::Nnls, Method::Em] {
            if method == Method::Paper && rows != 10 {
                continue;
            }
            let options = UnfoldOptions::default().with_method(method);
            group.bench_function(format!("{}_{rows}_by_10", method.name()), |b| {
                b.iter(|| unfold(black_box(&counts), &kernel, &options));
            });
            let options = options.with_bootstrap(Bootstrap::default());
            group.bench_function(format!("{}_{rows}_by_10_bootstrap_200", method.name()), |b| {
                b.iter(|| unfold(black_box(&counts), &kernel, &options));
            });
        }
    }
    let million: Vec<f64> = (1..=1_000_000).map(|k| f64::from(k) / 1e6).collect();
    let edges = equal_edges(1.0, 100);
    group.bench_function("count_1000000_profiles", |b| {
        b.iter(|| ProfileCounts::from_sizes(black_box(&million), None, &edges, 100.0));
    });
    group.finish();
}

criterion_group!(benches, bench_unfold);
criterion_main!(benches);
