//! The table of profiles that `stereology unfold` reads: sizes, and if given their types, categories, weights and slices.

use std::fmt;
use std::fs::File;
use std::path::Path;

use stereology::unfold::BoundingBox;

/// A profile of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableProfile {
    /// Diameter of the circle with its area.
    pub size: f64,
    /// Index of its particle type, if the table tells.
    pub kind: Option<usize>,
    /// Colour category, if the table tells.
    pub category: Option<u8>,
    /// What it counts for.
    pub weight: f64,
    /// The slice it is on, if the table tells.
    pub slice: Option<usize>,
    /// Whether it touches the edge of its slice, if the table tells.
    pub touches_edge: Option<bool>,
    /// Box around it, in a window that begins at (0, 0), if the table tells.
    pub bounding_box: Option<BoundingBox>,
}

/// Why a table of profiles cannot be read.
#[derive(Debug)]
pub enum TableError {
    /// The file cannot be opened.
    Open(std::io::Error),
    /// The first line has neither `size` nor `area`.
    NoSize {
        /// What it has.
        found: String,
    },
    /// A line that is no row of the table.
    Row {
        /// Line of the file, from 1.
        line: u64,
        /// What is wrong with it.
        what: String,
    },
    /// There is nothing below the first line.
    Empty,
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open(error) => write!(f, "cannot be read ({error})"),
            Self::NoSize { found } => write!(
                f,
                "line 1 has no column `size` or `area` (it has: {found}); a table of profiles begins with a header, such as `size` or `area,category`"
            ),
            Self::Row { line, what } => write!(f, "line {line}: {what}"),
            Self::Empty => f.write_str("has a header but no profiles; there is nothing to unfold"),
        }
    }
}

/// Reads a table of profiles; areas are turned into sizes, √(4 A / π).
pub fn read_profiles(path: &Path) -> Result<Vec<TableProfile>, TableError> {
    let file = File::open(path).map_err(TableError::Open)?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(file);
    let broken = |error: &csv::Error| TableError::Row {
        line: error.position().map_or(0, csv::Position::line),
        what: match error.kind() {
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                format!("{len} values, but the header has {expected_len}")
            }
            csv::ErrorKind::Utf8 { .. } => "this is not text in UTF-8; is it a CSV file?".to_owned(),
            _ => error.to_string(),
        },
    };
    let headers = reader.headers().map_err(|error| broken(&error))?.clone();
    let column = |name: &str| {
        headers
            .iter()
            .position(|header| header.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))
    };
    let (size, area) = (column("size"), column("area"));
    let (kind, category, weight, slice) = (column("type"), column("category"), column("weight"), column("slice"));
    let touches_edge = column("touches_edge");
    let sides = match ["left", "top", "right", "bottom"].map(column) {
        [Some(left), Some(top), Some(right), Some(bottom)] => Some([left, top, right, bottom]),
        _ => None,
    };
    if size.or(area).is_none() {
        let found: Vec<_> = headers.iter().take(8).collect();
        return Err(TableError::NoSize {
            found: if found.is_empty() {
                "nothing".to_owned()
            } else {
                found.join(", ")
            },
        });
    }
    let mut profiles = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| broken(&error))?;
        let line = record.position().map_or(0, csv::Position::line);
        let wrong = |what: String| TableError::Row { line, what };
        let text = |column: usize| record.get(column).unwrap_or_default();
        let number = |column: usize| -> Result<f64, TableError> {
            match text(column).parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                Ok(_) => Err(wrong(format!(
                    "`{}` in column `{}` is not a finite number",
                    text(column),
                    &headers[column]
                ))),
                Err(_) => Err(wrong(format!(
                    "`{}` in column `{}` is not a number",
                    text(column),
                    &headers[column]
                ))),
            }
        };
        let index = |column: usize, what: &str| -> Result<u8, TableError> {
            text(column)
                .parse()
                .map_err(|_| wrong(format!("`{}` is no {what}: a whole number from 0 to 255", text(column))))
        };
        let positive = |column: usize| match number(column)? {
            value if value > 0.0 => Ok(value),
            value => Err(wrong(format!("{} {value} is not above zero", &headers[column]))),
        };
        profiles.push(TableProfile {
            size: match (size, area) {
                (Some(size), _) => positive(size)?,
                (None, Some(area)) => (4.0 * positive(area)? / std::f64::consts::PI).sqrt(),
                (None, None) => return Err(TableError::NoSize { found: String::new() }),
            },
            kind: kind.map(|column| index(column, "type").map(usize::from)).transpose()?,
            slice: slice
                .map(|column| {
                    let number = text(column).parse();
                    number.map_err(|_| wrong(format!("`{}` is no slice: a whole number from 0", text(column))))
                })
                .transpose()?,
            category: category.map(|column| index(column, "category")).transpose()?,
            touches_edge: touches_edge
                .map(|column| match text(column).to_ascii_lowercase().as_str() {
                    "1" | "true" => Ok(true),
                    "0" | "false" => Ok(false),
                    other => Err(wrong(format!("`{other}` in column `touches_edge` is neither 0 nor 1"))),
                })
                .transpose()?,
            bounding_box: sides
                .map(|[left, top, right, bottom]| {
                    let of = BoundingBox {
                        left: number(left)?,
                        top: number(top)?,
                        right: number(right)?,
                        bottom: number(bottom)?,
                    };
                    if of.left < of.right && of.top < of.bottom {
                        Ok(of)
                    } else {
                        Err(wrong("left is not below right, or top not below bottom".to_owned()))
                    }
                })
                .transpose()?,
            weight: match weight.map(number).transpose()? {
                None => 1.0,
                Some(weight) if weight >= 0.0 => weight,
                Some(weight) => return Err(wrong(format!("weight {weight} is below zero"))),
            },
        });
    }
    if profiles.is_empty() {
        return Err(TableError::Empty);
    }
    Ok(profiles)
}

