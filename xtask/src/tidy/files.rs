//! Files: their size, their name, and what every source file begins with.

use std::path::Path;

use super::finding::Finding;
use super::library_code::{code_of, has_word};

/// Names that say nothing of what a module is about.
const EMPTY_NAMES: [&str; 7] = ["util", "utils", "common", "helper", "helpers", "types", "misc"];
/// Lines beyond which a file is probably more than one idea.
const LONG_FILE: usize = 600;
/// Largest committed file.
const LARGE_FILE: u64 = 2 << 20;

/// A committed file is small.
pub fn not_large(path: &Path, bytes: u64) -> Option<Finding> {
    (bytes >= LARGE_FILE).then(|| {
        Finding::error(
            path.display().to_string(),
            format!("has {bytes} bytes; a committed file stays under {LARGE_FILE}"),
        )
    })
}

/// A module is named by the field's word.
pub fn telling_name(path: &Path) -> Option<Finding> {
    let in_code = path.extension().is_some_and(|extension| extension == "rs");
    let empty = path
        .iter()
        .filter_map(|part| Path::new(part).file_stem()?.to_str())
        .find(|stem| EMPTY_NAMES.contains(stem))?;
    in_code.then(|| {
        Finding::error(
            path.display().to_string(),
            format!("`{empty}` names no idea; name the module by the field's word"),
        )
    })
}

/// A source file is short, begins by saying what it is about, and has no unsafe code.
pub fn source_file(path: &Path, text: &str) -> Vec<Finding> {
    let place = path.display().to_string();
    let mut findings = Vec::new();
    let lines = text.lines().count();
    if lines > LONG_FILE {
        findings.push(Finding::warning(
            &place,
            format!("{lines} lines: probably more than one idea"),
        ));
    }
    let in_src = path.iter().nth(1).is_some_and(|part| part == "src");
    if in_src && !text.trim_start().starts_with("//!") {
        findings.push(Finding::error(
            &place,
            "does not begin by saying what it is about (`//!`)",
        ));
    }
    for (number, line) in code_of(text) {
        if has_word(&line, "unsafe") && !line.contains("\"unsafe\"") {
            findings.push(Finding::error(format!("{place}:{number}"), "unsafe code"));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::{LARGE_FILE, not_large, source_file, telling_name};
    use std::path::Path;

    fn found(path: &str, text: &str) -> usize {
        source_file(Path::new(path), text).len()
    }

    #[test]
    fn files_say_what_they_are_about() {
        assert_eq!(found("grid/src/a.rs", "fn f() {}\n"), 1);
        assert_eq!(found("grid/tests/it/a.rs", "fn f() {}\n"), 0);
        assert_eq!(found("grid/src/a.rs", &format!("//! About.\n{}", "\n".repeat(700))), 1);
        assert_eq!(found("cli/src/a.rs", "//! About.\nunsafe { }\n"), 1);
    }

    #[test]
    fn files_are_small_and_named() {
        assert!(not_large(Path::new("a.png"), LARGE_FILE).is_some() && not_large(Path::new("a.png"), 10).is_none());
        assert!(
            telling_name(Path::new("grid/src/utils/a.rs")).is_some()
                && telling_name(Path::new("grid/src/types.rs")).is_some()
        );
        assert!(telling_name(Path::new("grid/src/particle_types.rs")).is_none());
    }
}
