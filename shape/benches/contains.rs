//! A thousand points, inside or outside?

#![allow(missing_docs, reason = "criterion's macro makes an undocumented function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody};

/// Points all over a cube somewhat larger than the unit body.
fn probes() -> Vec<Point3<f64>> {
    let at = |i: u32, k: f64| ((f64::from(i) * k).fract() - 0.5) * 1.2;
    (0..1000)
        .map(|i| Point3::new(at(i, 0.618_033), at(i, 0.754_877), at(i, 0.569_840)))
        .collect()
}

fn contains(c: &mut Criterion) {
    let mut group = c.benchmark_group("contains");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    let probes = probes();
    let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 48, 24)).expect("a torus is closed");
    for (name, body) in [("rock", Body::rock(7)), ("torus_2304", Body::from_mesh(torus))] {
        let unit = UnitBody::new(&body);
        group.bench_function(name, |b| {
            b.iter(|| probes.iter().filter(|p| unit.contains(black_box(p))).count());
        });
    }
    group.finish();
}

criterion_group!(benches, contains);
criterion_main!(benches);
