//! Names of columns and the units in them.

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// The name in the header; empty if it has none.
    pub name: String,
    /// The unit in the name, or below it.
    pub unit: Option<ColumnUnit>,
    /// The name without its unit.
    bare: String,
    /// The whole name.
    whole: String,
    /// The name behind the name of an object and without its unit, if it has one.
    behind_object: Option<String>,
}

/// A unit of lengths, areas or volumes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnUnit {
    /// Symbol of the unit of length: nm, um, mm, cm, m, in or px (pixels).
    pub length: &'static str,
    /// 1 for lengths, 2 for areas, 3 for volumes. Of an area in pixels, which is a number of pixels, it is often 1.
    pub power: u8,
}

impl Column {
    pub(super) fn new(name: &str) -> Self {
        let (bare, unit) = split_unit(name);
        Self {
            name: name.to_owned(),
            unit,
            bare: key(bare),
            whole: key(name),
            behind_object: bare.rsplit_once(": ").map(|(_, bare)| key(bare)),
        }
    }

    /// Whether the column has this name, which is written in lower case without other signs than letters and digits.
    /// The name of an object before a colon (`Nucleus: Area`) is no part of the name.
    #[must_use]
    pub fn is(&self, name: &str) -> bool {
        self.bare == name || self.whole == name || self.behind_object.as_deref() == Some(name)
    }

    /// Whether the name begins so; `name` is written as for [`Column::is`].
    #[must_use]
    pub fn begins_with(&self, name: &str) -> bool {
        self.bare.starts_with(name)
    }
}

/// A name without case, blanks and signs.
pub(super) fn key(name: &str) -> String {
    name.chars()
        .filter(|c| c.is_alphanumeric())
        .flat_map(char::to_lowercase)
        .collect()
}

/// A name without the unit at its end: `Area [um^2]`, `area (mm2)`, `Area µm²`, `area_um2`, `size/mm`.
fn split_unit(name: &str) -> (&str, Option<ColumnUnit>) {
    let name = name.trim();
    let bracket = [('[', ']'), ('(', ')'), ('{', '}')]
        .into_iter()
        .find(|of| name.ends_with(of.1));
    let start = match bracket {
        Some((open, _)) => name.rfind(open),
        None => name.rfind([' ', '_', '/', ',', '.']).map(|at| at + 1),
    };
    let Some((bare, unit)) = start.map(|at| name.split_at(at)) else {
        return (name, None);
    };
    match unit_of(unit) {
        Some(unit) if !bare.is_empty() => {
            let bare = bare.trim_end_matches([' ', '_', '/', ',', '.']);
            (bare.strip_suffix(" in").unwrap_or(bare), Some(unit))
        }
        _ => (name, None),
    }
}

/// Spellings of the units of length.
const UNITS: [(&str, &[&str]); 7] = [
    ("nm", &["nm", "nanometer", "nanometers", "nanometre", "nanometres"]),
    (
        "um",
        &[
            "um",
            "\u{b5}m",
            "\u{3bc}m",
            "micron",
            "microns",
            "micrometer",
            "micrometers",
            "micrometre",
            "micrometres",
        ],
    ),
    ("mm", &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    ("cm", &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]),
    ("m", &["m", "meter", "meters", "metre", "metres"]),
    ("in", &["in", "inch", "inches"]),
    ("px", &["px", "pixel", "pixels", "pix"]),
];

/// The unit that a text names: `um`, `[µm^2]`, `(sq. mm)`, `mm2`.
pub(super) fn unit_of(text: &str) -> Option<ColumnUnit> {
    let text = text.trim().trim_matches(['[', ']', '(', ')', '{', '}']).to_lowercase();
    // `Â` is the first byte of µ and ² in UTF-8, read as Latin-1 and stored again.
    let text = text.replace('â', "");
    // Numbers per volume: 1/mm^3, mm^-3.
    let text = text.strip_prefix("1/").unwrap_or(&text);
    let (text, before) = ["square ", "sq. ", "sq "]
        .iter()
        .find_map(|word| text.strip_prefix(word))
        .map_or((text, 1), |rest| (rest, 2));
    let (text, power) = [("2", 2), ("\u{b2}", 2), (" squared", 2), ("3", 3), ("\u{b3}", 3)]
        .iter()
        .find_map(|(mark, power)| Some((text.strip_suffix(mark)?, *power)))
        .map_or((text, before), |(rest, power)| {
            (rest.trim_end_matches(['^', '*', '-']), power)
        });
    let length = UNITS.iter().find(|(_, spellings)| spellings.contains(&text.trim()))?.0;
    Some(ColumnUnit { length, power })
}

/// The units of a row below the header, or in the comment behind it: each field is empty or names a unit, one of them a
/// unit of length.
pub(super) fn units_row<'a>(fields: impl Iterator<Item = &'a str>) -> Option<Vec<Option<ColumnUnit>>> {
    const OTHERS: [&str; 9] = ["-", "deg", "\u{b0}", "rad", "%", "a.u.", "au", "none", "count"];
    let units: Option<Vec<Option<ColumnUnit>>> = fields
        .map(|field| {
            let unit = unit_of(field);
            let other = field.is_empty()
                || OTHERS.contains(&field.to_lowercase().as_str())
                || (field.starts_with('[') && field.ends_with(']'));
            (unit.is_some() || other).then_some(unit)
        })
        .collect();
    units.filter(|units| units.iter().any(Option::is_some))
}

#[cfg(test)]
mod tests {
    use super::{Column, units_row};

    #[test]
    fn units_are_no_part_of_the_name() {
        for (name, bare, unit) in [
            ("Area [um^2]", "area", Some(("um", 2))),
            ("area (mm2)", "area", Some(("mm", 2))),
            ("Area µm²", "area", Some(("um", 2))),
            ("Area (\u{3bc}m\u{b2})", "area", Some(("um", 2))),
            ("Area (ÂµmÂ²)", "area", Some(("um", 2))),
            ("Nucleus: Area \u{b5}m^2", "area", Some(("um", 2))),
            ("area_um2", "area", Some(("um", 2))),
            ("area [sq. mm]", "area", Some(("mm", 2))),
            ("size in mm", "size", Some(("mm", 1))),
            ("Diameter (pixels)", "diameter", Some(("px", 1))),
            ("equivalent_diameter_area", "equivalentdiameterarea", None),
            ("Area (filled)", "areafilled", None),
            ("m", "m", None),
            ("size", "size", None),
        ] {
            let column = Column::new(name);
            assert!(column.is(bare), "{name}: {column:?}");
            let found = column.unit.as_ref().map(|unit| (unit.length, unit.power));
            assert_eq!(found, unit, "{name}");
        }
        assert!(!Column::new("Area (filled)").is("area"));
    }

    #[test]
    fn a_row_of_units_holds_nothing_else() {
        assert!(units_row(["", "", "um^2", "deg"].into_iter()).is_some());
        assert!(units_row(["", "[um^2]", "[-]"].into_iter()).is_some());
        for row in [&["", "um^2", "red"][..], &["", "-"], &["1", "mm"]] {
            assert!(units_row(row.iter().copied()).is_none(), "{row:?}");
        }
    }
}
