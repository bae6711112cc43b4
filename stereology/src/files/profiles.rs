//! `profiles.csv`: a table of profiles with a header. `size` or `area` is required; `type`, `category`, `weight`,
//! `slice`, `x` and `y`, `touches_edge` and the bounding box `left,top,right,bottom` are optional, other columns are
//! ignored. The table may begin with lines `# key=value` ([`table_head`]).

use crate::files::FileError;
use crate::files::table_head::{self, TableHead, TableUnit};
use std::fs::File;
use std::io::Write;
use std::path::Path;
use stereology_grid::{LengthUnit, write_atomically};
use stereology_segment::Segmentation;
use stereology_unfold::{BoundingBox, EdgeRule};

/// Columns of the table of a segmentation.
const HEADER: &str = "id,x,y,area,size,r,g,b,category,touches_edge,weight,left,top,right,bottom,pixels,axis_ratio,ellipticity,solidity,orientation";

/// Writes the profiles of a segmentation and the head of the table, with lengths multiplied by `scale`, completely or
/// not at all.
///
/// # Errors
///
/// [`FileError`] if it cannot be written.
pub fn write(
    path: impl AsRef<Path>,
    segmentation: &Segmentation,
    scale: f64,
    head: &TableHead,
) -> Result<(), FileError> {
    Ok(write_atomically(path, |out| {
        head.write(out)?;
        writeln!(out, "{HEADER}")?;
        segmentation.profiles.iter().try_for_each(|p| {
            let [r, g, b] = p.colour.map(|c| 255.0 * c);
            write!(
                out,
                "{},{},{},{},{},{r},{g},{b},{},{},{}",
                p.id,
                p.x * scale,
                p.y * scale,
                p.area * scale * scale,
                p.size * scale,
                p.category,
                u8::from(p.touches_edge),
                p.weight
            )?;
            let [left, top, right, bottom] = p.bounding_box.map(|side| side as f64 * scale);
            write!(out, ",{left},{top},{right},{bottom},{}", p.pixels)?;
            match p.shape {
                None => writeln!(out, ",,,,"),
                Some(of) => writeln!(
                    out,
                    ",{},{},{},{}",
                    of.axis_ratio, of.ellipticity, of.solidity, of.orientation
                ),
            }
        })
    })?)
}

/// The head of the table of a segmentation whose edge rule was `rule`, with lengths multiplied by `scale` to be in
/// `unit`.
#[must_use]
pub fn head(segmentation: &Segmentation, scale: f64, unit: Option<LengthUnit>, rule: EdgeRule) -> TableHead {
    let window = segmentation.window;
    TableHead {
        area: Some(window.area * scale * scale),
        min_size: Some(segmentation.min_size * scale),
        unit: TableUnit::of(scale, unit),
        edge_rule: Some(match rule {
            // Both are unbiased counting frames; this one decides by a point of each profile.
            EdgeRule::AssociatedPoint => EdgeRule::CountingFrame.name().to_owned(),
            rule => rule.name().to_owned(),
        }),
        window: Some([window.width, window.height].map(|side| side as f64 * scale)),
    }
}

/// A row of a table of profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileRow {
    /// Equivalent circular diameter.
    pub size: f64,
    /// Area, if the table has sizes and areas.
    pub area: Option<f64>,
    /// Index of the particle type, if the table has types.
    pub kind: Option<usize>,
    /// Colour category, if the table has categories.
    pub category: Option<u8>,
    /// Weight in the counts; 1 if the table has no weights.
    pub weight: f64,
    /// Index of the slice, if the table has slices.
    pub slice: Option<usize>,
    /// Whether the profile touches the edge of its slice, if the table has that column.
    pub touches_edge: Option<bool>,
    /// Mean colour, encoded values / 255, if the table has the columns r, g, b.
    pub colour: Option<[f64; 3]>,
    /// Bounding box in a window that begins at (0, 0), if the table has boxes.
    pub bounding_box: Option<BoundingBox>,
    /// Position on the slice, if the table has the columns x, y, or boxes: then the centre of the box.
    pub position: Option<[f64; 2]>,
}

