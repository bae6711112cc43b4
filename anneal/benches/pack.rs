//! Packing and its certificate at the sizes the notes give targets for.

#![expect(missing_docs, reason = "criterion's macro writes undocumented functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::ops::ControlFlow;
use std::time::Duration;
use stereology_anneal::{Mode, PackOptions, Packing, box_for_fraction, lognormal_sizes, mix, overlaps, pack, populate};
use stereology_shape::{Body, Particle, PeriodicBox, UnitBody};

fn start(bodies: &[UnitBody], count: usize, fraction: f64) -> (Vec<Particle>, PeriodicBox) {
    let sizes = lognormal_sizes(count, 0.3, 0).expect("a valid width");
    let grains = mix(&sizes, &[1.0], 0).expect("valid sizes");
    let period = box_for_fraction(bodies, &grains, fraction).expect("a valid fraction");
    (populate(&grains, &period, 0), period)
}

fn packed(bodies: &[UnitBody], particles: &[Particle], period: &PeriodicBox, options: &PackOptions) -> Packing {
    pack(bodies, particles.to_vec(), period, options, &|_| {
        ControlFlow::Continue(())
    })
    .expect("possible")
}

fn packs(c: &mut Criterion) {
    let sphere = [UnitBody::new(&Body::sphere(1.0).expect("a sphere"))];
    let rock = [UnitBody::new(&Body::rock(1))];
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
        ("rocks 1000 at .50", &rock, 1000, 0.5),
        ("ellipsoids 1000 at .50", &ellipsoid, 1000, 0.5),
    ] {
        let (particles, period) = start(bodies, count, fraction);
        group.bench_function(name, |b| {
            b.iter(|| packed(bodies, &particles, &period, &PackOptions::default()));
        });
    }
    let (particles, period) = start(&sphere, 1000, 0.3);
    let paper = PackOptions::default().with_mode(Mode::Paper);
    group.bench_function("spheres 1000 at .30, paper", |b| {
        b.iter(|| packed(&sphere, &particles, &period, &paper));
    });
    group.finish();
}

fn certificates(c: &mut Criterion) {
    let rock = [UnitBody::new(&Body::rock(1))];
    let (particles, period) = start(&rock, 1000, 0.5);
    let packing = packed(&rock, &particles, &period, &PackOptions::default());
    let mut group = c.benchmark_group("overlaps");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    group.bench_function("rocks 1000 at .50", |b| {
        b.iter(|| overlaps(&rock, black_box(packing.particles()), &period).expect("valid particles"));
    });
    group.finish();
}

criterion_group!(benches, packs, certificates);
criterion_main!(benches);
