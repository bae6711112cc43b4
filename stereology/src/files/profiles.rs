//! `profiles.csv`: a table of profiles with a header. `size` or `area`, or another name of these, is required; `type`,
//! `category`, `weight`, `slice`, `x` and `y`, `touches_edge` and the bounding box `left,top,right,bottom` are
//! optional, other columns are ignored. The table may begin with lines `# key=value`
//! ([`table_head`](super::table_head)).

use crate::files::FileError;
use crate::files::delimited::{Opened, ReadTable};
use crate::files::labels;
pub use crate::files::profile_columns::Headless;
use crate::files::profile_columns::{Measure, ProfileColumns, Scales};
use crate::files::table_head::{TableHead, TableUnit};
use std::io::Write;
use std::path::Path;
use stereology_grid::{LengthUnit, write_atomically};
use stereology_metrics::Finding;
use stereology_segment::Segmentation;
use stereology_shape::{Table, TableError, TableRow};
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
        // Without a photo there are no colours.
        let header = if segmentation.has_colours {
            HEADER.to_owned()
        } else {
            HEADER.replace("r,g,b,", "")
        };
        writeln!(out, "{header}")?;
        segmentation.profiles.iter().try_for_each(|p| {
            let [r, g, b] = p.colour.map(|c| 255.0 * c);
            write!(
                out,
                "{},{},{},{},{}",
                p.id,
                p.x * scale,
                p.y * scale,
                p.area * scale * scale,
                p.size * scale,
            )?;
            if segmentation.has_colours {
                write!(out, ",{r},{g},{b}")?;
            }
            write!(out, ",{},{},{}", p.category, u8::from(p.touches_edge), p.weight)?;
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
    /// Number of the slice among those of the table, from 0, if the table has slices.
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

/// A table of profiles.
pub type ProfileTable = ReadTable<ProfileRow>;

/// How a table of profiles is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProfileReading {
    /// The unit to which lengths are converted if the header states theirs.
    pub unit: Option<LengthUnit>,
    /// Rows with an invalid value are left out and counted, in place of an error; those whose size is NaN always are.
    pub skip_invalid: bool,
    /// A table without a header.
    pub headless: Headless,
}

/// Reads a table of profiles; areas are converted to equivalent circular diameters, √(4 A / π). It is delimited text of
/// any kind ([`Table`]), with the names of columns that ImageJ, scikit-image, CellProfiler, DREAM.3D, GrainSizeTools
/// and QuPath use.
///
/// Slices, categories and types may be words or any numbers. Slices are numbered from 0 without gaps; so are
/// categories and types that are not whole numbers from 0 to 255, in alphabetical order.
///
/// # Errors
///
/// [`FileError`] with the line: no column of sizes or areas, an invalid value, no profiles. It shows how the table was
/// understood.
pub fn read(path: impl AsRef<Path>, reading: &ProfileReading) -> Result<ProfileTable, FileError> {
    let path = path.as_ref();
    Opened::read(path, &ProfileColumns::names())?.into_rows(path, |table, head, findings| {
        let columns = ProfileColumns::of(table, reading.headless, findings)?;
        let scales = Scales::of(table, &columns, reading.unit, head, findings)?;
        let mut rows = Vec::new();
        let mut labels = Labels::default();
        let (mut invalid, mut first_fault) = (0_usize, None);
        // A program writes NaN for the size of what it could not measure: there is no profile.
        let (size, _) = columns.size;
        let is_unmeasured = |row: &TableRow<'_>| row.text(size).eq_ignore_ascii_case("nan");
        for row in table.rows() {
            match profile(&row, &columns, &scales) {
                Ok(profile) => {
                    rows.push(profile);
                    labels.push(&row, &columns);
                }
                Err(fault) if reading.skip_invalid || is_unmeasured(&row) => {
                    invalid += 1;
                    first_fault.get_or_insert(fault);
                }
                Err(fault) => return Err(fault),
            }
        }
        if rows.is_empty() {
            return Err(first_fault.unwrap_or_else(|| table.error(None, "has a header but no profiles")));
        }
        labels.number(&mut rows, table, findings)?;
        findings.extend(first_fault.map(|fault| {
            let fault = TableError { read_as: None, ..fault };
            Finding::new(
                "invalid-rows",
                format!("{invalid} rows with invalid values were left out; the first: {fault}"),
            )
        }));
        Ok(rows)
    })
}

/// Words of the columns of labels.
#[derive(Default)]
struct Labels<'a> {
    kinds: Vec<&'a str>,
    categories: Vec<&'a str>,
    slices: Vec<&'a str>,
}

