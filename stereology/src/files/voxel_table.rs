//! Values at points or voxels as a CSV table: rows of x, y, z and one value per channel. A header is optional: its
//! columns x, y, z, and r, g, b of three channels, may be in any order; other value columns keep theirs. Lines that
//! begin with `#` are ignored.

use crate::files::FileError;
use crate::files::delimited::{Opened, ReadTable};
use std::io::Write;
use std::path::Path;
use stereology_grid::write_atomically;
use stereology_shape::{Table, TableError};

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueRow {
    /// Line of the file, from 1.
    pub line: u64,
    /// x, y, z: a point, or indices of a voxel.
    pub place: [f64; 3],
    /// One value per channel.
    pub values: Vec<f32>,
}

impl ValueRow {
    /// The voxel (z, y, x), if x, y, z are indices of a grid of this shape (z, y, x).
    #[must_use]
    pub fn voxel(&self, shape: [usize; 3]) -> Option<[usize; 3]> {
        let [x, y, z] = self.place;
        let index = |at: f64, n: usize| (at.fract() == 0.0 && at >= 0.0 && at < n as f64).then(|| whole(at));
        Some([index(z, shape[0])?, index(y, shape[1])?, index(x, shape[2])?])
    }
}

/// Values that a table may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueRange {
    /// Any finite numbers.
    Any,
    /// Whole numbers from 0 to 255.
    Bytes,
}

/// Writes a table with the header `x,y,z,...`, completely or not at all; values are `r,g,b` of three channels,
/// otherwise `value`.
///
/// # Errors
///
/// [`FileError`] if it cannot be written.
pub fn write(path: impl AsRef<Path>, rows: &[ValueRow]) -> Result<(), FileError> {
    let channels = rows.first().map_or(1, |row| row.values.len());
    let names = if channels == 3 {
        "r,g,b".to_owned()
    } else {
        vec!["value"; channels].join(",")
    };
    Ok(write_atomically(path, |out| {
        writeln!(out, "x,y,z,{names}")?;
        rows.iter().try_for_each(|row| {
            let [x, y, z] = row.place;
            write!(out, "{x},{y},{z}")?;
            row.values.iter().try_for_each(|value| write!(out, ",{value}"))?;
            writeln!(out)
        })
    })?)
}

/// Reads rows of x, y, z and a value for each of `channels`.
///
/// # Errors
///
/// [`FileError`] with the line: a header without x, y, z, another number of values, values outside `range`, no rows.
pub fn read(path: impl AsRef<Path>, channels: usize, range: ValueRange) -> Result<ReadTable<ValueRow>, FileError> {
    let path = path.as_ref();
    Opened::read(path, &["x", "y", "z"])?.into_rows(path, |table, _, _| values(table, channels, range))
}

fn values(table: &Table, channels: usize, range: ValueRange) -> Result<Vec<ValueRow>, TableError> {
    let columns = columns(table, channels)?;
    let mut rows = Vec::new();
    for row in table.rows() {
        let count = row.fields().count();
        if count != 3 + channels {
            return Err(row.error(format!(
                "{count} numbers; x, y, z and {channels} value(s) are needed, one per channel of the image"
            )));
        }
        if columns.len() != count {
            return Err(row.error(format!("{count} numbers under a header of {} columns", columns.len())));
        }
        let numbers: Vec<f64> = columns
            .iter()
            .map(|column| row.number(*column))
            .collect::<Result<_, _>>()?;
        let (place, values) = numbers.split_at(3);
        let byte = |v: &f64| v.fract() == 0.0 && (0.0..=255.0).contains(v);
        if range == ValueRange::Bytes && !values.iter().all(byte) {
            return Err(row.error(format!(
                "values {values:?}; those of an image are whole numbers from 0 to 255"
            )));
        }
        rows.push(ValueRow {
            line: row.line() as u64,
            place: [place[0], place[1], place[2]],
            values: values.iter().map(|&v| single(v)).collect(),
        });
    }
    if rows.is_empty() {
        return Err(table.error(None, "holds no measurement"));
    }
    Ok(rows)
}

/// Columns of x, y, z and then of the values.
fn columns(table: &Table, channels: usize) -> Result<Vec<usize>, TableError> {
    let count = table.columns().len();
    if count == 0 {
        return Ok((0..3 + channels).collect());
    }
    let column = |name: &str| table.column(&[name]);
    let (Some(x), Some(y), Some(z)) = (column("x")?, column("y")?, column("z")?) else {
        return Err(table.error(
            None,
            "its header has no columns x, y, z; name them, or leave the header out",
        ));
    };
    let place = [x, y, z];
    let values = match (column("r")?, column("g")?, column("b")?) {
        (Some(r), Some(g), Some(b)) if count == 6 => vec![r, g, b],
        _ => (0..count).filter(|column| !place.contains(column)).collect(),
    };
    Ok(place.into_iter().chain(values).collect())
}

/// A whole number from 0, below the size of an array.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the caller has checked both"
)]
fn whole(value: f64) -> usize {
    value as usize
}

/// Rounded to single precision, as values are processed.
#[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
fn single(value: f64) -> f32 {
    value as f32
}
