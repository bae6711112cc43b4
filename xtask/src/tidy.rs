//! The invariants of ARCHITECTURE.md that a program can check. Each check is a plain function from text or lists to findings.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

/// Crates that know nothing of ours.
const FLOOR: [&str; 5] = [
    "stereology-shape",
    "stereology-grid",
    "stereology-spectrum",
    "stereology-imaging",
    "stereology-metrics",
];
/// Crates that may know several rooms.
const ROOF: [&str; 5] = [
    "stereology",
    "stereology-report",
    "stereology-cli",
    "stereology-studies",
    "xtask",
];
/// Folders that are programs (fuzz stands outside the workspace): they may print and look at the clock.
const PROGRAMS: [&str; 4] = ["cli", "studies", "xtask", "fuzz"];
/// Names that say nothing of what a module is about.
const EMPTY_NAMES: [&str; 7] = ["util", "utils", "common", "helper", "helpers", "types", "misc"];
/// Packages that end in -sys and hold Rust only.
const RUST_ONLY_SYS: [&str; 5] = ["linux-raw-sys", "windows-sys", "js-sys", "web-sys", "wasi-sys"];
/// What draws in a C compiler.
const C_BUILDERS: [&str; 5] = ["cc", "cmake", "bindgen", "pkg-config", "vcpkg"];
/// Lines beyond which a file is probably more than one idea.
const LONG_FILE: usize = 600;
/// Largest committed file.
const LARGE_FILE: u64 = 2 << 20;

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// File, line or crate.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// Does it fail the check, or is it only said?
    pub fatal: bool,
}

impl Finding {
    fn error(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            message: message.into(),
            fatal: true,
        }
    }

    fn warning(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            fatal: false,
            ..Self::error(place, message)
        }
    }
}

/// Runs every check on the workspace around this crate.
///
/// # Errors
///
/// If anything fatal is found, or a file or cargo itself cannot be read.
pub fn run() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .context("xtask stands inside the workspace")?;
    let mut findings = Vec::new();

    let metadata: Value = serde_json::from_str(&output(
        root,
        "cargo",
        &["metadata", "--format-version", "1", "--no-deps", "--offline"],
    )?)?;
    findings.extend(who_knows_whom(&metadata));

    let tree = output(
        root,
        "cargo",
        &[
            "tree",
            "--workspace",
            "--edges",
            "normal,build,dev",
            "--prefix",
            "none",
            "--offline",
        ],
    )?;
    findings.extend(no_c(&tree));

    let committed = output(
        root,
        "git",
        &["ls-files", "-z", "--cached", "--others", "--exclude-standard"],
    )?;
    let committed: Vec<PathBuf> = committed
        .split('\0')
        .filter(|path| !path.is_empty())
        .map(PathBuf::from)
        .collect();
    for path in &committed {
        let Ok(about) = fs::metadata(root.join(path)) else {
            continue;
        }; // removed, not committed yet
        findings.extend(not_large(path, about.len()));
        findings.extend(telling_name(path));
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("rs") => {
                let text = fs::read_to_string(root.join(path)).with_context(|| path.display().to_string())?;
                findings.extend(source(path, &text));
            }
            Some("toml") if path.file_name().is_some_and(|name| name == "Cargo.toml") => {
                let text = fs::read_to_string(root.join(path)).with_context(|| path.display().to_string())?;
                findings.extend(lints_are_on(path, &text));
            }
            _ => {}
        }
    }

    let manual = output(
        root,
        "cargo",
        &["run", "--quiet", "--package", "stereology-cli", "--", "manual"],
    )?;
    let page = fs::read_to_string(root.join("docs/cli.md")).unwrap_or_default();
    findings.extend(manual_is_written_down(&manual, &page));

    for finding in &findings {
        println!(
            "{} {}: {}",
            if finding.fatal { "error:  " } else { "warning:" },
            finding.place,
            finding.message
        );
    }
    let fatal = findings.iter().filter(|finding| finding.fatal).count();
    ensure!(fatal == 0, "tidy: {fatal} of ARCHITECTURE.md's invariants do not hold");
    println!("tidy: {} files in order", committed.len());
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

