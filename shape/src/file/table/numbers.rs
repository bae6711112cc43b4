//! The decimal mark of a table, and numbers with marks between thousands.
//!
//! | field | reading |
//! |---|---|
//! | `1,234.5`, `1,234,567` | decimal point |
//! | `1.234,5`, `1.234.567`, `0,5`, `12,25`, `1234,567` | decimal comma |
//! | `1.5`, `1234.567` | decimal point |
//! | `1,234` | undecided |
//!
//! The columns of a table have one decimal mark if all columns that decide agree, which undecided columns share; else
//! each column has its own. If no column decides, `1,234` is one thousand two hundred and thirty-four where commas
//! separate the fields, and 1.234 elsewhere, because spreadsheets do not separate by the decimal mark; `1.234` has a
//! decimal point.

use std::fmt;

use super::cells::Cells;
use super::separator::Separator;

/// The mark between the whole part and the fraction of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecimalMark {
    /// 1.5
    Point,
    /// 1,5
    Comma,
}

impl DecimalMark {
    fn character(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }
}

impl fmt::Display for DecimalMark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Point => "point",
            Self::Comma => "comma",
        })
    }
}

/// Decimal marks of the columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    columns: Vec<Marks>,
    /// The mark of columns that do not decide; `None` if others contradict each other.
    rest: Option<DecimalMark>,
    /// A column and a field that may be read in two ways, in a table that does not decide.
    pub(super) undecided: Option<(usize, String)>,
}

/// What a column decides.
#[derive(Clone, Debug, Default)]
struct Marks {
    point: bool,
    comma: bool,
}

/// What a field decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Decides {
    Nothing,
    Point,
    Comma,
    /// `1,234`.
    Undecided,
}

impl Numbers {
    /// The marks of the rows from `first` on.
    pub(super) fn of(cells: &Cells, first: usize, separator: Separator) -> Self {
        let mut found = Self {
            rest: Some(DecimalMark::Point),
            ..Self::default()
        };
        if separator == Separator::Comma && !cells.contain(',') {
            return found;
        }
        let mut undecided = None;
        for row in first..cells.len() {
            for (column, field) in cells.row(row).enumerate() {
                if column >= found.columns.len() {
                    found.columns.push(Marks::default());
                }
                match decides(field) {
                    Decides::Nothing => {}
                    Decides::Point => found.columns[column].point = true,
                    Decides::Comma => found.columns[column].comma = true,
                    Decides::Undecided => undecided = undecided.or(Some((column, field))),
                }
            }
        }
        let any = |of: fn(&Marks) -> bool| found.columns.iter().any(of);
        found.rest = match (any(|of| of.point && !of.comma), any(|of| of.comma && !of.point)) {
            (true, true) => None,
            (true, false) => Some(DecimalMark::Point),
            (false, true) => Some(DecimalMark::Comma),
            (false, false) => {
                found.undecided = undecided.map(|(column, field)| (column, field.to_owned()));
                match (undecided, separator) {
                    (Some(_), Separator::Comma) | (None, _) => Some(DecimalMark::Point),
                    (Some(_), _) => Some(DecimalMark::Comma),
                }
            }
        };
        found
    }

    /// The mark of a column; `None` if it is not known.
    fn of_column(&self, column: usize) -> Option<DecimalMark> {
        match self.columns.get(column) {
            Some(Marks {
                point: true,
                comma: false,
            }) => Some(DecimalMark::Point),
            Some(Marks {
                point: false,
                comma: true,
            }) => Some(DecimalMark::Comma),
            Some(Marks {
                point: true,
                comma: true,
            }) => None,
            _ => self.rest,
        }
    }

    /// The mark of the table, if all columns have the same.
    pub(super) fn mark(&self) -> Option<DecimalMark> {
        self.rest
    }

    /// The number in a field of the column; why it is none otherwise.
    pub(super) fn parse(&self, column: usize, field: &str) -> Result<f64, &'static str> {
        let Some(mark) = self.of_column(column) else {
            return match parse(field, DecimalMark::Point).zip(parse(field, DecimalMark::Comma)) {
                // A whole number, which has no mark.
                Some((a, b)) if a.total_cmp(&b).is_eq() => Ok(a),
                _ if is_number(field) => {
                    Err("may have a decimal point or a decimal comma: write all numbers with one decimal mark")
                }
                _ => Err("is not a number"),
            };
        };
        parse(field, mark).ok_or_else(|| match (is_number(field), mark) {
            (false, _) => "is not a number",
            (true, DecimalMark::Point) => "is not a number with a decimal point",
            (true, DecimalMark::Comma) => "is not a number with a decimal comma",
        })
    }
}

/// Whether the field is a number in some notation.
pub(super) fn is_number(field: &str) -> bool {
    parse(field, DecimalMark::Point).is_some() || parse(field, DecimalMark::Comma).is_some()
}

/// [`is_number`] without blanks between thousands, which may separate fields.
pub(super) fn looks_like_a_number(field: &str) -> bool {
    !field.contains(char::is_whitespace) && is_number(field)
}

