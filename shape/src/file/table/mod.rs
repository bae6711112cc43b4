//! Delimited text as instruments, image analysis and spreadsheets write it: one reader for every table.
//!
//! Encoding, separator, decimal mark, header and units are found; what was found is reported, and every error shows it.

mod cells;
mod column;
mod dialect;
mod encoding;
mod header;
mod numbers;
mod separator;
mod summary_rows;

use std::io::Read;
use std::path::Path;

use cells::{Cells, Comments};
pub use column::{Column, ColumnUnit};
pub use encoding::TextEncoding;
use header::Header;
pub use numbers::DecimalMark;
use numbers::Numbers;
pub use separator::Separator;

/// Delimited text: names of columns, and rows of fields.
///
/// Plain tables are comma-separated UTF-8 with decimal points and a header in the first line. Everything else is
/// accepted where it is unambiguous, and [`Table::format`] reports it:
///
/// - UTF-8 with or without byte order mark, UTF-16, Latin-1; line ends of any system; a line `sep=;`.
/// - Comma, semicolon, tab, vertical bar or blanks between fields; quotes, with separators, line ends, doubled quotes
///   in them; separators at the end of rows; empty rows; comments that begin with `#`.
/// - Decimal point or comma, decided by all columns, and marks between thousands.
/// - Units in the header or in a row below it, titles and the number of rows above it, a header in a comment, rows of
///   statistics at the end.
///
/// # Examples
///
/// ```
/// use stereology_shape::{Table, TableSource};
///
/// let source = TableSource { columns: &["area"], ..TableSource::default() };
/// let table = source.parse(b"Label;Area [\xb5m\xb2]\r\nquartz;1.403,5\r\nmica;12,25\r\n")?;
/// let area = table.column(&["area"])?.ok_or("no column of areas")?;
/// assert_eq!(table.columns()[area].unit.as_ref().map(|unit| (unit.length, unit.power)), Some(("um", 2)));
/// assert_eq!(table.rows().map(|row| row.number(area)).collect::<Result<Vec<_>, _>>()?, [1403.5, 12.25]);
/// assert_eq!(table.format().as_deref(), Some("encoding Latin-1, separator semicolon, decimal mark comma"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Table {
    encoding: TextEncoding,
    separator: Separator,
    numbers: Numbers,
    header: Header,
    cells: Cells,
    summary_rows: usize,
}

/// What a reader expects of a table.
#[derive(Clone, Copy, Debug, Default)]
pub struct TableSource<'a> {
    /// Names of columns by which the header is found, in lower case without blanks and signs: `equivalentdiameter`.
    pub columns: &'a [&'a str],
    /// Lines that begin with `//` are comments too.
    pub slashes: bool,
}

/// Why a table cannot be read: the line, the fault, and how the table was understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{what}{}", line.map_or_else(String::new, |line| format!("line {line}: ")), read_as.as_ref().map_or_else(String::new, |read_as| format!(" (read as: {read_as})")))]
pub struct TableError {
    /// The line, from 1.
    pub line: Option<usize>,
    /// What is wrong.
    pub what: String,
    /// Encoding, separator, decimal mark and columns; `None` if the file is not text.
    pub read_as: Option<String>,
}

/// Longest file that is read: 2 GiB.
const MOST_BYTES: u64 = 1 << 31;

impl TableSource<'_> {
    /// Reads a table from a file.
    ///
    /// # Errors
    ///
    /// [`TableError`]: the file cannot be read, is not text, or has a quote that is not closed.
    pub fn read(&self, path: impl AsRef<Path>) -> Result<Table, TableError> {
        let unreadable = |error: std::io::Error| TableError::of_file(format!("cannot be read ({error})"));
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(unreadable)?;
        file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(TableError::of_file(
                "the table is larger than 2 GiB; split it".to_owned(),
            ));
        }
        self.parse(&bytes)
    }

    /// Reads a table from the bytes of a file, in time and memory that are linear in their number.
    ///
    /// # Errors
    ///
    /// Those of [`TableSource::read`].
    pub fn parse(&self, bytes: &[u8]) -> Result<Table, TableError> {
        let (mut text, encoding) = encoding::decode(bytes).map_err(TableError::of_file)?;
        let comments = if self.slashes {
            Comments::HashAndSlashes
        } else {
            Comments::Hash
        };
        let separator = match dialect::stated(&text).map_err(TableError::of_file)? {
            Some((separator, end)) => {
                // Its line remains, empty, so that lines are counted as in the file.
                text.replace_range(..end, "");
                separator
            }
            None => dialect::separator(&text, comments),
        };
        let cells = Cells::split(&text, separator, comments, usize::MAX).map_err(|(line, what)| TableError {
            line: Some(line),
            what,
            read_as: Some(format!("encoding {encoding}, separator {separator}")),
        })?;
        let mut header = Header::find(&cells, separator, self.columns);
        let widest = header.columns.len().max(1);
        let summary_rows = summary_rows::summary_rows(&cells, header.body, widest);
        header.body.1 -= summary_rows;
        Ok(Table {
            encoding,
            separator,
            numbers: Numbers::of(&cells, header.body.0, separator),
            header,
            cells,
            summary_rows,
        })
    }
}

impl TableError {
    fn of_file(what: String) -> Self {
        Self {
            line: None,
            what,
            read_as: None,
        }
    }
}

