//! The fields of delimited text: quotes, comments, empty rows, and the line of each row.
//!
//! Own code because a table from outside must not lose rows: a quote that is never closed is an error here, where other
//! readers take the rest of the file as one field; lines are those of the file, comments and empty rows included; and
//! fields may be separated by any number of blanks.

use super::separator::Separator;

/// The fields of a table, row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    /// All fields, one behind the other.
    text: String,
    /// Where each field ends in `text`.
    ends: Vec<usize>,
    rows: Vec<Row>,
    /// Comment lines with their line numbers.
    pub(super) comments: Vec<(usize, String)>,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    line: usize,
    /// Number of its first field.
    first: usize,
}

/// What begins a comment line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comments {
    /// `#`.
    Hash,
    /// `#` or `//`, as in files of point clouds.
    HashAndSlashes,
}

impl Comments {
    fn begin(self, line: &str) -> bool {
        line.starts_with('#') || (self == Self::HashAndSlashes && line.starts_with("//"))
    }
}

impl Cells {
    /// Splits text with line ends `\n` into at most `most` rows; rows whose fields are all empty are left out.
    ///
    /// Time and memory are linear in the length of the text. Errors have the line.
    pub(super) fn split(
        text: &str,
        separator: Separator,
        comments: Comments,
        most: usize,
    ) -> Result<Self, (usize, String)> {
        let mut cells = Self::default();
        let (mut rest, mut line) = (text, 1);
        while !rest.is_empty() && cells.rows.len() < most {
            let end = rest.find('\n').unwrap_or(rest.len());
            let consumed = if comments.begin(&rest[..end]) {
                cells.comments.push((line, rest[..end].to_owned()));
                end + 1
            } else if rest[..end].trim().is_empty() {
                end + 1
            } else {
                cells.add_row(rest, separator, line)?
            };
            let (row, after) = rest.split_at(consumed.min(rest.len()));
            line += row.bytes().filter(|byte| *byte == b'\n').count();
            rest = after;
        }
        Ok(cells)
    }

    /// Adds the row with which `text` begins, and returns the length of what it takes.
    fn add_row(&mut self, text: &str, separator: Separator, line: usize) -> Result<usize, (usize, String)> {
        let (first, length) = (self.ends.len(), self.text.len());
        let mut at = 0;
        loop {
            at += blanks(&text[at..], separator);
            if text[at..].starts_with('"') {
                at = self.add_quoted(text, at + 1).ok_or_else(|| {
                    let opened = line + text[..at].matches('\n').count();
                    (opened, "a quote (\") is opened but never closed".to_owned())
                })?;
            }
            let ends = |c: char| c == '\n' || separator.is(c);
            let end = text[at..].find(ends).map_or(text.len(), |length| at + length);
            self.text.push_str(&text[at..end]);
            self.ends.push(self.text.len());
            at = end;
            if separator == Separator::Blanks {
                // Blanks at the end of a line separate nothing.
                at += blanks(&text[at..], separator);
                if at < text.len() && !text[at..].starts_with('\n') {
                    continue;
                }
            } else if at < text.len() && !text[at..].starts_with('\n') {
                at += text[at..].chars().next().map_or(1, char::len_utf8);
                continue;
            }
            break;
        }
        self.rows.push(Row { line, first });
        if self.row(self.rows.len() - 1).all(str::is_empty) {
            self.rows.pop();
            self.ends.truncate(first);
            self.text.truncate(length);
        }
        Ok(at + 1)
    }

    /// Adds the text of a quoted field that begins at `at`, and returns the place behind its closing quote; `None` if
    /// there is none.
    fn add_quoted(&mut self, text: &str, mut at: usize) -> Option<usize> {
        loop {
            let quote = at + text[at..].find('"')?;
            self.text.push_str(&text[at..quote]);
            at = quote + 1;
            if !text[at..].starts_with('"') {
                return Some(at);
            }
            self.text.push('"');
            at += 1;
        }
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn line(&self, row: usize) -> usize {
        self.rows[row].line
    }

    /// Number of fields of a row.
    pub(super) fn width(&self, row: usize) -> usize {
        let end = self.rows.get(row + 1).map_or(self.ends.len(), |next| next.first);
        end - self.rows[row].first
    }

    /// A field without blanks around it; `None` if the row is shorter.
    pub(super) fn field(&self, row: usize, column: usize) -> Option<&str> {
        (column < self.width(row)).then(|| {
            let field = self.rows[row].first + column;
            let start = field.checked_sub(1).map_or(0, |before| self.ends[before]);
            self.text[start..self.ends[field]].trim()
        })
    }

    /// The fields of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = &str> {
        (0..self.width(row)).filter_map(move |column| self.field(row, column))
    }

    /// Whether any field contains this character.
    pub(super) fn contain(&self, c: char) -> bool {
        self.text.contains(c)
    }
}

/// Length of the blanks at the start of the text, other than separators that make fields.
fn blanks(text: &str, separator: Separator) -> usize {
    let blank = |c: char| c != '\n' && c.is_whitespace() && (separator == Separator::Blanks || !separator.is(c));
    text.len() - text.trim_start_matches(blank).len()
}

#[cfg(test)]
mod tests {
    use super::{Cells, Comments, Separator};

    fn rows(text: &str, separator: Separator) -> Vec<(usize, Vec<String>)> {
        let cells = Cells::split(text, separator, Comments::Hash, usize::MAX).unwrap();
        (0..cells.len())
            .map(|row| (cells.line(row), cells.row(row).map(str::to_owned).collect()))
            .collect()
    }

    #[test]
    fn quotes_comments_and_empty_rows() {
        let text = "a,\"b,\"\"c\"\"\nd\" ,e\n\n# c,d\n,,\n 1 , \"2\" ,\n3";
        let found = rows(text, Separator::Comma);
        let shown: Vec<String> = found
            .iter()
            .map(|(line, fields)| format!("{line} {fields:?}"))
            .collect();
        assert_eq!(
            shown,
            [r#"1 ["a", "b,\"c\"\nd", "e"]"#, r#"6 ["1", "2", ""]"#, r#"7 ["3"]"#]
        );
        assert_eq!(rows("  a \t \"b c\"  \n", Separator::Blanks)[0].1, ["a", "b c"]);
        assert_eq!(rows("a\t\tb\t\n", Separator::Tab)[0].1, ["a", "", "b", ""]);
    }

    #[test]
    fn an_open_quote_is_an_error_with_its_line() {
        let error = Cells::split("a,b\n1,\"2\n3,4\n", Separator::Comma, Comments::Hash, usize::MAX).unwrap_err();
        assert_eq!(error.0, 2);
    }
}
