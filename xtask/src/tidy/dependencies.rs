//! Which crate knows which, what a build pulls in, and the lints of every crate.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::finding::Finding;

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
/// Packages that end in -sys and hold Rust only.
const RUST_ONLY_SYS: [&str; 5] = ["linux-raw-sys", "windows-sys", "js-sys", "web-sys", "wasi-sys"];
/// What draws in a C compiler.
const C_BUILDERS: [&str; 5] = ["cc", "cmake", "bindgen", "pkg-config", "vcpkg"];

/// A room knows only the floor; the floor knows nothing of ours (tests included).
pub fn who_knows_whom(metadata: &Value) -> Vec<Finding> {
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
pub fn no_c(tree: &str) -> Vec<Finding> {
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

/// Every crate takes the workspace's lints, or forbids unsafe code.
pub fn lints_are_on(path: &Path, text: &str) -> Option<Finding> {
    let workspace = text.contains("[lints]\nworkspace = true");
    (!workspace && !text.contains("unsafe_code = \"forbid\"")).then(|| {
        Finding::error(
            path.display().to_string(),
            "takes neither the workspace's lints nor forbids unsafe code",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{lints_are_on, no_c, who_knows_whom};
    use serde_json::json;
    use std::path::Path;

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
    fn every_crate_has_lints() {
        assert!(lints_are_on(Path::new("Cargo.toml"), "[package]").is_some());
        assert!(lints_are_on(Path::new("Cargo.toml"), "[lints]\nworkspace = true").is_none());
    }
}
