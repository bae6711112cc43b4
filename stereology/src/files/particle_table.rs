//! Particles as a CSV table: columns `shape,size,category,x,y,z,qw,qx,qy,qz`, one particle per row.

use crate::files::FileError;
use crate::files::delimited::{Opened, ReadTable, needed};
use nalgebra::{Point3, Quaternion, UnitQuaternion};
use std::io::Write;
use std::path::Path;
use stereology_grid::{LengthUnit, write_atomically};
use stereology_shape::{Particle, Table, TableError, TableRow};

const COLUMNS: [&str; 10] = ["shape", "size", "category", "x", "y", "z", "qw", "qx", "qy", "qz"];

/// Writes the table, with lengths in `unit`, completely or not at all.
///
/// # Errors
///
/// [`FileError`] if it cannot be written.
///
/// # Examples
///
/// ```
/// use stereology::files::particle_table;
/// use stereology::shape::Particle;
///
/// let particle = Particle { shape: 0, size: 1.0, category: 0, position: nalgebra::Point3::origin(), orientation: nalgebra::UnitQuaternion::identity() };
/// let folder = tempfile::tempdir()?;
/// particle_table::write(folder.path().join("particles.csv"), &[particle], None)?;
/// assert_eq!(particle_table::read(folder.path().join("particles.csv"))?.rows, [particle]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: impl AsRef<Path>, particles: &[Particle], unit: Option<LengthUnit>) -> Result<(), FileError> {
    Ok(write_atomically(path, |out| {
        if let Some(unit) = unit {
            writeln!(out, "# unit={unit}")?;
        }
        writeln!(out, "{}", COLUMNS.join(","))?;
        particles.iter().try_for_each(|particle| {
            let (p, q) = (particle.position, particle.orientation.quaternion());
            let Particle {
                shape, size, category, ..
            } = particle;
            writeln!(
                out,
                "{shape},{size},{category},{},{},{},{},{},{},{}",
                p.x, p.y, p.z, q.w, q.i, q.j, q.k
            )
        })
    })?)
}

/// Reads the table; its columns may be in any order.
///
/// # Errors
///
/// [`FileError`] with the line: a missing column, a value that is not a finite number, an orientation that is not a
/// unit quaternion.
pub fn read(path: impl AsRef<Path>) -> Result<ReadTable<Particle>, FileError> {
    let path = path.as_ref();
    Opened::read(path, &COLUMNS)?.into_rows(path, |table, _, _| particles(table))
}

fn particles(table: &Table) -> Result<Vec<Particle>, TableError> {
    let has = format!("a table of particles has {}", COLUMNS.join(","));
    let columns = COLUMNS
        .iter()
        .map(|name| needed(table, name, &has))
        .collect::<Result<Vec<_>, _>>()?;
    let particle = |row: TableRow<'_>| {
        row.check_width()?;
        let number = |k: usize| row.number(columns[k]);
        let wrong = |k: usize| {
            row.error(format!(
                "`{}` in column `{}` is not a valid value",
                row.text(columns[k]),
                COLUMNS[k]
            ))
        };
        Ok(Particle {
            shape: row.text(columns[0]).parse().map_err(|_| wrong(0))?,
            size: number(1)?,
            category: row.text(columns[2]).parse().map_err(|_| wrong(2))?,
            position: Point3::new(number(3)?, number(4)?, number(5)?),
            orientation: orientation([number(6)?, number(7)?, number(8)?, number(9)?])
                .ok_or_else(|| row.error("the orientation is not a unit quaternion"))?,
        })
    };
    table.rows().map(particle).collect()
}

/// The rotation of a quaternion w, x, y, z as written: a second normalisation could change the last bit. `None` unless
/// its norm is 1.
pub(crate) fn orientation(q: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let [w, i, j, k] = q;
    let norm: f64 = q.iter().map(|c| c * c).sum();
    ((norm - 1.0).abs() <= 1e-6).then(|| UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
}