impl<'a> Labels<'a> {
    fn push(&mut self, row: &TableRow<'a>, columns: &ProfileColumns) {
        let add =
            |labels: &mut Vec<&'a str>, column: Option<usize>| labels.extend(column.map(|column| row.text(column)));
        add(&mut self.kinds, columns.kind);
        add(&mut self.categories, columns.category);
        add(&mut self.slices, columns.slice);
    }

    /// Numbers the labels of the rows.
    fn number(&self, rows: &mut [ProfileRow], table: &Table, findings: &mut Vec<Finding>) -> Result<(), TableError> {
        for (row, slice) in rows.iter_mut().zip(labels::numbered(&self.slices).0) {
            row.slice = Some(slice);
        }
        for (row, category) in rows
            .iter_mut()
            .zip(indices("category", &self.categories, table, findings)?)
        {
            row.category = Some(category);
        }
        if is_kind_of_selection(&self.kinds) {
            let message = "the column `type` has one word, or kinds of selections (ImageJ), and was ignored";
            findings.push(Finding::new("words-as-numbers", message));
            return Ok(());
        }
        for (row, kind) in rows.iter_mut().zip(indices("type", &self.kinds, table, findings)?) {
            row.kind = Some(usize::from(kind));
        }
        Ok(())
    }
}

/// Labels from 0 to 255: themselves, or their numbers in the order of the alphabet.
fn indices(column: &str, labels: &[&str], table: &Table, findings: &mut Vec<Finding>) -> Result<Vec<u8>, TableError> {
    if let Some(indices) = labels::indices(labels) {
        return Ok(indices);
    }
    let (numbers, names) = labels::numbered(labels);
    let numbers: Result<Vec<u8>, _> = numbers.into_iter().map(u8::try_from).collect();
    let Ok(numbers) = numbers else {
        let what = format!(
            "the column `{column}` has {} different labels; at most 256 are possible",
            names.len()
        );
        return Err(table.error(None, what));
    };
    let shown: Vec<String> = names
        .iter()
        .take(8)
        .enumerate()
        .map(|(at, name)| format!("{at} = {name}"))
        .collect();
    let more = if names.len() > shown.len() { ", ..." } else { "" };
    let message = format!(
        "the labels of the column `{column}` were numbered: {}{more}",
        shown.join(", ")
    );
    findings.push(Finding::new("words-as-numbers", message));
    Ok(numbers)
}

/// Whether a column `type` is that of ImageJ, which names the kind of selection, or does not distinguish anything.
fn is_kind_of_selection(labels: &[&str]) -> bool {
    const SELECTIONS: [&str; 12] = [
        "polygon",
        "rectangle",
        "oval",
        "freehand",
        "traced",
        "polyline",
        "freeline",
        "straight line",
        "angle",
        "composite",
        "point",
        "line",
    ];
    let words = labels::indices(labels).is_none();
    let selections = || {
        labels
            .iter()
            .all(|label| SELECTIONS.contains(&label.to_lowercase().as_str()))
    };
    words && (labels.iter().all(|label| *label == labels[0]) || selections())
}

fn profile(row: &TableRow<'_>, columns: &ProfileColumns, scales: &Scales) -> Result<ProfileRow, TableError> {
    row.check_width()?;
    let positive = |column: usize, name: &str| match row.number(column)? {
        value if value > 0.0 => Ok(value),
        value => Err(row.error(format!("{name} {value} is not above zero"))),
    };
    let channel = |column: usize| match row.number(column)? {
        value @ 0.0..=255.0 => Ok(value / 255.0),
        value => Err(row.error(format!("{value} is not a colour value from 0 to 255"))),
    };
    for (column, name) in [
        (columns.kind, "type"),
        (columns.category, "category"),
        (columns.slice, "slice"),
    ] {
        if column.is_some_and(|column| row.text(column).is_empty()) {
            return Err(row.error(format!("column `{name}` is empty")));
        }
    }
    let bounding_box = columns
        .sides
        .zip(scales.sides)
        .map(|(sides, scale)| bounding_box(row, sides, scale))
        .transpose()?;
    // Positions only serve to find clusters: where one is missing there are none.
    let position = columns
        .position
        .zip(scales.position)
        .and_then(|([x, y], scale)| Some([scale * row.number(x).ok()?, scale * row.number(y).ok()?]));
    let centre = |of: BoundingBox| [0.5 * (of.left + of.right), 0.5 * (of.top + of.bottom)];
    let (column, measure) = columns.size;
    Ok(ProfileRow {
        size: scales.length
            * match measure {
                Measure::Size => positive(column, "size")?,
                Measure::Area => (4.0 * positive(column, "area")? / std::f64::consts::PI).sqrt(),
            },
        // A missing area leaves nothing to compare.
        area: columns
            .area
            .zip(scales.area)
            .and_then(|(column, scale)| Some(scale * scale * positive(column, "area").ok()?)),
        kind: None,
        category: None,
        slice: None,
        touches_edge: columns.touches_edge.map(|column| truth(row, column)).transpose()?,
        colour: columns
            .colour
            .map(|[r, g, b]| Ok::<_, TableError>([channel(r)?, channel(g)?, channel(b)?]))
            .transpose()?,
        bounding_box,
        position: position.or(bounding_box.map(centre)),
        weight: match columns.weight.map(|column| row.number(column)).transpose()? {
            None => 1.0,
            Some(weight) if weight >= 0.0 => weight,
            Some(weight) => return Err(row.error(format!("weight {weight} is below zero"))),
        },
    })
}

