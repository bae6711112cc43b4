//! The separator of a table: by its line `sep=`, or by which separator gives rows of equal length that hold numbers.

use std::collections::BTreeMap;

use super::cells::{Cells, Comments};
use super::numbers::{is_number, looks_like_a_number};
use super::separator::Separator;

/// Rows by which the separator is found.
const SAMPLE: usize = 100;

/// The separator that a first line `sep=X` states, and the length of that line.
///
/// An error names a separator that is not known.
pub(super) fn stated(text: &str) -> Result<Option<(Separator, usize)>, String> {
    let end = text.find('\n').unwrap_or(text.len());
    let line = text[..end].trim_matches([' ', '"']);
    let Some(separator) = line
        .get(..4)
        .filter(|key| key.eq_ignore_ascii_case("sep="))
        .map(|_| &line[4..])
    else {
        return Ok(None);
    };
    let found = match separator.trim_matches('"') {
        "," => Separator::Comma,
        ";" => Separator::Semicolon,
        "\t" | "\\t" | "tab" => Separator::Tab,
        "|" => Separator::Bar,
        "" | " " => Separator::Blanks,
        other => {
            return Err(format!(
                "line 1: `sep={other}` is not a known separator: comma, semicolon, tab, vertical bar or blank"
            ));
        }
    };
    Ok(Some((found, end)))
}

/// The separator of a table without the line `sep=`.
///
/// Tabs and semicolons are hardly ever accidental: one of them is taken if rows split by it agree. Otherwise that of
/// comma, bar and blanks is taken whose rows have the largest fraction of numbers.
pub(super) fn separator(text: &str, comments: Comments) -> Separator {
    let of = |separator| Split::by(separator, text, comments);
    let candidates: Vec<Split> = [
        Separator::Tab,
        Separator::Semicolon,
        Separator::Comma,
        Separator::Bar,
        Separator::Blanks,
    ]
    .into_iter()
    .filter_map(of)
    .collect();
    let most = candidates.iter().map(|split| split.numeric).fold(0.0, f64::max);
    let certain = |split: &&Split| {
        matches!(split.separator, Separator::Tab | Separator::Semicolon) && (split.numeric > 0.0 || most <= 0.0)
    };
    let best = candidates.iter().find(certain).or_else(|| {
        // The first of equal ones.
        candidates.iter().find(|split| split.numeric >= most)
    });
    best.map_or_else(|| by_first_row(text, comments), |split| split.separator)
}

/// Rows that agree on a separator.
struct Split {
    separator: Separator,
    /// Fraction of the fields of rows with numbers that are numbers in some notation.
    numeric: f64,
}

impl Split {
    /// `None` unless most rows, and the header, have the same number of fields, two or more.
    fn by(separator: Separator, text: &str, comments: Comments) -> Option<Self> {
        let cells = Cells::split(text, separator, comments, SAMPLE).ok()?;
        let rows = 0..cells.len();
        let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
        rows.clone()
            .for_each(|row| *lengths.entry(cells.width(row)).or_default() += 1);
        let (&width, &agree) = lengths.iter().max_by_key(|(width, rows)| (**rows, **width))?;
        if width < 2 || 2 * agree < rows.len() {
            return None;
        }
        let numbers = |row: usize| cells.row(row).filter(|field| looks_like_a_number(field)).count();
        let data = |row: &usize| cells.width(*row) == width && numbers(*row) > 0;
        let first = rows.clone().find(data);
        if first.is_none() && rows.clone().any(|row| numbers(row) > 0) {
            return None;
        }
        // The header is the last row of words above the data.
        if let Some(first) = first
            && let Some(header) = (0..first).rev().find(|row| numbers(*row) == 0)
        {
            let names = cells.width(header);
            let row_names = matches!(separator, Separator::Tab | Separator::Blanks) && names + 1 == width;
            // Names between commas are not one name, whatever blanks there are.
            let others = separator == Separator::Blanks && cells.row(header).any(|name| name.contains([',', ';', '|']));
            if names.abs_diff(width) > 1 || (names < 2 && !row_names) || others {
                return None;
            }
        }
        let (mut numeric, mut fields) = (0, 0);
        for row in rows.filter(data) {
            numeric += numbers(row);
            fields += width;
        }
        Some(Self {
            separator,
            numeric: numeric as f64 / fields.max(1) as f64,
        })
    }
}

/// The separator of the first row of words, or of the first row: no separator gives rows that agree, and errors should
/// show the fields of the header.
fn by_first_row(text: &str, comments: Comments) -> Separator {
    let widest = |separator: &Separator| {
        let Ok(cells) = Cells::split(text, *separator, comments, SAMPLE) else {
            return 0;
        };
        let words = (0..cells.len()).find(|&row| !cells.row(row).any(is_number));
        match words.or((cells.len() > 0).then_some(0)) {
            Some(row) if cells.width(row) > 1 => cells.width(row),
            _ => 0,
        }
    };
    let candidates = [Separator::Comma, Separator::Semicolon, Separator::Tab];
    candidates
        .into_iter()
        .map(|separator| (widest(&separator), separator))
        // The first of equal ones.
        .rev()
        .max_by_key(|(width, _)| *width)
        .filter(|(width, _)| *width > 0)
        .map_or(Separator::None, |(_, separator)| separator)
}