#[cfg(test)]
mod tests {
    use super::read_profiles;

    fn read(text: &str) -> Result<Vec<super::TableProfile>, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("profiles.csv");
        std::fs::write(&file, text).unwrap();
        read_profiles(&file).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_name() {
        let profiles = read("id,area,type,category,weight\n1,3.141592653589793,1,2,0.5\n").unwrap();
        assert!((profiles[0].size - 2.0).abs() < 1e-12);
        assert_eq!(
            (profiles[0].kind, profiles[0].category, profiles[0].weight),
            (Some(1), Some(2), 0.5)
        );
        assert_eq!(read("size\n1\n 2.5 \n").unwrap()[1].size, 2.5);
        assert_eq!(read("\u{feff}size\r\n1\r\n").unwrap().len(), 1);
    }

    #[test]
    fn each_fault_is_told_with_its_line() {
        for (text, what) in [
            ("1\n2\n", "no column `size` or `area`"),
            ("", "no column `size`"),
            ("size\n", "no profiles"),
            (
                "size\n1\nnan\n",
                "line 3: `nan` in column `size` is not a finite number",
            ),
            ("size\n1e400\n", "not a finite number"),
            ("size\n-1\n", "line 2: size -1 is not above zero"),
            ("size\n0\n", "not above zero"),
            ("size\nabc\n", "`abc` in column `size` is not a number"),
            ("size\n\"\"\n", "is not a number"),
            ("size,weight\n1,-1\n", "weight -1 is below zero"),
            ("size,type\n1,x\n", "`x` is no type"),
            ("size,type\n1\n", "1 values, but the header has 2"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
        assert!(
            super::read_profiles(std::path::Path::new("/nowhere/at/all.csv"))
                .unwrap_err()
                .to_string()
                .contains("cannot be read")
        );
    }
}
