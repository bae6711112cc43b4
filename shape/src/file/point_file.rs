//! Points in text files: rows of x, y, z, as written by instruments and spreadsheets.

use std::path::Path;

use nalgebra::Point3;

use crate::file::mesh_file::{MeshFormat, read_mesh};
use crate::file::mesh_file_error::{Fault, MeshFileError, MeshFileFault, MeshFilePlace, coordinate};

/// Reads points: the vertices of a mesh file (.obj, .stl, .ply), or the rows of a text file of any other name.
///
/// A row is three numbers x, y, z, separated by commas, semicolons, tabs or blanks; further columns (colours, normals)
/// are ignored. A first row of words is a header; if it names columns x, y and z, those are used. Empty rows, rows that
/// begin with `#` or `//`, and the number of points at the start of many .xyz and .pts files are skipped.
///
/// # Errors
///
/// [`MeshFileError`] states the file, the line and the fault.
///
/// # Examples
///
/// ```
/// use stereology_shape::{convex_hull, read_points};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("corners.csv");
/// std::fs::write(&path, "x,y,z\n0,0,0\n1,0,0\n0,1,0\n0,0,1\n")?;
/// assert!((convex_hull(&read_points(&path)?)?.volume() - 1.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_points(path: impl AsRef<Path>) -> Result<Vec<Point3<f64>>, MeshFileError> {
    let path = path.as_ref();
    if MeshFormat::from_path(path).is_ok() {
        return Ok(read_mesh(path)?.vertices);
    }
    let bytes = std::fs::read(path).map_err(|source| MeshFileError::Read {
        path: path.to_owned(),
        source,
    })?;
    parse_points(&bytes, path)
}

/// The points in the bytes of a text file, as [`read_points`] reads it; errors report it as `name`.
///
/// # Errors
///
/// [`MeshFileError::Content`] states the line and the fault.
///
/// ```
/// # use stereology_shape::parse_points;
/// let points = parse_points(b"id;z;y;x\n7;3;2;1\n", "stones.csv".as_ref())?;
/// assert_eq!(points[0], nalgebra::Point3::new(1.0, 2.0, 3.0));
/// # Ok::<(), stereology_shape::MeshFileError>(())
/// ```
pub fn parse_points(bytes: &[u8], name: &Path) -> Result<Vec<Point3<f64>>, MeshFileError> {
    rows(bytes).map_err(|(place, fault)| MeshFileError::Content {
        path: name.to_owned(),
        place,
        fault,
    })
}

fn rows(bytes: &[u8]) -> Result<Vec<Point3<f64>>, Fault> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let lines = bytes[..error.valid_up_to()]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count();
        let expected = MeshFileFault::Expected {
            expected: "text: rows of x, y, z (or a mesh file, .obj, .stl or .ply)",
            found: "bytes that are not text".to_owned(),
        };
        (MeshFilePlace::Line(lines + 1), expected)
    })?;
    let mut columns = None;
    let mut points = Vec::new();
    // The byte order mark that some editors write.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        let words: Vec<&str> = words(line);
        let Some(columns) = columns else {
            let is_count = words.len() == 1 && words[0].parse::<u64>().is_ok();
            if is_count {
                columns = Some([0, 1, 2]);
                continue;
            }
            columns = Some(header(&words).unwrap_or([0, 1, 2]));
            // A row with a number is not a header, so no point is skipped silently.
            if words.iter().any(|word| word.parse::<f64>().is_ok()) {
                points.push(point(&words, [0, 1, 2], number)?);
            }
            continue;
        };
        points.push(point(&words, columns, number)?);
    }
    Ok(points)
}

fn words(line: &str) -> Vec<&str> {
    match line.find([',', ';']).map(|at| line.as_bytes()[at]) {
        Some(separator) => line.split(char::from(separator)).map(str::trim).collect(),
        None => line.split_whitespace().collect(),
    }
}

/// Where a header has the columns x, y and z.
fn header(words: &[&str]) -> Option<[usize; 3]> {
    let place = |name: &str| {
        words
            .iter()
            .position(|word| word.trim_matches('"').eq_ignore_ascii_case(name))
    };
    Some([place("x")?, place("y")?, place("z")?])
}

fn point(words: &[&str], columns: [usize; 3], line: usize) -> Result<Point3<f64>, Fault> {
    let at =
        |column: usize| coordinate(words.get(column).copied()).map_err(|fault| (MeshFilePlace::Line(line + 1), fault));
    Ok(Point3::new(at(columns[0])?, at(columns[1])?, at(columns[2])?))
}

#[cfg(test)]
mod tests {
    use super::parse_points;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<Vec<Point3<f64>>, String> {
        parse_points(text.as_bytes(), "p.csv".as_ref()).map_err(|error| error.to_string())
    }

    proptest! {
        /// Written points are read bit for bit, with any separator and any further columns.
        #[test]
        fn rows_are_read(points in prop::collection::vec(prop::array::uniform3(-1e30..1e30_f64), 1..20), separator in prop_oneof![Just(","), Just(" ; "), Just("\t"), Just("   "), Just(", ")], head in prop_oneof![Just(""), Just("# a comment\n\n"), Just("\u{feff}"), Just("12\n"), Just("// a\n")], more in prop_oneof![Just(false), Just(true)]) {
            let mut text = head.to_owned();
            for [x, y, z] in &points {
                text += &format!("{x}{separator}{y}{separator}{z}");
                text += &if more { format!("{separator}255{separator}red\r\n") } else { "\n".to_owned() };
            }
            prop_assert_eq!(parse(&text).unwrap(), points.iter().map(|&p| Point3::from(p)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn faults_name_their_line() {
        assert_eq!(
            parse("x,y,z\n1,2,3\n4,5\n").unwrap_err(),
            "p.csv: line 3: \"\" is not a finite coordinate"
        );
        assert!(parse("1,2,3\n4,nan,6\n").unwrap_err().contains("line 2: \"nan\""));
        assert!(parse("1,2,3\n1,2,three\n").unwrap_err().contains("line 2: \"three\""));
        let error = parse_points(b"1,2,3\n\xff\xfe", "p.xyz".as_ref())
            .unwrap_err()
            .to_string();
        assert!(error.contains("line 2: expected text"), "{error}");
        assert!(parse("Na 1 2 3\n").unwrap_err().contains("line 1: \"Na\""));
        assert_eq!(parse("").unwrap(), []);
    }
}
