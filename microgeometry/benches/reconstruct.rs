//! Labels on spheres of 5,000 to 82,000 triangles: the time as a power of the number of triangles.

#![allow(missing_docs, reason = "made by criterion's macro")]

use std::{hint::black_box, ops::ControlFlow, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use stereology_microgeometry::{
    ContactDistribution, Law, Method, ReconstructOptions, reconstruct, to_distribution_units,
};
use stereology_shape::TriangleMesh;

fn reconstruct_spheres(c: &mut Criterion) {
    let of = ContactDistribution::from_laws(1.0, Law::Disc(12.0), Law::Disc(12.0), 0.5).expect("a distribution");
    let mut group = c.benchmark_group("reconstruct");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(2))
        .warm_up_time(Duration::from_millis(300));
    for times in [4, 5, 6] {
        let ball = to_distribution_units(&TriangleMesh::icosphere(2.0, times), 60.0).expect("a sphere");
        group.throughput(Throughput::Elements(ball.triangles.len() as u64));
        for method in [Method::Tight, Method::Paper] {
            let options = ReconstructOptions::default().with_method(method);
            group.bench_function(format!("{} {}", method.name(), ball.triangles.len()), |b| {
                b.iter(|| reconstruct(black_box(&ball), &of, &options, &|_| ControlFlow::Continue(())));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, reconstruct_spheres);
criterion_main!(benches);