/// A room knows only the floor; the floor knows nothing of ours (tests included).
fn who_knows_whom(metadata: &Value) -> Vec<Finding> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let name_of = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let packages = list(&metadata["packages"]);
    let ours: BTreeSet<String> = packages.iter().map(name_of).collect();
    let mut findings = Vec::new();
    for package in &packages {
        let name = name_of(package);
        if ROOF.contains(&name.as_str()) {
            continue;
        }
        for known in list(&package["dependencies"])
            .iter()
            .map(name_of)
            .filter(|known| ours.contains(known))
        {
            if FLOOR.contains(&name.as_str()) {
                findings.push(Finding::error(
                    &name,
                    format!("is of the floor and knows nothing of ours, not {known}"),
                ));
            } else if !FLOOR.contains(&known.as_str()) {
                findings.push(Finding::error(
                    &name,
                    format!("is a room and knows only the floor, not {known}"),
                ));
            }
        }
    }
    findings
}

/// Nothing in the default tree compiles C or links to a system library. `tree` has a package a line: `name v1.2.3 ...`.
fn no_c(tree: &str) -> Vec<Finding> {
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
    names
        .into_iter()
        .filter(|name| C_BUILDERS.contains(name) || (name.ends_with("-sys") && !RUST_ONLY_SYS.contains(name)))
        .map(|name| {
            Finding::error(
                "Cargo.lock",
                format!("{name} compiles C or links to a system library: a fresh machine has neither"),
            )
        })
        .collect()
}

fn not_large(path: &Path, bytes: u64) -> Option<Finding> {
    (bytes >= LARGE_FILE).then(|| {
        Finding::error(
            path.display().to_string(),
            format!("has {bytes} bytes; a committed file stays under {LARGE_FILE}"),
        )
    })
}

fn telling_name(path: &Path) -> Option<Finding> {
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

fn lints_are_on(path: &Path, text: &str) -> Option<Finding> {
    let workspace = text.contains("[lints]\nworkspace = true");
    (!workspace && !text.contains("unsafe_code = \"forbid\"")).then(|| {
        Finding::error(
            path.display().to_string(),
            "takes neither the workspace's lints nor forbids unsafe code",
        )
    })
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

/// Checks one Rust file.
fn source(path: &Path, text: &str) -> Vec<Finding> {
    let place = path.display().to_string();
    let mut findings = Vec::new();
    let lines = text.lines().count();
    if lines > LONG_FILE {
        findings.push(Finding::warning(
            &place,
            format!("{lines} lines: probably more than one idea"),
        ));
    }
    let part = |index: usize| {
        path.iter()
            .nth(index)
            .and_then(|part| part.to_str())
            .unwrap_or_default()
    };
    if part(1) == "src" && !text.trim_start().starts_with("//!") {
        findings.push(Finding::error(
            &place,
            "does not begin by saying what it is about (`//!`)",
        ));
    }
    // The checks below name what they look for, so this file would find itself.
    if place.ends_with("xtask/src/tidy.rs") {
        return findings;
    }
    let code = code_of(text);
    for (number, line) in &code {
        if has_word(line, "unsafe") {
            findings.push(Finding::error(format!("{place}:{number}"), "unsafe code"));
        }
    }
    let is_test = path.file_name().is_some_and(|name| name == "tests.rs");
    if part(1) != "src" || PROGRAMS.contains(&part(0)) || is_test {
        return findings;
    }
    for (number, line) in &code {
        for (wrong, why) in NOT_IN_LIBRARIES {
            if has_word(line, wrong) {
                findings.push(Finding::error(format!("{place}:{number}"), format!("`{wrong}`: {why}")));
            }
        }
    }
    findings.extend(hash_order(&place, &code));
    findings.extend(unordered_sums(&place, &code));
    findings
}

/// What libraries do not do.
const NOT_IN_LIBRARIES: [(&str, &str); 15] = [
    ("println!", "libraries print nothing"),
    ("print!", "libraries print nothing"),
    ("eprintln!", "libraries print nothing"),
    ("eprint!", "libraries print nothing"),
    ("dbg!", "libraries print nothing"),
    ("Instant", "libraries do not look at the clock"),
    ("SystemTime", "libraries do not look at the clock"),
    ("thread_rng", "libraries take seeds"),
    ("OsRng", "libraries take seeds"),
    ("SysRng", "libraries take seeds"),
    ("from_os_rng", "libraries take seeds"),
    ("RandomState", "libraries take seeds"),
    ("StdRng", "its stream may change with a version: take ChaCha8Rng"),
    ("SmallRng", "its stream differs between machines: take ChaCha8Rng"),
    ("std::env", "results depend on arguments only"),
];

/// Lines of code with their numbers: without comments, and without the test module at the end.
fn code_of(text: &str) -> Vec<(usize, String)> {
    let mut code = Vec::new();
    let mut lines = text.lines().enumerate().peekable();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line == "#[cfg(test)]"
            && lines
                .peek()
                .is_some_and(|(_, next)| next.trim().starts_with("mod ") && next.trim().ends_with('{'))
        {
            break;
        }
        if !line.starts_with("//") {
            code.push((index + 1, line.split(" // ").next().unwrap_or_default().to_owned()));
        }
    }
    code
}

/// Does `word` stand in the line, not as a part of a longer one, nor in a string?
fn has_word(line: &str, word: &str) -> bool {
    let of_a_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + word.len()..].chars().next();
        let in_string = line[..at].matches('"').count() % 2 == 1;
        !in_string && !before.is_some_and(of_a_name) && (word.ends_with('!') || !after.is_some_and(of_a_name))
    })
}

