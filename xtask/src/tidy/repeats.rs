//! Code that stands in two crates.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::finding::Finding;
use super::library_code::code_of;

/// Lines of code that two crates may have in common.
const LONGEST_RUN: usize = 7;

/// A line of code: file, number, text.
type Line<'a> = (&'a Path, usize, String);

/// Runs of more than [`LONGEST_RUN`] equal lines in the sources of two crates. Imports, comments, tests and lines
/// without a word do not count. The first run that a pair of files shares is reported.
pub fn repeats(sources: &[(PathBuf, String)]) -> Vec<Finding> {
    let mut runs: BTreeMap<Vec<String>, (&Path, usize)> = BTreeMap::new();
    let mut found: BTreeMap<(&Path, &Path), (usize, usize)> = BTreeMap::new();
    for (path, text) in sources {
        let lines: Vec<Line<'_>> = code_of(text)
            .into_iter()
            .filter(|(_, line)| counts(line))
            .map(|(number, line)| (path.as_path(), number, line))
            .collect();
        for window in lines.windows(LONGEST_RUN + 1) {
            let key: Vec<String> = window.iter().map(|(_, _, line)| line.clone()).collect();
            let (here, number) = (window[0].0, window[0].1);
            match runs.get(&key) {
                Some((there, other)) if there.iter().next() != here.iter().next() => {
                    found.entry((*there, here)).or_insert((*other, number));
                }
                Some(_) => {}
                None => {
                    runs.insert(key, (here, number));
                }
            }
        }
    }
    found
        .into_iter()
        .map(|((there, here), (other, number))| {
            Finding::error(
                format!("{}:{number}", here.display()),
                format!("the same code stands at {}:{other}; give it one place", there.display()),
            )
        })
        .collect()
}

fn counts(line: &str) -> bool {
    let is_import = line.starts_with("use ") || line.starts_with("pub use ") || line.starts_with("mod ");
    !is_import && line.chars().filter(|letter| letter.is_alphanumeric()).count() > 3
}

#[cfg(test)]
mod tests {
    use super::repeats;
    use std::path::PathBuf;

    #[test]
    fn equal_runs_of_two_crates_are_found_once() {
        let body = |lines: usize| {
            (0..lines)
                .map(|i| format!("    let x{i} = value({i});\n"))
                .collect::<String>()
        };
        let file = |path: &str, text: String| (PathBuf::from(path), text);
        let found = |a: &str, b: &str, lines: usize| {
            repeats(&[
                file(a, format!("fn f() {{\n{}}}\n", body(lines))),
                file(b, format!("fn g() {{\n\n    // why\n{}}}\n", body(lines))),
            ])
            .len()
        };
        assert_eq!(found("a/src/x.rs", "b/src/y.rs", 20), 1);
        assert_eq!(found("a/src/x.rs", "b/src/y.rs", 7), 0);
        assert_eq!(found("a/src/x.rs", "a/src/y.rs", 20), 0);
    }
}
