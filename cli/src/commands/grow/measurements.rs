//! Measurements from a CSV file: places and values.

use std::path::Path;

use clap::ValueEnum;
use nalgebra::Point3;
use stereology::exemplar::grow::Voxels;

use crate::failure::{Explain, Failure};
use crate::warnings::Warning;

/// What x, y, z are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Mesh units; if that does not fit but numbers of voxels do, those, with a warning
    Auto,
    /// Mesh units
    Mesh,
    /// Numbers of voxels from 0
    Voxels,
}

/// Measured voxels (z, y, x) with their values, and what was noticed.
pub struct Measurements {
    pub voxels: Vec<([usize; 3], Vec<f32>)>,
    pub warnings: Vec<Warning>,
}

/// Farthest a point of the surface may be from the centre of a voxel inside, voxels: a diagonal.
const REACH: f64 = 1.75;

/// Reads rows of x, y, z and a value for each of `channels`; `bytes` asks for whole numbers from 0 to 255.
pub fn read(path: &Path, unit: Unit, voxels: &Voxels, channels: usize, bytes: bool) -> Result<Measurements, Failure> {
    let rows = rows(path, channels, bytes)?;
    let in_mesh = || in_mesh(path, &rows, voxels);
    let found = match unit {
        Unit::Mesh => in_mesh()?,
        Unit::Voxels => in_voxels(path, &rows, voxels)?,
        Unit::Auto => match in_mesh() {
            Ok(found) => found,
            Err(error) => {
                let mut found = in_voxels(path, &rows, voxels).map_err(|_| error)?;
                found.warnings.push(Warning::new(
                    "measured-as-voxels",
                    format!("x, y, z of {} were taken as numbers of voxels", path.display()),
                ));
                found
            }
        },
    };
    Ok(found)
}

/// A row: its line, place and values.
struct Row {
    line: u64,
    place: [f64; 3],
    values: Vec<f32>,
}

fn rows(path: &Path, channels: usize, bytes: bool) -> Result<Vec<Row>, Failure> {
    let place = path.display();
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .at(path)?;
    let (mut rows, mut columns) = (Vec::new(), None);
    for record in reader.records() {
        let record = record.at(path)?;
        let line = record.position().map_or(0, csv::Position::line);
        let numbers: Option<Vec<f64>> = record.iter().map(|field| field.parse().ok()).collect();
        let Some(numbers) = numbers.filter(|n| n.iter().all(|v| v.is_finite())) else {
            if columns.is_none() && rows.is_empty() {
                columns = Some(named(&record).ok_or_else(|| {
                    Failure::run(format!(
                        "{place}: its header names no columns x, y, z; name them, or leave the header out"
                    ))
                })?);
                continue;
            }
            return Err(Failure::run(format!(
                "{place}, line {line}: not a row of finite numbers"
            )));
        };
        if numbers.len() != 3 + channels {
            return Err(Failure::run(format!(
                "{place}, line {line}: {} numbers; x, y, z and {channels} value(s) are needed, one a channel of the picture",
                numbers.len()
            )));
        }
        let [x, y, z] = columns.unwrap_or([0, 1, 2]);
        let values = numbers
            .iter()
            .enumerate()
            .filter(|(i, _)| ![x, y, z].contains(i))
            .map(|(_, v)| *v);
        let values: Vec<f64> = values.collect();
        if bytes && values.iter().any(|v| v.fract() != 0.0 || !(0.0..=255.0).contains(v)) {
            return Err(Failure::run(format!(
                "{place}, line {line}: values {values:?}; those of a picture are whole numbers from 0 to 255"
            )));
        }
        rows.push(Row {
            line,
            place: [numbers[x], numbers[y], numbers[z]],
            values: values.into_iter().map(|v| v as f32).collect(),
        });
    }
    if rows.is_empty() {
        return Err(Failure::run(format!("{place}: holds no measurement")));
    }
    Ok(rows)
}

/// Columns of x, y, z in a header.
fn named(header: &csv::StringRecord) -> Option<[usize; 3]> {
    let column = |name: &str| header.iter().position(|field| field.eq_ignore_ascii_case(name));
    Some([column("x")?, column("y")?, column("z")?])
}

fn in_mesh(path: &Path, rows: &[Row], voxels: &Voxels) -> Result<Measurements, Failure> {
    let (mut found, mut moved) = (Vec::new(), 0);
    for row in rows {
        let point = Point3::from(row.place);
        let own = voxels.voxel_at(&point).filter(|voxel| voxels.inside[*voxel]);
        let near = || voxels.nearest_inside(&point, REACH).map(|(voxel, _)| voxel);
        moved += usize::from(own.is_none());
        let voxel = own.or_else(near).ok_or_else(|| {
            Failure::run(format!(
                "{}, line {}: ({}, {}, {}) lies outside the mesh, farther than a voxel of {}; correct its place, or say --measured-in voxels",
                path.display(),
                row.line,
                row.place[0],
                row.place[1],
                row.place[2],
                crate::numbers::significant(voxels.spacing)
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

fn in_voxels(path: &Path, rows: &[Row], voxels: &Voxels) -> Result<Measurements, Failure> {
    let (nz, ny, nx) = voxels.inside.dim();
    let index = |at: f64, n: usize| (at.fract() == 0.0 && at >= 0.0 && at < n as f64).then_some(at as usize);
    let voxel = |row: &Row| {
        let [x, y, z] = row.place;
        let at = [index(z, nz)?, index(y, ny)?, index(x, nx)?];
        voxels.inside[at].then_some((at, row.values.clone()))
    };
    let found = rows.iter().map(|row| {
        voxel(row).ok_or_else(|| {
            Failure::run(format!(
                "{}, line {}: ({}, {}, {}) is no voxel inside the mesh, of {nx} x {ny} x {nz}; remove it, or correct its place",
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