fn truth(row: &TableRow<'_>, column: usize) -> Result<bool, TableError> {
    match row.text(column).to_ascii_lowercase().as_str() {
        "1" | "true" => Ok(true),
        "0" | "false" => Ok(false),
        other => Err(row.error(format!("`{other}` in column `touches_edge` is neither 0 nor 1"))),
    }
}

fn bounding_box(row: &TableRow<'_>, sides: [usize; 4], scale: f64) -> Result<BoundingBox, TableError> {
    let [left, top, right, bottom] = sides.map(|side| row.number(side).map(|at| at * scale));
    let of = BoundingBox {
        left: left?,
        top: top?,
        right: right?,
        bottom: bottom?,
    };
    if of.left < of.right && of.top < of.bottom {
        Ok(of)
    } else {
        Err(row.error("left is not below right, or top is not below bottom"))
    }
}

#[cfg(test)]
mod tests {
    use super::{Headless, ProfileReading, ProfileRow, ProfileTable, read as read_file};
    use stereology_grid::LengthUnit;

    fn table(text: impl AsRef<[u8]>, reading: &ProfileReading) -> Result<ProfileTable, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("profiles.csv");
        std::fs::write(&file, text).unwrap();
        read_file(&file, reading).map_err(|error| error.to_string())
    }

    fn read(text: &str) -> Result<Vec<ProfileRow>, String> {
        table(text, &ProfileReading::default()).map(|table| table.rows)
    }

    fn codes(table: &ProfileTable) -> Vec<&'static str> {
        table.findings.iter().map(|finding| finding.code).collect()
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

    /// Tables as other programs write them have the sizes of the plain one, and a plain one has no findings.
    #[test]
    fn names_of_other_programs() {
        let plain = table("size\n2.5\n3\n", &ProfileReading::default()).unwrap();
        assert!(plain.findings.is_empty());
        let area = |d: f64| std::f64::consts::FRAC_PI_4 * d * d;
        let areas = format!("{}\n{}\n", area(2.5), area(3.0));
        for text in [
            "2\nFeature_ID,EquivalentDiameters,NumElements\n1,2.5,10\n2,3,10\nFeature_ID,Neighbours\n1,2\n".to_owned(),
            ",label,equivalent_diameter_area\n0,1,2.5\n1,2,3\n".to_owned(),
            "ImageNumber,AreaShape_EquivalentDiameter\n1,2.5\n1,3\n".to_owned(),
            "Image,Grains\nImageNumber,AreaShape_EquivalentDiameter\n1,2.5\n1,3\n".to_owned(),
            "EqDiam\n\"2,5\"\n3\n".to_owned(),
            "id;ECD [\u{b5}m]\n1;2,5\n2;3,0\n".to_owned(),
            "Label\tDiameter\na\t2,5\nb\t3\nMean\t2,75\nSD\t0,3\nMin\t2,5\nMax\t3\n".to_owned(),
            format!("AreaShape_Area\n{areas}"),
            format!("Grain: Area \u{b5}m^2\n{areas}"),
        ] {
            let found = table(&text, &ProfileReading::default()).unwrap();
            assert_eq!(found.rows.len(), 2, "{text}");
            for (row, of) in found.rows.iter().zip(&plain.rows) {
                assert!((row.size - of.size).abs() < 1e-14, "{text}");
            }
            assert!(!found.findings.is_empty(), "{text}");
        }
    }

    #[test]
    fn units_of_the_header_are_converted() {
        let reading = ProfileReading {
            unit: Some(LengthUnit::Millimetre),
            ..ProfileReading::default()
        };
        let text =
            "Area,x [um],left (mm),top (mm),right (mm),bottom (mm)\n[um^2],,,,,\n3141592.653589793,500,0,0,2,2\n";
        let found = table(text, &reading).unwrap();
        assert!((found.rows[0].size - 2.0).abs() < 1e-12);
        assert_eq!(found.rows[0].bounding_box.map(|of| of.right), Some(2.0));
        assert_eq!(
            (found.head.unit.unit(), codes(&found)),
            (reading.unit, vec!["table-unit"])
        );
        let found = table(text, &ProfileReading::default()).unwrap();
        assert!((found.rows[0].size - 2000.0).abs() < 1e-9);
        assert_eq!(found.head.unit.unit(), Some(LengthUnit::Micrometre));
        let error = table("# unit=mm\nsize [um]\n1\n", &reading).unwrap_err();
        assert!(error.contains("another unit"), "{error}");
        assert!(read("size [um^2]\n1\n").unwrap_err().contains("not that of a length"));
    }

    #[test]
    fn labels_are_words_or_numbers_with_gaps() {
        let text = "size,slice,category,type\n1,20,mica,b\n2,10,quartz,a\n3,20,quartz,b\n";
        let found = table(text, &ProfileReading::default()).unwrap();
        let labels: Vec<_> = found
            .rows
            .iter()
            .map(|row| (row.slice, row.category, row.kind))
            .collect();
        assert_eq!(
            labels,
            [
                (Some(1), Some(0), Some(1)),
                (Some(0), Some(1), Some(0)),
                (Some(1), Some(1), Some(1))
            ]
        );
        assert_eq!(codes(&found), ["words-as-numbers"; 2]);
        assert!(found.findings[0].message.contains("0 = mica, 1 = quartz"));
        let imagej = table("size,type\n1,Polygon\n2,Oval\n", &ProfileReading::default()).unwrap();
        assert_eq!(imagej.rows[0].kind, None);
    }

    #[test]
    fn invalid_rows_are_left_out_on_request() {
        let text = "area,slice\n1,1\nNaN,1\n,2\n-3,2\n4,\n5,3\n";
        assert!(read(text).unwrap_err().contains("line 4"));
        let unmeasured = table("area,slice\n1,1\nNaN,1\n5,3\n", &ProfileReading::default()).unwrap();
        assert_eq!((unmeasured.rows.len(), codes(&unmeasured)), (2, vec!["invalid-rows"]));
        assert!(read("area,weight\n1,1\n2,NaN\n").unwrap_err().contains("line 3: `NaN`"));
        let reading = ProfileReading {
            skip_invalid: true,
            ..ProfileReading::default()
        };
        let found = table(text, &reading).unwrap();
        assert_eq!((found.rows.len(), codes(&found)), (2, vec!["invalid-rows"]));
        assert!(found.findings[0].message.starts_with("4 rows"), "{:?}", found.findings);
        assert!(table("area\nNaN\n", &reading).unwrap_err().contains("line 2"));
    }

    #[test]
    fn a_column_without_a_header_may_be_sizes() {
        let reading = ProfileReading {
            headless: Headless::Sizes,
            ..ProfileReading::default()
        };
        let found = table("1\n2\n3\n", &reading).unwrap();
        assert_eq!((found.rows.len(), codes(&found)), (3, vec!["table-layout"]));
        assert!(table("1,2\n3,4\n", &reading).unwrap_err().contains("no column `size`"));
    }

    #[test]
    fn each_fault_names_its_line_and_what_was_understood() {
        for (text, what) in [
            ("1\n2\n", "no column `size` or `area`"),
            ("", "no column `size`"),
            (
                "id,Feret\n1,2\n",
                "no column `size` or `area`: `Feret` is a caliper (Feret) diameter",
            ),
            ("id,Feret\n1,2\n", "accepted names: size, area, equivalent_diameter"),
            ("size\n", "no profiles"),
            ("size\nnan\n", "line 2: `nan` in column `size` is not a finite number"),
            ("size\n1e400\n", "not a finite number"),
            ("size\n-1\n", "line 2: size -1 is not above zero"),
            ("size\n0\n", "not above zero"),
            ("size\nabc\n", "`abc` in column `size` is not a number"),
            ("size,id\n\"\",1\n", "column `size` is empty"),
            ("size,weight\n1,-1\n", "weight -1 is below zero"),
            ("size,type\n1,\n", "column `type` is empty"),
            ("size,type\n1\n", "1 values, but the header has 2"),
            ("id,size\n1,403,7\n", "3 values, but the header has 2"),
            (
                "size;id\n1.5;1\n2,5;2\n",
                "line 2: `1.5` in column `size` may have a decimal point or a decimal comma",
            ),
            (
                "id;size\n1;x\n2;1,5\n",
                "line 2: `x` in column `size` is not a number (read as: encoding UTF-8, separator semicolon, decimal mark comma, columns id | size)",
            ),
            ("size\n1\n\"2\n3\n", "line 3: a quote (\") is opened but never closed"),
            ("sep=#\nsize\n1\n", "`sep=#` is not a known separator"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
        assert!(
            read_file("/nowhere/at/all.csv", &ProfileReading::default())
                .unwrap_err()
                .to_string()
                .contains("cannot be read")
        );
    }
}