/// Reads a table of profiles; areas are converted to equivalent circular diameters, √(4 A / π).
///
/// # Errors
///
/// [`FileError`] with the line: no column of sizes or areas, an invalid value, no profiles.
pub fn read(path: impl AsRef<Path>) -> Result<ProfileTable, FileError> {
    let path = path.as_ref();
    Ok(ProfileTable {
        head: table_head::read(path)?,
        rows: parse(path).map_err(|what| FileError::value(path, what))?,
    })
}

/// A table of profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileTable {
    /// What its first lines state.
    pub head: TableHead,
    /// The profiles.
    pub rows: Vec<ProfileRow>,
}

fn parse(path: &Path) -> Result<Vec<ProfileRow>, String> {
    let file = File::open(path).map_err(|error| format!("cannot be read ({error})"))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(file);
    let columns = Columns::of(reader.headers().map_err(|error| broken(&error))?)?;
    let mut profiles = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| broken(&error))?;
        let line = record.position().map_or(0, csv::Position::line);
        profiles.push(columns.row(&record).map_err(|what| format!("line {line}: {what}"))?);
    }
    if profiles.is_empty() {
        return Err("has a header but no profiles".to_owned());
    }
    Ok(profiles)
}

fn broken(error: &csv::Error) -> String {
    let line = error.position().map_or(0, csv::Position::line);
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} values, but the header has {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "this is not text in UTF-8; is it a CSV file?".to_owned(),
        _ => error.to_string(),
    };
    format!("line {line}: {what}")
}

/// Where the sizes are.
enum SizeColumn {
    Size(usize),
    Area(usize),
}

/// Numbers of the columns.
struct Columns {
    headers: csv::StringRecord,
    size: SizeColumn,
    /// Areas beside sizes.
    area: Option<usize>,
    kind: Option<usize>,
    category: Option<usize>,
    weight: Option<usize>,
    slice: Option<usize>,
    touches_edge: Option<usize>,
    colour: Option<[usize; 3]>,
    sides: Option<[usize; 4]>,
    position: Option<[usize; 2]>,
}

