//! Particles as a CSV table: columns `shape,size,category,x,y,z,qw,qx,qy,qz`, one particle per row.

use crate::files::FileError;
use nalgebra::{Point3, Quaternion, UnitQuaternion};
use std::io::Write;
use std::path::Path;
use stereology_grid::{LengthUnit, write_atomically};
use stereology_shape::Particle;

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
/// assert_eq!(particle_table::read(folder.path().join("particles.csv"))?, [particle]);
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
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Particle>, FileError> {
    let path = path.as_ref();
    parse(path).map_err(|what| FileError::value(path, what))
}

fn parse(path: &Path) -> Result<Vec<Particle>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| error.to_string())?;
    let headers = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |name: &str| {
        let found = headers.iter().position(|header| header.eq_ignore_ascii_case(name));
        found.ok_or_else(|| {
            format!(
                "line 1 has no column `{name}`; a table of particles has {}",
                COLUMNS.join(",")
            )
        })
    };
    let columns = COLUMNS.iter().map(|name| column(name)).collect::<Result<Vec<_>, _>>()?;
    let mut particles = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |k: usize| record.get(columns[k]).unwrap_or_default();
        let wrong = |k: usize| {
            format!(
                "line {line}: `{}` in column `{}` is not a valid value",
                field(k),
                COLUMNS[k]
            )
        };
        let number = |k: usize| match field(k).parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(wrong(k)),
        };
        particles.push(Particle {
            shape: field(0).parse().map_err(|_| wrong(0))?,
            size: number(1)?,
            category: field(2).parse().map_err(|_| wrong(2))?,
            position: Point3::new(number(3)?, number(4)?, number(5)?),
            orientation: orientation([number(6)?, number(7)?, number(8)?, number(9)?])
                .ok_or_else(|| format!("line {line}: the orientation is not a unit quaternion"))?,
        });
    }
    Ok(particles)
}

/// The rotation of a quaternion w, x, y, z as written: a second normalisation could change the last bit. `None` unless
/// its norm is 1.
pub(crate) fn orientation(q: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let [w, i, j, k] = q;
    let norm: f64 = q.iter().map(|c| c * c).sum();
    ((norm - 1.0).abs() <= 1e-6).then(|| UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
}
