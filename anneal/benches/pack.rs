//! Packing, its certificate and measures of its quality.

#![expect(missing_docs, reason = "criterion's macro generates undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::ops::ControlFlow;
use std::time::Duration;
use stereology_anneal::{
    Distance, Mode, PackOptions, Packing, bond_order, box_for_fraction, equilibrate, lognormal_sizes, mix, overlaps,
    pack, populate, radial_distribution, section_test,
};
use stereology_shape::{Arrangement, Body, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody};

fn start(bodies: &[UnitBody], count: usize, fraction: f64) -> (Vec<Particle>, PeriodicBox) {
    let sizes = lognormal_sizes(count, 0.3, 0).expect("a valid width");
    let grains = mix(&sizes, &[1.0], 0).expect("valid sizes");
    let period = box_for_fraction(bodies, &grains, fraction).expect("a valid fraction");
    (populate(&grains, &period, 0), period)
}

fn packed(bodies: &[UnitBody], particles: &[Particle], period: &PeriodicBox, options: &PackOptions) -> Packing {
    pack(
        &Arrangement::new(bodies, particles.to_vec(), *period).expect("valid particles"),
        options,
        &|_| ControlFlow::Continue(()),
    )
    .expect("possible")
}

fn packs(c: &mut Criterion) {
    let sphere = [UnitBody::new(&Body::sphere(1.0).expect("a sphere"))];
    let rock = [UnitBody::new(&Body::rock(24))];
    let ellipsoid = [UnitBody::new(&Body::ellipsoid([1.0, 0.8, 0.6]).expect("an ellipsoid"))];
    let mut group = c.benchmark_group("pack");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    for (name, bodies, count, fraction) in [
        ("spheres 1000 at .60", &sphere, 1000, 0.6),
        ("spheres 1000 at .64", &sphere, 1000, 0.64),
        ("spheres 10000 at .30", &sphere, 10_000, 0.3),
        ("rocks of 20 vertices, 1000 at .50", &rock, 1000, 0.5),
        ("ellipsoids 1000 at .50", &ellipsoid, 1000, 0.5),
    ] {
        let (particles, period) = start(bodies, count, fraction);
        group.bench_function(name, |b| {
            b.iter(|| packed(bodies, &particles, &period, &PackOptions::default()));
        });
    }
    let (particles, period) = start(&sphere, 200, 0.3);
    for (name, mode) in [
        ("spheres 200 at .30, paper", Mode::paper()),
        ("spheres 200 at .30, anneal", Mode::anneal()),
        ("spheres 200 at .30, sequential", Mode::sequential()),
    ] {
        let options = PackOptions::default().with_mode(mode);
        group.bench_function(name, |b| {
            b.iter(|| packed(&sphere, &particles, &period, &options));
        });
    }
    let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 16, 8)).expect("a closed mesh");
    let ring = [UnitBody::new(&Body::from_mesh(ring))];
    let (particles, period) = start(&ring, 60, 0.2);
    group.bench_function("rings 60 at .20", |b| {
        b.iter(|| packed(&ring, &particles, &period, &PackOptions::default()));
    });
    group.finish();
}

fn certificates(c: &mut Criterion) {
    let rock = [UnitBody::new(&Body::rock(24))];
    let (particles, period) = start(&rock, 1000, 0.5);
    let packing = packed(&rock, &particles, &period, &PackOptions::default());
    let mut group = c.benchmark_group("overlaps");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    group.bench_function("rocks 1000 at .50", |b| {
        b.iter(|| overlaps(black_box(&packing)));
    });
    group.finish();
}

fn qualities(c: &mut Criterion) {
    let sphere = [UnitBody::new(&Body::sphere(1.0).expect("a sphere"))];
    let (particles, period) = start(&sphere, 1000, 0.3);
    let packing = packed(&sphere, &particles, &period, &PackOptions::default());
    let particles = packing.particles();
    let mut group = c.benchmark_group("quality");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(300));
    group.bench_function("radial_distribution 1000", |b| {
        b.iter(|| radial_distribution(black_box(particles), &period, Distance::Contacts, 3.0, 60));
    });
    group.bench_function("bond_order 1000", |b| {
        b.iter(|| bond_order(black_box(particles), &period, 1.4));
    });
    group.bench_function("section_test 1000, 10 replicates", |b| {
        b.iter(|| section_test(black_box(&packing), 5, 10, 0));
    });
    group.bench_function("equilibrate 1000, 10 sweeps", |b| {
        b.iter(|| equilibrate(black_box(&packing), 10, 0, &|_| ControlFlow::Continue(())).expect("not cancelled"));
    });
    group.finish();
}

criterion_group!(benches, packs, certificates, qualities);
criterion_main!(benches);