impl Columns {
    fn of(headers: &csv::StringRecord) -> Result<Self, String> {
        let column = |name: &str| {
            headers
                .iter()
                .position(|header| header.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))
        };
        let size = column("size")
            .map(SizeColumn::Size)
            .or(column("area").map(SizeColumn::Area));
        let Some(size) = size else {
            let found: Vec<_> = headers.iter().take(8).collect();
            return Err(format!(
                "line 1 has no column `size` or `area` (it has: {}); a table of profiles begins with a header, such as `size` or `area,category`",
                if found.is_empty() {
                    "nothing".to_owned()
                } else {
                    found.join(", ")
                }
            ));
        };
        Ok(Self {
            area: matches!(size, SizeColumn::Size(_)).then(|| column("area")).flatten(),
            size,
            kind: column("type"),
            category: column("category"),
            weight: column("weight"),
            slice: column("slice"),
            touches_edge: column("touches_edge"),
            colour: match ["r", "g", "b"].map(column) {
                [Some(r), Some(g), Some(b)] => Some([r, g, b]),
                _ => None,
            },
            sides: match ["left", "top", "right", "bottom"].map(column) {
                [Some(left), Some(top), Some(right), Some(bottom)] => Some([left, top, right, bottom]),
                _ => None,
            },
            position: match ["x", "y"].map(column) {
                [Some(x), Some(y)] => Some([x, y]),
                _ => None,
            },
            headers: headers.clone(),
        })
    }

    fn row(&self, record: &csv::StringRecord) -> Result<ProfileRow, String> {
        let text = |column: usize| record.get(column).unwrap_or_default();
        let name = |column: usize| &self.headers[column];
        let number = |column: usize| match text(column).parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(format!(
                "`{}` in column `{}` is not a finite number",
                text(column),
                name(column)
            )),
            Err(_) => Err(format!(
                "`{}` in column `{}` is not a number",
                text(column),
                name(column)
            )),
        };
        let positive = |column: usize| match number(column)? {
            value if value > 0.0 => Ok(value),
            value => Err(format!("{} {value} is not above zero", name(column))),
        };
        let channel = |column: usize| match number(column)? {
            value @ 0.0..=255.0 => Ok(value / 255.0),
            value => Err(format!("{} {value} is not a colour value from 0 to 255", name(column))),
        };
        let index = |column: usize, what: &str| {
            let value = text(column).parse::<u8>();
            value.map_err(|_| format!("`{}` is not a {what}: a whole number from 0 to 255", text(column)))
        };
        let slice = |column: usize| {
            let value = text(column).parse::<usize>();
            value.map_err(|_| format!("`{}` is not a slice: a whole number from 0", text(column)))
        };
        let bounding_box = self.sides.map(|sides| bounding_box(sides, number)).transpose()?;
        // Positions only serve to find clusters: where one is missing there are none.
        let position = self
            .position
            .and_then(|[x, y]| Some([number(x).ok()?, number(y).ok()?]));
        let centre = |of: BoundingBox| [0.5 * (of.left + of.right), 0.5 * (of.top + of.bottom)];
        Ok(ProfileRow {
            size: match self.size {
                SizeColumn::Size(column) => positive(column)?,
                SizeColumn::Area(column) => (4.0 * positive(column)? / std::f64::consts::PI).sqrt(),
            },
            // A missing area leaves nothing to compare.
            area: self.area.and_then(|column| positive(column).ok()),
            kind: self
                .kind
                .map(|column| index(column, "type").map(usize::from))
                .transpose()?,
            slice: self.slice.map(slice).transpose()?,
            category: self.category.map(|column| index(column, "category")).transpose()?,
            touches_edge: self.touches_edge.map(|column| truth(text(column))).transpose()?,
            colour: self
                .colour
                .map(|[r, g, b]| Ok::<_, String>([channel(r)?, channel(g)?, channel(b)?]))
                .transpose()?,
            bounding_box,
            position: position.or(bounding_box.map(centre)),
            weight: match self.weight.map(number).transpose()? {
                None => 1.0,
                Some(weight) if weight >= 0.0 => weight,
                Some(weight) => return Err(format!("weight {weight} is below zero")),
            },
        })
    }
}

fn truth(text: &str) -> Result<bool, String> {
    match text.to_ascii_lowercase().as_str() {
        "1" | "true" => Ok(true),
        "0" | "false" => Ok(false),
        other => Err(format!("`{other}` in column `touches_edge` is neither 0 nor 1")),
    }
}

fn bounding_box(sides: [usize; 4], number: impl Fn(usize) -> Result<f64, String>) -> Result<BoundingBox, String> {
    let [left, top, right, bottom] = sides;
    let of = BoundingBox {
        left: number(left)?,
        top: number(top)?,
        right: number(right)?,
        bottom: number(bottom)?,
    };
    if of.left < of.right && of.top < of.bottom {
        Ok(of)
    } else {
        Err("left is not below right, or top is not below bottom".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::read as read_file;

    fn read(text: &str) -> Result<Vec<super::ProfileRow>, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("profiles.csv");
        std::fs::write(&file, text).unwrap();
        read_file(&file)
            .map(|table| table.rows)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_name() {
        let profiles = read("id,area,type,category,weight\n1,3.141592653589793,1,2,0.5\n").unwrap();
        assert!((profiles[0].size - 2.0).abs() < 1e-12);
        assert_eq!(
            (profiles[0].kind, profiles[0].category, profiles[0].weight),
            (Some(1), Some(2), 0.5)
        );
        assert!((read("size\n1\n 2.5 \n").unwrap()[1].size - 2.5).abs() < 1e-12);
        assert_eq!(read("\u{feff}size\r\n1\r\n").unwrap().len(), 1);
    }

    #[test]
    fn each_fault_names_its_line() {
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
            ("size,type\n1,x\n", "`x` is not a type"),
            ("size,type\n1\n", "1 values, but the header has 2"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
        assert!(
            read_file(std::path::Path::new("/nowhere/at/all.csv"))
                .unwrap_err()
                .to_string()
                .contains("cannot be read")
        );
    }
}
