//! Solids: colours of single points by number of particles, and voxels written beside a raw write of the same bytes.

use std::fs::{self, File};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use nalgebra::{Point3, Vector3};
use ndarray::Array4;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::grid::Format;
use stereology::shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody, isotropic_rotation};
use stereology::volume::{Channel, Residual, Solid};

use super::bench::{Bench, Row, Section};

const SIDE: f64 = 128.0;
const POINTS: usize = 1_000_000;
const RUNS: usize = 5;

pub fn measure(bench: &Bench) -> Result<Section> {
    let mut rows = Vec::new();
    for along in [5, 10, 22, 46, 100] {
        let solid = rocks(along)?;
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let points: Vec<Point3<f64>> = (0..POINTS)
            .map(|_| Point3::from(Vector3::from_fn(|_, _| SIDE * random.random::<f64>())))
            .collect();
        let (ours, _) = bench.time(3, || Ok(solid.colours_at(&points)))?;
        rows.push(Row {
            task: format!("colours at a million random points of {} rocks", along.pow(3)),
            ours,
            peer: None,
            remark: format!("{:.1} million per second on one core", 1e-6 * POINTS as f64 / ours),
        });
    }
    let folder = crate::workspace::root()?.join("target/bench-report");
    fs::create_dir_all(&folder)?;
    let written = files(&folder);
    fs::remove_dir_all(&folder)?;
    rows.extend(written?);
    Ok(Section {
        words: format!(
            "Rocks of two shapes, a fifth of them slightly overlapping, in a box of side {SIDE:.0} with a residual of as many voxels per side. Files: voxels of \
             10648 rocks. Their times are wall times with all cores until the file is synced to disk; the reference is a raw disk write of the same number of \
             bytes. Both are measured in turn, {RUNS} times, and medians are reported, as the speed of a shared disk varies. The target is half the speed of \
             the disk; each row gives the speed of the disk of which ours is half. For faster disks the cores limit the speed."
        ),
        peer: Ok("raw disk write".to_owned()),
        rows,
    })
}

/// Rocks on a randomly displaced lattice.
fn rocks(along: u32) -> Result<Solid> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let spacing = SIDE / f64::from(along);
    let particles: Vec<Particle> = (0..along.pow(3))
        .map(|i| Particle {
            shape: i as usize % 2,
            size: spacing * (0.8 + 0.25 * random.random::<f64>()),
            category: 0,
            position: Point3::from(
                [i % along, i / along % along, i / along / along]
                    .map(|k| (f64::from(k) + 0.3 * random.random::<f64>()) * spacing),
            ),
            orientation: isotropic_rotation(&mut random),
        })
        .collect();
    let colours = particles
        .iter()
        .map(|_| [random.random(), random.random(), random.random()])
        .collect();
    let voxels = SIDE as usize;
    let noise = Array4::from_shape_simple_fn((voxels, voxels, voxels, 3), || 0.1 * random.random::<f32>());
    let residual = Residual {
        binder: noise.clone(),
        particles: noise,
        voxel: 1.0,
    };
    let bodies = [1, 2].map(|seed| UnitBody::new(&Body::rock(seed))).to_vec();
    let period = PeriodicBox::new(Vector3::repeat(SIDE))?;
    Ok(Solid::new(
        Arrangement::new(bodies, particles, period)?,
        colours,
        [0.5; 3],
        Some(residual),
    )?)
}

/// Voxels in each kind of format: one file, pages, chunks with coarser resolutions, and ids.
fn files(folder: &Path) -> Result<Vec<Row>> {
    let solid = rocks(22)?;
    // Random bytes, which no file system can compress.
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let block: Vec<u8> = (0..1 << 20).map(|_| random.random()).collect();
    let mut rows = Vec::new();
    for (voxels, channel, name, format, ending) in [
        (512, Channel::Rgb, "colour", Format::Npy, "npy"),
        (1024, Channel::Rgb, "colour", Format::Npy, "npy"),
        (512, Channel::Rgb, "colour", Format::Tiff, "tif"),
        (512, Channel::Rgb, "colour", Format::Zarr, "zarr"),
        (512, Channel::Id, "ids", Format::Hdf5, "h5"),
    ] {
        let grid = solid.voxel_grid(voxels);
        let path = folder.join(format!("voxels.{ending}"));
        let mut bytes = 0;
        let [mut ours, mut disk] = [Vec::new(), Vec::new()];
        for _ in 0..RUNS {
            ours.push(seconds(|| {
                let go = |_: f64| ControlFlow::Continue(());
                solid.write_voxels(&path, format, &grid, channel, &go)?;
                bytes = synced(&path)?;
                Ok(())
            })?);
            remove(&path)?;
            disk.push(seconds(|| write_plainly(&path, &block, bytes))?);
            remove(&path)?;
        }
        let [ours, disk] = [ours, disk].map(median);
        let megabytes = 1e-6 * bytes as f64;
        rows.push(Row {
            task: format!("{voxels}³ in {name}, .{ending}"),
            ours,
            peer: Some(disk),
            remark: format!(
                "{megabytes:.0} MB: {:.0} MB/s, half of {:.0}; raw write {:.0}",
                megabytes / ours,
                2.0 * megabytes / ours,
                megabytes / disk
            ),
        });
    }
    Ok(rows)
}

fn seconds(task: impl FnOnce() -> Result<()>) -> Result<f64> {
    let start = Instant::now();
    task()?;
    Ok(start.elapsed().as_secs_f64())
}

/// Median of an odd number of runs.
fn median(mut runs: Vec<f64>) -> f64 {
    runs.sort_by(f64::total_cmp);
    runs[runs.len() / 2]
}

/// Bytes of a file, or of all files of a folder, after they are synced to disk.
fn synced(path: &Path) -> Result<u64> {
    if !path.is_dir() {
        let file = File::open(path)?;
        file.sync_all()?;
        return Ok(file.metadata()?.len());
    }
    let mut bytes = 0;
    for entry in fs::read_dir(path)? {
        bytes += synced(&entry?.path())?;
    }
    Ok(bytes)
}

fn remove(path: &Path) -> Result<()> {
    if path.is_dir() {
        fs::remove_dir_all(path)?;
    } else {
        fs::remove_file(path)?;
    }
    Ok(())
}

/// Writes this many bytes and syncs them to disk.
fn write_plainly(path: &Path, block: &[u8], bytes: u64) -> Result<()> {
    let mut file = File::create(path)?;
    let mut left = bytes;
    while left > 0 {
        let part = left.min(block.len() as u64);
        file.write_all(&block[..part as usize])?;
        left -= part;
    }
    file.sync_all()?;
    Ok(())
}
