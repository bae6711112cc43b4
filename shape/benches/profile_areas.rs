//! One section of a rock and of a torus.

#![allow(missing_docs, reason = "criterion's macro makes an undocumented function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody};

fn profile_areas(c: &mut Criterion) {
    let mut group = c.benchmark_group("profile_areas");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 48, 24)).expect("a torus is closed");
    for (name, body) in [("rock", Body::rock(7)), ("torus_2304", Body::from_mesh(torus))] {
        let unit = UnitBody::new(&body);
        group.bench_function(name, |b| {
            b.iter(|| unit.profile_areas(black_box(&Vector3::z_axis()), 0.1));
        });
    }
    group.finish();
}

criterion_group!(benches, profile_areas);
criterion_main!(benches);
