//! The columns of a table of profiles, by the names that programs give them.

use stereology_grid::LengthUnit;
use stereology_metrics::Finding;
use stereology_shape::{ColumnUnit, Table, TableError};

use crate::files::table_head::{TableHead, TableUnit};

/// Names of the columns of sizes and areas, in the order in which they are preferred: our own, then those of
/// scikit-image, CellProfiler, MIPAR, DREAM.3D and GrainSizeTools. ImageJ and QuPath have `Area`.
const SIZES: [(&str, Measure); 15] = [
    ("size", Measure::Size),
    ("area", Measure::Area),
    ("equivalentdiameterarea", Measure::Size),
    ("equivalentdiameter", Measure::Size),
    ("equivalentdiameters", Measure::Size),
    ("equivalentcirculardiameter", Measure::Size),
    ("circularequivalentdiameter", Measure::Size),
    ("areashapeequivalentdiameter", Measure::Size),
    ("eqdiam", Measure::Size),
    ("eqdiameter", Measure::Size),
    ("ecd", Measure::Size),
    ("areashapearea", Measure::Area),
    ("areas", Measure::Area),
    ("diameter", Measure::Size),
    ("diameters", Measure::Size),
];

/// Names as they are shown to users.
const SHOWN: &str = "size, area, equivalent_diameter, equivalent_diameter_area, EqDiam, EquivalentDiameters, AreaShape_Area, AreaShape_EquivalentDiameter, ECD, diameter";

/// Beginnings of names of columns that are not the size of a profile, and what they are.
const NOT_SIZES: [(&str, &str); 16] = [
    ("feret", CALIPER),
    ("minferet", CALIPER),
    ("maxferet", CALIPER),
    ("areashapemaxferet", CALIPER),
    ("areashapeminferet", CALIPER),
    ("maxdiameter", CALIPER),
    ("mindiameter", CALIPER),
    ("maxcaliper", CALIPER),
    ("mincaliper", CALIPER),
    ("length", CALIPER),
    ("major", "the axis of an ellipse"),
    ("axismajor", "the axis of an ellipse"),
    ("areashapemajor", "the axis of an ellipse"),
    ("perim", "a perimeter"),
    ("radius", "a radius: double it, and name it `size`"),
    ("volume", "a volume, which a section does not show"),
];

const CALIPER: &str = "a caliper (Feret) diameter";

/// What a column measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    /// Equivalent circular diameters.
    Size,
    /// Areas.
    Area,
}

/// Whether a table may consist of sizes alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Headless {
    /// A table without a header is refused.
    #[default]
    Refused,
    /// A single column without a header contains sizes.
    Sizes,
}

/// Places of the columns.
pub(super) struct ProfileColumns {
    /// Sizes or areas.
    pub(super) size: (usize, Measure),
    /// Areas beside sizes.
    pub(super) area: Option<usize>,
    pub(super) kind: Option<usize>,
    pub(super) category: Option<usize>,
    pub(super) weight: Option<usize>,
    pub(super) slice: Option<usize>,
    pub(super) touches_edge: Option<usize>,
    pub(super) colour: Option<[usize; 3]>,
    pub(super) sides: Option<[usize; 4]>,
    pub(super) position: Option<[usize; 2]>,
}

impl ProfileColumns {
    /// Names by which the header is found.
    pub(super) fn names() -> Vec<&'static str> {
        SIZES.iter().map(|(name, _)| *name).collect()
    }

    pub(super) fn of(table: &Table, headless: Headless, findings: &mut Vec<Finding>) -> Result<Self, TableError> {
        let column = |name: &str| table.column(&[name]);
        let mut found = None;
        for (name, measure) in SIZES {
            if let Some(place) = column(name)? {
                found = Some((place, measure));
                break;
            }
        }
        let single = || table.rows().all(|row| row.fields().count() == 1);
        let size = match found {
            Some(size) => size,
            None if table.columns().is_empty() && headless == Headless::Sizes && single() => {
                let message =
                    "the table has no header; its only column was read as sizes (equivalent circular diameters)";
                findings.push(Finding::new("table-layout", message));
                (0, Measure::Size)
            }
            None => return Err(without_sizes(table)),
        };
        if let Some(column) = table.columns().get(size.0).filter(|column| {
            let plain = ["size", "area"].iter().any(|name| column.is(name));
            !plain || column.name.contains(':')
        }) {
            let what = match size.1 {
                Measure::Size => "equivalent circular diameters",
                Measure::Area => "areas",
            };
            findings.push(Finding::new(
                "table-layout",
                format!("the column `{}` was read as {what} of the profiles", column.name),
            ));
        }
        Ok(Self {
            area: match size.1 {
                Measure::Size => column("area")?,
                Measure::Area => None,
            },
            size,
            kind: column("type")?,
            category: column("category")?,
            weight: column("weight")?,
            slice: column("slice")?,
            touches_edge: column("touchesedge")?,
            colour: all(["r", "g", "b"].map(column))?,
            sides: all(["left", "top", "right", "bottom"].map(column))?,
            position: all(["x", "y"].map(column))?,
        })
    }
}

