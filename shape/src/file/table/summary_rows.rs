//! Rows of statistics below the rows of a table, as ImageJ (Mean, SD, Min, Max) and spreadsheets add them.

use super::cells::Cells;
use super::column::key;

const STATISTICS: [&str; 16] = [
    "mean", "average", "avg", "median", "sd", "std", "stdev", "stddev", "min", "minimum", "max", "maximum", "sum",
    "total", "count", "variance",
];

/// How many of the last rows of `body` are statistics: two or more, each with another word of statistics in the same
/// column, in which no other row has one.
pub(super) fn summary_rows(cells: &Cells, body: (usize, usize), columns: usize) -> usize {
    let (first, end) = body;
    let statistic = |row: usize, column: usize| {
        let word = key(cells.field(row, column)?);
        STATISTICS.iter().position(|of| *of == word)
    };
    let of_column = |column: usize| {
        let words: Vec<usize> = (first..end).rev().map_while(|row| statistic(row, column)).collect();
        let distinct = words.iter().enumerate().all(|(at, word)| !words[..at].contains(word));
        let above = first..end - words.len();
        // A table of statistics alone has no rows to leave out.
        (words.len() >= 2 && distinct && !above.is_empty() && above.clone().all(|row| statistic(row, column).is_none()))
            .then_some(words.len())
    };
    (0..columns).filter_map(of_column).max().unwrap_or(0)
}
