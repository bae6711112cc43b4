//! Queries of a body with a thousand points: inside or outside, signed distance, farthest point in a direction.

#![allow(missing_docs, reason = "criterion's macro makes an undocumented function")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use stereology_shape::{Body, ClosedMesh, TriangleMesh, UnitBody};

type Query = fn(&UnitBody, &Point3<f64>) -> f64;

/// Points all over a cube somewhat larger than the unit body.
fn probes() -> Vec<Point3<f64>> {
    let at = |i: u32, k: f64| ((f64::from(i) * k).fract() - 0.5) * 1.2;
    (0..1000)
        .map(|i| Point3::new(at(i, 0.618_033), at(i, 0.754_877), at(i, 0.569_840)))
        .collect()
}

fn points(c: &mut Criterion) {
    let queries: [(&str, Query); 3] = [
        ("contains", |body, p| f64::from(u8::from(body.contains(p)))),
        ("signed_distance", |body, p| body.signed_distance(p)),
        ("support", |body, p| body.support(&p.coords).x),
    ];
    let probes = probes();
    let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 48, 24)).expect("a torus is closed");
    let bodies = [("rock", Body::rock(7)), ("torus_2304", Body::from_mesh(torus))];
    for (query_name, query) in queries {
        let mut group = c.benchmark_group(query_name);
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_millis(500));
        for (name, body) in &bodies {
            let unit = UnitBody::new(body);
            group.bench_function(*name, |b| {
                b.iter(|| probes.iter().map(|p| query(&unit, black_box(p))).sum::<f64>());
            });
        }
        group.finish();
    }
}

criterion_group!(benches, points);
criterion_main!(benches);
