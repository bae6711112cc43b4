//! Points in text files: rows of x, y, z, as written by instruments and spreadsheets.

use std::path::Path;

use nalgebra::Point3;

use crate::file::mesh_file::{MeshFormat, read_mesh};
use crate::file::mesh_file_error::{MeshFileError, MeshFileFault, MeshFilePlace};
use crate::file::table::{Table, TableError, TableRow, TableSource};

/// Reads points: the vertices of a mesh file (.obj, .stl, .ply), or the rows of a text file of any other name.
///
/// A text file is delimited text ([`Table`]): a header names the columns x, y and z, also with units of length, as
/// `Points:0` (ParaView) or `centroid-2` (scikit-image); other columns are ignored. Without a header the first three
/// columns are x, y, z, unless the first numbers the rows. Lines that begin with `#` or `//` are comments, or the
/// header (CloudCompare); the number of points may precede the rows.
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
    points(bytes).map_err(|error| MeshFileError::Content {
        path: name.to_owned(),
        place: error.line.map_or(MeshFilePlace::File, MeshFilePlace::Line),
        fault: MeshFileFault::Table {
            message: TableError { line: None, ..error }.to_string(),
        },
    })
}

/// Names of columns of x, y and z.
const NAMES: [[&str; 11]; 3] = [
    [
        "x",
        "xcoordinate",
        "coordinatex",
        "xcoord",
        "coordx",
        "posx",
        "positionx",
        "centroidx",
        "centerx",
        "points0",
        "centroid2",
    ],
    [
        "y",
        "ycoordinate",
        "coordinatey",
        "ycoord",
        "coordy",
        "posy",
        "positiony",
        "centroidy",
        "centery",
        "points1",
        "centroid1",
    ],
    [
        "z",
        "zcoordinate",
        "coordinatez",
        "zcoord",
        "coordz",
        "posz",
        "positionz",
        "centroidz",
        "centerz",
        "points2",
        "centroid0",
    ],
];

fn points(bytes: &[u8]) -> Result<Vec<Point3<f64>>, TableError> {
    let source = TableSource {
        columns: NAMES.as_flattened(),
        slashes: true,
    };
    let table = source.parse(bytes)?;
    let columns = columns(&table)?;
    let mut rows = table.rows().peekable();
    // The number of points, in many .xyz and .pts files.
    let is_count = |row: &TableRow<'_>| row.fields().count() == 1 && row.text(0).parse::<u64>().is_ok();
    if table.columns().is_empty() {
        rows.next_if(is_count);
    }
    let point = |row: TableRow<'_>| {
        let [x, y, z] = columns.map(|column| row.number(column));
        Ok(Point3::new(x?, y?, z?))
    };
    rows.map(point).collect()
}

/// The columns of x, y and z.
fn columns(table: &Table) -> Result<[usize; 3], TableError> {
    if table.columns().is_empty() {
        return if numbers_its_rows(table) {
            let what = "the first of four or more columns numbers the rows: name x, y and z in a header";
            Err(table.error(None, what))
        } else {
            Ok([0, 1, 2])
        };
    }
    let [x, y, z] = NAMES.map(|names| table.column(&names));
    let (Some(x), Some(y), Some(z)) = (x?, y?, z?) else {
        return Err(table.error(None, "the header does not name columns x, y and z"));
    };
    let units = [x, y, z].map(|column| table.columns()[column].unit.as_ref());
    let differ = units.iter().any(|unit| *unit != units[0]);
    if differ || units[0].is_some_and(|unit| unit.power != 1) {
        return Err(table.error(None, "x, y and z do not have one unit of length"));
    }
    Ok([x, y, z])
}

/// Whether the first of four or more columns counts the rows, from 0 or 1.
fn numbers_its_rows(table: &Table) -> bool {
    let mut first = None;
    let counts = table.rows().enumerate().all(|(index, row)| {
        let number: Option<usize> = row.text(0).parse().ok();
        let start = number.and_then(|number| number.checked_sub(index));
        row.fields().count() > 3 && start.is_some_and(|start| start < 2 && *first.get_or_insert(start) == start)
    });
    counts && table.rows().count() > 3
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
    fn headers_are_understood_or_refused() {
        let point = Some(Point3::new(1.0, 2.0, 3.0));
        for text in [
            "Point,X [mm],Y [mm],Z [mm]\n7,1,2,3\n",
            "X;Y;Z\n1,0;2,0;3,0\n",
            "label,centroid-0,centroid-1,centroid-2\n1,3,2,1\n",
            "\"Points:2\",\"Points:1\",\"Points:0\"\n3,2,1\n",
            "//X Y Z R G B\n1 2 3 255 0 0\n",
            "# z y x\n3 2 1\n",
            "# three corner points\n1 2 3\n",
            "1\nz,y,x\n3,2,1\n",
            "1\n1 2 3\n",
            "\"x\" \"y\" \"z\"\n\"a\" 1 2 3\n",
        ] {
            assert_eq!(parse(text).unwrap().first().copied(), point, "{text}");
        }
        let understood = "(read as: encoding UTF-8, separator comma, decimal mark point, columns a | b | c)";
        for (text, what) in [
            ("a,b,c\n1,2,3\n", "does not name columns x, y and z"),
            ("a,b,c\n1,2,3\n", understood),
            ("x,y,z,x\n1,2,3,4\n", "could all be meant by `x`"),
            ("x [mm],y [um],z [mm]\n1,2,3\n", "one unit of length"),
            ("0,1,2,3\n1,1,2,4\n2,1,3,3\n3,2,2,3\n", "numbers the rows"),
            (
                "x;y;z\n1;2,5;4\n1;5.5;6\n",
                "may have a decimal point or a decimal comma",
            ),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(what), "{text}: {error}");
        }
    }

    #[test]
    fn faults_name_their_line() {
        let error = parse("x,y,z\n1,2,3\n4,5\n").unwrap_err();
        assert!(error.starts_with("p.csv: line 3: column `z` is empty"), "{error}");
        assert!(parse("1,2,3\n4,nan,6\n").unwrap_err().contains("line 2: `nan`"));
        assert!(parse("1,2,3\n1,2,three\n").unwrap_err().contains("line 2: `three`"));
        let error = parse_points(b"1,2,3\n\xff\xfe", "p.xyz".as_ref())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("line 2: `\u{ff}\u{fe}` in field 1 is not a number"),
            "{error}"
        );
        assert!(parse("Na 1 2 3\n").unwrap_err().contains("line 1: `Na`"));
        assert_eq!(parse("").unwrap(), []);
    }
}
