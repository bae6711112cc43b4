//! Every crate compiles with each of its features alone and with none.

use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::workspace::root;

/// Runs clippy on the libraries of the workspace with every choice of at most one feature, and on all targets of the
/// facade without any. Warnings, such as of imports that one feature alone needs, are errors.
///
/// # Errors
///
/// If one choice does not compile; the message names crate and feature.
pub fn run() -> Result<()> {
    let root = root()?;
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--locked"];
    let output = Command::new("cargo").args(arguments).current_dir(root).output()?;
    let metadata: Value = serde_json::from_slice(&output.stdout).context("cargo metadata")?;
    let choices = choices(&metadata);
    for choice in &choices {
        println!("{} {}", choice.package, choice.flags.join(" "));
        let status = Command::new("cargo")
            .args(["clippy", "--locked", "--quiet", "--package", &choice.package])
            .args(&choice.flags)
            .args(["--", "-D", "warnings"])
            .current_dir(root)
            .status()?;
        ensure!(
            status.success(),
            "{} does not compile with {}",
            choice.package,
            choice.flags.join(" ")
        );
    }
    println!("features: {} choices compile", choices.len());
    Ok(())
}

/// What is compiled: a package, and what cargo is called with.
#[derive(Debug, PartialEq, Eq)]
struct Choice {
    package: String,
    flags: Vec<String>,
}

/// No feature and each feature alone, of every package that has features.
fn choices(metadata: &Value) -> Vec<Choice> {
    let mut choices = Vec::new();
    for package in metadata["packages"].as_array().map_or(&[][..], Vec::as_slice) {
        let name = package["name"].as_str().unwrap_or_default();
        let choice = |flags: &[&str]| Choice {
            package: name.to_owned(),
            flags: flags.iter().map(|flag| (*flag).to_owned()).collect(),
        };
        let features = package["features"].as_object();
        let features: Vec<&str> = features
            .into_iter()
            .flat_map(|features| features.keys())
            .map(String::as_str)
            .filter(|feature| *feature != "default")
            .collect();
        if features.is_empty() {
            continue;
        }
        let targets = if name == "stereology" { "--all-targets" } else { "--lib" };
        choices.push(choice(&["--no-default-features", targets]));
        choices.extend(
            features
                .iter()
                .map(|feature| choice(&["--no-default-features", "--lib", "--features", feature])),
        );
    }
    choices
}

#[cfg(test)]
mod tests {
    use super::choices;
    use serde_json::json;

    #[test]
    fn no_feature_and_each_alone_are_tried() {
        let metadata = json!({"packages": [
            {"name": "stereology-shape", "features": {"default": ["io"], "io": []}},
            {"name": "stereology", "features": {"a": [], "b": []}},
            {"name": "xtask", "features": {}},
        ]});
        let lines: Vec<String> = choices(&metadata)
            .iter()
            .map(|choice| format!("{} {}", choice.package, choice.flags.join(" ")))
            .collect();
        assert_eq!(
            lines,
            [
                "stereology-shape --no-default-features --lib",
                "stereology-shape --no-default-features --lib --features io",
                "stereology --no-default-features --all-targets",
                "stereology --no-default-features --lib --features a",
                "stereology --no-default-features --lib --features b",
            ]
        );
    }
}