fn decides(field: &str) -> Decides {
    let counts = [',', '.'].map(|mark| field.bytes().filter(|byte| char::from(*byte) == mark).count());
    let with_point = || parse(field, DecimalMark::Point).is_some();
    let with_comma = || parse(field, DecimalMark::Comma).is_some();
    match counts {
        [0, 0] => Decides::Nothing,
        // `1.234` has a decimal point unless commas decide otherwise.
        [0, 1] if with_comma() => Decides::Nothing,
        _ => match (with_point(), with_comma()) {
            (true, true) => Decides::Undecided,
            (true, false) => Decides::Point,
            (false, true) => Decides::Comma,
            (false, false) => Decides::Nothing,
        },
    }
}

/// A number with this decimal mark: as Rust reads it, or with marks between groups of three digits.
fn parse(field: &str, mark: DecimalMark) -> Option<f64> {
    if (mark == DecimalMark::Point || !field.contains(['.', ',']))
        && let Ok(number) = field.parse()
    {
        return Some(number);
    }
    // Words are no numbers: without this, every field of text would be copied.
    if !field.starts_with(|c: char| c.is_ascii_digit() || "+-−.,".contains(c)) {
        return None;
    }
    let (sign, size) = match field.strip_prefix(['-', '\u{2212}']) {
        Some(size) => ("-", size),
        None => ("", field.strip_prefix('+').unwrap_or(field)),
    };
    let (mantissa, exponent) = match size.find(['e', 'E']) {
        Some(at) => size.split_at(at),
        None => (size, ""),
    };
    let (whole, fraction) = match mantissa.split_once(mark.character()) {
        // A mark at the end belongs to the sentence.
        Some((_, "")) => return None,
        Some(parts) => parts,
        None => (mantissa, ""),
    };
    if !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let whole = without_groups(whole, mark)?;
    format!("{sign}{whole}.{fraction}{exponent}").parse().ok()
}

/// The digits of a whole part: either only digits, or groups of three with one mark between them.
fn without_groups(whole: &str, decimal: DecimalMark) -> Option<String> {
    let is_mark = |c: char| {
        matches!(c, ',' | '.' | '\'' | '’' | ' ' | '\u{a0}' | '\u{2009}' | '\u{202f}') && c != decimal.character()
    };
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let Some(mark) = whole.chars().find(|c| is_mark(*c)) else {
        return digits(whole).then(|| whole.to_owned());
    };
    let mut groups = whole.split(mark);
    let first = groups.next()?;
    let leads = (1..=3).contains(&first.len()) && digits(first) && !first.starts_with('0');
    (leads && groups.all(|group| group.len() == 3 && digits(group))).then(|| whole.split(mark).collect())
}

#[cfg(test)]
mod tests {
    use super::{Decides, DecimalMark, decides, parse};
    use proptest::prelude::*;

    proptest! {
        /// A number is read bit for bit with either mark, and numbers with a point as Rust reads them.
        #[test]
        fn numbers_are_read_bit_for_bit(value in prop_oneof![-1e6..1e6_f64, any::<f64>()]) {
            prop_assume!(value.is_finite());
            for text in [value.to_string(), format!("{value:e}")] {
                prop_assert_eq!(parse(&text, DecimalMark::Point).map(f64::to_bits), Some(value.to_bits()));
                let text = text.replace('.', ",");
                prop_assert_eq!(parse(&text, DecimalMark::Comma).map(f64::to_bits), Some(value.to_bits()));
            }
        }
    }

    #[test]
    fn marks_between_thousands() {
        for (text, mark, value) in [
            ("1,234.5", DecimalMark::Point, Some(1234.5)),
            ("1,234,567", DecimalMark::Point, Some(1_234_567.0)),
            ("1'234.5", DecimalMark::Point, Some(1234.5)),
            ("1.234,5", DecimalMark::Comma, Some(1234.5)),
            ("1 234,5", DecimalMark::Comma, Some(1234.5)),
            ("1\u{a0}234\u{a0}567", DecimalMark::Point, Some(1_234_567.0)),
            ("\u{2212}0,5", DecimalMark::Comma, Some(-0.5)),
            ("1,2345", DecimalMark::Point, None),
            ("12,34", DecimalMark::Point, None),
            ("0,123", DecimalMark::Point, None),
            ("1234,567", DecimalMark::Point, None),
            ("1,234.567,8", DecimalMark::Point, None),
            ("1.5", DecimalMark::Comma, None),
            ("-", DecimalMark::Comma, None),
            ("1,", DecimalMark::Point, None),
            (",", DecimalMark::Comma, None),
            ("1 23", DecimalMark::Point, None),
        ] {
            assert_eq!(parse(text, mark), value, "{text:?}");
        }
    }

    #[test]
    fn what_a_field_decides() {
        for (text, decision) in [
            ("403,727", Decides::Undecided),
            ("403.727", Decides::Nothing),
            ("1.234.567", Decides::Comma),
            ("1,234,567", Decides::Point),
            ("120,5", Decides::Comma),
            ("120.5", Decides::Point),
            ("thin section, 1.tif", Decides::Nothing),
            ("12", Decides::Nothing),
        ] {
            assert_eq!(decides(text), decision, "{text:?}");
        }
    }
}
