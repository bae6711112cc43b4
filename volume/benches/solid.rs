//! Points, voxels and pictures per second of a packing of 5,000 rocks; points of 100 to 100,000 rocks.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use ndarray::{Array3, Array4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Duration;
use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody, isotropic_rotation};
use stereology_volume::{Axis, Residual, SlicePlane, Solid};

/// Rocks on a jittered lattice, a fifth of them overlapping a little: as many to search as in a packing.
fn rocks(n: u32) -> Solid {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let side = 256.0;
    let spacing = side / f64::from(n);
    let particles: Vec<Particle> = (0..n * n * n)
        .map(|i| Particle {
            shape: i as usize % 2,
            size: spacing * (0.8 + 0.25 * rng.random::<f64>()),
            category: 0,
            position: Point3::from(
                [i % n, i / n % n, i / n / n].map(|k| (f64::from(k) + 0.3 * rng.random::<f64>()) * spacing),
            ),
            orientation: isotropic_rotation(&mut rng),
        })
        .collect();
    let colours = particles
        .iter()
        .map(|_| [rng.random(), rng.random(), rng.random()])
        .collect();
    let bodies = [1, 2].map(|seed| UnitBody::new(&Body::rock(seed))).to_vec();
    let noise = Array4::from_shape_fn((64, 64, 64, 3), |_| 0.1 * rng.random::<f32>());
    let residual = Residual {
        binder: noise.clone(),
        particles: noise,
        voxel: 1.0,
    };
    let period = PeriodicBox::new(Vector3::repeat(side)).expect("a box");
    Solid::new(
        Arrangement::new(bodies, particles, period).expect("particles"),
        colours,
        [0.5; 3],
        Some(residual),
    )
    .expect("a solid")
}

fn points() -> Vec<Point3<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    (0..4096)
        .map(|_| Point3::from(Vector3::from_fn(|_, _| 256.0 * rng.random::<f64>())))
        .collect()
}

fn numbers_of_particles(c: &mut Criterion) {
    let points = points();
    let mut group = c.benchmark_group("colour_at");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(800))
        .throughput(Throughput::Elements(4096));
    for n in [5, 10, 22, 46_u32] {
        let solid = rocks(n);
        group.bench_function(format!("{} rocks", n.pow(3)), |b| {
            b.iter(|| points.iter().map(|p| solid.colour_at(p)[0]).sum::<f32>());
        });
    }
    group.finish();
}

fn queries(c: &mut Criterion) {
    let solid = rocks(17);
    let points = points();
    let mut group = c.benchmark_group("4913 rocks");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(800));
    group.throughput(Throughput::Elements(4096));
    group.bench_function("id_at", |b| {
        b.iter(|| points.iter().filter(|p| solid.id_at(p).is_some()).count());
    });
    group.bench_function("colour_at", |b| {
        b.iter(|| points.iter().map(|p| solid.colour_at(p)[0]).sum::<f32>());
    });
    group.bench_function("distance_at", |b| {
        b.iter(|| points.iter().map(|p| solid.distance_at(p)).sum::<f64>());
    });
    let grid = solid.voxel_grid(256);
    let mut slab = Array3::zeros((256, 256, 3));
    group.throughput(Throughput::Elements(256 * 256));
    group.bench_function("fill_rgb, a slab of 256²", |b| {
        b.iter(|| solid.fill_rgb(&grid, 100, slab.view_mut()));
    });
    let plane = SlicePlane::across(Axis::Z, 100.0);
    group.bench_function("slice of 256²", |b| b.iter(|| solid.slice(&plane, 256, 256, 1.0)));
    group.bench_function("section_profiles", |b| {
        b.iter(|| solid.section_profiles(Axis::Z, 100.0).len());
    });
    group.bench_function("new", |b| b.iter(|| rocks(17)));
    group.finish();
}

criterion_group!(benches, queries, numbers_of_particles);
criterion_main!(benches);
