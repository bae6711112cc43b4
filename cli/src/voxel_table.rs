//! Rows of places and values: what `grow` and `exemplar` are given about single voxels.

use std::path::Path;

use crate::failure::{Explain, Failure};

/// A row: its line, place and values.
pub struct Row {
    pub line: u64,
    pub place: [f64; 3],
    pub values: Vec<f32>,
}

/// Reads rows of x, y, z and a value for each of `channels`; `bytes` asks for whole numbers from 0 to 255. A header is optional: its columns x, y, z, and r, g, b of three channels, may stand in any order; other values keep theirs.
pub fn read(path: &Path, channels: usize, bytes: bool) -> Result<Vec<Row>, Failure> {
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
        let columns = columns.clone().unwrap_or_else(|| (0..3 + channels).collect());
        // A header may be shorter than the rows.
        let Some(ordered) = columns
            .iter()
            .map(|&column| numbers.get(column).copied())
            .collect::<Option<Vec<f64>>>()
            .filter(|o| o.len() == numbers.len())
        else {
            return Err(Failure::run(format!(
                "{place}, line {line}: {} numbers under a header of {} columns",
                numbers.len(),
                columns.len()
            )));
        };
        let (at, values) = ordered.split_at(3);
        if bytes && values.iter().any(|v| v.fract() != 0.0 || !(0.0..=255.0).contains(v)) {
            return Err(Failure::run(format!(
                "{place}, line {line}: values {values:?}; those of a picture are whole numbers from 0 to 255"
            )));
        }
        rows.push(Row {
            line,
            place: [at[0], at[1], at[2]],
            values: values.iter().map(|&v| v as f32).collect(),
        });
    }
    if rows.is_empty() {
        return Err(Failure::run(format!("{place}: holds no measurement")));
    }
    Ok(rows)
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
