//! Tables of all kinds: the file, its head, and what was found about its layout.

use crate::files::FileError;
use crate::files::table_head::{self, TableHead};
use std::path::Path;
use stereology_metrics::Finding;
use stereology_shape::{Table, TableError, TableSource};

/// The rows of a table, and what the file states besides.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadTable<R> {
    /// What its first lines state.
    pub head: TableHead,
    /// The rows.
    pub rows: Vec<R>,
    /// What was found about the layout of the file and what was assumed, of which a plain table has nothing:
    /// `table-format` (encoding, separator, decimal mark), `table-layout` (header, columns, rows of statistics),
    /// `table-unit`, `invalid-rows`, `words-as-numbers`.
    pub findings: Vec<Finding>,
}

/// A table and its head; further findings are added by the reader of the columns.
pub(super) struct Opened {
    pub(super) table: Table,
    pub(super) head: TableHead,
    pub(super) findings: Vec<Finding>,
}

impl Opened {
    /// Reads a file, whose header has one of `columns`.
    pub(super) fn read(path: &Path, columns: &[&str]) -> Result<Self, FileError> {
        let source = TableSource {
            columns,
            ..TableSource::default()
        };
        let refused = |error: TableError| FileError::value(path, error);
        let table = source.read(path).map_err(refused)?;
        let head = table_head::of_comments(table.comments()).map_err(|what| FileError::value(path, what))?;
        let name = path.display();
        let format = table.format();
        let format = format.map(|format| Finding::new("table-format", format!("{name} was read with {format}")));
        let remarks = table.remarks();
        let layout =
            (!remarks.is_empty()).then(|| Finding::new("table-layout", format!("{name}: {}", remarks.join("; "))));
        Ok(Self {
            findings: format.into_iter().chain(layout).collect(),
            table,
            head,
        })
    }

    /// The table with its rows, as read by `rows`, which may add findings.
    pub(super) fn into_rows<R>(
        mut self,
        path: &Path,
        rows: impl FnOnce(&Table, &mut TableHead, &mut Vec<Finding>) -> Result<Vec<R>, TableError>,
    ) -> Result<ReadTable<R>, FileError> {
        let found = rows(&self.table, &mut self.head, &mut self.findings);
        Ok(ReadTable {
            rows: found.map_err(|error| FileError::value(path, error))?,
            head: self.head,
            findings: self.findings,
        })
    }
}

/// The column with one of these names; a table without it is refused, with `columns`, which it should have.
pub(super) fn needed(table: &Table, name: &str, columns: &str) -> Result<usize, TableError> {
    let missing = || {
        let header = if table.columns().is_empty() {
            "line 1 is not a header"
        } else {
            "the header"
        };
        table.error(None, format!("{header} has no column `{name}`; {columns}"))
    };
    table.column(&[&name.replace('_', "")])?.ok_or_else(missing)
}
