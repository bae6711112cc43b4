//! The invariants of ARCHITECTURE.md that a program can check. Each check is a plain function from text or lists to
//! findings.

mod dependencies;
mod files;
mod finding;
mod import_circles;
mod library_code;
mod module_tree;
mod prose;
mod repeats;
mod tokens;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use finding::Finding;

/// Folders that are programs (fuzz stands outside the workspace): they may print and look at the clock.
const PROGRAMS: [&str; 4] = ["cli", "studies", "xtask", "fuzz"];

/// Runs every check on the workspace around this crate.
///
/// # Errors
///
/// If anything fatal is found, or a file or cargo itself cannot be read.
pub fn run() -> Result<()> {
    let root = crate::workspace::root()?;
    let mut findings = Vec::new();

    let metadata: Value = serde_json::from_str(&output(
        root,
        "cargo",
        &["metadata", "--format-version", "1", "--no-deps", "--offline"],
    )?)?;
    findings.extend(dependencies::who_knows_whom(&metadata));
    let edges = "normal,build,dev";
    let tree = output(
        root,
        "cargo",
        &["tree", "--workspace", "--edges", edges, "--prefix", "none", "--offline"],
    )?;
    findings.extend(dependencies::no_c(&tree));

    let listed = output(
        root,
        "git",
        &["ls-files", "-z", "--cached", "--others", "--exclude-standard"],
    )?;
    // A file that was removed and not committed yet is still listed.
    let committed: Vec<PathBuf> = listed
        .split('\0')
        .filter(|path| !path.is_empty())
        .map(PathBuf::from)
        .filter(|path| root.join(path).is_file())
        .collect();
    let read = |path: &Path| fs::read_to_string(root.join(path)).with_context(|| path.display().to_string());
    let mut sources = Vec::new();
    for path in &committed {
        let bytes = fs::metadata(root.join(path))?.len();
        findings.extend(files::not_large(path, bytes));
        findings.extend(files::telling_name(path));
        if path.extension().is_some_and(|extension| extension == "rs") {
            let text = read(path)?;
            findings.extend(source(path, &text));
            sources.push((path.clone(), text));
        } else if path.file_name().is_some_and(|name| name == "Cargo.toml") {
            findings.extend(dependencies::lints_are_on(path, &read(path)?));
        } else if path.extension().is_some_and(|extension| extension == "md") {
            findings.extend(prose::plain_words(path, &read(path)?));
        }
    }
    sources.retain(|(path, _)| path.iter().nth(1).is_some_and(|part| part == "src"));
    findings.extend(repeats::repeats(&sources));
    findings.extend(crates(&sources).iter().flat_map(|folder| {
        let read = |path: &Path| fs::read_to_string(root.join(folder).join(path)).ok();
        import_circles::import_circles(folder, &read)
    }));

    // The program is built only if everything else is in order.
    report(&findings, committed.len())?;
    let manual = output(
        root,
        "cargo",
        &["run", "--quiet", "--package", "stereology-cli", "--", "manual"],
    )?;
    let page = fs::read_to_string(root.join("docs/cli.md")).unwrap_or_default();
    let written = manual_is_written_down(&manual, &page);
    report(&Vec::from_iter(written), 1)
}

/// Checks one Rust file.
fn source(path: &Path, text: &str) -> Vec<Finding> {
    let part = |index: usize| {
        path.iter()
            .nth(index)
            .and_then(|part| part.to_str())
            .unwrap_or_default()
    };
    let mut findings = files::source_file(path, text);
    let mut words = prose::narrow_comments(path, text);
    // The checks name what they look for, so they would find themselves.
    if part(0) != "xtask" {
        words.extend(prose::plain_words(path, text));
    }
    let is_test = path.file_name().is_some_and(|name| name == "tests.rs");
    if part(1) == "src" && !PROGRAMS.contains(&part(0)) && !is_test {
        findings.extend(library_code::library_code(path, text));
        if part(0) != "report" {
            words.extend(prose::names_no_options(path, text));
        }
    }
    findings.extend(words);
    findings
}

/// Folders of the crates that the sources belong to, in order.
fn crates(sources: &[(PathBuf, String)]) -> Vec<&str> {
    let mut folders: Vec<&str> = sources
        .iter()
        .filter_map(|(path, _)| path.iter().next()?.to_str())
        .collect();
    folders.sort_unstable();
    folders.dedup();
    folders
}

fn report(findings: &[Finding], files: usize) -> Result<()> {
    for finding in findings {
        println!(
            "{} {}: {}",
            if finding.fatal { "error:  " } else { "warning:" },
            finding.place,
            finding.message
        );
    }
    let fatal = findings.iter().filter(|finding| finding.fatal).count();
    ensure!(fatal == 0, "tidy: {fatal} of ARCHITECTURE.md's invariants do not hold");
    println!("tidy: {files} files in order");
    Ok(())
}

fn output(root: &Path, program: &str, arguments: &[&str]) -> Result<String> {
    let done = Command::new(program)
        .args(arguments)
        .current_dir(root)
        .output()
        .with_context(|| format!("{program} cannot be run"))?;
    if !done.status.success() {
        bail!(
            "{program} {}: {}",
            arguments.join(" "),
            String::from_utf8_lossy(&done.stderr)
        );
    }
    Ok(String::from_utf8(done.stdout)?)
}

fn manual_is_written_down(manual: &str, page: &str) -> Option<Finding> {
    if manual == page {
        return None;
    }
    let same = manual
        .lines()
        .zip(page.lines())
        .take_while(|(is, was)| is == was)
        .count();
    Some(Finding::error(
        format!("docs/cli.md:{}", same + 1),
        "differs from the program's help: `cargo run -- manual > docs/cli.md` writes it again",
    ))
}

#[cfg(test)]
mod tests {
    use super::manual_is_written_down;

    #[test]
    fn a_manual_that_differs_is_found_by_its_line() {
        assert!(manual_is_written_down("a\nb", "a\nb").is_none());
        assert!(manual_is_written_down("a\nb", "a\nc").is_some_and(|finding| finding.place == "docs/cli.md:2"));
    }
}