/// Walks over a hash map or set come in another order each time.
fn hash_order(place: &str, code: &[(usize, String)]) -> Vec<Finding> {
    let mut names = BTreeSet::new();
    for (_, line) in code {
        for hash in ["HashMap", "HashSet"] {
            if let Some(at) = line.find(hash) {
                let before = line[..at]
                    .trim_end_matches(|letter: char| !letter.is_whitespace())
                    .trim_end();
                let before = before.trim_end_matches(['=', ':', '&', ' ']).trim_end_matches(" mut");
                let name: String = before
                    .chars()
                    .rev()
                    .take_while(|letter| letter.is_alphanumeric() || *letter == '_')
                    .collect();
                let name: String = name.chars().rev().collect();
                if !name.is_empty() && !["use", "let", "mut", "pub", "fn", "type"].contains(&name.as_str()) {
                    names.insert(name);
                }
            }
        }
    }
    let mut findings = Vec::new();
    for (number, line) in code {
        for name in &names {
            let walks = [
                "iter()",
                "iter_mut()",
                "keys()",
                "values()",
                "values_mut()",
                "into_iter()",
                "drain(",
            ]
            .iter()
            .any(|walk| line.contains(&format!("{name}.{walk}")));
            let loops = [format!(" in {name} {{"), format!(" in &{name} {{")]
                .iter()
                .any(|end| line.contains(end.as_str()));
            if walks || loops {
                findings.push(Finding::error(
                    format!("{place}:{number}"),
                    format!("`{name}` is walked in the order of its hashes"),
                ));
            }
        }
    }
    findings
}

