//! Measurements from a CSV file: positions and values.

use std::path::Path;

use clap::ValueEnum;
use nalgebra::Point3;
use stereology::files::voxel_table::{self, ValueRange, ValueRow};
use stereology::grow::Voxels;

use crate::failure::{Explain, Failure};
use crate::warnings::Warning;

/// Unit of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Units of the mesh; if those do not fit, voxel indices, with a warning
    Auto,
    /// Units of the mesh
    Mesh,
    /// Voxel indices from 0
    Voxels,
}

/// Measured voxels (z, y, x) with their values, and warnings.
pub struct Measurements {
    pub voxels: Vec<([usize; 3], Vec<f32>)>,
    pub warnings: Vec<Warning>,
}

/// Largest distance in voxels from a point of the surface to the centre of a voxel inside: a diagonal.
const REACH: f64 = 1.75;

/// Reads rows of x, y, z and one value in `range` for each of `channels`.
pub fn read(
    path: &Path,
    unit: Unit,
    voxels: &Voxels,
    channels: usize,
    range: ValueRange,
) -> Result<Measurements, Failure> {
    let table = voxel_table::read(path, channels, range).or_fail()?;
    let rows = table.rows;
    let in_mesh = || in_mesh(path, &rows, voxels);
    let mut found = match unit {
        Unit::Mesh => in_mesh()?,
        Unit::Voxels => in_voxels(path, &rows, voxels)?,
        Unit::Auto => match in_mesh() {
            Ok(found) => found,
            Err(error) => {
                let mut found = in_voxels(path, &rows, voxels).map_err(|_| error)?;
                found.warnings.push(Warning::new(
                    "measured-as-voxels",
                    format!("x, y, z in {} were taken as voxel indices", path.display()),
                ));
                found
            }
        },
    };
    found.warnings.extend(table.findings);
    Ok(found)
}

fn in_mesh(path: &Path, rows: &[ValueRow], voxels: &Voxels) -> Result<Measurements, Failure> {
    let (mut found, mut moved) = (Vec::new(), 0);
    for row in rows {
        let point = Point3::from(row.place);
        let own = voxels.voxel_at(&point).filter(|voxel| voxels.inside[*voxel]);
        let near = || voxels.nearest_inside(&point, REACH).map(|(voxel, _)| voxel);
        moved += usize::from(own.is_none());
        let voxel = own.or_else(near).ok_or_else(|| {
            Failure::run(format!(
                "{}, line {}: ({}, {}, {}) lies more than one voxel ({}) outside the mesh; correct its position, or give --measured-in voxels",
                path.display(),
                row.line,
                row.place[0],
                row.place[1],
                row.place[2],
                stereology_report::significant(voxels.spacing)
            ))
        })?;
        found.push((voxel, row.values.clone()));
    }
    let warning = Warning::new(
        "measured-moved",
        format!(
            "{moved} of {} measurements were moved to the nearest voxel inside",
            rows.len()
        ),
    );
    Ok(Measurements {
        voxels: found,
        warnings: (moved > 0).then_some(warning).into_iter().collect(),
    })
}

fn in_voxels(path: &Path, rows: &[ValueRow], voxels: &Voxels) -> Result<Measurements, Failure> {
    let (nz, ny, nx) = voxels.inside.dim();
    let voxel = |row: &ValueRow| {
        let at = row.voxel([nz, ny, nx])?;
        voxels.inside[at].then(|| (at, row.values.clone()))
    };
    let found = rows.iter().map(|row| {
        voxel(row).ok_or_else(|| {
            Failure::run(format!(
                "{}, line {}: ({}, {}, {}) is not a voxel inside the mesh, whose box has {nx} x {ny} x {nz} voxels; remove it, or correct its position",
                path.display(),
                row.line,
                row.place[0],
                row.place[1],
                row.place[2]
            ))
        })
    });
    Ok(Measurements {
        voxels: found.collect::<Result<_, _>>()?,
        warnings: Vec::new(),
    })
}
