//! Where the header of a table is.

use super::cells::{Cells, Comments};
use super::column::{Column, units_row};
use super::numbers::is_number;
use super::separator::Separator;

/// Names of the columns, and the rows below them.
#[derive(Clone, Debug, Default)]
pub(super) struct Header {
    /// Empty without a header.
    pub(super) columns: Vec<Column>,
    /// The first row of the body, and the row behind its last.
    pub(super) body: (usize, usize),
    /// What was left out or assumed.
    pub(super) remarks: Vec<String>,
}

/// Rows and fields in which the header is searched: titles, the number of rows and names of objects may precede it.
const SEARCHED: (usize, usize) = (50, 100_000);

impl Header {
    /// The first row without a number that has a column in `known`, below at most rows without numbers, or of fewer
    /// fields; else the comment above the first row, if it has one; else the first row, if it has no number.
    pub(super) fn find(cells: &Cells, separator: Separator, known: &[&str]) -> Self {
        let count = cells.len();
        let is_known = |columns: &[Column]| columns.iter().any(|column| known.iter().any(|name| column.is(name)));
        let names = |row: usize| cells.row(row).map(Column::new).collect::<Vec<_>>();
        let words = |row: usize| !cells.row(row).any(is_number);
        let mut searched = 0;
        for row in 0..count.min(SEARCHED.0) {
            if !words(row) {
                if cells.width(row) > 1 {
                    break;
                }
                continue;
            }
            let columns = names(row);
            let may_precede = |above| words(above) || cells.width(above) < columns.len() || states_rows(cells, row);
            if is_known(&columns) && (0..row).all(may_precede) {
                return Self::at(cells, separator, row, columns);
            }
            searched += columns.len();
            if searched > SEARCHED.1 {
                break;
            }
        }
        let commented = commented(cells, separator);
        if let Some(columns) = commented.filter(|columns| is_known(columns)) {
            return Self {
                columns,
                body: (0, count),
                remarks: vec!["the header is the comment above the first row".to_owned()],
            };
        }
        if count > 0 && words(0) {
            return Self::at(cells, separator, 0, names(0));
        }
        Self {
            body: (0, count),
            ..Self::default()
        }
    }

    fn at(cells: &Cells, separator: Separator, row: usize, columns: Vec<Column>) -> Self {
        let mut header = Self {
            columns,
            body: (row + 1, cells.len()),
            remarks: Vec::new(),
        };
        if row > 0 {
            header.titles(cells, row);
        }
        header.row_names(cells, separator);
        header.units(cells, separator, row);
        header.commented_rows(cells, separator);
        header
    }

    /// Rows that begin like a comment are reported.
    fn commented_rows(&mut self, cells: &Cells, separator: Separator) {
        let width = self.columns.len();
        let below = |line: usize| self.body.0 < self.body.1 && line > cells.line(self.body.0);
        let is_row = |text: &str| {
            let fields = one_row(text, separator);
            fields.is_some_and(|fields| fields.width(0) == width && fields.row(0).skip(1).any(is_number))
        };
        let comments = cells
            .comments
            .iter()
            .filter(|(line, text)| width > 1 && below(*line) && is_row(text));
        let lines: Vec<usize> = comments.map(|(line, _)| *line).collect();
        if let [first, ..] = lines[..] {
            let count = lines.len();
            self.remarks.push(format!(
                "{count} rows that begin with # were left out as comments, the first in line {first}"
            ));
        }
    }

    /// Rows above the header: one may be the number of rows.
    fn titles(&mut self, cells: &Cells, row: usize) {
        let stated = (row == 1 && cells.width(0) == 1)
            .then(|| cells.field(0, 0)?.parse::<usize>().ok())
            .flatten();
        match stated {
            None => self.remarks.push(format!(
                "the header is line {}; the lines above it were left out",
                cells.line(row)
            )),
            Some(rows) => {
                let (first, end) = self.body;
                let last = first.saturating_add(rows);
                // Another table may follow (neighbour lists of DREAM.3D): its header has no numbers.
                if last < end && !cells.row(last).any(is_number) {
                    self.body.1 = last;
                    self.remarks.push(format!(
                        "line 1 states {rows} rows; line {} and those below it were left out",
                        cells.line(last)
                    ));
                } else if end - first != rows {
                    self.remarks
                        .push(format!("line 1 states {rows} rows, but there are {}", end - first));
                }
            }
        }
    }

    /// The first column of tables that R writes has names of rows, and no name of its own.
    fn row_names(&mut self, cells: &Cells, separator: Separator) {
        let (first, end) = self.body;
        let width = self.columns.len() + 1;
        let wider = first < end
            && matches!(separator, Separator::Tab | Separator::Blanks)
            && (first..end).all(|row| cells.width(row) == width)
            && (first..end).any(|row| cells.field(row, width - 1).is_some_and(|last| !last.is_empty()));
        if wider {
            self.columns.insert(0, Column::new(""));
            self.remarks.push(
                "the rows have one more field than the header: the first was taken as the name of the row".to_owned(),
            );
        }
    }

    /// Units in the row below the header, or in a comment there.
    fn units(&mut self, cells: &Cells, separator: Separator, row: usize) {
        let (first, end) = self.body;
        let below = || (first < end).then(|| units_row(cells.row(first)));
        let next = cells.line(row) + 1;
        let comment = cells
            .comments
            .iter()
            .find(|(line, _)| *line == next)
            .map(|(_, text)| text);
        let in_comment = comment.and_then(|text| {
            let fields = one_row(text, separator)?;
            units_row(
                (0..fields.width(0)).map(|column| match fields.field(0, column).unwrap_or_default() {
                    "#" if column == 0 => "",
                    field => field,
                }),
            )
        });
        let units = match below().flatten() {
            Some(units) => {
                self.body.0 += 1;
                units
            }
            None => in_comment.unwrap_or_default(),
        };
        for (column, unit) in self.columns.iter_mut().zip(units) {
            column.unit = column.unit.take().or(unit);
        }
    }
}

/// Whether the first row is the number of rows below the header in `row`.
fn states_rows(cells: &Cells, row: usize) -> bool {
    row == 1 && cells.width(0) == 1 && cells.field(0, 0).and_then(|field| field.parse().ok()) == Some(cells.len() - 2)
}

/// The last comment above the first row, if it has as many fields as that.
fn commented(cells: &Cells, separator: Separator) -> Option<Vec<Column>> {
    let (first, width) = (cells.len() > 0).then(|| (cells.line(0), cells.width(0)))?;
    let (_, text) = cells.comments.iter().rev().find(|(line, _)| *line < first)?;
    let fields = one_row(text.trim_start_matches(['#', '/']), separator)?;
    let names: Vec<&str> = fields.row(0).collect();
    (names.len() == width && !names.iter().any(|name| is_number(name) || name.contains('=')))
        .then(|| names.into_iter().map(Column::new).collect())
}

/// A line as a row, whatever it begins with.
fn one_row(text: &str, separator: Separator) -> Option<Cells> {
    let text = text.trim_start();
    let text = match text.strip_prefix('#') {
        Some(rest) => format!("\"#\"{rest}"),
        None => text.to_owned(),
    };
    Cells::split(&text, separator, Comments::Hash, 1)
        .ok()
        .filter(|cells| cells.len() == 1)
}
