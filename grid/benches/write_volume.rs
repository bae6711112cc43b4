//! Bytes per second of each format.
#![expect(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::ops::ControlFlow;
use std::time::Duration;
use stereology_grid::{Format, VolumeShape, write_volume};

fn formats(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let shape = VolumeShape {
        nz: 128,
        ny: 128,
        nx: 128,
        channels: 3,
    };
    let mut group = c.benchmark_group("write_volume 128³ RGB");
    group.throughput(Throughput::Bytes(3 << 21));
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    for format in Format::ALL {
        let file = folder.path().join(format!("volume{format}"));
        group.bench_function(format.to_string(), |b| {
            b.iter(|| {
                write_volume::<u8>(&file, format, shape, [1.0; 3], |z, mut slab| {
                    slab.fill(u8::from(z > 64));
                    ControlFlow::Continue(())
                })
                .expect("room for 6 MB");
            });
        });
    }
    group.finish();
}

criterion_group!(benches, formats);
criterion_main!(benches);
