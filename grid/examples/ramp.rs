//! Writes an asymmetric colour ramp in every format to a folder, to see that a reader has axes, channels and spacing right: red grows along x, green along y, blue along z.
//!
//! `cargo run -p stereology-grid --example ramp -- FOLDER`
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use ndarray::ArrayViewMut3;
use std::ops::ControlFlow;
use std::path::PathBuf;
use stereology_grid::{Format, GridError, VolumeShape, write_volume};

fn main() -> Result<(), GridError> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(std::env::temp_dir, PathBuf::from);
    let shape = VolumeShape {
        nz: 3,
        ny: 4,
        nx: 5,
        channels: 3,
    };
    let ramp = |z: usize, mut slab: ArrayViewMut3<'_, u8>| {
        for ((y, x, channel), sample) in slab.indexed_iter_mut() {
            *sample = u8::try_from(10 * [x, y, z][channel]).unwrap_or(u8::MAX);
        }
        ControlFlow::Continue(())
    };
    for format in Format::ALL {
        let file = folder.join(format!("ramp{format}"));
        write_volume::<u8>(&file, format, shape, [0.5, 1.0, 2.0], ramp)?;
        println!("{}", file.display());
    }
    Ok(())
}
