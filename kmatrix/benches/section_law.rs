//! Section laws: closed form, convex sweep, contour sweep, Monte Carlo.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use std::hint::black_box;
use std::time::Duration;
use stereology_kmatrix::{MonteCarloOptions, SectionLaw, SectionOptions, Sizes, SphereKernel};
use stereology_shape::{Body, ClosedMesh, TriangleMesh};

fn mesh(triangles: TriangleMesh) -> Body {
    Body::from_mesh(ClosedMesh::try_from(triangles).expect("a primitive is closed"))
}

/// A torus with knobs: many saddles. 2 × around × across triangles.
fn knobbly(across: u32, around: u32) -> TriangleMesh {
    TriangleMesh::torus(2.0, 0.7, around, across)
        .mapped(|p| p * (1.0 + 0.1 * (9.0 * p.x).sin() * (9.0 * p.y).sin() * (9.0 * p.z).cos()))
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
    let chip = mesh(TriangleMesh::icosphere(1.0, 3).mapped(|p| Point3::new(p.x, 0.8 * p.y, 0.6 * p.z)));
    let bodies = [
        (
            "cube_half_percent",
            Body::cuboid([1.0; 3]).expect("edges are positive"),
            half_percent,
        ),
        ("convex_1280_half_percent", chip.clone(), half_percent),
        ("convex_1280_hundredth_percent", chip, half_percent.with_tolerance(1e-4)),
        (
            "torus_10000_half_percent",
            mesh(TriangleMesh::torus(2.0, 0.5, 100, 50)),
            half_percent,
        ),
        ("knobbly_10240_half_percent", mesh(knobbly(40, 128)), half_percent),
        ("knobbly_100000_half_percent", mesh(knobbly(125, 400)), half_percent),
    ];
    for (name, body, options) in &bodies {
        group.bench_function(*name, |b| {
            b.iter(|| SectionLaw::of_body(black_box(body), options));
        });
    }
    group.bench_function("body_of_convex_1280", |b| {
        b.iter(|| mesh(black_box(TriangleMesh::icosphere(1.0, 3))));
    });
    group.bench_function("body_of_knobbly_10240", |b| {
        b.iter(|| mesh(black_box(knobbly(40, 128))));
    });
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
