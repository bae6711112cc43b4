//! Values at points or voxels as a CSV table: rows of x, y, z and one value per channel. A header is optional: its
//! columns x, y, z, and r, g, b of three channels, may be in any order; other value columns keep theirs. Lines that
//! begin with `#` are ignored.

use crate::files::FileError;
use std::io::Write;
use std::path::Path;
use stereology_grid::write_atomically;

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
pub fn read(path: impl AsRef<Path>, channels: usize, range: ValueRange) -> Result<Vec<ValueRow>, FileError> {
    let path = path.as_ref();
    parse(path, channels, range).map_err(|what| FileError::value(path, what))
}

fn parse(path: &Path, channels: usize, range: ValueRange) -> Result<Vec<ValueRow>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| error.to_string())?;
    let (mut rows, mut columns) = (Vec::new(), None);
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let numbers: Option<Vec<f64>> = record.iter().map(|field| field.parse().ok()).collect();
        let Some(numbers) = numbers.filter(|n| n.iter().all(|v| v.is_finite())) else {
            if columns.is_none() && rows.is_empty() {
                columns = Some(
                    named(&record).ok_or("its header has no columns x, y, z; name them, or leave the header out")?,
                );
                continue;
            }
            return Err(format!("line {line}: not a row of finite numbers"));
        };
        if numbers.len() != 3 + channels {
            return Err(format!(
                "line {line}: {} numbers; x, y, z and {channels} value(s) are needed, one per channel of the image",
                numbers.len()
            ));
        }
        let columns = columns.clone().unwrap_or_else(|| (0..3 + channels).collect());
        // A header may be shorter than the rows.
        let Some(ordered) = columns
            .iter()
            .map(|&column| numbers.get(column).copied())
            .collect::<Option<Vec<f64>>>()
            .filter(|ordered| ordered.len() == numbers.len())
        else {
            return Err(format!(
                "line {line}: {} numbers under a header of {} columns",
                numbers.len(),
                columns.len()
            ));
        };
        let (place, values) = ordered.split_at(3);
        let byte = |v: &f64| v.fract() == 0.0 && (0.0..=255.0).contains(v);
        if range == ValueRange::Bytes && !values.iter().all(byte) {
            return Err(format!(
                "line {line}: values {values:?}; those of an image are whole numbers from 0 to 255"
            ));
        }
        rows.push(ValueRow {
            line,
            place: [place[0], place[1], place[2]],
            values: values.iter().map(|&v| single(v)).collect(),
        });
    }
    if rows.is_empty() {
        return Err("holds no measurement".to_owned());
    }
    Ok(rows)
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

/// Columns of x, y, z and then of the values, by a header.
fn named(header: &csv::StringRecord) -> Option<Vec<usize>> {
    let column = |name: &str| header.iter().position(|field| field.eq_ignore_ascii_case(name));
    let place = [column("x")?, column("y")?, column("z")?];
    let rest = || (0..header.len()).filter(|i| !place.contains(i));
    let values = match [column("r"), column("g"), column("b")] {
        [Some(r), Some(g), Some(b)] if header.len() == 6 => vec![r, g, b],
        _ => rest().collect(),
    };
    Some(place.into_iter().chain(values).collect())
}