impl Table {
    /// The columns of the header; none if the table has no header.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.header.columns
    }

    /// The column with the first of these names that any column has; names are in lower case without blanks and signs,
    /// and a column may have a unit and the name of an object (`Nucleus: Area µm^2`).
    ///
    /// # Errors
    ///
    /// [`TableError`] if several columns have that name.
    pub fn column(&self, names: &[&str]) -> Result<Option<usize>, TableError> {
        for name in names {
            let exact = |column: &Column| column.name.eq_ignore_ascii_case(name);
            let find = |is: &dyn Fn(&Column) -> bool| {
                let columns = self.columns().iter().enumerate();
                columns
                    .filter(|(_, column)| is(column))
                    .map(|(at, _)| at)
                    .collect::<Vec<_>>()
            };
            let mut found = find(&exact);
            if found.is_empty() {
                found = find(&|column| column.is(name));
            }
            match found[..] {
                [] => {}
                [one] => return Ok(Some(one)),
                _ => {
                    let names: Vec<String> = found
                        .iter()
                        .map(|at| format!("`{}`", self.columns()[*at].name))
                        .collect();
                    return Err(self.error(
                        None,
                        format!(
                            "the columns {} could all be meant by `{name}`; keep one of them",
                            names.join(", ")
                        ),
                    ));
                }
            }
        }
        Ok(None)
    }

    /// The rows below the header, without rows of statistics.
    pub fn rows(&self) -> impl Iterator<Item = TableRow<'_>> {
        let (first, end) = self.header.body;
        (first..end).map(|row| TableRow { table: self, row })
    }

    /// Comment lines above the rows, with their line numbers.
    pub fn comments(&self) -> impl Iterator<Item = (usize, &str)> {
        let first = (self.cells.len() > 0).then(|| self.cells.line(0));
        let comments = self.cells.comments.iter();
        comments
            .take_while(move |(line, _)| first.is_none_or(|first| *line < first))
            .map(|(line, text)| (*line, text.as_str()))
    }

    /// Encoding, separator and decimal mark, unless the table is plain: comma-separated UTF-8 with decimal points.
    #[must_use]
    pub fn format(&self) -> Option<String> {
        let plain = self.encoding == TextEncoding::Utf8
            && matches!(self.separator, Separator::Comma | Separator::None)
            && self.numbers.mark() == Some(DecimalMark::Point)
            && self.numbers.undecided.is_none();
        if plain {
            return None;
        }
        let mut format = self.dialect();
        if let Some((column, field)) = &self.numbers.undecided {
            let name = self.columns().get(*column).map_or("", |column| &column.name);
            format += &format!(
                "; no field decides between a decimal comma and thousands, such as `{field}` in column `{name}`"
            );
        }
        Some(format)
    }

    fn dialect(&self) -> String {
        let mark = self
            .numbers
            .mark()
            .map_or("of each column".to_owned(), |mark| mark.to_string());
        format!(
            "encoding {}, separator {}, decimal mark {mark}",
            self.encoding, self.separator
        )
    }

    /// What was left out, and what was assumed of rows and header: empty for a plain table.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = self.header.remarks.clone();
        if self.summary_rows > 0 {
            let first = self.cells.line(self.header.body.1);
            remarks.push(format!(
                "the last {} rows, from line {first} on, are statistics (mean, minimum and so on) and were left out",
                self.summary_rows
            ));
        }
        remarks
    }

    /// A fault of the table, with what was understood of it.
    #[must_use]
    pub fn error(&self, line: Option<usize>, what: impl Into<String>) -> TableError {
        const SHOWN: usize = 12;
        let columns = self.columns();
        let names: Vec<&str> = columns.iter().take(SHOWN).map(|column| column.name.as_str()).collect();
        let columns = match columns.len() {
            0 => "no header".to_owned(),
            1..=SHOWN => format!("columns {}", names.join(" | ")),
            count => format!("{count} columns {} | ...", names.join(" | ")),
        };
        TableError {
            line,
            what: what.into(),
            read_as: Some(format!("{}, {columns}", self.dialect())),
        }
    }
}

/// A row of a table.
#[derive(Clone, Copy, Debug)]
pub struct TableRow<'a> {
    table: &'a Table,
    row: usize,
}

impl<'a> TableRow<'a> {
    /// The line of the file on which the row begins, from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.table.cells.line(self.row)
    }

    /// The text of a field without blanks around it; empty if the row is shorter.
    #[must_use]
    pub fn text(&self, column: usize) -> &'a str {
        self.table.cells.field(self.row, column).unwrap_or_default()
    }

    /// The fields.
    pub fn fields(&self) -> impl Iterator<Item = &'a str> {
        self.table.cells.row(self.row)
    }

    /// The finite number in a field.
    ///
    /// # Errors
    ///
    /// [`TableError`] with line, field and column.
    pub fn number(&self, column: usize) -> Result<f64, TableError> {
        let text = self.text(column);
        let name = self.table.columns().get(column).map_or("", |column| &column.name);
        let place = || {
            if name.is_empty() {
                format!("field {}", column + 1)
            } else {
                format!("column `{name}`")
            }
        };
        match self.table.numbers.parse(column, text) {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(self.error(format!("`{text}` in {} is not a finite number", place()))),
            Err(_) if text.is_empty() => Err(self.error(format!("{} is empty", place()))),
            Err(why) => Err(self.error(format!("`{text}` in {} {why}", place()))),
        }
    }

    /// Refuses a row with fewer fields than the header, or with more that are not empty.
    ///
    /// # Errors
    ///
    /// [`TableError`] with the line and both numbers.
    pub fn check_width(&self) -> Result<(), TableError> {
        let (expected, found) = (self.table.columns().len(), self.table.cells.width(self.row));
        let extra = || self.fields().skip(expected).any(|field| !field.is_empty());
        if expected > 0 && (found < expected || extra()) {
            return Err(self.error(format!("{found} values, but the header has {expected}")));
        }
        Ok(())
    }

    /// A fault of this row.
    #[must_use]
    pub fn error(&self, what: impl Into<String>) -> TableError {
        self.table.error(Some(self.line()), what)
    }
}