/// All of the columns, or none.
fn all<const N: usize>(columns: [Result<Option<usize>, TableError>; N]) -> Result<Option<[usize; N]>, TableError> {
    let columns: Vec<Option<usize>> = columns.into_iter().collect::<Result<_, _>>()?;
    let columns: Option<Vec<usize>> = columns.into_iter().collect();
    Ok(columns.and_then(|columns| columns.try_into().ok()))
}

fn without_sizes(table: &Table) -> TableError {
    if table.columns().is_empty() {
        let what = "there is no column `size` or `area`: the table has no header; begin it with the names of the columns, such as `size` or `area,category`";
        return table.error(None, what);
    }
    let other = table.columns().iter().find_map(|column| {
        let (_, what) = NOT_SIZES.iter().find(|(name, _)| column.begins_with(name))?;
        Some(format!(
            ": `{}` is {what}, not the diameter of the circle of equal area",
            column.name
        ))
    });
    table.error(
        None,
        format!(
            "the header has no column `size` or `area`{}; accepted names: {SHOWN}",
            other.unwrap_or_default()
        ),
    )
}

/// Factors from the units of the columns to the unit of the table.
pub(super) struct Scales {
    /// Of sizes, and of lengths without a unit of their own.
    pub(super) length: f64,
    /// Of lengths in the unit of areas beside sizes; `None` if it cannot be converted to that of sizes.
    pub(super) area: Option<f64>,
    /// Of positions, likewise.
    pub(super) position: Option<f64>,
    /// Of boxes, likewise.
    pub(super) sides: Option<f64>,
}

impl Scales {
    /// The factors to `wanted`, or else to the unit of the column of sizes, which is then that of the table's head.
    pub(super) fn of(
        table: &Table,
        columns: &ProfileColumns,
        wanted: Option<LengthUnit>,
        head: &mut TableHead,
        findings: &mut Vec<Finding>,
    ) -> Result<Self, TableError> {
        let unit = |column: usize| table.columns().get(column).and_then(|column| column.unit.as_ref());
        let own = unit(columns.size.0);
        if own.is_some_and(|unit| unit.power > if columns.size.1 == Measure::Size { 1 } else { 2 }) {
            let name = &table.columns()[columns.size.0].name;
            return Err(table.error(None, format!("the unit of the column `{name}` is not that of a length")));
        }
        let of = own.map_or(head.unit, known);
        if own.is_some() && head.unit != TableUnit::Unknown && head.unit != of {
            let what = "the first lines of the table state another unit than its header; remove one of them";
            return Err(table.error(None, what));
        }
        let to = match (of, wanted) {
            (TableUnit::Unit(_), Some(wanted)) if own.is_some() => TableUnit::Unit(wanted),
            _ => of,
        };
        head.unit = to;
        let length = factor(of, to).unwrap_or(1.0);
        if let (TableUnit::Unit(from), TableUnit::Unit(to)) = (of, to)
            && own.is_some()
        {
            let message = if from == to {
                format!(
                    "by the header of the table, lengths are in {}, and the area examined in {0}\u{b2}",
                    to.printed()
                )
            } else {
                format!(
                    "by the header of the table, lengths are in {}; they were converted to {1}, in which the area examined is given ({1}\u{b2})",
                    from.printed(),
                    to.printed()
                )
            };
            findings.push(Finding::new("table-unit", message));
        }
        let scale = |columns: &[usize]| {
            let mut scales = columns
                .iter()
                .map(|column| unit(*column).map_or(Some(length), |unit| factor(known(unit), to)));
            let first = scales.next().flatten()?;
            scales
                .all(|scale| scale.is_some_and(|scale| scale.total_cmp(&first).is_eq()))
                .then_some(first)
        };
        let area = columns.area.map_or(Some(length), |column| scale(&[column]));
        let position = columns.position.and_then(|columns| scale(&columns));
        let sides = columns.sides.and_then(|columns| scale(&columns));
        let without = [
            (columns.area.is_some() && area.is_none(), "areas"),
            (columns.position.is_some() && position.is_none(), "positions"),
            (columns.sides.is_some() && sides.is_none(), "bounding boxes"),
        ];
        for (_, what) in without.iter().filter(|(without, _)| *without) {
            let message =
                format!("the unit of the {what} cannot be converted to that of the sizes; {what} were not used");
            findings.push(Finding::new("table-unit", message));
        }
        Ok(Self {
            length,
            area,
            position,
            sides,
        })
    }
}

fn known(unit: &ColumnUnit) -> TableUnit {
    unit.length.parse().map_or(TableUnit::Pixels, TableUnit::Unit)
}

/// Length of a unit in another; `None` if it is not known.
fn factor(from: TableUnit, to: TableUnit) -> Option<f64> {
    match (from, to) {
        (TableUnit::Unit(from), TableUnit::Unit(to)) if from != to => Some(from.in_metres() / to.in_metres()),
        (from, to) if from == to => Some(1.0),
        _ => None,
    }
}
