//! Section laws: closed form, convex sweep, contour sweep, Monte Carlo.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;
use stereology_kmatrix::{MonteCarloOptions, SectionLaw, SectionOptions, Sizes, SphereKernel};
use stereology_shape::{Body, ClosedMesh, TriangleMesh};

fn mesh(triangles: TriangleMesh) -> Body {
    Body::from_mesh(ClosedMesh::try_from(triangles).expect("a primitive is closed"))
}

fn section_law(c: &mut Criterion) {
    let mut group = c.benchmark_group("section_law");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    group.bench_function("sphere_kernel_100", |b| b.iter(|| SphereKernel::new(black_box(100))));
    group.bench_function("ellipsoid", |b| {
        b.iter(|| SectionLaw::ellipsoid(black_box([1.0, 2.0, 3.0])));
    });
    let half_percent = SectionOptions::default().with_tolerance(5e-3);
    let bodies = [
        ("cube_half_percent", Body::cuboid([1.0; 3]).expect("edges are positive")),
        ("icosphere_1280_half_percent", mesh(TriangleMesh::icosphere(1.0, 3))),
        ("torus_2048_half_percent", mesh(TriangleMesh::torus(2.0, 0.5, 64, 16))),
    ];
    for (name, body) in &bodies {
        group.bench_function(*name, |b| {
            b.iter(|| SectionLaw::of_body(black_box(body), &half_percent));
        });
    }
    let cube = &bodies[0].1;
    let some = MonteCarloOptions::default().with_iterations(10_000);
    group.bench_function("monte_carlo_cube_10000", |b| {
        b.iter(|| SectionLaw::monte_carlo(black_box(cube), &some));
    });
    let law = SectionLaw::of_body(cube, &half_percent).expect("a cube has sections");
    let edges = |bins: i32| (0..=bins).map(|k| f64::from(k) / f64::from(bins)).collect::<Vec<_>>();
    let (profile_edges, size_edges) = (edges(100), edges(40));
    group.bench_function("integrated_kernel_100_by_40", |b| {
        b.iter(|| law.kernel(black_box(&profile_edges), &size_edges, Sizes::Integrated));
    });
    group.finish();
}

criterion_group!(benches, section_law);
criterion_main!(benches);
