//! Writes small asymmetric volumes in every format to a folder, to check that a reader gets axes, channels and spacing
//! right.
//!
//! In `ramp` red grows along x, green along y, blue along z. `ids` and `distances` have one channel that depends on
//! x + 5 y + 20 z.
//!
//! `cargo run -p stereology-grid --example ramp -- FOLDER`
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use stereology_grid::{Element, Format, GridError, VolumeShape, write_volume};

fn main() -> Result<(), GridError> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(std::env::temp_dir, PathBuf::from);
    let byte = |n: usize| u8::try_from(n).unwrap_or(u8::MAX);
    write(&folder, "ramp", 3, |place, channel| byte(10 * place[channel]))?;
    let cell = |[x, y, z]: [usize; 3]| byte(x + 5 * y + 20 * z);
    write(&folder, "ids", 1, |place, _| 1 + u32::from(cell(place)))?;
    write(&folder, "distances", 1, |place, _| -0.25 * f32::from(cell(place)))
}

/// Writes 5 × 4 × 3 voxels of 0.5 × 1 × 2 in every format; `sample` gets the voxel along x, y, z, and the channel.
fn write<T: Element>(
    folder: &Path,
    name: &str,
    channels: usize,
    sample: impl Fn([usize; 3], usize) -> T,
) -> Result<(), GridError> {
    let (nz, ny, nx) = (3, 4, 5);
    let shape = VolumeShape { nz, ny, nx, channels };
    for format in Format::ALL {
        let file = folder.join(format!("{name}{format}"));
        write_volume::<T>(&file, format, shape, [0.5, 1.0, 2.0], |z, mut slab| {
            for ((y, x, channel), place) in slab.indexed_iter_mut() {
                *place = sample([x, y, z], channel);
            }
            ControlFlow::Continue(())
        })?;
        println!("{}", file.display());
    }
    Ok(())
}
