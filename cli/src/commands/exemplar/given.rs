//! Inputs besides the images: fixed voxels and a mask.

use std::path::Path;

use ndarray::Array3;
use stereology::exemplar::FixedVoxel;
use stereology::files::voxel_table::{self, ValueRange, ValueRow};
use stereology::grid::read_volume;
use stereology::grow::Voxels;

use crate::answer::Notes;
use crate::commands::grow::closed_mesh;
use crate::failure::{Explain, Failure};
use crate::warnings::Warning;

/// Largest side of a solid, in voxels.
const MOST: usize = 65_536;

/// Reads voxels from rows of x, y, z and `channels` values from 0 to 255, which are divided by `scale`.
pub fn voxels(path: &Path, channels: usize, scale: f32, notes: &mut Notes) -> Result<Vec<FixedVoxel>, Failure> {
    let voxel = |row: ValueRow| {
        let Some([z, y, x]) = row.voxel([MOST; 3]) else {
            let [x, y, z] = row.place;
            return Err(Failure::run(format!(
                "{}: line {}: ({x}, {y}, {z}) is not a voxel; x, y, z are whole numbers from 0",
                path.display(),
                row.line
            )));
        };
        Ok(([z, y, x], row.values.iter().map(|v| v / scale).collect()))
    };
    let table = voxel_table::read(path, channels, ValueRange::Bytes).or_fail()?;
    for finding in table.findings {
        notes.warn(finding);
    }
    table.rows.into_iter().map(voxel).collect()
}

/// Reads the mask: an array of the solid's size, or a mesh that is scaled to fit the box and centred.
pub fn mask(path: &Path, size: [usize; 3], notes: &mut Notes) -> Result<Array3<bool>, Failure> {
    if path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
    {
        let samples = read_volume(path).at(path)?.samples;
        return Ok(samples.map_axis(ndarray::Axis(3), |channels| channels.iter().any(|v| *v != 0.0)));
    }
    let mesh = closed_mesh(path.as_os_str())?;
    for repair in mesh.repairs() {
        notes.warn(Warning::new("mesh-repaired", repair.to_string()));
    }
    let (low, high) = mesh
        .as_triangle_mesh()
        .bounding_box()
        .ok_or_else(|| Failure::run(format!("{}: the mesh is empty", path.display())))?;
    let sides = high - low;
    let room = [size[2], size[1], size[0]].map(|n| n as f64);
    let scale = (0..3)
        .map(|axis| room[axis] / sides[axis])
        .fold(f64::INFINITY, f64::min);
    let resolution = ((sides.max() * scale + 1e-9).floor() as usize).max(1);
    let voxels = Voxels::of_mesh(&mesh, resolution).at(path)?;
    let (nz, ny, nx) = voxels.inside.dim();
    let from = [(nz, size[0]), (ny, size[1]), (nx, size[2])].map(|(n, room)| room.saturating_sub(n) / 2);
    let mut mask = Array3::from_elem(size, false);
    for ((z, y, x), &inside) in voxels.inside.indexed_iter() {
        if let Some(slot) = mask.get_mut([from[0] + z, from[1] + y, from[2] + x]) {
            *slot = inside;
        }
    }
    Ok(mask)
}
