//! The lines `# key=value` with which a table begins: area, threshold, edge rule, window and unit of its rows.
//!
//! Other keys, and comments without a key, are ignored.

use std::io::{self, Write};
use stereology_grid::LengthUnit;

/// The unit of the lengths in a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableUnit {
    /// The table does not state it.
    #[default]
    Unknown,
    /// Pixels of the photograph.
    Pixels,
    /// A unit of length.
    Unit(LengthUnit),
}

impl TableUnit {
    /// The unit of length, if it is known.
    #[must_use]
    pub fn unit(self) -> Option<LengthUnit> {
        match self {
            Self::Unit(unit) => Some(unit),
            Self::Unknown | Self::Pixels => None,
        }
    }

    /// The unit of a run: pixels if a pixel has the length 1 without a unit.
    #[must_use]
    pub fn of(pixel: f64, unit: Option<LengthUnit>) -> Self {
        match unit {
            Some(unit) => Self::Unit(unit),
            None if (pixel - 1.0).abs() < 1e-12 => Self::Pixels,
            None => Self::Unknown,
        }
    }
}

/// What the rows of a table of profiles need to be unfolded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableHead {
    /// Area in which profiles are counted, in the squared unit of the table.
    pub area: Option<f64>,
    /// Size of the smallest profile that is kept.
    pub min_size: Option<f64>,
    /// Unit of all lengths.
    pub unit: TableUnit,
    /// Name of the rule that gave the weights.
    pub edge_rule: Option<String>,
    /// Width and height of the photograph.
    pub window: Option<[f64; 2]>,
}

impl TableHead {
    /// Writes the lines, without those that are not known.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    ///
    /// ```
    /// use stereology::files::table_head::{TableHead, TableUnit};
    ///
    /// let head = TableHead { area: Some(2.5), unit: TableUnit::Pixels, ..TableHead::default() };
    /// let mut lines = Vec::new();
    /// head.write(&mut lines)?;
    /// assert_eq!(lines, b"# area=2.5\n# unit=px\n");
    /// # Ok::<(), std::io::Error>(())
    /// ```
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let lines = [
            ("area", number(self.area)),
            ("min_size", number(self.min_size)),
            (
                "unit",
                match self.unit {
                    TableUnit::Unknown => None,
                    TableUnit::Pixels => Some(PIXELS.to_owned()),
                    TableUnit::Unit(unit) => Some(unit.to_string()),
                },
            ),
            ("edge_rule", self.edge_rule.clone()),
            ("width", number(self.window.map(|sides| sides[0]))),
            ("height", number(self.window.map(|sides| sides[1]))),
        ];
        lines
            .into_iter()
            .filter_map(|(key, value)| Some((key, value?)))
            .try_for_each(|(key, value)| writeln!(out, "# {key}={value}"))
    }
}

const PIXELS: &str = "px";

/// The head in comment lines with their line numbers; empty if they state nothing. An error names the line.
pub(super) fn of_comments<'a>(comments: impl Iterator<Item = (usize, &'a str)>) -> Result<TableHead, String> {
    let mut head = TableHead::default();
    let (mut width, mut height) = (None, None);
    for (line, comment) in comments {
        let comment = comment.trim_start_matches('#');
        let Some((key, value)) = comment.split_once('=') else {
            continue;
        };
        let (key, value) = (key.trim(), value.trim());
        let number = || match value.parse::<f64>() {
            Ok(number) if number.is_finite() && number > 0.0 => Ok(Some(number)),
            _ => Err(format!(
                "line {line}: `{value}` is not a valid {key}: a finite number above zero is needed"
            )),
        };
        match key {
            "area" => head.area = number()?,
            "min_size" => head.min_size = number()?,
            "width" => width = number()?,
            "height" => height = number()?,
            "edge_rule" => head.edge_rule = Some(value.to_owned()).filter(|value| !value.is_empty()),
            "unit" => {
                head.unit = match value {
                    "" => TableUnit::Unknown,
                    PIXELS => TableUnit::Pixels,
                    unit => TableUnit::Unit(unit.parse().map_err(|error| format!("line {line}: {error}"))?),
                }
            }
            _ => {}
        }
    }
    head.window = width.zip(height).map(|(width, height)| [width, height]);
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::{TableHead, TableUnit, of_comments};
    use proptest::prelude::*;
    use stereology_grid::LengthUnit;
    use stereology_shape::TableSource;

    fn parse(text: &[u8]) -> Result<TableHead, String> {
        of_comments(TableSource::default().parse(text).unwrap().comments())
    }

    proptest! {
        /// A head that is written is read back bit for bit.
        #[test]
        fn heads_are_read_back(
            area in prop::option::of(1e-9..1e9_f64), min_size in prop::option::of(1e-9..1e9_f64),
            window in prop::option::of([1e-9..1e9_f64, 1e-9..1e9_f64]), unit in 0_usize..8, rule in prop::option::of("[a-z-]{1,12}"),
        ) {
            let unit = match unit {
                0 => TableUnit::Unknown,
                1 => TableUnit::Pixels,
                k => TableUnit::Unit(LengthUnit::ALL[k - 2]),
            };
            let head = TableHead { area, min_size, unit, edge_rule: rule, window };
            let mut lines = Vec::new();
            head.write(&mut lines).unwrap();
            lines.extend(b"size\n1\n# area=7\n");
            prop_assert_eq!(parse(&lines[..]).unwrap(), head);
        }
    }

    #[test]
    fn comments_are_no_keys_and_faults_name_their_line() {
        let read = |text: &str| parse(text.as_bytes());
        assert_eq!(
            read("# measured by hand\n#area = 3\r\n# camera=x\nsize\n")
                .unwrap()
                .area,
            Some(3.0)
        );
        for (text, what) in [
            ("# area=-1\n", "line 1: `-1` is not a valid area"),
            ("#\n# min_size=nan\n", "line 2"),
            ("# unit=ell\n", "line 1: `ell` is not a known unit"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
    }
}
