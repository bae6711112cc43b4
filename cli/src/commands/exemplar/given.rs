//! What is given beside the pictures: voxels and a mask.

use std::path::Path;

use ndarray::Array3;
use stereology::exemplar::FixedVoxel;
use stereology::exemplar::grow::Voxels;
use stereology::grid::read_volume;

use crate::answer::Answer;
use crate::commands::grow::closed_mesh;
use crate::failure::{Explain, Failure};
use crate::warnings::Warning;

/// Voxels from rows of x, y, z and `channels` values, which are divided by `scale`. A header is optional; its columns may stand
/// in any order.
pub fn voxels(path: &Path, channels: usize, scale: f32) -> Result<Vec<FixedVoxel>, Failure> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .at(path)?;
    let names: &[&str] = if channels == 3 {
        &["x", "y", "z", "r", "g", "b"]
    } else {
        &["x", "y", "z", "value"]
    };
    let wrong = |line: u64, what: &str| {
        Failure::run(format!(
            "{}, line {line}: {what}; a row is {}, with whole numbers of voxels from 0 and values from 0 to 255",
            path.display(),
            names.join(", ")
        ))
    };
    let mut columns: Vec<usize> = (0..3 + channels).collect();
    let mut found = Vec::new();
    for (number, record) in reader.records().enumerate() {
        let record = record.at(path)?;
        let line = record.position().map_or(0, csv::Position::line);
        if number == 0 && record.iter().all(|field| field.parse::<f64>().is_err()) {
            let named: Option<Vec<usize>> = names
                .iter()
                .map(|name| record.iter().position(|field| field.eq_ignore_ascii_case(name)))
                .collect();
            columns = named.ok_or_else(|| wrong(line, "the header does not name these columns"))?;
            continue;
        }
        let numbers: Option<Vec<f64>> = columns
            .iter()
            .map(|&column| record.get(column).and_then(|field| field.parse().ok()))
            .collect();
        let numbers = numbers.ok_or_else(|| wrong(line, "not enough numbers"))?;
        let (place, values) = numbers.split_at(3);
        if place.iter().any(|v| v.fract() != 0.0 || !(0.0..65_536.0).contains(v)) {
            return Err(wrong(line, "x, y, z are no voxel"));
        }
        if values.iter().any(|v| v.fract() != 0.0 || !(0.0..=255.0).contains(v)) {
            return Err(wrong(line, "the value is none of a picture"));
        }
        found.push((
            [place[2] as usize, place[1] as usize, place[0] as usize],
            values.iter().map(|&v| v as f32 / scale).collect(),
        ));
    }
    if found.is_empty() {
        return Err(Failure::run(format!("{}: holds no voxel", path.display())));
    }
    Ok(found)
}

/// The mask: an array of the solid's size, or a mesh as large as fits into it, in its middle.
pub fn mask(path: &Path, size: [usize; 3], answer: &mut Answer) -> Result<Array3<bool>, Failure> {
    if path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
    {
        let samples = read_volume(path).at(path)?.samples;
        return Ok(samples.map_axis(ndarray::Axis(3), |channels| channels.iter().any(|v| *v != 0.0)));
    }
    let mesh = closed_mesh(&path.to_string_lossy())?;
    for repair in mesh.repairs() {
        answer.warn(Warning::new("mesh-repaired", repair.to_string()));
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