/// Floats summed by threads: the result would depend on their number.
fn unordered_sums(place: &str, code: &[(usize, String)]) -> Vec<Finding> {
    const PARALLEL: [&str; 4] = ["par_iter()", "into_par_iter()", "par_chunks(", "par_bridge()"];
    const EXACT: [&str; 6] = ["u64", "usize", "u32", "i64", "u128", "bool"];
    let mut findings = Vec::new();
    for (index, (number, line)) in code.iter().enumerate() {
        let Some(start) = PARALLEL.iter().filter_map(|parallel| line.find(parallel)).min() else {
            continue;
        };
        // The rest of the chain, at the depth of the parallel call.
        let rest = line[start..]
            .chars()
            .chain(code[index + 1..].iter().flat_map(|(_, line)| line.chars()))
            .take(4000);
        let (mut depth, mut chain) = (0_i32, String::new());
        for letter in rest {
            match letter {
                '(' | '[' | '{' => depth += 1,
                ')' | ']' | '}' => depth -= 1,
                ';' if depth == 0 => break,
                _ if depth == 0 => chain.push(letter),
                _ => {}
            }
            if depth < 0 {
                break;
            }
        }
        let after = [".sum", ".product", ".reduce", ".fold"].iter().find_map(|step| {
            let (_, after) = chain.split_once(step)?;
            (!after.starts_with("_with") || *step == ".reduce").then_some(after)
        });
        if let Some(after) = after
            && !EXACT.iter().any(|exact| after.starts_with(&format!("::<{exact}>")))
            && !chain.contains(".collect")
        {
            findings.push(Finding::error(
                format!("{place}:{number}"),
                "threads add in any order: collect blocks, then add them in order (or say an integer type: `.sum::<u64>()`)",
            ));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn found(path: &str, text: &str) -> Vec<String> {
        source(Path::new(path), text)
            .into_iter()
            .map(|finding| format!("{}: {}", finding.place, finding.message))
            .collect()
    }

    #[test]
    fn rooms_know_only_the_floor() {
        let package = |name: &str, knows: &[&str]| {
            let dependencies: Vec<_> = knows.iter().map(|known| json!({"name": known})).collect();
            json!({"name": name, "dependencies": dependencies})
        };
        let metadata = json!({"packages": [
            package("stereology-shape", &["nalgebra"]),
            package("stereology-grid", &["stereology-shape"]),
            package("stereology-unfold", &["stereology-kmatrix", "nalgebra"]),
            package("stereology-kmatrix", &["stereology-shape"]),
            package("stereology", &["stereology-kmatrix", "stereology-unfold"]),
        ]});
        let places: Vec<_> = who_knows_whom(&metadata)
            .into_iter()
            .map(|finding| finding.place)
            .collect();
        assert_eq!(places, ["stereology-grid", "stereology-unfold"]);
    }

    #[test]
    fn c_is_found() {
        assert!(no_c("rayon v1.0.0\nlinux-raw-sys v0.9.0\nlibm v0.2.0").is_empty());
        assert_eq!(no_c("cc v1.0.0\nzlib-sys v1.0.0 (*)\nzlib-sys v1.0.0").len(), 2);
    }

    #[test]
    fn libraries_are_quiet_and_seeded() {
        let head = "//! About.\n";
        assert!(
            found(
                "grid/src/a.rs",
                &format!("{head}/// println!(\"in a doc test\");\nfn f() {{}} // Instant\n")
            )
            .is_empty()
        );
        assert!(found("grid/src/a.rs", &format!("{head}#[error(\"Instant\")]\n")).is_empty());
        assert_eq!(found("grid/src/a.rs", &format!("{head}println!(\"x\");\n")).len(), 1);
        assert_eq!(
            found("grid/src/a.rs", &format!("{head}let t = std::time::Instant::now();\n")).len(),
            1
        );
        assert!(found("cli/src/a.rs", &format!("{head}println!(\"x\");\n")).is_empty());
        assert!(
            found(
                "grid/src/a.rs",
                &format!("{head}#[cfg(test)]\nmod tests {{\nprintln!(\"x\");\n}}\n")
            )
            .is_empty()
        );
        assert_eq!(found("cli/src/a.rs", &format!("{head}unsafe {{ }}\n")).len(), 1);
    }

    #[test]
    fn files_say_what_they_are_about() {
        assert_eq!(found("grid/src/a.rs", "fn f() {}\n").len(), 1);
        assert!(found("grid/tests/it/a.rs", "fn f() {}\n").is_empty());
        assert_eq!(
            found("grid/src/a.rs", &format!("//! About.\n{}", "\n".repeat(700))).len(),
            1
        );
    }

    #[test]
    fn hash_maps_are_looked_up_not_walked() {
        let code = |line: &str| format!("//! About.\nlet mut seen: HashMap<u32, u32> = HashMap::new();\n{line}\n");
        assert!(found("grid/src/a.rs", &code("seen.get(&3);")).is_empty());
        assert_eq!(found("grid/src/a.rs", &code("for (k, v) in &seen {")).len(), 1);
        assert_eq!(found("grid/src/a.rs", &code("seen.values().sum()")).len(), 1);
        assert_eq!(
            found(
                "grid/src/a.rs",
                "//! A.\nlet set = HashSet::new();\nset.iter().max();\n"
            )
            .len(),
            1
        );
    }

    #[test]
    fn threads_do_not_add_floats() {
        let code = |line: &str| format!("//! About.\n{line}\n");
        assert_eq!(
            found(
                "grid/src/a.rs",
                &code("let s: f64 = xs.par_iter().map(|x| x * 2.0).sum();")
            )
            .len(),
            1
        );
        assert_eq!(
            found(
                "grid/src/a.rs",
                &code("let s = xs.par_iter()\n    .map(|x| { x.len() })\n    .sum::<f64>();")
            )
            .len(),
            1
        );
        assert!(
            found(
                "grid/src/a.rs",
                &code("let n = xs.par_iter().map(|x| x.len()).sum::<usize>();")
            )
            .is_empty()
        );
        assert!(
            found(
                "grid/src/a.rs",
                &code("let v: Vec<f64> = xs.par_iter().map(|x| x.iter().sum()).collect();")
            )
            .is_empty()
        );
    }

    #[test]
    fn files_are_small_and_named() {
        assert!(not_large(Path::new("a.png"), LARGE_FILE).is_some() && not_large(Path::new("a.png"), 10).is_none());
        assert!(
            telling_name(Path::new("grid/src/utils/a.rs")).is_some()
                && telling_name(Path::new("grid/src/types.rs")).is_some()
        );
        assert!(telling_name(Path::new("grid/src/particle_types.rs")).is_none());
        assert!(lints_are_on(Path::new("Cargo.toml"), "[package]").is_some());
        assert!(manual_is_written_down("a\nb", "a\nc").is_some_and(|finding| finding.place == "docs/cli.md:2"));
    }
}
